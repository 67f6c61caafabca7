"""A made-up walk of half a second that learns in seconds."""

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.motion.resample import resample
from motionstyle.nio.learning_problem import learning_problem
from synthetic_walk import make_walk


@pytest.fixture(scope="session")
def made_walk():
    motion = resample(make_walk(), 30.0).window(20, 33)
    held = motion.contacts.sum(axis=1)
    forces = np.zeros((motion.frames, 8, 3))
    weight = motion.body.mass * 9.81
    forces[..., 1] = motion.contacts * (weight / np.maximum(held, 1))[:, None]
    return replace(motion, contact_forces=forces)


@pytest.fixture(scope="session")
def made_learning(made_walk, all_functions):
    return learning_problem(made_walk, all_functions)

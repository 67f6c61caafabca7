"""A made-up walk of half a second that learns in seconds."""

import pytest

from motionstyle.nio.learning_problem import learning_problem
from synthetic_walk import loaded_walk


@pytest.fixture(scope="session")
def made_walk():
    return loaded_walk(20, 33)


@pytest.fixture(scope="session")
def made_learning(made_walk, all_functions):
    return learning_problem(made_walk, all_functions)

"""Functions on the virtual machine, and random states far from zero."""

import numpy as np
import pytest

from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions


@pytest.fixture(scope="session")
def functions():
    return load_functions(dynamics_functions, None)


@pytest.fixture
def states():
    """Five random states: q, q̇, q̈ (5, 35) and contact forces (5, 24)."""
    rng = np.random.default_rng(7)
    return [
        rng.standard_normal((5, n)) * size for n, size in ((35, 0.6), (35, 2), (35, 9), (24, 150))
    ]

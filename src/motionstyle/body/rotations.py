"""Exponential maps in time: matrices, logarithms, continuity and derivatives (Grassia 1998).

The conversions themselves are SciPy's; what lives here is what motion needs on top of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

# Beyond this angle (rad) the exponential map nears its singularity at 2π and is re-branched.
LARGEST_ANGLE = 1.75 * np.pi


def skew(vectors: Array) -> Array:
    """Return the cross-product matrices [v]× of vectors, (..., 3) to (..., 3, 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def exponential(vectors: Array) -> Array:
    """Return rotation matrices of rotation vectors in rad, (..., 3) to (..., 3, 3)."""
    flat = Rotation.from_rotvec(np.reshape(vectors, (-1, 3))).as_matrix()
    return flat.reshape(*vectors.shape[:-1], 3, 3)


def logarithm(matrices: Array) -> Array:
    """Return rotation vectors of angle at most π rad, (..., 3, 3) to (..., 3)."""
    flat = Rotation.from_matrix(np.reshape(matrices, (-1, 3, 3))).as_rotvec()
    return flat.reshape(*matrices.shape[:-2], 3)


def left_jacobian(vectors: Array) -> Array:
    """Return J with angular velocity ω = J(v) v̇ in the parent frame, (..., 3) to (..., 3, 3).

    J = I + (1−cos θ)/θ² [v]× + (θ−sin θ)/θ³ [v]×², with Taylor series below θ = 1e-4.
    """
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    second = np.where(small, 1 / 6 - angle**2 / 120, (safe - np.sin(safe)) / safe**3)
    cross = skew(vectors)
    return np.eye(3) + first * cross + second * cross @ cross


def unroll(vectors: Array, largest_angle: float = LARGEST_ANGLE) -> tuple[Array, list[int]]:
    """Make a sequence of rotation vectors (F, 3) continuous in time.

    Each vector is replaced by the equivalent v·(1 + 2πk/θ) nearest to its predecessor. Where
    that would exceed `largest_angle` the smallest equivalent is taken instead and the frame is
    reported, since no exponential map is continuous through 2π.

    Returns
    -------
    The continuous vectors and the list of re-branched frames.
    """
    result = np.array(vectors, dtype=float)
    jumps: list[int] = []
    for frame in range(1, len(result)):
        previous, vector = result[frame - 1], result[frame]
        angle = np.linalg.norm(vector)
        if angle < 1e-9:
            size = np.linalg.norm(previous)
            if size > np.pi:  # the identity, reached at a full turn
                vector = previous / size * 2 * np.pi * np.round(size / (2 * np.pi))
            nearest = vector
        else:
            axis = vector / angle
            turns = np.round((previous @ axis - angle) / (2 * np.pi))
            nearest = axis * (angle + 2 * np.pi * turns)
        if np.linalg.norm(nearest) > largest_angle:
            smallest = logarithm(exponential(nearest))
            if np.linalg.norm(smallest - previous) > np.pi:
                jumps.append(frame)
            nearest = smallest
        result[frame] = nearest
    return result, jumps


def shortest_arc(source: Array, target: Array) -> Array:
    """Return the rotation matrix of least angle that turns direction `source` into `target`."""
    a = source / np.linalg.norm(source)
    b = target / np.linalg.norm(target)
    axis = np.cross(a, b)
    size = np.linalg.norm(axis)
    if size < 1e-12:
        if a @ b > 0:
            return np.eye(3)
        helper = np.eye(3)[np.argmin(np.abs(a))]
        axis = np.cross(a, helper)
        return exponential(np.pi * axis / np.linalg.norm(axis))
    upright = axis - (axis @ a) * a  # rounding tilts it where the directions are almost opposite
    return exponential(upright / np.linalg.norm(upright) * np.arctan2(size, a @ b))


def slerp(matrices: Array, times: Array, new_times: Array) -> Array:
    """Interpolate rotation matrices (F, 3, 3) from `times` to `new_times` (s) along great arcs."""
    from scipy.spatial.transform import Slerp  # noqa: PLC0415 (only resampling needs it)

    return Slerp(times, Rotation.from_matrix(matrices))(new_times).as_matrix()

"""What force on the pelvis a motion would need, before and after the physics fit.

A kinematic motion has no contact forces: those that leave least to the pelvis are found frame by
frame, in the friction cones of its own contacts (Liu et al. 2005, eqs. (8), (11)).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from motionstyle.body.kinematics import contact_points
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.evaluation.joint_loads import JointLoads, joint_loads
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.forces import cone_basis

Array = NDArray[np.float64]
ROOT_RESIDUAL_COLUMNS = (
    *("id", "dataset", "config", "action", "surface", "force_before_n", "force_after_n"),
    *("force_before_pctbw", "force_after_pctbw", "moment_before_nm", "moment_after_nm"),
    *("status", "reason"),
)


def least_root_residual(motion: Motion, loads: JointLoads, friction: float) -> tuple[Array, Array]:
    """Return the force (N) and moment (N·m) at the pelvis that no contact force can spare, (F, 3).

    Parameters
    ----------
    loads : of the motion without any contact force. friction : coefficient of the cones.
    """
    need = np.concatenate([loads.root_force, loads.root_moment], axis=1)
    pose = motion.pose()
    arms = contact_points(motion.body, pose) - pose.positions[:, :1]
    edges = cone_basis(motion.contact_normals, friction)
    wrenches = np.concatenate([edges, np.cross(arms[:, :, None], edges)], axis=-1)
    left = np.array(need)
    for t, bearing in enumerate(motion.contacts):
        if bearing.any():
            columns = wrenches[t, bearing].reshape(-1, 6).T
            found, _ = nnls(columns, need[t], maxiter=30 * columns.shape[1])
            left[t] -= columns @ found
    return left[:, :3], left[:, 3:]


def _rms(vectors: Array) -> float:
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


def root_residual_row(
    kinematic: Motion,
    physical: Motion,
    functions: Mapping[str, FrameFunction],
    friction: float,
    status: str,
    config_name: str,
) -> dict[str, object]:
    """Return a clip's row with `ROOT_RESIDUAL_COLUMNS`, rms over its frames.

    kinematic : at the rate and in the window of the fit. status : of the fit.
    """
    before = least_root_residual(kinematic, joint_loads(kinematic, functions, []), friction)
    loads = joint_loads(physical, functions)
    weight = physical.body.mass * GRAVITY
    known = physical.provenance
    forces = [_rms(before[0]), _rms(loads.root_force)]
    return {
        "id": known.get("example", physical.id),
        "config": config_name,
        **{name: known.get(name, "") for name in ("dataset", "action", "surface")},
        "force_before_n": forces[0],
        "force_after_n": forces[1],
        "force_before_pctbw": 100 * forces[0] / weight,
        "force_after_pctbw": 100 * forces[1] / weight,
        "moment_before_nm": _rms(before[1]),
        "moment_after_nm": _rms(loads.root_moment),
        "status": status,
    }

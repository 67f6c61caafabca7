"""The body as a table: nodes, degrees of freedom, masses (nio.md F1)."""

from __future__ import annotations

import numpy as np

from motionstyle.body.layout import JOINTS
from motionstyle.motion.motion import Motion

BODY_COLUMNS = (
    *("id", "dataset", "config", "node", "parent", "dof", "mass_kg", "mass_pctbw", "length_m"),
)


def body_table(motion: Motion, config_name: str) -> list[dict[str, object]]:
    """Return one row per node of a motion's body, with `BODY_COLUMNS`.

    length_m is the distance from the parent's joint to the node's own.
    """
    body = motion.body
    lengths = np.linalg.norm(body.joint_offsets, axis=1)
    return [
        {
            "id": motion.id,
            "dataset": motion.provenance.get("dataset", ""),
            "config": config_name,
            "node": joint.node,
            "parent": joint.parent or "world",
            "dof": len(joint.names),
            "mass_kg": float(body.masses[i]),
            "mass_pctbw": float(100 * body.masses[i] / body.mass),
            "length_m": float(lengths[i]),
        }
        for i, joint in enumerate(JOINTS)
    ]

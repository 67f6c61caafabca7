"""Which source joint each node of the body follows: `config/skeletons/{name}.yaml`.

A map names, for every node the source shows, the source joint at the node's joint centre
(`joints`), the source joint whose rotation the node follows where that is another one
(`frames`), and the tips of head, hands and feet (`ends`). Nodes that are not named are not
observed. Every joint of the source must be mapped or listed under `ignored` (shell patterns),
so that no clip is read through the wrong map.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from motionstyle.body.layout import NODES
from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.mocap.formats.clip import SkeletonClip, forward_kinematics
from motionstyle.mocap.map_file import read_map_file

END_NAMES = (
    "head_top",
    *(f"{end}_{side}" for end in ("toe", "foot_front", "fingertip", "wrist") for side in "rl"),
)
_LIMB_NODES = ("thigh", "shank", "foot", "upper_arm", "forearm")
REQUIRED_NODES = (
    *("pelvis", "abdomen", "head"),
    *(f"{node}_{side}" for node in _LIMB_NODES for side in "rl"),
)
_SECTIONS = ("joints", "frames", "ends", "axes", "offsets_like")
_KEYS = dict.fromkeys(_SECTIONS, dict) | {"ignored": list, "zero_pose": None, "note": None}
_DIRECTIONS = {
    sign + letter: (1.0 if sign == "+" else -1.0) * np.eye(3)[i]
    for sign in "+-"
    for i, letter in enumerate("xyz")
}


@dataclass(frozen=True)
class SkeletonMap:
    """A source skeleton's joints by node; see the module's text.

    zero_pose is "standing" (bones of the zero pose point where they do in a person standing
    with arms hanging or raised sideways) or "axes" (the zero pose means nothing and `axes` says
    which local axis of each source joint points forward, up and right). `offsets_like` gives
    joints whose offset the file has lost the offset of another joint.
    """

    name: str
    joints: Mapping[str, str]
    frames: Mapping[str, str] = field(default_factory=dict)
    ends: Mapping[str, str] = field(default_factory=dict)
    ignored: tuple[str, ...] = ()
    zero_pose: str = "standing"
    axes: Mapping[str, np.ndarray] = field(default_factory=dict)
    offsets_like: Mapping[str, str] = field(default_factory=dict)

    def observes(self, node: str) -> bool:
        """Whether the source shows this node."""
        return node in self.joints

    def frame_joint(self, node: str) -> str:
        """Return the source joint whose rotation the node follows."""
        return self.frames.get(node, self.joints[node])


def _axes(node: str, text: object, problems: list[str]) -> np.ndarray:
    """Return the rotation a text such as '+z +x +y' stands for; note it if it stands for none."""
    words = str(text).split()
    if len(words) != 3 or any(w not in _DIRECTIONS for w in words):
        problems.append(
            f"axes of {node} are '{text}'; write the source joint's local axes that point "
            "forward, up and right, such as '+z +x +y'"
        )
        return np.eye(3)
    matrix = np.column_stack([_DIRECTIONS[w] for w in words])
    if not np.isclose(np.linalg.det(matrix), 1.0):
        problems.append(f"axes of {node} ('{text}') are not a right-handed frame")
    return matrix


def read_skeleton_map(folder: str | Path, name: str) -> SkeletonMap:
    """Read and check one skeleton map.

    Raises
    ------
    MotionStyleError
        If there is no such map, or a key, node or end name in it is unknown.
    """
    path, data, problems = read_map_file(folder, name, "skeleton", _KEYS)
    joints, frames, ends, axes, offsets_like = (data.get(key, {}) for key in _SECTIONS)
    for section, nodes in (("joints", joints), ("frames", frames), ("axes", axes)):
        for node in nodes:
            if node not in NODES:
                problems.append(f"{section}: unknown node '{node}'{near_matches(str(node), NODES)}")
            elif node not in joints:
                problems.append(f"{section}: node '{node}' is not among the joints")
    for end in ends:
        if end not in END_NAMES:
            problems.append(f"ends: unknown end '{end}'{near_matches(str(end), END_NAMES)}")
    problems += [f"joints: node '{n}' is missing" for n in REQUIRED_NODES if n not in joints]
    problems += [
        f"joints: node 'toes_{side}' is missing, and ends has no 'foot_front_{side}' instead"
        for side in "rl"
        if f"toes_{side}" not in joints and f"foot_front_{side}" not in ends
    ]
    zero_pose = data.get("zero_pose", "standing")
    if zero_pose not in {"standing", "axes"}:
        problems.append(f"zero_pose is '{zero_pose}', must be standing or axes")
    if zero_pose == "axes":
        problems += [f"axes: node '{n}' is missing" for n in joints if n not in axes]
    matrices = {node: _axes(node, text, problems) for node, text in axes.items()}
    if problems:
        raise MotionStyleError(f"{path}: " + "; ".join(sorted(problems)))
    return SkeletonMap(
        name=name,
        joints=joints,
        frames=frames,
        ends=ends,
        ignored=tuple(data.get("ignored", ())),
        zero_pose=zero_pose,
        axes=matrices,
        offsets_like=offsets_like,
    )


def check_joints(clip: SkeletonClip, skeleton: SkeletonMap) -> None:
    """Refuse a clip whose joints are not the ones of the map, naming all that differ.

    Raises
    ------
    MotionStyleError
        With every joint the map needs and the clip lacks, and every joint of the clip the map
        does not know, each with its near matches.
    """
    wanted = (
        set(skeleton.joints.values())
        | set(skeleton.frames.values())
        | set(skeleton.ends.values())
        | set(skeleton.offsets_like)
        | set(skeleton.offsets_like.values())
    )
    missing = sorted(wanted - set(clip.joints))
    unknown = [
        joint
        for joint in clip.joints
        if joint not in wanted and not any(fnmatchcase(joint, p) for p in skeleton.ignored)
    ]
    problems = [f"lacks joint '{j}'{near_matches(j, clip.joints)}" for j in missing]
    problems += [
        f"has joint '{j}' that the map does not name{near_matches(j, sorted(wanted))}"
        for j in unknown
    ]
    if problems:
        raise MotionStyleError(
            f"{clip.source}: not the skeleton '{skeleton.name}': "
            + "; ".join(problems)
            + ". Choose another skeleton in the sheet, or add the joint to "
            f"config/skeletons/{skeleton.name}.yaml (under `ignored` if it is of no use)"
        )


def restore_offsets(clip: SkeletonClip, like: Mapping[str, str]) -> SkeletonClip:
    """Give joints whose offset the file has lost the offset of another joint (a known defect).

    Positions of the joints and of all that hangs on them are recomputed; rotations stay.
    """
    if not like:
        return clip
    index = {name: i for i, name in enumerate(clip.joints)}
    local_rotations = np.array(clip.rotations)
    local_positions = np.array(clip.positions)
    for joint, parent in enumerate(clip.parents):
        if parent >= 0:
            turned = np.swapaxes(clip.rotations[:, parent], 1, 2)
            local_rotations[:, joint] = turned @ clip.rotations[:, joint]
            arm = clip.positions[:, joint] - clip.positions[:, parent]
            local_positions[:, joint] = np.einsum("fab,fb->fa", turned, arm)
    offsets = np.array(clip.rest_offsets)
    for joint, model in like.items():
        offsets[index[joint]] += clip.rest_offsets[index[model]]
        local_positions[:, index[joint]] += clip.rest_offsets[index[model]]
    positions, rotations = forward_kinematics(clip.parents, local_positions, local_rotations)
    return SkeletonClip(
        clip.joints, clip.parents, offsets, positions, rotations, clip.rate_hz, clip.source
    )


def joint_indices(clip: SkeletonClip, names: Sequence[str]) -> list[int]:
    """Return the positions of joint names in the clip."""
    index = {name: i for i, name in enumerate(clip.joints)}
    return [index[name] for name in names]

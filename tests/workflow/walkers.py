"""Tiny made-up clips of one walker, in every format a user may bring, and a user's own project.

The walker is closed-form: the pelvis travels evenly and bobs, each foot stands still for 62 % of
the stride and swings forward in a cosine, the legs follow by two-bone inverse kinematics in the
sagittal plane, and the arms swing against the legs.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from motionstyle.mocap.datasets.sheet import COLUMNS
from motionstyle.tables import read_table

ROOT = Path(__file__).parents[2]
TARGETS = ("all", *(f"out/bvh/captured/{id}.bvh" for id in ("steady", "own_01", "mimic")))
RATE = 30.0
FRAMES = 48
THIGH, SHANK, ANKLE = 0.409, 0.444, 0.08
STRIDE_M, STRIDE_S, STANCE = 0.8, 1.0, 0.62
UP, FORWARD, LEFT = np.array([0, 1, 0]), np.array([0, 0, 1]), np.array([1, 0, 0])


@dataclass(frozen=True)
class Walk:
    """Paths (m) and angles (rad, flexion positive) of F frames; sides are "r" and "l"."""

    forward: np.ndarray
    height: np.ndarray
    hip: dict[str, np.ndarray]
    knee: dict[str, np.ndarray]
    ankle: dict[str, np.ndarray]
    shoulder: dict[str, np.ndarray]
    elbow: dict[str, np.ndarray]


def walk(frames: int = FRAMES, rate: float = RATE, stride: float = STRIDE_M) -> Walk:
    """Return the walker's movement."""
    cycle = np.arange(frames) / rate / STRIDE_S
    forward = stride * cycle
    height = ANKLE + 0.79 + 0.01 * np.cos(4 * np.pi * (cycle - 0.06))
    angles: dict[str, dict[str, np.ndarray]] = {
        name: {} for name in ("hip", "knee", "ankle", "shoulder", "elbow")
    }
    for side, shift in (("r", 0.0), ("l", 0.5)):
        whole, part = np.divmod(cycle + shift, 1.0)
        swing = np.clip((part - STANCE) / (1 - STANCE), 0.0, 1.0)
        x = stride * (whole - shift + STANCE / 2 + (1 - np.cos(np.pi * swing)) / 2)
        y = ANKLE + 0.09 * np.sin(np.pi * swing) ** 2
        reach = np.hypot(x - forward, height - y)
        inner = (THIGH**2 + SHANK**2 - reach**2) / (2 * THIGH * SHANK)
        knee = np.pi - np.arccos(inner)
        ahead = np.arctan2(x - forward, height - y)
        hip = ahead + np.arcsin(SHANK * np.sin(knee) / reach)
        angles["hip"][side], angles["knee"][side], angles["ankle"][side] = hip, knee, knee - hip
        angles["shoulder"][side] = -0.4 * np.cos(2 * np.pi * (cycle + shift + 0.1))
        angles["elbow"][side] = 0.35 + 0.1 * np.sin(2 * np.pi * (cycle + shift))
    return Walk(forward, height, **angles)


def _about(axis: Sequence[float], angle: np.ndarray | float, frames: int) -> Rotation:
    turn = np.broadcast_to(np.asarray(angle, dtype=float), (frames,))
    return Rotation.from_rotvec(turn[:, None] * np.asarray(axis, dtype=float))


def _local_rotations(moved: Walk) -> dict[str, Rotation]:
    """Return local rotations by part, on a T-pose that looks along +z with its left along +x."""
    frames = len(moved.forward)
    turns = {}
    for side, out in (("r", -1.0), ("l", 1.0)):
        turns[f"hip_{side}"] = _about(-LEFT, moved.hip[side], frames)
        turns[f"knee_{side}"] = _about(LEFT, moved.knee[side], frames)
        turns[f"ankle_{side}"] = _about(-LEFT, moved.ankle[side], frames)
        hang = _about(FORWARD, -out * np.radians(80), frames)
        turns[f"shoulder_{side}"] = _about(-LEFT, moved.shoulder[side], frames) * hang
        turns[f"elbow_{side}"] = _about(UP, -out * moved.elbow[side], frames)
    sway = 0.06 * np.sin(2 * np.pi * np.arange(frames) / RATE / STRIDE_S)
    turns["spine"] = _about(UP, sway, frames)
    return turns


# name, parent, offset in cm, which local rotation
AALTO = (
    ("Hips", None, (0, 0, 0), None),
    ("Ab", "Hips", (0, 8.1, 0), None),
    ("Chest", "Ab", (0, 25.0, 0), "spine"),
    ("Neck", "Chest", (0, 25.0, 0), None),
    ("Head", "Neck", (0, 10.8, 0), None),
    ("LeftCollar", "Chest", (0, 25.0, 0), None),
    ("LeftShoulder", "LeftCollar", (19.6, 0, 0), "shoulder_l"),
    ("LeftElbow", "LeftShoulder", (27.2, 0, 0), "elbow_l"),
    ("LeftWrist", "LeftElbow", (23.3, 0, 0), None),
    ("RightCollar", "Chest", (0, 25.0, 0), None),
    ("RightShoulder", "RightCollar", (-19.6, 0, 0), "shoulder_r"),
    ("RightElbow", "RightShoulder", (-27.2, 0, 0), "elbow_r"),
    ("RightWrist", "RightElbow", (-23.3, 0, 0), None),
    ("LeftHip", "Hips", (11.7, 0, 0), "hip_l"),
    ("LeftKnee", "LeftHip", (0, -100 * THIGH, 0), "knee_l"),
    ("LeftAnkle", "LeftKnee", (0, -100 * SHANK, 0), "ankle_l"),
    ("RightHip", "Hips", (-11.7, 0, 0), "hip_r"),
    ("RightKnee", "RightHip", (0, -100 * THIGH, 0), "knee_r"),
    ("RightAnkle", "RightKnee", (0, -100 * SHANK, 0), "ankle_r"),
)
AALTO_ENDS = {
    "Head": (0, 16.6, 0),
    "LeftWrist": (0, -14.7, 0),
    "RightWrist": (0, -14.7, 0),
    "LeftAnkle": (0, -4.9, 16.6),
    "RightAnkle": (0, -4.9, 16.6),
}


def bvh_text(
    frames: int = FRAMES,
    *,
    rate: float = RATE,
    claimed_rate: float | None = None,
    stride: float = STRIDE_M,
    unit: float = 100.0,
    z_up: bool = False,
    rename: Mapping[str, str] | None = None,
) -> str:
    """Return the walker as BVH with Aalto's 19 joints.

    unit is in units a metre; `claimed_rate` is what the file says of its rate, true or not.
    """
    rename = rename or {}
    moved = walk(frames, rate, stride)
    turns = _local_rotations(moved)
    tilt = Rotation.from_euler("x", 90 if z_up else 0, degrees=True)

    def placed(offset: Sequence[float]) -> str:
        place = tilt.apply(np.array(offset, dtype=float) * unit / 100)
        return "OFFSET " + " ".join(f"{v:.5f}" for v in place)

    lines = ["HIERARCHY"]

    def put(name: str, depth: int) -> None:
        _, parent, offset, _ = next(joint for joint in AALTO if joint[0] == name)
        pad = "  " * depth
        kind = "JOINT" if parent else "ROOT"
        moves = "" if parent else "Xposition Yposition Zposition "
        lines.extend(
            [f"{pad}{kind} {rename.get(name, name)}", pad + "{", f"{pad}  {placed(offset)}"]
        )
        lines.append(f"{pad}  CHANNELS {3 if parent else 6} {moves}Zrotation Xrotation Yrotation")
        for child in (joint[0] for joint in AALTO if joint[1] == name):
            put(child, depth + 1)
        if name in AALTO_ENDS:
            lines.extend([f"{pad}  End Site", pad + "  {"])
            lines.extend([f"{pad}    {placed(AALTO_ENDS[name])}", pad + "  }"])
        lines.append(pad + "}")

    put("Hips", 0)
    order = re.findall(r"(?:ROOT|JOINT) (\S+)", "\n".join(lines))
    back = {new: old for old, new in rename.items()}
    parts = {joint[0]: joint[3] for joint in AALTO}
    root = tilt.apply(np.column_stack([np.zeros(frames), moved.height, moved.forward]) * unit)
    columns = [root]
    for name in order:
        part = parts[back.get(name, name)]
        turn = turns[part] if part else Rotation.identity(frames)
        columns.append((tilt * turn * tilt.inv()).as_euler("ZXY", degrees=True))
    lines += ["MOTION", f"Frames: {frames}", f"Frame Time: {1 / (claimed_rate or rate):.8f}"]
    lines += [" ".join(f"{v:.6f}" for v in row) for row in np.column_stack(columns)]
    return "\n".join(lines) + "\n"


_CMU = 0.45 * 39.37007874
# name, parent, direction, length in m, which local rotation
ASF = (
    *(("lhipjoint", "root", (1, 0, 0), 0.1, None), ("rhipjoint", "root", (-1, 0, 0), 0.1, None)),
    ("lowerback", "root", (0, 1, 0), 0.12, None),
    ("upperback", "lowerback", (0, 1, 0), 0.12, "spine"),
    ("thorax", "upperback", (0, 1, 0), 0.14, None),
    ("lowerneck", "thorax", (0, 1, 0), 0.1, None),
    ("upperneck", "lowerneck", (0, 1, 0), 0.08, None),
    ("head", "upperneck", (0, 1, 0), 0.17, None),
    *(
        bone
        for side, out in (("l", 1), ("r", -1))
        for bone in (
            (f"{side}femur", f"{side}hipjoint", (0, -1, 0), THIGH, f"hip_{side}"),
            (f"{side}tibia", f"{side}femur", (0, -1, 0), SHANK, f"knee_{side}"),
            (f"{side}foot", f"{side}tibia", (0, -0.35, 0.9367), 0.15, f"ankle_{side}"),
            (f"{side}toes", f"{side}foot", (0, 0, 1), 0.06, None),
            (f"{side}clavicle", "thorax", (out, 0, 0), 0.18, None),
            (f"{side}humerus", f"{side}clavicle", (out, 0, 0), 0.28, f"shoulder_{side}"),
            (f"{side}radius", f"{side}humerus", (out, 0, 0), 0.24, f"elbow_{side}"),
            (f"{side}wrist", f"{side}radius", (out, 0, 0), 0.03, None),
            (f"{side}hand", f"{side}wrist", (out, 0, 0), 0.08, None),
            (f"{side}fingers", f"{side}hand", (out, 0, 0), 0.07, None),
            (f"{side}thumb", f"{side}wrist", (0.7071 * out, 0, 0.7071), 0.05, None),
        )
    ),
)


def asf_text() -> str:
    """Return the walker's skeleton with the bones of CMU's ASF files, axes along the world's."""
    lines = [":version 1.10", ":units", "  mass 1.0", "  length 0.45", "  angle deg", ":root"]
    lines += ["  order TX TY TZ RX RY RZ", "  axis XYZ", "  position 0 0 0", "  orientation 0 0 0"]
    lines.append(":bonedata")
    for number, (name, _, direction, length, part) in enumerate(ASF, start=1):
        lines += ["  begin", f"    id {number}", f"    name {name}"]
        lines.append("    direction " + " ".join(f"{v:g}" for v in direction))
        lines += [f"    length {length * _CMU:.6f}", "    axis 0 0 0 XYZ"]
        lines += ["    dof rx ry rz"] if part else []
        lines += [f"    limits {' '.join(['(-180 180)'] * 3)}"] if part else []
        lines.append("  end")
    lines += [":hierarchy", "  begin"]
    parents = list(dict.fromkeys(bone[1] for bone in ASF))
    lines += [f"    {one} {' '.join(b[0] for b in ASF if b[1] == one)}" for one in parents]
    return "\n".join([*lines, "  end", ""])


def amc_text(frames: int = FRAMES) -> str:
    """Return the walker's movement on `asf_text`'s skeleton."""
    moved = walk(frames)
    turns = _local_rotations(moved)
    lines = ["#!OML:ASF own", ":FULLY-SPECIFIED", ":DEGREES"]
    angles = {b[0]: turns[b[4]].as_euler("xyz", degrees=True) for b in ASF if b[4]}
    for frame in range(frames):
        place = np.array([0, moved.height[frame], moved.forward[frame]]) * _CMU
        lines += [str(frame + 1), "root " + " ".join(f"{v:.6f}" for v in (*place, 0, 0, 0))]
        lines += [f"{b} " + " ".join(f"{v:.6f}" for v in one[frame]) for b, one in angles.items()]
    return "\n".join(lines) + "\n"


_URDF_JOINTS = (
    *(("chest", "root", "0 0.2 0", "spherical"), ("neck", "chest", "0 0.35 0", "spherical")),
    *(
        joint
        for side, out in (("right", 1), ("left", -1))
        for joint in (
            (f"{side}_hip", "root", f"0 0 {0.1 * out}", "spherical"),
            (f"{side}_knee", f"{side}_hip", f"0 {-THIGH} 0", "revolute"),
            (f"{side}_ankle", f"{side}_knee", f"0 {-SHANK} 0", "spherical"),
            (f"{side}_shoulder", "chest", f"0 0.3 {0.19 * out}", "spherical"),
            (f"{side}_elbow", f"{side}_shoulder", "0 -0.28 0", "revolute"),
            (f"{side}_wrist", f"{side}_elbow", "0 -0.25 0", "fixed"),
        )
    ),
)


def urdf_text(scale: float = 4.0) -> str:
    """Return the walker's skeleton as DeepMimic's humanoid, `scale` units a metre as there."""

    def scaled(text: str) -> str:
        return " ".join(f"{scale * float(v):g}" for v in text.split())

    lines = ["<robot>", '<link name="root"/>']
    for name, *_ in _URDF_JOINTS:
        shape = ""
        if name == "neck":
            ball = f'<sphere radius="{0.1 * scale}"/>'
            shape = f'<origin xyz="{scaled("0 0.18 0")}"/><geometry>{ball}</geometry>'
        if name.endswith("ankle"):
            box = f'<box size="{scaled("0.2 0.05 0.1")}"/>'
            shape = f'<origin xyz="{scaled("0.05 -0.055 0")}"/><geometry>{box}</geometry>'
        lines.append(f'<link name="{name}"><collision>{shape}</collision></link>')
    for name, parent, place, kind in _URDF_JOINTS:
        axis = '<axis xyz="0 0 1"/>' if kind == "revolute" else ""
        lines.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{name}"/>'
            f'<origin rpy="0 0 0" xyz="{scaled(place)}"/>{axis}</joint>'
        )
    return "\n".join([*lines, "</robot>", ""])


def deepmimic_text(frames: int = FRAMES) -> str:
    """Return the walker in DeepMimic's format: it looks along +x and its right is +z."""
    moved = walk(frames)

    def about_z(angle: float) -> list[float]:
        return [np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)]

    rows = []
    for f in range(frames):
        row = [1 / RATE, moved.forward[f], moved.height[f], 0.0, *about_z(0), *about_z(0)]
        row += about_z(0)
        for side in "rl":
            row += [*about_z(moved.hip[side][f]), -moved.knee[side][f]]
            row += about_z(moved.ankle[side][f])
            row += [*about_z(moved.shoulder[side][f]), moved.elbow[side][f]]
        rows.append([float(v) for v in row])
    return json.dumps({"Loop": "none", "Frames": rows})


# Lets a job wait before it completes the file that is named in `pause`.
_PAUSE = """\
import os, time
_fsync = os.fsync
def fsync(descriptor):
    if os.path.exists("pause"):
        name = os.readlink(f"/proc/self/fd/{descriptor}")
        wanted = open("pause").read()
        if wanted in name:
            open("reached", "w").close()
            end = time.time() + 60
            while os.path.exists("pause") and time.time() < end:
                time.sleep(0.02)
    _fsync(descriptor)
os.fsync = fsync
"""


def copy_code(folder: Path) -> Path:
    """Copy the workflow and the package, as they are now, and return the folder."""
    folder.mkdir(parents=True)
    for name in ("config", "workflow", "src"):
        ignored = shutil.ignore_patterns("__pycache__", "*.egg-info")
        shutil.copytree(ROOT / name, folder / name, ignore=ignored)
    shutil.copy(ROOT / "Snakefile", folder)
    (folder / "profiles").symlink_to("workflow/profiles")
    return folder


class Project:
    """A user's folder: clips, a sheet, and Snakemake run on it with the workflow in `code`."""

    def __init__(self, folder: Path, code: Path) -> None:
        self.folder, self.code = folder, code
        self.rows: dict[str, dict[str, object]] = {}
        self.results = folder / "out"
        folder.mkdir(parents=True, exist_ok=True)

    def copy(self, folder: Path) -> Project:
        """Return a copy of all of it, results and Snakemake's records included."""
        shutil.copytree(self.folder, folder, symlinks=True)
        twin = Project(folder, self.code)
        twin.rows = {key: dict(row) for key, row in self.rows.items()}
        return twin

    @property
    def sheet(self) -> Path:
        return self.folder / "sheet.tsv"

    def add(self, name: str, content: str | None, **cells: object) -> Path:
        """Write a clip, unless content is None, and its row; the id is the file's stem."""
        path = self.folder / name
        if content is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content, encoding="utf-8")
        row = {"id": path.stem, "path": name, "up_axis": "y", "unit": "cm", "action": "walk"}
        self.rows[path.stem] = row | {"skeleton": "aalto"} | cells
        self.write_sheet()
        return path

    def write_sheet(self, rows: Sequence[Mapping[str, object]] | None = None) -> None:
        rows = list(self.rows.values()) if rows is None else rows
        lines = ["\t".join(COLUMNS)]
        lines += ["\t".join(str(row.get(column, "")) for column in COLUMNS) for row in rows]
        self.sheet.write_text("\n".join(lines) + "\n", encoding="utf-8")

    def command(self, *arguments: str, **config: object) -> list[str]:
        settings = {"motions": self.sheet.name, "results_root": self.results.name, **config}
        pairs = [f"{key}={value}" for key, value in settings.items() if value is not ...]
        command = [sys.executable, "-m", "snakemake", *arguments, "--cores", "2", "--nocolor"]
        command += ["--snakefile", str(self.code / "Snakefile"), "--directory", str(self.folder)]
        return [*command, "--config", *pairs]

    def environment(self, **changes: str | None) -> dict[str, str]:
        paths = f"{self.folder / 'hooks'}{os.pathsep}{self.code / 'src'}"
        changes = {"PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1", **changes}
        environment = {**os.environ, **{k: v for k, v in changes.items() if v is not None}}
        for name in (key for key, value in changes.items() if value is None):
            environment.pop(name, None)
        return environment

    def run(
        self,
        *arguments: str,
        cwd: Path | None = None,
        env: Mapping[str, str | None] | None = None,
        limits: str = "",
        **config: object,
    ) -> Run:
        """Run Snakemake to its end; `limits` is a shell command before it, such as ulimit."""
        command = self.command(*arguments, **config)
        if limits:
            command = ["bash", "-c", f'{limits} && exec "$@"', "bash", *command]
        done = subprocess.run(
            command,
            cwd=cwd or self.code,
            env=self.environment(**(env or {})),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
            timeout=300,
            check=False,
        )
        return Run(done.returncode, done.stdout)

    def start(self, *arguments: str, **config: object) -> subprocess.Popen[str]:
        """Start Snakemake in a process group of its own, its output in `started.txt`."""
        # A suite in the background may be deaf to Ctrl-C; what it starts would be, too.
        former = signal.signal(signal.SIGINT, signal.default_int_handler)
        with (
            (self.folder / "started.txt").open("w", encoding="utf-8") as output,
            contextlib.ExitStack() as stack,
        ):
            stack.callback(signal.signal, signal.SIGINT, former)
            return subprocess.Popen(
                self.command(*arguments, **config),
                cwd=self.code,
                env=self.environment(),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def output_of_start(self) -> str:
        return (self.folder / "started.txt").read_text(encoding="utf-8")

    def start_and_pause(self, name: str, *arguments: str) -> subprocess.Popen[str]:
        """Start Snakemake and return when a job is about to complete the file called so."""
        (self.folder / "hooks").mkdir(exist_ok=True)
        (self.folder / "hooks" / "sitecustomize.py").write_text(_PAUSE, encoding="utf-8")
        (self.folder / "pause").write_text(name, encoding="utf-8")
        (self.folder / "reached").unlink(missing_ok=True)
        process = self.start(*arguments)
        end = time.monotonic() + 90
        while not (self.folder / "reached").exists():
            if process.poll() is not None or time.monotonic() > end:
                stop_group(process)
                raise AssertionError(f"never reached {name}:\n{self.output_of_start()}")
            time.sleep(0.02)
        return process

    def go_on(self) -> None:
        """Let the waiting job complete its file."""
        (self.folder / "pause").unlink(missing_ok=True)

    def clips(self) -> dict[str, dict[str, str]]:
        """Return the rows of clips.csv by id."""
        return {row["id"]: row for row in read_table(self.results / "tables/clips.csv")}

    def files(self, *patterns: str) -> dict[str, bytes]:
        """Return name -> content of the files of the results."""
        found = (file for pattern in patterns for file in self.results.glob(pattern))
        return {str(f.relative_to(self.results)): f.read_bytes() for f in found if f.is_file()}

    def leftovers(self) -> list[str]:
        """Return the names of temporary files."""
        return sorted(str(p.relative_to(self.folder)) for p in self.folder.rglob("*.part"))


@dataclass(frozen=True)
class Run:
    """How a run ended."""

    code: int
    output: str

    @property
    def jobs(self) -> list[str]:
        """Return the jobs that were run: rule, or rule:wildcards."""
        found = re.findall(
            r"^(?:local)?rule (\w+):\n((?: {4}.*\n)*)", self.output, flags=re.MULTILINE
        )
        names = []
        for rule, body in found:
            values = re.search(r"wildcards: (.*)", body)
            parts = [pair.split("=")[1] for pair in values[1].split(", ")] if values else []
            names.append(":".join([rule, "/".join(parts)]) if parts else rule)
        return sorted(names)

    @property
    def idle(self) -> bool:
        return "Nothing to be done" in self.output and not self.jobs


def stop_group(process: subprocess.Popen[str]) -> None:
    """End what is left of a started run, orphans included."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()

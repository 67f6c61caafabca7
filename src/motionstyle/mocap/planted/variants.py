"""Planted motions: the catalogue, and which source frames two motions have in common.

`read_planted` turns the catalogue `config/planted.yaml` into recipes and `plant` a recipe into a
motion. Planted motions are variants of a real clip with known parameters; they are no
performances, see `planted.cycle` for what they rest on.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.mocap.planted.planting import plant
from motionstyle.mocap.planted.recipe import GROUPS, POSTURE_NAMES, PlantedRecipe
from motionstyle.motion.motion import Motion

__all__ = ["PlantedRecipe", "plant", "read_planted", "shared_source_frames", "source_frames_of"]

Keys = Mapping[str, Any]
_CHANGES = {"posture_offset_deg": dict, "swing_gain": dict, "cadence": float, "step_length": float}
_SHAPE: dict[str, dict[str, Any]] = {
    "bases": {"cycle_frames": int, "cycles": int},
    "takes": {"source_window": str, "phase_noise": float, "pose_noise_deg": float},
    "style_axes": _CHANGES,
    "doses": {"base": str, "takes": list, "seed": int, "parameter": str, "values": list},
    "styled": {"bases": list, "takes": list, "seed": int, "experiments": list},
    "undosed": {"takes": list, "seed": int, "experiments": list},
}
_NAMED = ("bases", "takes", "style_axes", "doses")  # groups of named entries of one shape
_OPTIONAL = {"bases", "takes", "style_axes"}  # whose entries may leave keys out
_SECTIONS = (*_SHAPE, "styles")
_WORDS = {int: "a whole number", float: "a number", str: "text", list: "a list", dict: "a group"}
DOSED = (*POSTURE_NAMES, *GROUPS, "step_length", "cadence")
NEUTRAL = "planted-neutral"


def source_frames_of(motion: Motion) -> set[tuple[str, int]]:
    """Return (file, frame) of the original file for all frames a motion was made from.

    Where the original repeats itself mirrored, the first of the two frames stands for both.
    """
    file = str(motion.provenance.get("source", motion.id))
    twins = motion.provenance.get("mirror_twin_after_frames")
    found: set[tuple[str, int]] = set()
    for part in str(motion.provenance.get("source_frames", "")).split(","):
        if not part:
            continue
        ends = re.fullmatch(r"(\d+)(?:-(\d+))?", part.strip())
        if not ends:
            raise MotionStyleError(
                f"motion {motion.id}: source_frames has {part!r}, expected numbers like 0-37 or 4"
            )
        first, last = int(ends[1]), int(ends[2] or ends[1])
        found |= {(file, f % twins if twins else f) for f in range(first, last + 1)}
    return found


def shared_source_frames(a: Motion, b: Motion) -> int:
    """Return how many source frames two motions have in common, mirror images counted as one."""
    return len(source_frames_of(a) & source_frames_of(b))


@dataclass
class _Reader:
    """The catalogue's checked sections, and the problems found on the way."""

    name: str
    problems: list[str] = field(default_factory=list)

    def note(self, where: str, text: str) -> None:
        """Note what is wrong, and where."""
        self.problems.append(f"{self.name}, {where}: {text}")

    def group(self, where: str, value: object) -> Keys:
        """Return a group of keys; anything else is noted and read as an empty one."""
        if isinstance(value, Mapping):
            return {str(k): v for k, v in value.items()}
        self.note(where, f"found {value!r}, expected a group of keys")
        return {}

    def shaped(self, where: str, value: object, shape: Keys, *, optional: bool) -> dict[str, Any]:
        """Return the entries that have the right name and type."""
        given, good = self.group(where, value), {}
        for key, item in given.items():
            if key not in shape:
                near = near_matches(key, list(shape)) or f"; known are {', '.join(shape)}"
                self.note(where, f"unknown key '{key}'{near}")
            elif not _is_of(item, shape[key]):
                self.note(where, f"{key} is {item!r}, expected {_WORDS[shape[key]]}")
            else:
                good[key] = item
        if not optional:
            for key in [k for k in shape if k not in given]:
                self.note(where, f"'{key}' is missing")
        return good

    def number(self, where: str, name: str, value: object) -> None:
        """Note a value that is no number."""
        if not _is_of(value, float):
            self.note(where, f"{name} is {value!r}, expected a number")

    def known(self, where: str, names: Sequence[object], choices: Sequence[str]) -> None:
        """Note the names that are not among the choices."""
        for name in names:
            if str(name) not in choices:
                near = near_matches(str(name), choices) or f"; known are {', '.join(choices)}"
                self.note(where, f"'{name}' is unknown{near}")


def _is_of(value: object, kind: type) -> bool:
    if isinstance(value, bool) or (isinstance(value, float) and not math.isfinite(value)):
        return False
    return isinstance(value, int | float if kind is float else kind)


def read_planted(path: str | Path) -> tuple[PlantedRecipe, ...]:
    """Read and check the catalogue of planted motions.

    Raises
    ------
    MotionStyleError
        With every problem of the catalogue, one a line.
    """
    path = Path(path)
    try:
        raw = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise MotionStyleError(f"{path}: not a readable YAML file ({error})") from error
    reader = _Reader(path.name)
    catalogue = _sections(reader, raw)
    recipes: list[PlantedRecipe] = []
    if not reader.problems:
        seen: set[str] = set()
        for fields in (*_styled(catalogue), *_dosed(catalogue)):
            if fields["id"] in seen:
                reader.note(fields["id"], "this motion is asked for twice")
            seen.add(fields["id"])
            try:
                recipes.append(PlantedRecipe(**fields))
            except MotionStyleError as error:
                reader.problems += str(error).splitlines()
    if reader.problems:
        raise MotionStyleError("\n".join(dict.fromkeys(reader.problems)))
    return tuple(recipes)


def _sections(reader: _Reader, raw: object) -> dict[str, Any]:
    given = reader.group("top", raw)
    for key in given:
        if key not in _SECTIONS:
            near = near_matches(key, _SECTIONS) or f"; known are {', '.join(_SECTIONS)}"
            reader.note("top", f"unknown key '{key}'{near}")
    for key in _SECTIONS:
        if key not in given:
            reader.note("top", f"'{key}' is missing")
    sections: dict[str, Any] = {}
    for key, shape in _SHAPE.items():
        if key in _NAMED:
            entries = reader.group(key, given.get(key, {}))
            sections[key] = {
                name: reader.shaped(f"{key}.{name}", entry, shape, optional=key in _OPTIONAL)
                for name, entry in entries.items()
            }
        else:
            sections[key] = reader.shaped(key, given.get(key, {}), shape, optional=False)
    sections["styles"] = reader.group("styles", given.get("styles", {}))
    _check_styles(reader, sections)
    _check_names(reader, sections)
    return sections


def _check_styles(reader: _Reader, sections: Keys) -> None:
    """Note style axes and styles that make no sense."""
    for axis, change in sections["style_axes"].items():
        for key, names in (("posture_offset_deg", POSTURE_NAMES), ("swing_gain", GROUPS)):
            for name, value in change.get(key, {}).items():
                reader.known(f"style_axes.{axis}.{key}", [name], names)
                reader.number(f"style_axes.{axis}.{key}", name, value)
    count = len(sections["style_axes"])
    for style, vector in sections["styles"].items():
        good = isinstance(vector, list) and len(vector) == count
        if not (good and all(_is_of(v, float) for v in vector)):
            reader.note(f"styles.{style}", f"found {vector!r}, expected {count} numbers")
        if not style.startswith("planted"):
            reader.note(f"styles.{style}", "a planted style's name begins with 'planted'")


def _check_names(reader: _Reader, sections: Keys) -> None:
    """Note bases, takes and parameters that the catalogue does not define."""
    bases, takes = list(sections["bases"]), list(sections["takes"])
    for take in takes:
        if not take.isdigit():
            reader.note("takes", f"'{take}' is not a whole number")
    reader.known("styled.bases", sections["styled"].get("bases", []), bases)
    users = {"styled": sections["styled"], "undosed": sections["undosed"]}
    users |= {f"doses.{name}": entry for name, entry in sections["doses"].items()}
    for where, user in users.items():
        reader.known(f"{where}.takes", user.get("takes", []), takes)
    for name, entry in sections["doses"].items():
        reader.known(f"doses.{name}.base", [entry["base"]] if "base" in entry else [], bases)
        named = [entry["parameter"]] if "parameter" in entry else []
        reader.known(f"doses.{name}.parameter", named, DOSED)
        for value in entry.get("values", []):
            reader.number(f"doses.{name}", "values", value)


def _common(catalogue: Keys, base: str, take: str, seed: int) -> dict[str, Any]:
    fields = {"base": base, "take": int(take), "seed": seed}
    return fields | catalogue["bases"][base] | catalogue["takes"][take]


def _styled(catalogue: Keys) -> Iterator[dict[str, Any]]:
    """Yield the fields of the styled motions: bases by styles by takes."""
    plan, seed = catalogue["styled"], catalogue["styled"]["seed"]
    for base in plan["bases"]:
        for style, vector in catalogue["styles"].items():
            for take in map(str, plan["takes"]):
                short = style.removeprefix("planted").strip("-_ ")
                yield {
                    **_common(catalogue, base, take, seed),
                    **_style_changes(catalogue["style_axes"], vector),
                    "id": f"planted-{base}-{short}-take{take}",
                    "style": style,
                    "series": "styles",
                    "style_coordinates": tuple(float(v) for v in vector),
                    "experiments": tuple(plan["experiments"]),
                }
                seed += 1


def _style_changes(axes: Mapping[str, Keys], vector: Sequence[float]) -> dict[str, Any]:
    """Return the parameters of a style: changes add up, factors start at 1."""
    fields: dict[str, Any] = {"posture_offset_deg": {}, "swing_gain": {}}
    for change, value in zip(axes.values(), vector, strict=True):
        for key in ("cadence", "step_length"):
            if key in change:
                fields[key] = round(fields.get(key, 1.0) + value * change[key], 9)
        for key, start in (("posture_offset_deg", 0.0), ("swing_gain", 1.0)):
            for name, size in change.get(key, {}).items():
                fields[key][name] = round(fields[key].get(name, start) + value * size, 9)
    return fields


def _dosed(catalogue: Keys) -> Iterator[dict[str, Any]]:
    """Yield the fields of the dose series, and of dose 0 once a base and take."""
    undosed, series = catalogue["undosed"], catalogue["doses"]
    shared = {"style": NEUTRAL, "experiments": tuple(undosed["experiments"])}
    seed = undosed["seed"]
    for base in dict.fromkeys(entry["base"] for entry in series.values()):
        for take in map(str, undosed["takes"]):
            fields = _common(catalogue, base, take, seed) | shared
            yield fields | {
                "id": f"planted-{base}-dose0-take{take}",
                "series": "dose0",
                "dose": 0.0,
            }
            seed += 1
    for name, entry in series.items():
        seed = entry["seed"]
        for value in map(float, entry["values"]):
            for take in map(str, entry["takes"]):
                fields = _common(catalogue, entry["base"], take, seed) | shared
                fields |= _dose(entry["parameter"], value)
                label = f"{value:g}"
                fields |= {"id": f"planted-{name}-{label}-take{take}", "series": name}
                yield fields | {"style": f"planted-{name}-{label}"}
                seed += 1


def _dose(parameter: str, value: float) -> dict[str, Any]:
    """Return the fields of one dose, the size of the change from neutral."""
    if parameter in GROUPS:
        return {"swing_gain": {parameter: value}, "dose": round(abs(value - 1), 9)}
    if parameter in POSTURE_NAMES:
        return {"posture_offset_deg": {parameter: value}, "dose": abs(value)}
    return {parameter: value, "dose": round(abs(value - 1), 9)}

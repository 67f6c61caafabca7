"""OpenSim's inverse dynamics of the exports in the working folder, by a Python that has OpenSim.

Not for import: OpenSim brings a CasADi of its own, which does not live beside ours.
"""

import json
from pathlib import Path

import opensim

UNIT = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def joint(parent, child, offset, coordinates, translations=None):
    """A joint that turns about signed axes ("z", "-x", …) one after the other."""
    transform = opensim.SpatialTransform()

    def put(axis, direction, name):
        axis.set_axis(opensim.Vec3(*direction))
        if name is None:
            axis.set_function(opensim.Constant(0))
            return
        names = opensim.ArrayStr()
        names.append(name)
        axis.setCoordinateNames(names)
        axis.set_function(opensim.LinearFunction(1, 0))

    turns = [(name, axis) for name, axis in coordinates]
    turns += [(None, a) for a in "zxy" if a not in {axis[-1] for _name, axis in turns}]
    for k, (name, axis) in enumerate(turns, start=1):
        sign = -1.0 if axis.startswith("-") else 1.0
        direction = [sign * v for v in UNIT[axis[-1]]]
        put(getattr(transform, f"upd_rotation{k}")(), direction, name)
    for k, axis in enumerate("xyz"):
        name = translations[k] if translations else None
        put(getattr(transform, f"upd_translation{k + 1}")(), UNIT[axis], name)
    zero = opensim.Vec3(0, 0, 0)
    place = opensim.Vec3(*offset)
    name = f"to_{child.getName()}"
    return opensim.CustomJoint(name, parent, place, zero, child, zero, zero, transform)


def legs_of(body):
    """Pelvis and legs, of the lists in body.json: nothing above bears on the legs' moments."""
    model = opensim.Model()
    model.set_gravity(opensim.Vec3(0, -9.81, 0))

    def add(node, name, parent, coordinates, translations=None):
        given = body[node]
        inertia = given["inertia"]
        values = [inertia[a][b] for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        com = opensim.Vec3(*given["com"])
        part = opensim.Body(name, given["mass"], com, opensim.Inertia(*values))
        model.addBody(part)
        model.addJoint(joint(parent, part, given["offset"], coordinates, translations))
        return part

    turns = [("pelvis_tilt", "z"), ("pelvis_list", "x"), ("pelvis_rotation", "y")]
    moves = ["pelvis_tx", "pelvis_ty", "pelvis_tz"]
    pelvis = add("pelvis", "pelvis", model.getGround(), turns, moves)
    for side, sign in (("r", ""), ("l", "-")):
        hip = [("hip_flexion", "z"), ("hip_adduction", f"{sign}x"), ("hip_rotation", f"{sign}y")]
        part = pelvis
        for node, name, coordinates in (
            ("thigh", "femur", hip),
            ("shank", "tibia", [("knee_angle", "-z")]),
            ("foot", "calcn", [("ankle_angle", "z"), ("subtalar_angle", f"{sign}x")]),
            ("toes", "toes", [("mtp_angle", "z")]),
        ):
            named = [(f"{c}_{side}", axis) for c, axis in coordinates]
            part = add(f"{node}_{side}", f"{name}_{side}", part, named)
    model.finalizeConnections()
    model.initSystem()
    return model


def main():
    table = opensim.TimeSeriesTable("angles.mot")
    print("angles", table.getNumRows(), table.getTableMetaDataString("inDegrees"))
    times = list(table.getIndependentColumn())
    tool = opensim.InverseDynamicsTool()
    model = legs_of(json.loads(Path("body.json").read_text(encoding="utf-8")))
    tool.setModel(model)
    tool.setCoordinatesFileName("angles.mot")
    tool.setExternalLoadsFileName("loads.xml")
    tool.setLowpassCutoffFrequency(-1)
    tool.setStartTime(times[0])
    tool.setEndTime(times[-1])
    tool.setResultsDir(".")
    tool.setOutputGenForceFileName("found.sto")
    assert tool.run()


main()

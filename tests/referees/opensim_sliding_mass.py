"""Run in an environment with the package `opensim`: the sliding mass of least effort by Moco.

Arguments: mass (kg), distance (m), time (s). Prints the integral of the squared force.
"""

import sys

import opensim as osim

mass, distance, span = map(float, sys.argv[1:4])
model = osim.Model()
model.set_gravity(osim.Vec3(0))
body = osim.Body("body", mass, osim.Vec3(0), osim.Inertia(0))
model.addComponent(body)
joint = osim.SliderJoint("slider", model.getGround(), body)
joint.updCoordinate().setName("position")
model.addComponent(joint)
actuator = osim.CoordinateActuator("position")
actuator.setName("actuator")
actuator.setOptimalForce(1)
model.addComponent(actuator)
model.finalizeConnections()

study = osim.MocoStudy()
problem = study.updProblem()
problem.setModel(model)
problem.setTimeBounds(0, span)
problem.setStateInfo(
    "/slider/position/value", osim.MocoBounds(-5, 5), osim.MocoInitialBounds(0),
    osim.MocoFinalBounds(distance),
)  # fmt: skip
problem.setStateInfo("/slider/position/speed", [-50, 50], [0], [0])
problem.setControlInfo("/actuator", osim.MocoBounds(-100, 100))
problem.addGoal(osim.MocoControlGoal("effort"))
solver = study.initCasADiSolver()
solver.set_num_mesh_intervals(50)
solver.set_verbosity(0)
solution = study.solve()
assert solution.success()
print("effort", solution.getObjective())

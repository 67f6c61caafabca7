"""The body: 18 nodes, 35 coordinates, masses, ranges, rotations and forward kinematics."""

"""From the markers of a laboratory to a motion: sets, checks, joints, paths, fit, plates."""

"""What the spacetime solver is measured by: known optima, twins, choices of the problem, growth."""

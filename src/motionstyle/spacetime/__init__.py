"""Motions as solutions: splines, residual blocks, contact forces, and the physics fit."""

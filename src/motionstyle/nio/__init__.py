"""Nonlinear Inverse Optimisation: a style learnt from one motion (Liu et al. 2005, §4.3–4.6)."""

"""Figures: one style, one way to write them; numbers come from `evaluation`."""

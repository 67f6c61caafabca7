"""Experiments of Brand & Hertzmann 2000 and their ground truth (style_machines.md §9)."""

"""Variants of embedded clips, changed by known amounts."""

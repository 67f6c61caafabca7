"""Readers of clip files: one per format, into `SkeletonClip`, `MarkerClip` or `ForceRecord`."""

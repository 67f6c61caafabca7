"""Motion style from motion capture: a replication of three papers, as a library."""

__version__ = "0.1.0"

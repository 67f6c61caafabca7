"""`Motion`, the one value that travels between the stages, and its files."""

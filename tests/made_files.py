"""Small files that tests make, and what is left of them."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path


def digest(data: bytes) -> str:
    return sha256(data).hexdigest()


def nothing_left(folder: Path) -> bool:
    return not [path for path in folder.rglob("*") if path.is_file()]


def put(path: Path, data: bytes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path

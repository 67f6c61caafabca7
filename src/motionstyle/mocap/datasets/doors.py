"""Where a clip's file comes from: the user's cache, a mirror folder, or upstream by HTTPS.

Whatever the source, its bytes are used only if their SHA-256 is the pinned one. The module is
imported by several hundred tiny jobs and therefore imports little.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.files import atomic_write
from motionstyle.mocap.datasets.upstream import SourceError, download

if TYPE_CHECKING:
    from urllib.request import OpenerDirector

Log = Callable[[str], None]

UPSTREAM = "https://raw.githubusercontent.com/{repository}/{commit}/{upstream_path}"
DATASET_COLUMNS = (
    "dataset",
    "path",
    "repository",
    "commit",
    "upstream_path",
    "sha256",
    "licence",
    "note",
)
_LFS_POINTER = b"version https://git-lfs.github.com/spec/"


@dataclass(frozen=True)
class DatasetFile:
    """One row of `config/datasets.tsv`: a file pinned by repository, commit, path and SHA-256."""

    dataset: str
    path: str
    repository: str
    commit: str
    upstream_path: str
    sha256: str
    licence: str
    note: str


@dataclass(frozen=True)
class FetchRecord:
    """What `fetch_file` did.

    Attributes
    ----------
    destination : the file written.
    source : `cache`, `mirror` or `upstream`.
    location : file or address the bytes came from.
    sha256 : their checksum, equal to the pinned one.
    failures : (location, reason) of the sources tried before, in order.
    """

    destination: Path
    source: str
    location: str
    sha256: str
    failures: tuple[tuple[str, str], ...]


def cached_file(cache_dir: str | Path, checksum: str) -> Path:
    """Return where the cache keeps the file with this SHA-256."""
    return Path(cache_dir) / "files" / checksum[:2] / checksum


def read_datasets(path: str | Path) -> dict[tuple[str, str], DatasetFile]:
    """Read `datasets.tsv` into a dictionary by (dataset, path).

    Raises
    ------
    MotionStyleError
        With every problem of the file: columns, cell counts, checksums, doubled rows.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise MotionStyleError(f"{path}: cannot read the table of datasets: {error}") from error
    rows = list(csv.reader(text.splitlines(), delimiter="\t", quoting=csv.QUOTE_NONE))
    if not rows or tuple(rows[0]) != DATASET_COLUMNS:
        found = ", ".join(rows[0]) if rows else "nothing"
        raise MotionStyleError(
            f"{path}: the first line must name the columns {', '.join(DATASET_COLUMNS)};"
            f" found {found}"
        )
    problems: list[str] = []
    entries: dict[tuple[str, str], DatasetFile] = {}
    for number, cells in enumerate(rows[1:], start=2):
        where = f"{path.name} row {number}"
        if len(cells) != len(DATASET_COLUMNS):
            problems.append(f"{where}: {len(cells)} cells, expected {len(DATASET_COLUMNS)}")
            continue
        entry = DatasetFile(*cells)
        problems += [f"{where}, {problem}" for problem in _entry_problems(entry)]
        if (entry.dataset, entry.path) in entries:
            problems.append(f"{where}: {entry.path} of {entry.dataset} is listed twice")
        entries[entry.dataset, entry.path] = entry
    if problems:
        raise MotionStyleError("\n".join(problems))
    return entries


def _entry_problems(entry: DatasetFile) -> list[str]:
    problems = []
    if not re.fullmatch(r"[0-9a-f]{64}", entry.sha256):
        problems.append(f"column sha256: {entry.sha256!r} is not 64 lower-case hexadecimal digits")
    if not re.fullmatch(r"[0-9a-f]{40}", entry.commit):
        problems.append(f"column commit: {entry.commit!r} is not 40 lower-case hexadecimal digits")
    for column in ("path", "upstream_path"):
        value = PurePosixPath(getattr(entry, column))
        if not value.parts or value.is_absolute() or ".." in value.parts:
            problems.append(f"column {column}: {str(value)!r} is not a relative path")
    return problems


def dataset_file(
    datasets: Mapping[tuple[str, str], DatasetFile], dataset: str, path: str
) -> DatasetFile:
    """Return the pinned file, or raise one error with the nearest names."""
    if entry := datasets.get((dataset, path)):
        return entry
    raise MotionStyleError(unknown_dataset_file(datasets, dataset, path))


def unknown_dataset_file(
    datasets: Mapping[tuple[str, str], DatasetFile], dataset: str, path: str
) -> str:
    """Say why (dataset, path) is not among `datasets`, with near matches."""
    paths = [known_path for known, known_path in datasets if known == dataset]
    if not paths:
        names = sorted({known for known, _ in datasets})
        return f"{dataset!r} is not a dataset of datasets.tsv{near_matches(dataset, names)}"
    return f"{path!r} is not a file of dataset {dataset}{near_matches(path, paths)}"


def fetch_file(
    entry: DatasetFile,
    destination: str | Path,
    *,
    cache_dir: str | Path,
    mirrors: Sequence[str | Path],
    log: Log,
    timeout_s: float = 30.0,
    url_template: str = UPSTREAM,
    root: str | Path = ".",
    opener: OpenerDirector | None = None,
    pause_s: float = 1.0,
) -> FetchRecord:
    """Write the file `entry` pins to `destination`, from the first source that has it right.

    Order: the user's cache, the mirror folders, upstream at the pinned commit. What came from
    upstream is kept in the cache.

    Parameters
    ----------
    cache_dir : see `cache_folder`.
    mirrors : folders that hold the files under their `path`; relative ones are taken from
        `root`; absent ones are skipped.
    log : called with one line per source tried.
    timeout_s : seconds without an answer after which a connection is given up.
    opener : what opens addresses; the standard library's own, proxies included, if None.
    pause_s : seconds before the first retry of a network failure, doubled for the second.

    Raises
    ------
    MotionStyleError
        If no source gives the pinned bytes (it names them all), or the disk refuses the file.
    """
    destination = Path(destination)
    kept = cached_file(cache_dir, entry.sha256)
    url = _upstream_address(entry, url_template)
    folders = [Path(root, mirror) for mirror in mirrors]

    def from_upstream() -> tuple[bytes, str]:
        return download(url, timeout_s=timeout_s, pause_s=pause_s, log=log, opener=opener)

    sources: list[tuple[str, str, Callable[[], tuple[bytes, str]]]] = [
        ("cache", str(kept), partial(_read_local, kept)),
        *(("mirror", str(f / entry.path), partial(_read_mirror, f, entry.path)) for f in folders),
        ("upstream", url, from_upstream),
    ]

    failures: list[tuple[str, str]] = []
    for kind, location, read in sources:
        try:
            data, remark = read()
            _check(data, entry.sha256, remark)
        except SourceError as failure:
            failures.append((location, str(failure)))
            if not failure.expected:
                log(f"{entry.path}: {kind} {location}: {failure}")
            continue
        log(f"{entry.path}: from {kind} {location}")
        if kind == "upstream":
            _keep(kept, data, log)
        _write(destination, data)
        return FetchRecord(destination, kind, location, entry.sha256, tuple(failures))
    tried = "\n".join(f"- {location}: {reason}" for location, reason in failures)
    raise MotionStyleError(
        f"clip {entry.path} (dataset {entry.dataset}): no source gave the file with sha256"
        f" {entry.sha256}\n{tried}\n"
        f"Put the file into {kept}, or configure a mirror folder that holds {entry.path} in"
        " `mirrors:`, or check the network and run again."
    )


def _read_local(path: Path) -> tuple[bytes, str]:
    try:
        return path.read_bytes(), ""
    except FileNotFoundError as error:
        raise SourceError("no such file", expected=True) from error
    except OSError as error:
        raise SourceError(f"cannot be read: {error.strerror or error}") from error


def _read_mirror(folder: Path, path: str) -> tuple[bytes, str]:
    if not folder.is_dir():
        raise SourceError("the mirror folder is absent", expected=True)
    return _read_local(folder / path)


def _check(data: bytes, expected: str, remark: str) -> None:
    found = sha256(data).hexdigest()
    if found == expected:
        return
    if data.startswith(_LFS_POINTER):
        raise SourceError(f"a Git LFS pointer, not the file itself{remark}")
    if data[:200].lstrip().lower().startswith((b"<!doctype html", b"<html")):
        raise SourceError(f"a web page, not the file{remark}")
    raise SourceError(f"wrong checksum: sha256 {found}, {len(data)} bytes{remark}")


def _keep(path: Path, data: bytes, log: Log) -> None:
    try:
        with atomic_write(path, "wb") as handle:
            handle.write(data)
    except OSError as error:
        log(f"not kept in the cache: {path}: {error.strerror or error}")


def _write(path: Path, data: bytes) -> None:
    try:
        with atomic_write(path, "wb") as handle:
            handle.write(data)
    except OSError as error:
        raise MotionStyleError(f"cannot write {path}: {error.strerror or error}") from error


def _upstream_address(entry: DatasetFile, template: str) -> str:
    from urllib.parse import quote  # noqa: PLC0415

    return template.format(
        repository=quote(entry.repository),
        commit=quote(entry.commit),
        upstream_path=quote(entry.upstream_path),
    )

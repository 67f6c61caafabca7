"""What the repository itself must be: no captured data, no hosts, rules complete and tidy."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from walkers import ROOT

DATA = {
    *(".bvh", ".amc", ".asf", ".c3d", ".trc", ".mot", ".npz", ".npy", ".whl", ".fbx", ".pkl"),
    *(".h5", ".mat", ".zip"),
}
CLIP_NAME = re.compile(r"humanoid3d_\w+\.(txt|json)$|\.urdf$")


@pytest.fixture(scope="module")
def tracked():
    done = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if done.returncode:
        pytest.skip("not a git clone")
    return [Path(name) for name in done.stdout.split("\0") if name]


def test_no_captured_motion_is_tracked(tracked):
    assert len(tracked) > 50
    assert [str(p) for p in tracked if p.suffix.lower() in DATA or CLIP_NAME.search(p.name)] == []


def test_no_tracked_file_is_over_a_megabyte(tracked):
    there = [path for path in tracked if (ROOT / path).is_file()]
    assert [str(path) for path in there if (ROOT / path).stat().st_size > 1_000_000] == []


def test_only_published_results_are_tracked(tracked):
    results = [path for path in tracked if path.parts[0] == "results"]
    assert [str(path) for path in results if path.parts[1] != "published"] == []


@pytest.mark.parametrize("name", ["requirements.lock", "requirements-test.lock"])
def test_lock_files_name_no_index_and_pin_by_hash(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
    assert not re.search(r"https?://|--index-url|--extra-index|--find-links|--trusted-host", text)
    pins = [line for line in lines if re.match(r"[A-Za-z0-9]", line)]
    assert len(pins) > 20
    assert all(re.match(r"[A-Za-z0-9._-]+(\[.*\])?==\S+( ; .*)? \\$", line) for line in pins)
    assert text.count("--hash=sha256:") >= len(pins)


@pytest.mark.skipif(os.name != "posix", reason="file modes are POSIX")
def test_the_ci_script_can_be_run():
    assert os.access(ROOT / ".ci/run", os.X_OK)
    assert "make test" in (ROOT / ".ci/run").read_text(encoding="utf-8")


def test_the_readme_names_its_two_commands():
    readme = ROOT / "README.md"
    if not readme.exists():
        pytest.skip("there is no README.md yet")
    code = re.findall(r"```.*?\n(.*?)```", readme.read_text(encoding="utf-8"), flags=re.DOTALL)
    commands = {line.split("#")[0].strip() for block in code for line in block.splitlines()}
    assert {"make", "make test"} <= commands


def rules() -> dict[str, str]:
    """Return the text of every rule, those that inherit from another one included."""
    found = {}
    for file in sorted((ROOT / "workflow/rules").glob("*.smk")):
        parts = re.split(r"^(?=(?:use )?rule )", file.read_text(encoding="utf-8"), flags=re.M)
        for part in parts[1:]:
            head = part.split(":\n")[0]
            found[re.sub(r"^use rule \w+ as (\w+) with$", r"\1", head).removeprefix("rule ")] = part
    return found


def test_every_rule_has_log_threads_and_resources():
    found = rules()
    assert len(found) > 12
    own = {name: text for name, text in found.items() if not text.startswith("use ")}
    for keyword in ("log", "threads", "resources"):
        assert [name for name, text in own.items() if f"\n    {keyword}:" not in text] == []
    assert [name for name, text in found.items() if "\n    log:" not in text] == []
    assert [name for name, text in own.items() if "\n    run:" in text] == []


def test_rules_that_run_the_package_declare_its_sources():
    """Fault 18: each rule whose script imports a science module has the package's digest."""
    fetching = {"fetch_embedded", "fetch_clip", "check_clips", "publish"}
    own = {name: t for name, t in rules().items() if "script:" in t and name not in fetching}
    assert [name for name, text in own.items() if "library=library(" not in text] == []


def test_every_script_is_the_script_of_a_rule():
    named = set(re.findall(r'"\.\./scripts/(\w+\.py)"', "".join(rules().values())))
    assert named == {file.name for file in (ROOT / "workflow/scripts").glob("*.py")}


@pytest.mark.workflow
def test_snakemake_lint_is_clean(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", "--lint", "--snakefile", str(ROOT / "Snakefile")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.workflow
def test_snakefmt_changes_nothing():
    command = [sys.executable, "-m", "snakefmt", "--check", "Snakefile", "workflow"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_physics_fit_reruns_for_every_module_of_its_room_that_it_imports():
    text = (ROOT / "workflow/rules/common.smk").read_text(encoding="utf-8")
    listed = set(re.findall(r'"(\w+)"', text.split("PHYSICAL_MODULES = [")[1].split("]")[0]))
    for name in listed:
        module = (ROOT / f"src/motionstyle/spacetime/{name}.py").read_text(encoding="utf-8")
        assert set(re.findall(r"from motionstyle\.spacetime\.(\w+) import", module)) <= listed

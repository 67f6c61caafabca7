"""One finished run of the workflow that many tests share, and a folder for each test's own."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from walkers import (
    TARGETS,
    Project,
    amc_text,
    asf_text,
    bvh_text,
    copy_code,
    deepmimic_text,
    urdf_text,
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    here = Path(__file__).parent
    for item in items:
        if here in item.path.parents and sys.platform == "win32":
            item.add_marker(pytest.mark.skip(reason="signals and limits are POSIX"))


@pytest.fixture(scope="session")
def code(tmp_path_factory):
    """The workflow and the package as they are at the start of the tests."""
    return copy_code(tmp_path_factory.mktemp("clone") / "motionstyle")


def own_clips(folder: Path, code: Path) -> Project:
    """The walker in every format, unrun."""
    project = Project(folder, code)
    project.add("steady.bvh", bvh_text(), experiments="gait")
    project.add("short.bvh", bvh_text(stride=0.7), mirror="yes")
    project.add("own_01.amc", amc_text(), skeleton="cmu_asf", unit="cmu", rate=30)
    (folder / "own.asf").write_text(asf_text())
    project.add("mimic.json", deepmimic_text(), skeleton="deepmimic", unit="m")
    (folder / "humanoid.urdf").write_text(urdf_text())
    return project


@pytest.fixture(scope="session")
def finished_run(tmp_path_factory, code):
    project = own_clips(tmp_path_factory.mktemp("finished") / "own", code)
    return project, project.run(*TARGETS)


@pytest.fixture(scope="session")
def finished(finished_run):
    """A finished run of own clips in all formats; not to be changed, see `twin`."""
    project, run = finished_run
    assert run.code == 0, run.output
    return project


@pytest.fixture
def twin(finished, tmp_path):
    """A copy of the finished run, to be changed."""
    return finished.copy(tmp_path / "twin")


@pytest.fixture
def project(tmp_path, code):
    """An empty folder of a user."""
    return Project(tmp_path / "own", code)

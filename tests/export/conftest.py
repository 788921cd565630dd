"""Runs to be exported, once for all tests."""

import shutil
from pathlib import Path

import pytest
from exported_runs import ROBOTS, ran
from wall_case import WALL_CASE


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> dict[str, Path]:
    return {
        name: ran(tmp_path_factory.mktemp(name), WALL_CASE.format(robot=name, home=home, part=part))
        for name, (home, part) in ROBOTS.items()
    }


@pytest.fixture
def run(runs, tmp_path) -> Path:
    """A copy of the example robot's run."""
    shutil.copytree(runs["icme2008"], tmp_path / "stroke")
    return tmp_path / "stroke"

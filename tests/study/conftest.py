"""A case, its run and its study, which nothing has disturbed."""

from pathlib import Path

import pytest
from command_line import command
from studies import CHOSEN, SAMPLES, moving


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Path:
    return moving(tmp_path_factory.mktemp("case"), CHOSEN)


@pytest.fixture(scope="module")
def run(case, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("run") / "run"
    command("compensate", case, "-o", folder, exits=0)
    return folder


@pytest.fixture(scope="module")
def undisturbed(case, run, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("undisturbed") / "study"
    options = ("-v", "--run", run, "--samples", SAMPLES, "--workers", 1)
    done = command("study", case, "-o", folder, *options, exits=0)
    assert f"on {SAMPLES} robots with sampled" in done.stdout
    return folder

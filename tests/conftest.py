"""Fixtures and generators shared by the tests."""

import gc
import os
import signal
import sys

# A shell that runs the tests in its background has them ignore Ctrl-C, and so would the runs they start.
signal.signal(signal.SIGINT, signal.default_int_handler)
for _library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_library, "1")
# Where no bytecode is kept, as in containers, each command that a test starts compiles the project anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
# What is collected stays to the end: nothing of it is garbage.
gc.disable()

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import command_line
import numpy as np
import pytest
from _pytest.doctest import DoctestModule
from drawn_robots import REPLAYS, leave_out_drawn_robots
from fixture_store import prune
from forked_workers import ForkedWorker
from fresh_processes import Fresh
from hypothesis import settings
from places import HELPERS, HOSTS, REFERENCE

from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu import worker
from coupling.fmu_export.build import build_fmu
from coupling.run import expected_robots
from coupling.run.fmu_pool import FmuPool
from elastic_robot.description import Robot

settings.register_profile("project", deadline=None, derandomize=True, max_examples=25)
settings.load_profile("project")

leave_out_drawn_robots()

# Scripts that tests run in processes of their own; not to be imported for doctests.
collect_ignore = ["fmu/hosts"]


class FilesWithExamples:
    """Other files need not be imported to find their doctests, of which they have none."""

    @pytest.hookimpl(wrapper=True)
    def pytest_collect_file(self, file_path: Path):
        collectors = yield
        if file_path.suffix == ".py" and ">>>" not in file_path.read_text(encoding="utf-8"):
            return [one for one in collectors if not isinstance(one, DoctestModule)]
        return collectors


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(
        FilesWithExamples()
    )  # for all folders, not that of the tests alone


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.enable()


def pytest_sessionfinish(session: pytest.Session) -> None:
    if not hasattr(session.config, "workerinput"):  # once, after the workers
        prune()


@pytest.fixture(scope="session", autouse=True)
def _workers() -> Iterator[None]:
    """FMUs run in processes that are forked, which takes a fifth of the time of a start."""
    if sys.platform != "linux":
        yield
        return
    forked = SimpleNamespace(**vars(subprocess) | {"Popen": ForkedWorker})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(worker, "subprocess", forked)
        yield


@pytest.fixture(scope="module")
def started_workers() -> Iterator[None]:
    """FMUs run in processes that are started, as users' do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(worker, "subprocess", subprocess)
        yield


@pytest.fixture(scope="module")
def drawn_robots() -> Iterator[None]:
    """Runs replay their command on drawn robots, as users' runs do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(expected_robots, "drawn_replays", REPLAYS)
        yield


@pytest.fixture(scope="module")
def few_drawn_robots(drawn_robots: None) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(expected_robots, "draw_counts", lambda *_: (8, 2))
        yield


def reference(name: str) -> np.ndarray:
    """Return a reference table without its header."""
    return np.loadtxt(REFERENCE / f"{name}.csv", delimiter=",", skiprows=1)


@pytest.fixture(scope="session")
def example() -> Robot:
    return load_robot(find_robot("icme2008"))


@pytest.fixture(scope="session")
def example_fmu(example: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_fmu(example, tmp_path_factory.mktemp("fmu") / "ElasticRobot.fmu")


@pytest.fixture(scope="module")
def models() -> Iterator[FmuPool]:
    """Robots in C, a hundred times as fast as those in Python."""
    with FmuPool("native") as models:
        yield models


@pytest.fixture
def command():
    """The command line in this process."""
    return command_line.command


@pytest.fixture(scope="session")
def fresh() -> Iterator[Fresh]:
    """Processes that have loaded what FMPy and an FMU need."""
    with Fresh(
        "fmpy.fmi2",
        "pinocchio",
        "scipy.integrate",
        "scipy.interpolate",
        "scipy.spatial.transform",
    ) as process:
        yield process


@pytest.fixture
def forked(tmp_path: Path, fresh: Fresh):
    """Run a script in a process that has not imported the project; return what it says."""

    def run(script: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
        return fresh.run([str(script), *map(str, arguments)], tmp_path)

    return run


@pytest.fixture
def run_host(forked):
    """Run a script of tests/fmu/hosts in a process that has not imported the project; return stderr."""

    def run(script: str, *arguments: object, succeeds: bool = True) -> str:
        done = forked(HOSTS / f"{script}.py", *arguments)
        assert (done.returncode == 0) == succeeds, done.stderr
        assert done.returncode >= 0, f"killed by signal {-done.returncode}"
        return done.stderr

    return run


@pytest.fixture
def judged(forked):
    """Run the judge of run folders, tests/helpers/replay.py, where the project has not been imported."""

    def run(folder: Path, fmu: Path, *options: object) -> dict:
        done = forked(HELPERS / "replay.py", folder, fmu, *options)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


@pytest.fixture
def run_fmu(tmp_path: Path, run_host):
    """Run jobs of tests/fmu/hosts/jobs.py in one fresh process."""

    def run(fmu: Path, *jobs: dict) -> list[dict]:
        order, answered = tmp_path / "jobs.json", tmp_path / "answers.npz"
        order.write_text(json.dumps(jobs, default=_plain))
        said = run_host("jobs", fmu, order, answered)
        answers: list[dict] = [{"stderr": said} for _ in jobs]
        with np.load(answered) as archive:
            for key in archive.files:
                number, name = key.split("|")
                answers[int(number)][name] = archive[key]
        return answers

    return run


@pytest.fixture
def small_disk(tmp_path) -> Iterator[Path]:
    """A disk of three megabytes."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(place)]
    if subprocess.run(mount, capture_output=True).returncode != 0:
        pytest.skip("needs the right to mount a small disk")
    yield place
    subprocess.run(["umount", "--lazy", str(place)], check=True)


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else str(value)

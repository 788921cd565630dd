"""The FMU in the masters of docs/import.md, by examples/masters, each in a process of its own."""

import functools
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from fresh_processes import Fresh
from places import DOCS

from coupling.fmu_export.build import BuildOptions, build_fmu
from docs.scripts.masters import (
    MASTERS,
    VERSIONS,
    Master,
    MasterError,
    Start,
    differences,
    prepare,
    run,
    run_reference,
    script_of,
    start_anew,
)

TOOLBOX = next(master for master in MASTERS if "Toolbox" in master.name)

# Masters that take two seconds to import, and what their scripts import.
SLOW = {
    "CoFMUPy": ("json", "numpy", "pandas", "cofmupy"),
    "PathSim": ("numpy", "pathsim", "pathsim.blocks", "pathsim_fmi"),
}


def require(master: Master) -> None:
    if master.version is None:
        pytest.skip(f"{master.distribution} is not installed: make masters")


@pytest.fixture(scope="module", params=VERSIONS, ids=lambda version: f"FMI {version}")
def version(request) -> str:
    return request.param


@pytest.fixture(scope="module")
def fmu(version, example, tmp_path_factory) -> Path:
    options = BuildOptions(fmi=version)
    return build_fmu(example, tmp_path_factory.mktemp("fmu") / "ElasticRobot.fmu", options)


@pytest.fixture(scope="module")
def start_of(fresh) -> Iterator[Callable[[Master], Start]]:
    """How the process of a master is started; slow ones are forked once they are imported."""
    with ExitStack() as stack:

        @functools.cache
        def start(master: Master) -> Start:
            if master.distribution == "fmpy":
                return fresh.run
            if master.name not in SLOW:
                return start_anew
            slow = Fresh(*SLOW[master.name], environment=master.environment)
            return stack.enter_context(slow).run

        yield start


@pytest.fixture(scope="module")
def folder(fmu, fresh, tmp_path_factory) -> Path:
    """A folder as the page tells the reader to prepare it."""
    folder = tmp_path_factory.mktemp("masters")
    prepare(folder, fmu, fresh.run)
    return folder


@pytest.fixture(scope="module")
def reference(example, fresh, tmp_path_factory) -> dict[bool, np.ndarray]:
    """FMPy's single calls of FMI 2 on the same task: by trajectory (False) and by inputs (True)."""
    folder = tmp_path_factory.mktemp("reference")
    prepare(folder, build_fmu(example, folder / "Built.fmu"), fresh.run)
    return {by_inputs: run_reference(by_inputs, folder, fresh.run) for by_inputs in (False, True)}


@pytest.fixture(scope="module")
def fmpys(folder, start_of) -> np.ndarray:
    """What FMPy's script finds; it leaves a page with the plot of the TCP."""
    return run(MASTERS[0], folder, start_of(MASTERS[0]))


@pytest.mark.parametrize("master", MASTERS, ids=lambda master: master.name)
def test_the_masters_script_gives_fmpys_pose_at_every_step(
    master, version, folder, start_of, fmpys, reference
):
    """Times are exact in binary, so nothing but the order of the calls could make a difference."""
    require(master)
    if version not in master.versions:
        with pytest.raises(MasterError):  # where it takes it now: `versions` in masters.py
            run(master, folder, start_of(master))
        return
    found = fmpys if master is MASTERS[0] else run(master, folder, start_of(master))
    position, rotation = differences(found, reference[master.by_inputs])
    assert position < master.within
    assert rotation < master.within


def test_the_task_tells_wrong_imports_apart(reference):
    """A force or a drive that comes one step late is seen, far above the tolerance."""
    for by_inputs in (False, True):
        poses = reference[by_inputs]
        late = np.column_stack([poses[1:, 0], poses[:-1, 1:]])
        assert differences(late, poses)[0] > 1e-4
    # Held drives follow the trajectory up to their jerk: h^3/6 q''' = 1e-6 rad, at 2 m.
    assert 1e-9 < differences(reference[True], reference[False])[0] < 1e-3


def test_a_master_of_other_times_is_refused(reference):
    shifted = reference[False] + np.eye(8)[0]
    with pytest.raises(MasterError, match="times"):
        differences(shifted, reference[False])


def test_the_page_has_a_script_and_a_row_for_every_master():
    assert all(map(script_of, (master.name for master in MASTERS)))
    page = (DOCS / "import.md").read_text(encoding="utf-8")
    for master in MASTERS:
        name = master.name.replace("-", " ")
        assert f"| {name} |" in page
        if master.version is not None:
            row = f"| {name} | {master.version} | {master.interface} | {master.driven_by} |"
            assert row in page, "make masters-table"
            (line,) = (line for line in page.splitlines() if line.startswith(row))
            cells = [cell.strip() for cell in line.split("|")[5 : 5 + len(VERSIONS)]]
            assert [cell != "no" for cell in cells] == [v in master.versions for v in VERSIONS]


def test_fmpy_draws_the_run(folder, fmpys):
    assert "tcp.x" in (folder / "tcp.html").read_text(encoding="utf-8")


def test_fmpy_validate_has_no_complaint(fmu):
    done = _command("-m", "fmpy", "validate", str(fmu))
    assert done.stdout.strip() == "No problems found."
    assert done.stderr == ""


def test_fmpys_command_line_simulates_with_an_input_file(folder, reference):
    (folder / "force.csv").write_text("time,force.z\n0,0\n1,-1000\n")
    done = _command(
        *["-m", "fmpy", "simulate", "ElasticRobot.fmu", "--stop-time", "0.5"],
        *["--output-interval", "0.0078125", "--start-values", "trajectory", "motion.csv"],
        *["--input-file", "force.csv", "--output-file", "result.csv"],
        folder=folder,
    )
    result = np.genfromtxt(folder / "result.csv", delimiter=",", names=True, deletechars="")
    assert len(result) == 65, done.stderr
    for column, name in enumerate(("tcp.x", "tcp.y", "tcp.z"), start=1):
        np.testing.assert_allclose(result[name], reference[False][:65, column], rtol=0, atol=1e-12)


def test_the_toolboxs_checker_has_no_complaint(fmu, version):
    """It says that it reads, that it checks, and that nothing is wrong: information only."""
    require(TOOLBOX)
    code = "from fmu_manipulation_toolbox.cli.fmutool import fmutool; fmutool()"
    done = _command("-c", code, "-input", str(fmu), "-check")
    said = (done.stdout + done.stderr).splitlines()
    assert any(f"compliant with FMI-{version}.0" in line for line in said)
    assert any("No semantic error" in line for line in said)
    assert [line for line in said if not line.startswith("INFO")] == []


def _command(*arguments: str, folder: Path | None = None) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, *arguments], cwd=folder, text=True, capture_output=True, timeout=300
    )

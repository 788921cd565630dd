"""Processes that do not answer end with their time limit and their run, with what they started."""

import shutil
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import psutil
import pytest
from fmpy import platform_tuple, sharedLibraryExtension
from killing import begin, wait_until
from own_program import external, task
from places import TESTS
from pythonfmu.builder import FmuBuilder

from coupling.errors import ProcessError
from coupling.fmu.worker import WorkerProcess, unpack
from coupling.process import ProcessFmuTable

SOURCES = TESTS / "process" / "process_fmus"
# Within which what was ended must be gone [s].
SOON = 20.0

pytestmark = pytest.mark.usefixtures("started_workers")


def hanging_table(file: Path, **keys: object) -> ProcessFmuTable:
    """Return the table of the wall, which hangs half way after it has started a process."""
    names = {"inputs": {"z": "height"}, "outputs": {"fz": "force"}}
    parameters = {"hangs_at": 0.5}
    return ProcessFmuTable.model_validate(
        {"model": "fmu", "file": str(file), "parameters": parameters, **names, **keys}
    )


def runs(number: int) -> bool:
    try:
        return psutil.Process(number).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def numbers_in(file: Path) -> list[int]:
    """Return the numbers of the processes in a file that they have written whole."""
    wait_until(lambda: file.exists() and file.read_text().endswith("\n"))
    return [int(number) for number in file.read_text().split()]


def require_end(numbers: list[int]) -> None:
    wait_until(lambda: not any(map(runs, numbers)), SOON)


@pytest.fixture(scope="module")
def wall(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wall")
    return FmuBuilder.build_FMU(SOURCES / "wall_slave.py", dest=folder / "WallSlave.fmu")


def test_an_fmu_that_hangs_is_ended_with_what_it_started(wall, tmp_path, monkeypatch):
    monkeypatch.setenv("HANGING", str(tmp_path / "numbers"))
    begun = time.monotonic()
    with pytest.raises(
        ProcessError, match=r"WallSlave\.fmu: .*within the time limit of 4 s .* raise time_limit_s"
    ):
        hanging_table(wall, time_limit_s=4.0).process(task()).evaluate(task().desired)
    assert time.monotonic() - begun < SOON
    require_end(numbers_in(tmp_path / "numbers"))


def evaluate_hanging(file: Path, numbers: Path) -> None:
    """Evaluate the wall that hangs, in a process that a test kills."""
    import os

    # What was started by nohup ignores the end of its terminal, and so would this.
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    os.environ["HANGING"] = str(numbers)
    hanging_table(file).process(task()).evaluate(task().desired)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGHUP, signal.SIGTERM])
def test_an_fmu_that_hangs_ends_with_its_run_however_that_ends(number, wall, tmp_path):
    run = begin(evaluate_hanging, wall, tmp_path / "numbers")
    numbers = numbers_in(tmp_path / "numbers")
    assert all(map(runs, numbers))
    psutil.Process(run.pid).send_signal(number)
    run.join(SOON)
    assert not run.is_alive()
    require_end(numbers)


HANGS_WHILE_LOADING = """
#include <unistd.h>
__attribute__((constructor)) static void hang(void) { fork(); for (;;) sleep(1); }
"""


def test_an_fmu_that_hangs_while_it_is_loaded_is_ended(tmp_path):
    """Native code, forked: the copy keeps the worker's streams open."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("needs a C compiler, cc")
    library = tmp_path / f"wall{sharedLibraryExtension}"
    (tmp_path / "wall.c").write_text(HANGS_WHILE_LOADING)
    build = [compiler, "-shared", "-fPIC", tmp_path / "wall.c", "-o", library]
    subprocess.run(list(map(str, build)), check=True)
    file = tmp_path / "Wall.fmu"
    with zipfile.ZipFile(file, "w") as archive:
        archive.write(SOURCES / "wall.xml", "modelDescription.xml")
        archive.write(library, f"binaries/{platform_tuple}/{library.name}")
    process = hanging_table(file, parameters={}, time_limit_s=3.0).process(task())
    with pytest.raises(ProcessError, match="within the time limit of 3 s"):
        process.evaluate(task().desired)
    require_end([own.pid for own in psutil.process_iter() if str(library.name) in maps_of(own)])


def maps_of(process: psutil.Process) -> str:
    """Return the libraries that a process has loaded."""
    try:
        return " ".join(own.path for own in process.memory_maps() if "Wall" in own.path)
    except (psutil.Error, AttributeError):
        return ""


def work_on_the_wall(file: Path, folder: Path) -> None:
    """Load the wall, tell its worker's number and sleep, in a process that a test kills."""
    folder.mkdir()
    unpack(file, folder)
    worker = WorkerProcess(folder)
    (folder / "numbers").write_text(f"{worker._process.pid}\n")
    time.sleep(600.0)


def test_a_worker_without_a_job_ends_with_its_run(wall, tmp_path):
    run = begin(work_on_the_wall, wall, tmp_path / "fmu")
    numbers = numbers_in(tmp_path / "fmu" / "numbers")
    run.kill()
    run.join()
    require_end(numbers)


DETACHES = """
import os, subprocess, sys, time
code = "import os, time; print(os.getpid(), file=open('numbers', 'w')); time.sleep(600.0)"
if os.fork() == 0:  # whose parent ends, so that nobody above knows of it
    subprocess.Popen([sys.executable, "-S", "-c", code], start_new_session=True)
    os._exit(0)
os.wait()
print("solving", flush=True)
time.sleep(600.0)
"""


def test_a_time_limit_ends_children_that_have_left_the_session(tmp_path):
    with pytest.raises(ProcessError, match=r"time limit of 2 s; its last lines:\nsolving"):
        external(tmp_path, DETACHES, time_limit_s=2.0).evaluate(task().desired)
    require_end(numbers_in(tmp_path / "evaluations" / "0001" / "numbers"))


def test_what_a_program_leaves_running_at_its_own_end_stays(tmp_path):
    """A licence server that it has started is not the run's."""
    starts = (
        "import subprocess, sys\n"
        "code = 'import time; time.sleep(600.0)'\n"
        f"server = subprocess.Popen([{sys.executable!r}, '-S', '-c', code], start_new_session=True)\n"
        "open('numbers', 'w').write(f'{server.pid}\\n')\n"
    )
    with pytest.raises(ProcessError, match=r"wrote no wrench\.csv"):
        external(tmp_path, starts).evaluate(task().desired)
    (number,) = numbers_in(tmp_path / "evaluations" / "0001" / "numbers")
    assert runs(number)
    psutil.Process(number).kill()

"""Runs that are killed go on from what was stored; damaged folders are refused with their file."""

import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from shutil import copytree

import pytest
from command_line import command
from killing import (
    Started,
    counts,
    files_of,
    log_of,
    logged_case,
    start,
    wait_until,
)
from places import LINE_CASE

from coupling.errors import ResultError
from coupling.process.program import end_programs
from coupling.results.run_result import GapResult
from coupling.results.run_state import RunState
from coupling.run.run_log import read_log
from coupling.run.stored_run import read_run

# Time that the process works on a path [s]; a run evaluates it four times.
WORK = 0.1


@dataclass(frozen=True)
class Task:
    """A case, and what a run of it leaves that nobody disturbs.

    Attributes:
        case: Its file.
        files: Result files of the run.
        log: What its process has logged.
        length: Time that the run takes [s].
    """

    case: Path
    files: dict[str, bytes]
    log: list[tuple[str, str]]
    length: float

    def forget(self) -> None:
        """Begin a new log."""
        (self.case.parent / "log.txt").unlink(missing_ok=True)

    @property
    def told(self) -> list[tuple[str, str]]:
        """The log."""
        return log_of(self.case.parent)

    def run(self, folder: Path, *more: object) -> Started:
        return start(folder / "output.txt", "couple", self.case, "-o", folder / "run", *more)


@pytest.fixture(scope="module")
def task(tmp_path_factory) -> Task:
    folder = tmp_path_factory.mktemp("undisturbed")
    case = logged_case(folder / "case", WORK)
    for number in ("first", "second"):  # the first one imports all
        place = folder / number
        place.mkdir()
        found = Task(case, {}, [], 0.0)
        found.forget()
        begin = time.monotonic()
        assert found.run(place).status() == 0, (place / "output.txt").read_text()
        length = time.monotonic() - begin
    return Task(case, files_of(place / "run"), found.told, length)


def state(folder: Path) -> RunState:
    """Return what a run tells of itself."""
    return RunState.read(folder / "run.json", ResultError)


def finishes(task: Task, folder: Path) -> None:
    """Run to the end where that is not reached yet, and compare with what nobody has disturbed."""
    log = read_log(folder / "run")
    if log is None or log.state != "finished":
        assert task.run(folder).status() == 0, (folder / "output.txt").read_text()
    found = files_of(folder / "run")
    assert set(found) == set(task.files)
    assert [name for name in found if found[name] != task.files[name]] == []
    assert state(folder / "run").state == "finished"


def test_an_undisturbed_run_computes_every_path_once(task):
    once = dict.fromkeys(counts(task.log, "begin"), 1)
    assert len(once) >= 4
    assert counts(task.log, "begin") == counts(task.log, "end") == once
    keys = json.loads(task.files["result.json"])["evaluation_keys"]
    assert len(keys) == len(set(keys)) == len(once)


def stored(folder: Path) -> int:
    """Return the number of answers in the store beside a run."""
    return len(list(folder.glob("store/*.npz")))


@pytest.mark.parametrize("dies", ["run", "run and program"])
def test_of_a_run_killed_at_any_moment_only_the_evaluation_that_went_on_begins_again(
    task, tmp_path, dies
):
    """4 kills each: of the run alone, whose program the next one ends, and as where a machine fails."""
    kills, chance = 0, random.Random(14)
    while kills < 4:
        folder = tmp_path / f"run{len(list(tmp_path.iterdir()))}"
        folder.mkdir()
        task.forget()
        run, killed = task.run(folder), 0
        while kills < 4 and not run.ends_within(chance.uniform(0.3, 1.0) * task.length):
            run.kill()
            kills, killed = kills + 1, killed + 1
            if dies != "run":
                end_programs(folder / "run.unfinished" / "evaluations")
            before, kept = counts(task.told, "begin"), stored(folder)
            run = task.run(folder)
            wait_until(
                lambda: counts(task.told, "begin") != before or run.process.exitcode is not None  # noqa: B023
            )
            assert stored(folder) == kept
        run.status()
        finishes(task, folder)
        again = counts(task.told, "begin") - counts(task.log, "begin")
        assert sum(again.values()) <= killed
        assert set(counts(task.told, "end")) == set(counts(task.log, "end"))


def computing(task: Task, evaluations: int) -> Callable[[], bool]:
    """Return what tells whether a run has begun so many evaluations."""
    return lambda: len(counts(task.told, "begin")) >= evaluations


def test_a_run_tells_how_far_it_is_and_a_second_one_on_its_folder_is_refused(task, tmp_path):
    task.forget()
    run = task.run(tmp_path)
    wait_until(computing(task, 2))
    log = state(tmp_path / "run.unfinished")
    assert (log.state, log.pid, log.host) == ("running", run.process.pid, os.uname()[1])
    assert [answer.origin for answer in log.answers] == ["computed"]
    assert log.evaluations[0].path_change > 0.0
    second = start(tmp_path / "second.txt", "couple", task.case, "-o", tmp_path / "run")
    assert second.status() == 2
    said = (tmp_path / "second.txt").read_text()
    assert f"process {run.process.pid} on {os.uname()[1]} writes it since" in said
    assert "Traceback" not in said
    assert run.status() == 0
    assert files_of(tmp_path / "run") == task.files


def test_two_runs_with_one_store_compute_every_path_once(task, tmp_path):
    task.forget()
    runs = [
        start(
            tmp_path / f"{name}.txt",
            *("couple", task.case, "-o", tmp_path / name, "--store", tmp_path / "kept"),
        )
        for name in ("one", "two")
    ]
    assert [run.status() for run in runs] == [0, 0]
    assert counts(task.told, "begin") == counts(task.log, "begin")
    assert files_of(tmp_path / "one") == files_of(tmp_path / "two") == task.files
    origins = [
        answer.origin for name in ("one", "two") for answer in state(tmp_path / name).answers
    ]
    assert sorted(origins) == ["computed"] * 4 + ["store"] * 4


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupt_says_what_is_kept_and_how_to_go_on(task, tmp_path, number):
    if signal.getsignal(number) is signal.SIG_IGN:
        pytest.skip("started to survive this signal, as by nohup: a run does, too")
    task.forget()
    run = task.run(tmp_path)
    wait_until(computing(task, 3))
    run.send(number)
    assert run.status() == 130
    said = (tmp_path / "output.txt").read_text()
    assert "stopped; " in said
    kept = f"evaluations so far, kept in {tmp_path / 'store'}: 2; the same command continues"
    assert kept in said.replace("\n", " ")
    assert "Traceback" not in said
    assert "Aborted" not in said
    assert state(tmp_path / "run.unfinished").state == "interrupted"
    finishes(task, tmp_path)
    again = counts(task.told, "begin") - counts(task.log, "begin")
    assert sum(again.values()) == 1  # the one that was interrupted


def test_other_tolerances_use_what_fits(task, tmp_path):
    """A finer tolerance goes on from the last evaluation of a coarser one."""
    assert task.run(tmp_path).status() == 0
    text = task.case.read_text()
    task.forget()
    finer = task.case.with_name("finer.toml")
    finer.write_text(text.replace("tolerance_m = 1e-8", "tolerance_m = 1e-13"))
    run = start(tmp_path / "finer.txt", "couple", finer, "-o", tmp_path / "finer")
    assert run.status() in (0, 1)
    answers = [answer.origin for answer in state(tmp_path / "finer").answers]
    assert answers[:5] == ["store"] * 4 + ["computed"]


def test_a_result_is_whole_at_every_moment_while_it_is_replaced(task, tmp_path):
    """The old one stays until the new one is there, and a killed run puts it back."""
    assert task.run(tmp_path).status() == 0
    result = files_of(tmp_path / "run")
    task.forget()
    run = task.run(tmp_path, "--overwrite", "--no-store")
    wait_until(lambda: len(counts(task.told, "begin")) >= 2)
    assert files_of(tmp_path / "run") == result
    assert state(tmp_path / "run.unfinished").state == "running"
    run.kill()
    assert task.run(tmp_path).status() == 2  # the old one is protected as ever
    assert files_of(tmp_path / "run") == result
    (tmp_path / "run").rename(tmp_path / ".run.replaced")  # as if killed between two renames
    assert task.run(tmp_path).status() == 2
    assert files_of(tmp_path / "run") == result
    assert task.run(tmp_path, "--overwrite").status() == 0
    assert files_of(tmp_path / "run") == result
    assert sorted(p.name for p in tmp_path.iterdir()) == ["output.txt", "run", "store"]


def test_files_of_the_user_are_left_alone(task, tmp_path):
    """In a folder that is taken over, and beside one that is replaced."""
    run = task.run(tmp_path)
    wait_until(lambda: (log := read_log(tmp_path / "run.unfinished")) and log.answers)
    run.kill()
    (tmp_path / "run.unfinished" / "notes.txt").write_text("mine")
    assert task.run(tmp_path).status() == 0
    assert (tmp_path / "run" / "notes.txt").read_text() == "mine"
    (tmp_path / "run.unfinished").mkdir()
    (tmp_path / "run.unfinished" / "thesis.csv").write_text("mine")
    assert task.run(tmp_path, "--overwrite").status() == 2
    assert "run.unfinished: holds files that are not a result" in (
        (tmp_path / "output.txt").read_text().replace("\n", " ")
    )
    assert (tmp_path / "run.unfinished" / "thesis.csv").read_text() == "mine"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_while_the_command_is_loaded_says_so_too(number):
    """Ctrl-C, or a batch system's end, comes while NumPy is imported."""
    program = f"""
import builtins, runpy, signal, sys
sys.argv = ["elastic-robot", "robots"]
known = builtins.__import__
def imported(name, *rest, **named):
    if name == "numpy":
        signal.raise_signal({int(number)})
    return known(name, *rest, **named)
builtins.__import__ = imported
runpy.run_module("coupling.cli", run_name="__main__")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 130
    assert done.stderr.startswith("stopped; nothing was written\n")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stored") / "out"
    command("compensate", "-v", LINE_CASE, "-o", folder, "--no-store", exits=0)
    return folder


@pytest.mark.parametrize(
    "name", ["desired", "uncompensated", "achieved", "correction", "wrench", "command"]
)
def test_a_table_that_is_cut_between_two_rows_is_refused_with_its_file(finished, tmp_path, name):
    """As by a disk that was full: what is left is a table of numbers."""
    folder = tmp_path / "cut"
    copytree(finished, folder)
    read_run(folder)
    file = folder / f"{name}.csv"
    rows = file.read_text().splitlines(keepends=True)
    file.write_text("".join(rows[: len(rows) // 2]))
    named = r"\w+" if name == "desired" else name
    with pytest.raises(ResultError, match=rf"{re.escape(str(folder))}/{named}\.csv: .* cut short"):
        read_run(folder)


def test_a_table_that_lacks_rows_within_is_refused_with_their_number(finished, tmp_path):
    folder = tmp_path / "gap"
    copytree(finished, folder)
    file = folder / "achieved.csv"
    rows = file.read_text().splitlines(keepends=True)
    file.write_text("".join(rows[:5] + rows[7:]))
    said = rf"achieved\.csv: expected {len(rows) - 1} rows as in desired\.csv, got {len(rows) - 3}"
    with pytest.raises(ResultError, match=said):
        read_run(folder)


def test_what_a_user_has_put_into_a_run_folder_is_no_part_of_the_run(finished, tmp_path):
    """A folder and a table of names like those of a cell's robots and of the other mode's path."""
    cell = tmp_path / "cell"
    copytree(finished, cell)
    for name in ("forming", "support", "copy of forming"):
        copytree(finished, cell / name)
        (cell / name / "achieved_mine.csv").write_text("not a path")
    figures = json.loads((cell / "result.json").read_text())
    gap = dict.fromkeys(GapResult.model_fields, 1e-3)
    (cell / "result.json").write_text(json.dumps({**figures, "pinch_gap_m": gap}))
    (cell / "gap.csv").write_text("time,before,after\n0,0.001,0.001\n1,0.001,0.001\n")
    assert list(read_run(cell).robots) == ["forming", "support"]

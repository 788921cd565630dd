"""The table of samples and the folder of a study: kills, full disks, bad sectors, robots that end."""

import os
import resource
import signal
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from coupling.errors import HostError, StudyError
from coupling.files.written_files import LIST, begin_folder, claim_file
from coupling.path.deviation import Deviation
from coupling.results.study_result import StudySample
from coupling.study import robot_pool
from coupling.study.conduct import simulate_samples
from coupling.study.folder import SampleTable, lock_folder
from coupling.study.robot_pool import RETRIES, Workers, simulate_here


def sample(number: int) -> StudySample:
    figures = [0.1 + number / 3.0, 1e-7, 1.0 / 3.0, 2e-300, 0.25, 0.1, 1e-9, 1.0 / 7.0]
    return StudySample(
        number=number, deviation=Deviation(*figures), distance=(1.0 / 3.0, 5e-324, 7.0e-5)
    )


@pytest.fixture
def table(tmp_path) -> Path:
    file = tmp_path / "rows.jsonl"
    with SampleTable(file) as rows:
        for number in (2, 0, 1):
            rows.add(sample(number))
    return file


def test_numbers_survive_exactly(table):
    with SampleTable(table) as rows:
        assert rows.samples == {number: sample(number) for number in range(3)}


def test_a_table_torn_at_any_byte_keeps_all_whole_lines_and_goes_on(table):
    """The end of the file at every byte of the last line, then that sample once more."""
    whole = table.read_bytes()
    start = whole.rindex(b"\n", 0, -1) + 1
    for end in range(start, len(whole)):
        table.write_bytes(whole[:end])
        with SampleTable(table) as rows:
            assert set(rows.samples) == {2, 0}
            rows.add(sample(1))
        assert table.read_bytes() == whole


def test_a_flipped_bit_costs_one_sample(table):
    whole = table.read_bytes()
    for place in range(0, len(whole), 7):
        bad = bytearray(whole)
        bad[place] ^= 1
        table.write_bytes(bad)
        with SampleTable(table) as rows:
            missing = {0, 1, 2} - set(rows.samples)
            assert 1 <= len(missing) <= 2  # two where a line end is lost
            assert all(rows.samples[k] == sample(k) for k in rows.samples)
            for number in missing:
                rows.add(sample(number))
        with SampleTable(table) as rows:
            assert rows.samples == {number: sample(number) for number in range(3)}


def test_a_table_of_something_else_holds_no_samples(table):
    table.write_bytes(os.urandom(3000) + b"\n12345678 {}\n00000000 []\n\n")
    with SampleTable(table) as rows:
        assert rows.samples == {}
        rows.add(sample(5))
    with SampleTable(table) as rows:
        assert rows.samples == {5: sample(5)}


def test_a_failed_sample_is_worth_another_try(table):
    with SampleTable(table) as rows:
        rows.add(StudySample(number=3, deviation=None, distance=(), failure="the robot fell"))
        assert not rows.has(3)
        rows.add(sample(3))
        assert rows.has(3)
    with SampleTable(table) as rows:
        assert rows.samples[3] == sample(3)


def test_an_interrupt_after_a_line_is_written_counts_it(tmp_path, monkeypatch):
    """It is on the disk, though the program has not noted that, and not simulated again."""
    asked = []

    def simulate(_work, points, *_) -> Iterator[StudySample]:
        asked.append(list(points))
        return map(sample, points)

    monkeypatch.setattr("coupling.study.cluster.simulate", simulate)
    study = SimpleNamespace(folder=tmp_path, points=np.zeros((9, 1)), work=None)
    sync, written = os.fsync, []

    def interrupted(file: int) -> None:
        sync(file)
        written.append(file)
        if len(written) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr("os.fsync", interrupted)
    with pytest.raises(KeyboardInterrupt) as stop:
        simulate_samples(study, Workers(2), lambda _: None)
    assert stop.value.__notes__ == ["2 of 9 samples are kept: the same command continues"]
    assert simulate_samples(study, Workers(2), lambda _: None) == [sample(k) for k in range(9)]
    assert asked == [[*range(9)], [*range(2, 9)]]


def test_a_full_disk_is_a_sentence_and_loses_nothing(table):
    """A limit on the file's size, in the middle of a line, stands for it."""
    size = table.stat().st_size
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        with SampleTable(table) as rows:
            resource.setrlimit(resource.RLIMIT_FSIZE, (size + 40, before[1]))
            with pytest.raises(StudyError, match=r"cannot be written.*3 samples that are kept"):
                rows.add(sample(3))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert table.stat().st_size == size + 40
    with SampleTable(table) as rows:
        assert set(rows.samples) == {0, 1, 2}
        rows.add(sample(3))
    with SampleTable(table) as rows:
        assert set(rows.samples) == {0, 1, 2, 3}


def test_what_a_killed_command_has_left_beside_its_run_is_the_study_s(tmp_path):
    """And goes with it; what anybody else has put there stays."""
    place, theirs = tmp_path / "study", {"run.sh", "run.log", "run.old", "rows.jsonl.kept"}
    with lock_folder(place, overwrite=False):
        for name in ("run", "run.unfinished", ".run.replaced"):
            begin_folder(place / name, "run")
            claim_file(place / name / "run.json").write_text("{}")
        for name in (".run.lock", "study.toml", f"study.json.{'0f' * 16}.partial"):
            (place / name).write_text("")
        for name in theirs - {"run.old"}:
            (place / name).write_text("mine")
        (place / "run.old").mkdir()
        (place / "run" / "notes.txt").write_text("mine")
    with lock_folder(place, overwrite=True):
        assert {file.name for file in place.iterdir()} == theirs | {"run", LIST}
        assert {file.name for file in (place / "run").iterdir()} == {"notes.txt", LIST}


@pytest.mark.parametrize("ends", [RETRIES, RETRIES + 1])
def test_a_robot_that_ends_its_process_is_tried_three_times_more(monkeypatch, ends):
    """Each sample anew: what is said where it ends once more is a sentence."""
    tried = []

    class Ending:
        def sample(self, number, values):
            tried.append(number)
            if tried.count(number) <= ends:
                raise HostError("the process that runs the FMU has ended")
            return number, values

    monkeypatch.setattr(robot_pool, "RobotPool", lambda work: nullcontext(Ending()))
    points = {0: [1.0], 7: [2.0]}
    if ends > RETRIES:
        with pytest.raises(StudyError, match=r"ended its process in 4 tries of one sample"):
            list(simulate_here(None, points))
        assert tried == [0] * 4
    else:
        assert list(simulate_here(None, points)) == [(0, [1.0]), (7, [2.0])]
        assert tried == [0] * 4 + [7] * 4

"""elastic-robot store: lists, verifies and clears; what is not an entry is never touched."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest
from killing import begin, die_while_keeping

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process import ProcessResponse
from coupling.store import EvaluatedProcess, Store

DAY = 86400.0


class Springs:
    identity = "springs"

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        return ProcessResponse(WrenchHistory.of_forces(path.time, [2e5 * path.position[0]]))


SOME_PATH = ToolPath(np.array([0.0, 1.0]), np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (2, 1)))


@pytest.fixture
def kept(tmp_path) -> Store:
    """Return a store with four entries of equal size, used 30, 20, 10 and 0 days ago."""
    store = Store(tmp_path / "kept")
    process = EvaluatedProcess(Springs(), store, name="springs of mine")
    for k in range(4):
        pose = np.tile([float(k), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (50, 1))
        process.evaluate(ToolPath(np.linspace(0.0, 1.0, 50), pose))
        (file,) = {entry.file for entry in store.entries() if entry.used > time.time() - DAY}
        then = time.time() - 10.0 * DAY * (3 - k)
        os.utime(file, (then, then))
    assert len(store.entries()) == 4
    return store


def test_it_lists_what_is_kept(kept, command):
    done = command("store", kept.folder)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    keys = [entry.key[:12] for entry in kept.entries()]
    assert len(lines) == 6
    for key, line in zip(keys, lines[1:5], strict=True):
        assert key in line
        assert line.endswith("springs of mine")
        assert " 50 " in line
    assert lines[-1].startswith(f"{kept.folder}: 4 evaluations, ")


def test_it_names_the_entries_that_are_damaged(kept, command):
    assert command("store", kept.folder, "--verify").returncode == 0
    files = [entry.file for entry in kept.entries()]
    content = bytearray(files[1].read_bytes())
    content[len(content) // 2] ^= 1
    files[1].write_bytes(content)
    files[2].write_bytes(b"")
    done = command("store", kept.folder, "--verify")
    assert done.returncode == 1
    said = done.stdout.replace("\n", " ")
    assert f"{files[1]}: the checksum of wrench.npy is wrong" in said
    assert f"{files[2]}: is no entry of a store" in said
    assert str(files[0]) not in said
    assert "2 damaged" in said
    assert "damaged" in command("store", kept.folder).stdout


CLEARED = {
    ("--older-than", "25d"): 1,
    ("--older-than", "360h"): 2,
    ("--older-than", "0.1w"): 3,
    ("--keep", "0"): 4,
    ("--keep", "{two}"): 2,
    ("--keep", "1TB"): 0,
    ("--keep", "{two}", "--older-than", "1d"): 3,
}


@pytest.mark.parametrize("options", CLEARED)
def test_it_clears_what_was_not_used_for_longest(kept, command, options):
    entries = kept.entries()
    two = sum(entry.size for entry in entries[2:])
    words = [word.format(two=two) for word in options]
    done = command("store", kept.folder, "--clear", *words)
    assert done.returncode == 0, done.stderr
    assert [e.key for e in kept.entries()] == [e.key for e in entries[CLEARED[options] :]]
    assert f"{CLEARED[options]} evaluations" in done.stdout


def test_it_clears_what_killed_processes_have_left_and_nothing_else(kept, command):
    (child := begin(die_while_keeping, kept.folder, "written", "others")).join()
    (kept.folder / f"{'a' * 64}.damaged").write_text("")
    (kept.folder / "notes.txt").write_text("mine")
    (kept.folder / "thesis.npz").write_text("mine")
    assert child.exitcode == -9
    assert len(list(kept.folder.glob("*.partial"))) == 1
    assert command("store", kept.folder, "--clear", "--keep", "0").returncode == 0
    left = sorted(str(f.relative_to(kept.folder)) for f in kept.folder.rglob("*"))
    assert left == ["locks", "notes.txt", "thesis.npz"]


def test_an_answer_that_is_being_computed_is_left_alone(kept, command):
    with kept.claimed("b" * 64, SOME_PATH):
        room = kept.room("b" * 64, 100)
        assert command("store", kept.folder, "--clear", "--keep", "0").returncode == 0
        assert len(list(kept.folder.glob(f"{'b' * 64}*.partial"))) == 1
        room.discard()


REFUSED = {
    ("--clear",): "--clear with --older-than",
    ("--older-than", "30d"): "--clear with --older-than",
    ("--clear", "--older-than", "30"): "as 30d, got '30'",
    ("--clear", "--older-than", "-1d"): "as 30d, got '-1d'",
    ("--clear", "--older-than", "nand"): "got 'nand'",
    ("--clear", "--older-than", "9" * 400 + "d"): "as 30d",
    ("--clear", "--keep", "10 apples"): "as 10GB or 500MB, got '10 apples'",
    ("--clear", "--keep", "-5GB"): "got '-5GB'",
    ("--clear", "--keep", "1e3GB"): "got '1e3GB'",
    ("--verify", "--clear", "--keep", "0"): "one of --verify and --clear",
}


@pytest.mark.parametrize("options", REFUSED)
def test_what_is_not_clear_is_refused_and_clears_nothing(kept, command, options):
    done = command("store", kept.folder, *options)
    assert done.returncode == 2
    said = " ".join(done.stderr.replace("│", " ").split())
    assert REFUSED[options] in said
    assert "Traceback" not in said
    assert len(kept.entries()) == 4


@pytest.mark.parametrize("place", ["nowhere", "file"])
def test_a_store_that_is_none_is_named(tmp_path, command, place):
    (tmp_path / "file").write_text("")
    for option in ((), ("--verify",), ("--clear", "--keep", "0")):
        done = command("store", tmp_path / place, *option)
        assert done.returncode == 2
        assert f"{tmp_path / place}: the store cannot be read" in done.stderr.replace("\n", "")
        assert "Traceback" not in done.stderr


def test_a_store_in_its_run_folder_is_refused(tmp_path, command):
    case = Path(__file__).parents[1] / "cases" / "line.toml"
    for store in (tmp_path / "run", tmp_path / "run" / "kept"):
        done = command("couple", case, "-o", tmp_path / "run", "--store", store)
        assert done.returncode == 2
        assert "the store is in the run folder" in done.stderr
    done = command("couple", case, "-o", tmp_path / "run", "--store", store, "--no-store")
    assert done.returncode == 2
    assert "either --store or --no-store" in done.stderr
    assert list(tmp_path.iterdir()) == []

"""elastic-robot store lists, verifies and clears; every bit of an entry survives or is missed."""

import os
import time
from dataclasses import fields, replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from killing import begin, die_while_keeping

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.workpiece import Workpiece
from coupling.process import ProcessResponse
from coupling.process import base as process_base
from coupling.store import EvaluatedProcess, Store, entry
from coupling.store.entry import (
    DamagedError,
    EntryInfo,
    as_stored,
    decode_response,
    encode_response,
    evaluation_key,
)

DAY = 86400.0
KEY = "a" * 64
ABOUT = EntryInfo(KEY, "a wall", 3, 1, 12.5, "host", 1.8e9)
RNG = np.random.default_rng(3)


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
    done = command("store", kept.folder, exits=0)
    lines = done.stdout.splitlines()
    keys = [entry.key[:12] for entry in kept.entries()]
    assert len(lines) == 6
    for key, line in zip(keys, lines[1:5], strict=True):
        assert key in line
        assert line.endswith("springs of mine")
        assert " 50 " in line
    assert lines[-1].startswith(f"{kept.folder}: 4 evaluations, ")


def test_it_names_the_entries_that_are_damaged(kept, command):
    command("store", kept.folder, "--verify", exits=0)
    files = [entry.file for entry in kept.entries()]
    content = bytearray(files[1].read_bytes())
    content[len(content) // 2] ^= 1
    files[1].write_bytes(content)
    files[2].write_bytes(b"")
    done = command("store", kept.folder, "--verify", exits=1)
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
    done = command("store", kept.folder, "--clear", *words, exits=0)
    assert [e.key for e in kept.entries()] == [e.key for e in entries[CLEARED[options] :]]
    assert f"{CLEARED[options]} evaluations" in done.stdout


def test_it_clears_what_killed_processes_have_left_and_nothing_else(kept, command):
    (child := begin(die_while_keeping, kept.folder, "written", "others")).join()
    (kept.folder / f"{'a' * 64}.damaged").write_text("")
    (kept.folder / "notes.txt").write_text("mine")
    (kept.folder / "thesis.npz").write_text("mine")
    assert child.exitcode == -9
    assert len(list(kept.folder.glob("*.partial"))) == 1
    command("store", kept.folder, "--clear", "--keep", "0", exits=0)
    left = sorted(str(f.relative_to(kept.folder)) for f in kept.folder.rglob("*"))
    assert left == ["locks", "notes.txt", "thesis.npz"]


def test_an_answer_that_is_being_computed_is_left_alone(kept, command):
    with kept.claimed("b" * 64, SOME_PATH):
        room = kept.room("b" * 64, 100)
        command("store", kept.folder, "--clear", "--keep", "0", exits=0)
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
    done = command("store", kept.folder, *options, exits=2)
    said = " ".join(done.stderr.replace("│", " ").split())
    assert REFUSED[options] in said
    assert "Traceback" not in said
    assert len(kept.entries()) == 4


@pytest.mark.parametrize("place", ["nowhere", "file"])
def test_a_store_that_is_none_is_named(tmp_path, command, place):
    (tmp_path / "file").write_text("")
    for option in ((), ("--verify",), ("--clear", "--keep", "0")):
        done = command("store", tmp_path / place, *option, exits=2)
        assert f"{tmp_path / place}: the store cannot be read" in done.stderr.replace("\n", "")
        assert "Traceback" not in done.stderr


def test_a_store_in_its_run_folder_is_refused(tmp_path, command):
    case = Path(__file__).parents[1] / "cases" / "line.toml"
    for store in (tmp_path / "run", tmp_path / "run" / "kept"):
        done = command("couple", case, "-o", tmp_path / "run", "--store", store, exits=2)
        assert "the store is in the run folder" in done.stderr
    done = command("couple", case, "-o", tmp_path / "run", "--store", store, "--no-store", exits=2)
    assert "either --store or --no-store" in done.stderr
    assert list(tmp_path.iterdir()) == []


def path(n: int = 3, tools: int = 1) -> ToolPath:
    pose = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (tools, n, 1))
    return ToolPath(np.linspace(0.0, 1.0, n), pose)


def answer(**changes: object) -> ProcessResponse:
    """An answer with all that one can have."""
    points = RNG.standard_normal((4, 3))
    piece = Workpiece(
        points,
        np.array([[0, 1, 2], [1, 2, 3]], dtype=np.int32),
        {"height [m]": np.array([0.0, -0.0, np.nan, np.inf]), "at point x": np.arange(4.0)},
        {"layer": np.array([1, 2], dtype=np.uint8), "": np.array([True, False])},
    )
    wrench = WrenchHistory(np.linspace(0.0, 1.0, 3), RNG.standard_normal((2, 3, 6)))
    whole = ProcessResponse(wrench, piece, 0.1, RNG.standard_normal((2, 3, 3, 3)))
    return replace(whole, **changes)


def content(kept: ProcessResponse) -> bytes:
    return bytes(encode_response(as_stored(kept), ABOUT))


def parts(found: ProcessResponse) -> dict[str, np.ndarray]:
    named = {"time": found.wrench.time, "wrench": found.wrench.wrench}
    if found.stiffness is not None:
        named["stiffness"] = found.stiffness
    if found.workpiece is not None:
        named |= {"points": found.workpiece.points, "cells": found.workpiece.cells}
        named |= {f"point {name}": v for name, v in found.workpiece.point_fields.items()}
        named |= {f"cell {name}": v for name, v in found.workpiece.cell_fields.items()}
    return named


def require_equal(found: ProcessResponse, expected: ProcessResponse) -> None:
    assert list(parts(found)) == list(parts(expected))
    for name, values in parts(expected).items():
        got = parts(found)[name]
        assert (got.dtype, got.shape) == (values.dtype, values.shape), name
        assert got.tobytes() == values.tobytes(), name
        assert got.flags.c_contiguous
        assert got.flags.writeable
    assert found.period == expected.period


@pytest.mark.parametrize("lacking", [(), ("workpiece",), ("stiffness", "period")])
def test_every_bit_of_an_answer_survives(lacking):
    kept = answer(**dict.fromkeys(lacking))
    require_equal(decode_response(content(kept), KEY), kept)


@given(
    arrays.arrays(
        st.sampled_from(["<f8", ">f8", "<f4"]),
        st.tuples(st.integers(1, 3), st.just(3), st.just(6)),
        elements=st.floats(allow_nan=False, allow_infinity=False, width=32),
    ),
    st.sampled_from("CF"),
)
def test_any_numbers_in_any_order_survive(wrench, order):
    kept = answer(wrench=WrenchHistory(np.arange(3.0), np.asarray(wrench, order=order)))
    require_equal(decode_response(content(kept), KEY), as_stored(kept))


def test_a_computed_answer_has_the_layout_of_a_kept_one():
    """Sums of the same numbers in another order would differ in their last digits."""
    kept = answer(stiffness=np.asfortranarray(RNG.standard_normal((2, 3, 3, 3))))
    assert not kept.stiffness.flags.c_contiguous
    assert all(values.flags.c_contiguous for values in parts(as_stored(kept)).values())


def test_a_flipped_bit_is_noticed_or_changes_nothing():
    """Such as one of the time that an archive has for each of its members."""
    kept, noticed = answer(), 0
    whole = content(kept)
    places = range(0, len(whole), 2)
    for place in places:
        changed = bytearray(whole)
        changed[place] ^= 1 << (place // 2 % 8)
        try:
            require_equal(decode_response(bytes(changed), KEY), kept)
        except DamagedError:
            noticed += 1
    assert noticed > 0.8 * len(places)


def test_every_truncation_is_noticed():
    whole = content(answer())
    for length in range(len(whole)):
        with pytest.raises(DamagedError):
            decode_response(whole[:length], KEY)


@pytest.mark.parametrize("junk", [b"", b"\n", b"\0" * 4096, b"PK\3\4"])
def test_what_is_no_entry_is_said_to_be_none(junk):
    with pytest.raises(DamagedError, match="is no entry"):
        decode_response(junk, KEY)


def test_an_entry_under_another_name_is_not_taken():
    with pytest.raises(DamagedError, match="another evaluation"):
        decode_response(content(answer()), "b" * 64)


def test_an_array_of_objects_is_refused():
    """What would have to be pickled is never written."""
    objects = np.array([{}, {}, {}, {}], dtype=object)
    piece = replace(answer().workpiece, point_fields={"x": objects})
    with pytest.raises(TypeError, match="point_fields 0: expected an array of numbers"):
        encode_response(answer(workpiece=piece), ABOUT)


FORGERIES = {
    "objects": {"wrench": np.array([{}] * 3, dtype=object)},
    "no JSON": {"header": np.array("elastic-robot")},
    "nothing about itself": {"header": np.array("{}")},
    "others' arrays": {"header": np.array(7.0)},
    "too many": {"wrench": np.zeros((2, 4, 6))},
    "no wrench": {"wrench": None},
}


@pytest.mark.parametrize("name", FORGERIES)
def test_a_forged_entry_is_damaged_whatever_its_checksum(name, tmp_path):
    with np.load(BytesIO(content(answer()))) as whole:
        arrays = {**whole, **FORGERIES[name]}
    np.savez(tmp_path / f"{KEY}.npz", **{k: v for k, v in arrays.items() if v is not None})
    assert Store(tmp_path).read(KEY, path()) is None
    (listed,) = Store(tmp_path).entries()
    assert "is no entry of a store" in listed.problem()


def test_all_that_an_answer_has_is_kept():
    """A new field of an answer or a workpiece needs its place in an entry."""
    assert [f.name for f in fields(ProcessResponse)] == [
        "wrench",
        "workpiece",
        "period",
        "stiffness",
        "noise",  # found whenever an answer is read
    ]
    known = ["points", "cells", "point_fields", "cell_fields"]
    assert [f.name for f in fields(Workpiece)] == known
    # The springs beside a wrench are the coupling's, never a process's.
    assert [f.name for f in fields(WrenchHistory)] == ["time", "wrench", "spring"]


def test_the_key_tells_process_path_and_physics_apart(monkeypatch):
    nearly = path()
    nearly.pose[0, 2, 1] = 5e-324  # the smallest number above zero
    later = ToolPath(path().time + 2.0**-40, path().pose)
    keys = {
        evaluation_key("wall", path()),
        evaluation_key("wall 2", path()),
        evaluation_key("wall", nearly),
        evaluation_key("wall", later),
        evaluation_key("wall", path(4)),
        evaluation_key("wall", path(3, tools=2)),
    }
    monkeypatch.setattr(entry, "PHYSICS", process_base.PHYSICS + 1)
    keys.add(evaluation_key("wall", path()))
    assert len(keys) == 7
    assert all(len(key) == 64 for key in keys)

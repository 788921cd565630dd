"""An answer in the store: every bit of it survives, and no changed bit of its file changes it."""

from __future__ import annotations

from dataclasses import fields, replace
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.workpiece import Workpiece
from coupling.process import ProcessResponse
from coupling.process import base as process_base
from coupling.store import Store, entry
from coupling.store.entry import (
    DamagedError,
    EntryInfo,
    as_stored,
    decode_response,
    encode_response,
    evaluation_key,
)

KEY = "a" * 64
ABOUT = EntryInfo(KEY, "a wall", 3, 1, 12.5, "host", 1.8e9)
RNG = np.random.default_rng(3)


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

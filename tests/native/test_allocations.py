"""No call of a running simulation asks for memory: counted in place of the C library's allocator."""

from __future__ import annotations

import sys

import pytest
from native_fmu import build_master, run_master


@pytest.mark.skipif(sys.platform != "linux", reason="its master counts calls of glibc")
def test_memory_is_asked_for_before_the_first_step_only(native, tmp_path):
    """Steps, refused ones among them, inputs, all outputs, derivatives, states kept and restored."""
    master = build_master("cycles", tmp_path / "cycles")
    lines = run_master(native, [str(master)], "allocations").splitlines()
    assert len(lines) == 6  # three curves, moving and at rest
    for line in lines:
        counts = dict(part.split() for part in line.split(": ")[1].split(", "))
        assert int(counts.pop("start")) > 0
        assert set(counts) == {"set", "step", "get", "derivative", "state"}
        assert set(counts.values()) == {"0"}, line

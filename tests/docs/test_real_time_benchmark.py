"""The benchmark of cycles: a short run of it, and what its table says."""

import sys

import pytest

from benchmarks.real_time import Cycles, lines, measured, with_elements, with_motors


@pytest.mark.skipif(sys.platform != "linux", reason="its master counts calls of glibc")
def test_cycles_are_timed():
    """Half of the cycles take less than the rest, and far less than they simulate."""
    for row in measured(steps=2000):
        assert 0.0 < row.median <= row.slow <= row.largest
        assert row.median < row.period
        assert row.mean <= row.slow


@pytest.mark.skipif(sys.platform != "linux", reason="its master counts calls of glibc")
def test_motors_and_hysteresis_cost_more_than_drives_without():
    plain, whole = measured((4e-3,), 2000), with_elements(with_motors(True))
    assert plain[0].mean < measured((4e-3,), 2000, whole, "servo")[0].mean


def test_the_table_tells_multiples_of_the_median():
    text = lines([Cycles(1e-3, 2e-6, 5e-6, 1e-4, 3e-6)])
    assert "| 1 ms | 2.0 | 2.5 | 50 | 2.0e-03 |" in text

"""Limits of published benchmarks: one mode of 922 Hz, low immersion, lobes of period doubling."""

from dataclasses import replace

import numpy as np
import pytest

from coupling.process.cutting_force import Cutter, CuttingCoefficients
from coupling.stability.floquet import growth_of, vibration_of
from coupling.stability.limit import first_border, stable_islands
from coupling.stability.steady_cut import SteadyCut
from coupling.stability.structure import Structure

# Modal mass, angular eigenfrequency, damping ratio, cutting coefficients of [Insperger2004].
MASS, OMEGA, RATIO = 0.03993, 5793.0, 0.011
ALUMINIUM = CuttingCoefficients(6.0e8, 2.0e8, 0.0, 0.0, 0.0, 0.0)


def along_feed() -> Structure:
    """Return the mode, which moves along the feed alone."""
    eigenvalue = np.array([complex(-RATIO * OMEGA, OMEGA * np.sqrt(1.0 - RATIO**2))])
    driving = np.zeros((1, 6), dtype=complex)
    driving[0, 0] = 1.0 / (2j * MASS * eigenvalue.imag[0])
    return Structure(eigenvalue, driving, np.array([[2.0], [0.0]], dtype=complex))


def down_milling(immersion: float, rpm: float, depth: float) -> SteadyCut:
    cutter = Cutter(radius=8e-3, teeth=2, helix=0.0, speed=rpm * np.pi / 30.0)
    start = np.pi - np.arccos(1.0 - 2.0 * immersion)
    return SteadyCut(cutter, ALUMINIUM, float(start), np.pi, depth)


@pytest.mark.parametrize(
    ("immersion", "rpm", "limit_mm", "border"),
    [
        (0.05, 5000, 2.21, "Hopf"), (0.05, 11000, 3.77, "Hopf"), (0.05, 18000, 1.30, "flip"),
        (0.10, 5000, 1.30, "Hopf"), (0.10, 11000, 1.77, "Hopf"), (0.10, 18000, 0.82, "flip"),
        (0.50, 5000, 0.85, "Hopf"), (0.50, 11000, 1.09, "Hopf"), (0.50, 18000, 1.62, "Hopf"),
        (1.00, 5000, 0.409, "Hopf"), (1.00, 11000, 0.612, "Hopf"), (1.00, 18000, 0.690, "Hopf"),
    ],
)  # fmt: skip
def test_the_mode_of_922_hz_has_the_limits_of_an_independent_computation(
    immersion, rpm, limit_mm, border
):
    structure, limit = along_feed(), 1e-3 * limit_mm
    assert growth_of(structure, down_milling(immersion, rpm, 0.992 * limit)) < 0.0
    beyond = vibration_of(structure, down_milling(immersion, rpm, 1.008 * limit))
    assert beyond.growth > 0.0
    assert beyond.border == border
    if border == "flip":
        assert beyond.frequency % (rpm / 30.0) == pytest.approx(rpm / 60.0, rel=1e-6)


def test_stable_depths_beyond_a_flip_are_found():
    """With a helix of 60 deg flips end where edges follow each other closely enough.

    Growths [1/s] are those of a computation by Runge-Kutta steps and Arnoldi iteration.
    """
    helical = replace(down_milling(0.05, 18000, 1e-3).cutter, helix=float(np.deg2rad(60.0)))
    cut, tip = replace(down_milling(0.05, 18000, 1e-3), cutter=helical), along_feed()
    limit = first_border(tip, cut, 5e-3)
    (island,) = stable_islands(tip, cut, limit, 5e-3)
    assert 1e3 * np.array([limit, *island]) == pytest.approx([1.386, 2.90, 4.59], rel=5e-3)
    growths = [growth_of(tip, cut.at_depth(1e-3 * depth)) for depth in (1.2, 2.0, 3.0, 4.7)]
    assert growths == pytest.approx([-19.282, 28.362, -15.351, 3.821], rel=0.01, abs=0.05)
    assert vibration_of(tip, cut.at_depth(2e-3)).border == "flip"
    assert vibration_of(tip, cut.at_depth(4.7e-3)).border == "Hopf"
    assert stable_islands(tip, cut, np.inf, 5e-3) == []

"""Forces of teeth in steady feed against closed forms, symmetries and the power balance."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from steady_feed import ALUMINIUM, RADIUS, SPEED, steady_wrench

from coupling.process.cutting_force import (
    Cutter,
    CuttingCoefficients,
    Engagement,
    Way,
    mean_wrench,
    tooth_wrench,
)

CUT_ONLY = CuttingCoefficients(7.7e8, 1.7e8, 2.2e8, 0.0, 0.0, 0.0)


def cutter(teeth: int = 2, helix: float = 0.5) -> Cutter:
    return Cutter(RADIUS, teeth, helix, SPEED)


def constant_cut(
    n: int, chip: tuple[float, float], start: float, end: float, depth: float
) -> Engagement:
    return Engagement(np.tile(chip, (n, 1)), np.full(n, start), np.full(n, end), np.full(n, depth))


def revolution(n: int) -> np.ndarray:
    return (np.arange(n) + 0.5) / n * 2.0 * np.pi / SPEED


@given(st.integers(0, 10**6))
def test_teeth_average_to_the_closed_form(seed):
    """Forces and moments over one revolution, any arc, helix, number of teeth and chip."""
    rng = np.random.default_rng(seed)
    mill = cutter(int(rng.integers(1, 6)), rng.uniform(0.05, 1.2))
    start, end = rng.uniform(0.4, 1.3), rng.uniform(1.7, np.pi - 0.4)
    chip = (rng.uniform(5e-5, 2e-4), rng.uniform(-1e-5, 1e-5))  # cuts all along the arc
    depth = rng.uniform(1e-3, 30e-3)
    n = 4000
    cut = constant_cut(n, chip, start, end, depth)
    resolved = steady_wrench(mill, ALUMINIUM, cut, revolution(n)).mean(axis=0)
    mean = mean_wrench(mill, ALUMINIUM, constant_cut(1, chip, start, end, depth))[0]
    np.testing.assert_allclose(resolved[:3], mean[:3], rtol=0, atol=1e-4 * np.abs(mean[:3]).max())
    np.testing.assert_allclose(resolved[3:], mean[3:], rtol=0, atol=1e-4 * np.abs(mean[3:]).max())


def test_mean_force_in_a_slot_is_the_text_books():
    """-N a (K_rc c/4 + K_re/pi), N a (K_tc c/4 + K_te/pi) [Altintas2012, eq. (2.38)]."""
    c, a, N, K = 1e-4, 3e-3, 2, ALUMINIUM
    force = mean_wrench(cutter(N), K, constant_cut(1, (c, 0.0), 0.0, np.pi, a))[0, :3]
    expected = [
        -N * a * (K.K_rc * c / 4 + K.K_re / np.pi),
        N * a * (K.K_tc * c / 4 + K.K_te / np.pi),
        -N * a * (K.K_ac * c / np.pi + K.K_ae / 2),
    ]
    np.testing.assert_allclose(force, expected, rtol=1e-12)


def test_four_straight_teeth_in_a_slot_push_without_ripple():
    """sin^2 and cos^2 of the two teeth in the cut add up to one: -K_rc c a and K_tc c a always."""
    c, a, n = 1e-4, 3e-3, 997
    cut = constant_cut(n, (c, 0.0), 0.0, np.pi, a)
    force = steady_wrench(cutter(4, 0.0), CUT_ONLY, cut, revolution(n))[:, :2]
    expected = [-CUT_ONLY.K_rc * c * a, CUT_ONLY.K_tc * c * a]
    np.testing.assert_allclose(force, np.tile(expected, (n, 1)), rtol=1e-10)


def test_one_straight_tooth_in_a_slot_pushes_alike_before_and_behind_the_middle():
    """Tangential forces alone: across the feed even, along the feed odd about phi = 90 deg."""
    K, n = CuttingCoefficients(7.7e8, 0.0, 0.0, 2.8e4, 0.0, 0.0), 1000
    cut = constant_cut(n, (1e-4, 0.0), 0.0, np.pi, 3e-3)
    force = steady_wrench(cutter(1, 0.0), K, cut, revolution(n))[: n // 2, :2]
    np.testing.assert_allclose(force[::-1, 0], -force[:, 0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(force[::-1, 1], force[:, 1], rtol=0, atol=1e-9)
    assert np.all(steady_wrench(cutter(1, 0.0), K, cut, revolution(n))[n // 2 :] == 0.0)


def test_a_vanishing_helix_is_a_straight_edge():
    """Away from entry and exit the forces differ by the lag over the depth, 4e-8 rad."""
    n = 1000
    cut = constant_cut(n, (1e-4, 0.0), 0.5, 2.0, 3e-3)
    time = revolution(n)
    straight = steady_wrench(cutter(1, 0.0), ALUMINIUM, cut, time)
    nearly = steady_wrench(cutter(1, 1e-7), ALUMINIUM, cut, time)
    phi = SPEED * time
    away = (np.abs(phi - 0.5) > 1e-2) & (np.abs(phi - 2.0) > 1e-2)
    np.testing.assert_allclose(nearly[away], straight[away], rtol=0, atol=1e-4)
    assert np.abs(straight).max() > 100.0


@pytest.mark.parametrize("engagement", ["up", "down", "slot"])
def test_spindle_power_is_that_of_the_chips_and_the_edges(engagement):
    """K_tc times the volume removed per second, and K_te at cutting speed while in the cut."""
    c, a_p, a_e, mill = 1e-4, 3e-3, 5e-3 if engagement != "slot" else 2 * RADIUS, cutter(3)
    arc = np.arccos(1.0 - a_e / RADIUS)
    start, end = {"up": (0.0, arc), "down": (np.pi - arc, np.pi), "slot": (0.0, np.pi)}[engagement]
    n = 4000
    cut = constant_cut(n, (c, 0.0), start, end, a_p)
    power = SPEED * steady_wrench(mill, ALUMINIUM, cut, revolution(n))[:, 5].mean()
    feed = c / mill.tooth_period
    share = (end - start) / (2.0 * np.pi)
    edges = mill.teeth * a_p * ALUMINIUM.K_te * RADIUS * SPEED * share
    assert power == pytest.approx(ALUMINIUM.K_tc * a_e * a_p * feed + edges, rel=1e-5)


def test_moments_are_those_of_forces_on_the_edges():
    """A straight tooth at phi = 90 deg: force along n and -f at radius R, half way up."""
    a, c, K = 4e-3, 1e-4, ALUMINIUM
    cut = constant_cut(1, (c, 0.0), 0.0, np.pi, a)
    wrench = steady_wrench(cutter(1, 0.0), K, cut, np.array([0.5 * np.pi / SPEED]))[0]
    tangential, radial, axial = a * np.array(
        [K.K_tc * c + K.K_te, K.K_rc * c + K.K_re, K.K_ac * c + K.K_ae]
    )
    np.testing.assert_allclose(wrench[:3], [-radial, tangential, -axial], rtol=1e-12)
    point = np.array([RADIUS, 0.0, 0.5 * a])
    np.testing.assert_allclose(wrench[3:], np.cross(point, wrench[:3]), rtol=1e-12, atol=1e-12)


def radial_force(time: np.ndarray, x: np.ndarray, instant: float, **of_mill: float) -> float:
    """Radial force over K_rc a of a straight tooth at phi = 90 deg: its chip [m]."""
    mill = Cutter(RADIUS, 2, 0.0, SPEED, **of_mill)
    one = np.ones(1)
    cut = Engagement(np.zeros((1, 2)), 0.0 * one, np.pi * one, 1e-3 * one)
    way = Way(time, np.column_stack([x, 0.0 * x]))
    K = CuttingCoefficients(0.0, 1e9, 0.0, 0.0, 0.0, 0.0)
    wrench = tooth_wrench(mill, K, cut, way, np.array([[1.0, 0.0]]), np.array([instant]))
    return -wrench[0, 0] / (1e9 * 1e-3)


def test_a_tooth_behind_one_that_missed_cuts_what_both_have_left():
    """The tool lifts off by 3 chips for one passage: nothing there, two chips behind it."""
    period, chip = np.pi / SPEED, 1e-4
    at = (0.5 + np.arange(12)) * period  # a tooth at phi = 90 deg
    x = chip * np.arange(12.0)
    x[6] -= 3.0 * chip
    assert radial_force(at, x, at[5]) == pytest.approx(chip)
    assert radial_force(at, x, at[6]) == 0.0
    assert radial_force(at, x, at[7]) == pytest.approx(2.0 * chip)
    assert radial_force(at, x, at[8]) == pytest.approx(chip)


def test_runout_gives_one_tooth_more_and_the_other_less():
    """Offset e along the first tooth: chips c + 2 e and c - 2 e; beyond c/2 one tooth cuts all."""
    period, chip = np.pi / SPEED, 1e-4
    at = (0.5 + np.arange(12)) * period
    x = chip * np.arange(12.0)
    both = [radial_force(at, x, at[k], runout=2e-5) for k in (8, 9)]
    assert sorted(both) == pytest.approx([chip - 4e-5, chip + 4e-5])
    assert both[0] > both[1]  # the first tooth is at 90 deg after a quarter of a turn
    one = sorted(radial_force(at, x, at[k], runout=8e-5) for k in (8, 9))
    assert one == pytest.approx([0.0, 2.0 * chip])

"""Teeth of varying pitch, and of a cutter that runs out, against forces by hand."""

from itertools import pairwise

import numpy as np
import pytest
from steady_feed import steady_wrench

from coupling.process.cutting_force import Cutter, CuttingCoefficients, Engagement, mean_wrench

STEEL = CuttingCoefficients(1.9e9, 8e8, 3.5e8, 3e4, 4.5e4, 2e3)
R, SPEED, DEPTH, CHIP = 8e-3, 500.0, 2e-3, 1e-4  # [m, rad/s, m, m per mean tooth]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


def slot(count: int) -> Engagement:
    one = np.ones(count)
    return Engagement(np.tile([CHIP, 0.0], (count, 1)), 0.0 * one, np.pi * one, DEPTH * one)


def by_hand(
    delays: list[float], reaches: list[float], tips: list[float], time: np.ndarray
) -> np.ndarray:
    """Force of straight teeth in a slot, axes f, n, z [N], (n, 3).

    A tooth with its tip at phi cuts h = v tau sin(phi) + e, v tau being the way since the tooth before
    and e how much further out it is: F_t = a (K_tc h + K_te) against the cut, and so on.
    """
    feed, force, K = CHIP * len(tips) * SPEED / (2.0 * np.pi), np.zeros((len(time), 3)), STEEL
    for delay, reach, tip in zip(delays, reaches, tips, strict=True):
        phi = (SPEED * time + tip) % (2.0 * np.pi)
        h = feed * delay * np.sin(phi) + reach
        is_cut = (phi < np.pi) * DEPTH
        t, r, a = (
            is_cut * (c * h + e) for c, e in ((K.K_tc, K.K_te), (K.K_rc, K.K_re), (K.K_ac, K.K_ae))
        )
        sin, cos = np.sin(phi), np.cos(phi)
        force += np.column_stack([-t * cos - r * sin, t * sin - r * cos, -a])
    return force


def test_two_unequal_pitches_have_the_forces_by_hand():
    """160 deg from the first tooth to the second, which goes before: chips 8/9 and 10/9 of the mean."""
    pitch = np.deg2rad([160.0, 200.0])
    mill = Cutter(R, 2, 0.0, SPEED, pitch=tuple(pitch.tolist()))
    time = np.linspace(0.013, 0.988, 36) * 2.0 * np.pi / SPEED
    expected = by_hand((pitch / SPEED).tolist(), [0.0, 0.0], [0.0, float(pitch[0])], time)
    np.testing.assert_allclose(
        steady_wrench(mill, STEEL, slot(len(time)), time)[:, :3], expected, rtol=1e-9, atol=1e-6
    )
    # At phi = 90 deg each is alone in the slot, and its chip is the way in its own pitch.
    chips = [
        -steady_wrench(mill, STEEL, slot(1), np.array([angle / SPEED]))[0, 0] / DEPTH
        for angle in (np.pi / 2.0, np.pi / 2.0 + pitch[1])
    ]
    np.testing.assert_allclose(
        (np.array(chips) - STEEL.K_re) / (STEEL.K_rc * CHIP), [8.0 / 9.0, 10.0 / 9.0], rtol=1e-9
    )


@pytest.mark.parametrize("helix", [0.0, 0.6])
def test_pitch_does_not_change_the_mean_over_a_turn(helix):
    """All chips together are the feed of a turn, and the force is linear in them."""
    mill = Cutter(R, 3, helix, SPEED, pitch=tuple(np.deg2rad([100.0, 115.0, 145.0]).tolist()))
    # Edges come and go at these angles of the first tip.
    lag = mill.lag * DEPTH
    corners = [b - tip for tip in mill.tips for b in (0.0, np.pi, lag, np.pi + lag)]
    ends = np.unique(np.append(np.array(corners) % (2.0 * np.pi), [0.0, 2.0 * np.pi]))
    total = np.zeros(3)
    for low, high in pairwise(ends):
        time = (low + 0.5 * (1.0 + NODES) * (high - low)) / SPEED
        force = steady_wrench(mill, STEEL, slot(len(time)), time)[:, :3]
        total += 0.5 * (high - low) / (2.0 * np.pi) * WEIGHTS @ force
    np.testing.assert_allclose(total, mean_wrench(mill, STEEL, slot(1))[0, :3], rtol=1e-3)


def test_run_out_of_three_teeth_has_the_forces_by_hand():
    """Offset e at lambda from the first tooth: tooth j reaches e cos(lambda - theta_j) further."""
    offset, angle, pitch = 8e-6, 0.7, 2.0 * np.pi / 3.0
    mill = Cutter(R, 3, 0.0, SPEED, runout=offset, runout_angle=angle)
    tips = [0.0, pitch, 2.0 * pitch]
    reach = [offset * np.cos(angle - tip) for tip in tips]
    over_the_next = [reach[j] - reach[(j + 1) % 3] for j in range(3)]
    # Where every tooth cuts: c sin(phi) is more than what the one before reaches further.
    time = np.linspace(0.0, 1.0, 400) * 2.0 * np.pi / SPEED
    phi = (SPEED * time[:, None] + tips) % (2.0 * np.pi)
    is_free = (phi > 0.35) & (phi < np.pi - 0.35) | (phi > np.pi + 0.02) & (phi < 6.2)
    time = time[is_free.all(axis=1)]
    assert len(time) > 100
    expected = by_hand([pitch / SPEED] * 3, over_the_next, tips, time)
    np.testing.assert_allclose(
        steady_wrench(mill, STEEL, slot(len(time)), time)[:, :3], expected, rtol=1e-9, atol=1e-6
    )


def test_run_out_goes_round_with_the_helix():
    """A point at height z lags by z tan(helix)/R on the cutter, and so does what it reaches further."""
    offset, angle, helix = 8e-6, 0.7, 0.5
    mill = Cutter(R, 2, helix, SPEED, runout=offset, runout_angle=angle)
    phi_tip = np.pi / 2.0
    height = 0.5 * DEPTH * (1.0 + NODES)
    phi = phi_tip - mill.lag * height
    further = 2.0 * offset * np.cos(angle + mill.lag * height)
    h = CHIP * np.sin(phi) + further
    radial, tangential = STEEL.K_rc * h + STEEL.K_re, STEEL.K_tc * h + STEEL.K_te
    along = -tangential * np.cos(phi) - radial * np.sin(phi)
    # The other tooth is behind, out of the slot from its tip to its end.
    expected = 0.5 * DEPTH * WEIGHTS @ along
    time = np.array([phi_tip / SPEED])
    assert steady_wrench(mill, STEEL, slot(1), time)[0, 0] == pytest.approx(expected, rel=1e-6)

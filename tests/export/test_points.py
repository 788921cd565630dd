"""Points of a program: within the tolerance, and hardly more than the fewest that are."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from coupling.export.curves import JointCurve, PoseCurve, continuous
from coupling.export.exporting import straight_error, straight_points
from coupling.export.spline_points import spline_points, spline_values


def motion(seed: int, samples: int) -> tuple[JointCurve, np.ndarray]:
    """Return a random smooth motion of one joint, a metre from the tool, and its times."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, 1.0, samples)
    waves = [rng.normal() / k * np.sin(np.pi * k * time + rng.uniform(0, 6)) for k in range(1, 7)]
    waves = [wave * np.sin(np.pi * time) ** 2 for wave in waves]  # at rest at both ends
    jacobian = np.zeros((samples, 6, 1))
    jacobian[:, 1] = 1.0
    return JointCurve(np.sum(waves, axis=0)[:, None], jacobian, lever=0.0), time


def fewest_straight(curve, time, candidates, tolerance) -> int:
    """Return the fewest points, by dynamic programming over all pairs."""
    best = [1]
    for end in range(1, len(candidates)):
        ways = [
            best[start] + 1
            for start in range(end)
            if straight_error(curve, time, tolerance, candidates[start], candidates[end]) <= 1.0
        ]
        best.append(min(ways))
    return best[-1]


@pytest.mark.parametrize("seed", range(12))
def test_straight_ways_need_hardly_more_points_than_the_fewest(seed):
    curve, time = motion(seed, 121)
    candidates, tolerance = np.arange(0, 121, 2), np.full(121, 0.01)
    chosen = straight_points(curve, time, candidates, tolerance)
    fewest = fewest_straight(curve, time, candidates, tolerance)
    assert fewest <= len(chosen) <= fewest + 1
    errors = [straight_error(curve, time, tolerance, *pair) for pair in pairwise(chosen)]
    assert max(errors) <= 1.0
    assert (chosen[0], chosen[-1]) == (0, 120)
    assert set(chosen) <= set(candidates)


@pytest.mark.parametrize("seed", range(8))
def test_a_spline_needs_hardly_more_points_than_the_fewest(seed):
    """All subsets of 13 candidates, from the smallest on."""
    curve, time = motion(seed, 25)
    candidates, tolerance = np.arange(0, 25, 2), np.full(25, 0.05)

    def fits(rows) -> bool:
        values = spline_values(time[rows], curve.values[rows], time)
        return bool(curve.errors(values, slice(None)).max() <= 0.05)

    inner = candidates[1:-1]
    fewest = next(
        (
            count + 2
            for count in range(len(inner) + 1)
            if any(fits(np.array([0, *rows, 24])) for rows in combinations(inner, count))
        ),
        len(candidates),
    )
    chosen = spline_points(curve, time, candidates, tolerance)
    assert len(chosen) <= fewest + 2
    assert fits(chosen) or len(chosen) == len(candidates)


def test_what_is_looked_at_near_changed_points_alone_holds_everywhere():
    """A long motion, a tolerance that varies; its spline evaluated whole once the points are there."""
    time = np.linspace(0.0, 60.0, 24001)
    angle = np.sin(0.9 * time) + 0.3 * np.sin(7.3 * time + 1.0) * np.sin(0.2 * time)
    jacobian = np.zeros((len(time), 6, 1))
    jacobian[:, 1] = 1.0
    curve = JointCurve((angle * np.sin(np.pi * time / 60.0) ** 2)[:, None], jacobian, lever=0.0)
    tolerance = 1e-6 * (1.0 + 5.0 * (np.sin(time) > 0.7))
    chosen = spline_points(curve, time, np.arange(0, len(time), 2), tolerance)
    values = spline_values(time[chosen], curve.values[chosen], time)
    shares = curve.errors(values, slice(None)) / tolerance
    assert 0.9 < shares.max() <= 1.0 + 1e-9
    assert len(chosen) < 3000


def test_points_are_closer_where_the_tolerance_is_smaller():
    """A circle: points are 2 sqrt(2 tolerance radius) apart, so a quarter takes twice as many."""
    time = np.linspace(0.0, 1.0, 4001)
    angle = np.pi * time
    values = np.zeros((4001, 7))
    values[:, 0], values[:, 1], values[:, 6] = np.cos(angle), np.sin(angle), 1.0
    tolerance = np.where(time < 0.5, 1e-4, 0.25e-4)
    chosen = straight_points(PoseCurve(values, 0.3), time, np.arange(4001), tolerance)
    before, after = np.sum(chosen < 2000), np.sum(chosen > 2000)
    assert after / before == pytest.approx(2.0, rel=0.05)
    assert before == pytest.approx(0.5 * np.pi / (2.0 * np.sqrt(2.0 * 1e-4)), rel=0.05)


def test_straight_ways_turn_evenly_about_one_axis():
    turns = Rotation.from_euler("xyz", [[0, 0, 0], [20, -50, 110]], degrees=True)
    share = np.linspace(0.0, 1.0, 11)
    rows = np.hstack([np.zeros((2, 3)), -turns.as_quat()])
    ends = (np.repeat(rows[k : k + 1], 11, axis=0) for k in (0, 1))
    found = PoseCurve(rows, 0.3).between(*ends, share)
    apart = Rotation.from_quat(found[:, 3:]) * Slerp([0.0, 1.0], turns)(share).inv()
    assert apart.magnitude().max() < 1e-12


def test_errors_are_distances_and_what_a_rotation_moves_the_wrist():
    still = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (2, 1))
    turned = still.copy()
    turned[0, :3] = [3e-6, 4e-6, 0.0]
    turned[1, 3:] = -Rotation.from_rotvec([0.0, 0.0, 1e-5]).as_quat()
    found = PoseCurve(still, lever=0.7).errors(turned, slice(0, 2))
    np.testing.assert_allclose(found, [5e-6, 7e-6], rtol=1e-6)


def test_quaternions_of_neighbours_are_on_one_side():
    turns = Rotation.from_euler("z", np.linspace(0, 700, 50)[:, None], degrees=True).as_quat()
    turns *= np.where(turns[:, 3:] < 0, -1.0, 1.0)
    found = continuous(turns)
    assert np.sum(found[1:] * found[:-1], axis=1).min() > 0.0
    assert (Rotation.from_quat(found) * Rotation.from_quat(turns).inv()).magnitude().max() < 1e-12

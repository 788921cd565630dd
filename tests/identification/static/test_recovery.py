"""Robots that MuJoCo has deflected are found again, to rounding: the second implementation measures."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the package mujoco, which is in the extra 'test'")
from random_robots import make_robot

from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.fit import IdentifyOptions, fit_static
from coupling.identification.static.measurements import noise_of
from examples.mujoco_robot.measuring import measured


def random_task(seed: int, joints: int, backlash: float, rotations: bool):
    """A random robot and three rows a joint: every row its own load, moment and points off the TCP."""
    rng = np.random.default_rng(seed)
    true, count = make_robot(seed, joints, backlash), max(8, 3 * joints)
    wrench = np.hstack([rng.normal(size=(count, 3)) * 800.0, rng.normal(size=(count, 3)) * 200.0])
    points = rng.uniform(-0.5, 0.5, (2, count, 3))
    q = rng.uniform(-2.5, 2.5, (count, joints))
    return true, measured(true, q, wrench, points, rotations), rng


@pytest.mark.parametrize("joints", range(1, 8))
@pytest.mark.parametrize("rotations", [False, True])
def test_stiffnesses_and_tilts_are_found_to_rounding(joints, rotations):
    """Gravity, geometry, moments, points off the TCP; start values off by up to 1.6 times."""
    true, rows, rng = random_task(100 + joints, joints, 0.0, rotations)
    right = ElasticParameters.of(true, "backlash")
    assert len(right.names) > 0
    start = right.described(right.start * rng.uniform(0.6, 1.6, len(right.start)))
    found = fit_static(
        ElasticParameters.of(start, "backlash"), rows, IdentifyOptions(noise_of(rows))
    )
    assert found.converged
    np.testing.assert_allclose(found.x, right.start, rtol=1e-8)


@pytest.mark.parametrize("seed", [1, 4, 9])
def test_backlash_is_found_where_loads_take_gears_to_their_other_flank(seed):
    """What no load reverses keeps its start, here the right one; all else is found to rounding."""
    true, rows, rng = random_task(seed, 4, 1e-4, False)
    right = ElasticParameters.of(true, "backlash")
    start = ElasticParameters.of(
        right.described(right.start * rng.uniform(0.6, 1.6, len(right.start))), "backlash"
    )
    silent = fit_static(start, rows, IdentifyOptions(noise_of(rows))).rigid.unobservable
    assert not silent[~right.chosen("backlash")].any()
    assert not silent.all()
    begun = start.described(np.where(silent, right.start, start.start))
    start = ElasticParameters.of(begun, "backlash")
    found = fit_static(start, rows, IdentifyOptions(noise_of(rows)))
    assert found.converged
    np.testing.assert_allclose(found.x, right.start, rtol=1e-7)

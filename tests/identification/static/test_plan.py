"""Plans: better than chance, within limits, and the interval that they promise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from noisy_arm import arm, noisy

from coupling.errors import IdentifyError
from coupling.identification.intervals import intervals
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.fit import IdentifyOptions, fit_static
from coupling.identification.static.measurements import noise_of
from coupling.identification.static.model import StaticModel
from coupling.identification.static.plan import (
    PlanRequest,
    _candidates,
    _information_rows,
    _noise,
    planned,
)

WISH = PlanRequest(count=8, force=400.0, poses=64, position=1e-5)


def limited(robot):
    joints = tuple(replace(joint, limits=(-1.0, 0.5)) for joint in robot.joints)
    return replace(robot, joints=joints)


def test_a_plan_keeps_to_limits_and_is_better_than_random_choices():
    robot = limited(arm(tilt=True))
    plan = planned(robot, "backlash", WISH)
    own = plan.measurements
    assert own.count == 8
    assert own.q.min() >= -1.0
    assert own.q.max() <= 0.5
    np.testing.assert_allclose(np.linalg.norm(own.wrench[:, :3], axis=1), 400.0)
    elasticity = ElasticParameters.of(robot, "backlash")
    candidates = _candidates(robot, WISH)
    rows = _information_rows(elasticity, candidates, _noise(candidates.count, WISH))
    chosen = _information_rows(elasticity, own, _noise(8, WISH))

    def gain(some):
        return np.linalg.slogdet(np.einsum("krp,krq->pq", some, some))[1]

    rng = np.random.default_rng(0)
    random = [gain(rows[rng.choice(len(rows), 8)]) for _ in range(200)]
    assert gain(chosen) > max(random) + 0.5


def test_the_interval_promised_is_the_one_that_measurements_give():
    """Median over 8 noisy repetitions of the plan; the jackknife makes some wider, none narrower."""
    robot, rng = limited(arm()), np.random.default_rng(1)
    plan = planned(robot, "backlash", replace(WISH, count=20))
    elasticity = ElasticParameters.of(robot, "backlash")
    model = StaticModel(elasticity, plan.measurements, "backlash")
    right = replace(plan.measurements, deflection=model.predict(elasticity.start).deflection)
    halves = []
    for _ in range(8):
        rows = noisy(right, rng, 1e-5, 5.0)
        fit = fit_static(elasticity, rows, IdentifyOptions(noise_of(rows)))
        found = intervals(fit.experiment.linear, fit.experiment.weight, fit.x, is_noise_known=False)
        halves.append((found.high - found.low) / 2.0 / elasticity.start)
    promised = np.array([entry.after for entry in plan.expected])
    ratio = np.median(halves, axis=0) / promised
    assert np.all((ratio > 0.8) & (ratio < 1.6))


def test_what_is_measured_already_counts():
    robot = limited(arm())
    first = planned(robot, "backlash", WISH).measurements
    more = planned(robot, "backlash", replace(WISH, count=4), (first, _noise(8, WISH)))
    before, after = (
        np.array([getattr(entry, name) for entry in more.expected]) for name in ("before", "after")
    )
    assert np.all(after < before)
    assert np.all(np.isfinite(before))
    alone = planned(robot, "backlash", replace(WISH, count=4))
    assert all(np.isinf(entry.before) for entry in alone.expected)


def test_weights_hang_down_and_tools_stay_above_the_floor():
    plan = planned(limited(arm()), "backlash", replace(WISH, down=True, lowest=1.0))
    np.testing.assert_array_equal(plan.measurements.wrench[:, 2], -400.0)
    with pytest.raises(IdentifyError, match="above 9 m"):
        planned(limited(arm()), "backlash", replace(WISH, lowest=9.0))

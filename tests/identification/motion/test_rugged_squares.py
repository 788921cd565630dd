"""What is identified of gears does not depend on the last digits of a measurement or on the start."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fixture_store import stored
from scipy.signal import lfilter

from coupling.identification.motion import identifiability
from coupling.identification.motion.driven_fmu import DrivenFmu
from coupling.identification.motion.identification import identify_motion
from docs.scripts.motion_recovery import BANDWIDTH, STEP, Known, arm, recorded


def test_a_trillionth_of_a_radian_moves_nothing_that_is_identified():
    """Links without weight swing in a backlash that the start has and the robot has not.

    Beside 20 urad that no model explains, correlated over 0.2 s, the squares along that backlash are
    rugged, and along it all others'.
    """
    rng = np.random.default_rng(2)
    robot = replace(arm(), gravity=(0.0, 0.0, 0.0))
    with DrivenFmu(robot) as fmu:
        recording = recorded(fmu, robot, rng)
    keep = np.exp(-STEP / 0.2)
    white = rng.standard_normal((len(recording.time) + 200, 2))
    unexplained = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, axis=0)[200:]
    rough = 1e-6 * rng.standard_normal(recording.motor.shape)
    recording = replace(
        recording, motor=recording.motor + rough, link=recording.link + 2e-5 * unexplained
    )
    drawn = Known.drawn(np.random.default_rng(6)).start
    joints = tuple(replace(joint, backlash=3e-5) for joint in drawn.joints)
    start = replace(drawn, joints=joints, gravity=(0.0, 0.0, 0.0))
    changed = replace(
        recording, link=recording.link + 1e-12 * rng.standard_normal(recording.link.shape)
    )
    one, other = (
        stored(identify_motion, start, [own], BANDWIDTH, leave_out=False)
        for own in (recording, changed)
    )
    assert one.fit.converged
    assert one.fit.slopes.exact
    assert not any(p.name.endswith("backlash") for p in one.fit.problem.parameters)
    assert {"joint[1].stiffness", "joint[2].stiffness"} <= one.result.identified
    assert one.result.identified == other.result.identified
    half = one.fit.blocks.half * one.fit.blocks.deviation
    own = np.array([p.name in one.result.identified for p in one.fit.problem.parameters])
    assert np.all(np.abs(other.fit.x - one.fit.x)[own] < 1e-2 * half[own])


@pytest.mark.parametrize(
    ("other", "less_likely", "stays"),
    [(1.0, 0.0, True), (2.0, 0.5, False), (2.0, 5.0, True), (1.25, 0.5, True), (1.4, 0.5, False)],
)
def test_a_value_with_another_as_likely_in_its_interval_is_one_of_several(
    monkeypatch, other, less_likely, stays
):
    """A likelihood with one maximum at 1 and one elsewhere, where fits from above 1.2 end; half 1."""

    def at(x):
        return SimpleNamespace(x=x, minus_log_likelihood=less_likely * float(x[0] != 1.0))

    monkeypatch.setattr(
        identifiability, "fit_roughly", lambda problem, x: at(np.where(x > 1.2, other, 1.0))
    )
    blocks = SimpleNamespace(half=2.0, deviation=np.array([0.5]))
    blocks.only = lambda others, away: SimpleNamespace(step=np.empty(0))
    one = at(np.ones(1))
    one.blocks, one.problem = blocks, SimpleNamespace(bounds=(np.zeros(1), np.full(1, 9.0)))
    assert identifiability.returns(one, np.array([True])) == [stays]

"""How soon a motion that no robot makes is given up, by tries of a step: Python takes 0.4 ms for one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_robots import make_robot

from elastic_robot.collocation import Collocation
from elastic_robot.description import Body
from elastic_robot.errors import IntegrationError
from elastic_robot.robot import ElasticRobot
from elastic_robot.settings import SETTINGS
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

STILL = HeldCommand(0.0, np.zeros(6), np.zeros(6), np.zeros(6))


@pytest.fixture
def tries(monkeypatch) -> list[np.ndarray]:
    """What was moving before each try of a step that is made [rad/s], one row each."""
    made, solve = [], Collocation.solve

    def counted(self, system, state, *rest):
        made.append(state.v.copy())
        return solve(self, system, state, *rest)

    monkeypatch.setattr(Collocation, "solve", counted)
    return made


def _pushed(seed: int, force: float, tolerance: float = 1e-6) -> ElasticRobot:
    """A robot at rest is pushed down for a second."""
    robot = ElasticRobot(make_robot(seed, 6), "backlash", tolerance=tolerance)
    robot.reset(0.0, STILL, Load())
    robot.step(1.0, STILL, Load(np.array([0.0, 0.0, -force, 0.0, 0.0, 0.0])))
    return robot


@pytest.mark.parametrize("seed", [2, 10])
@pytest.mark.parametrize(("force", "tolerance"), [(3e7, 1e-8), (1e8, 1e-6)])
def test_forces_of_thousands_of_tons_are_given_up_within_a_second(tries, seed, force, tolerance):
    """2400 tries; they took 6000 to 15000 and ended in motions of 200 m/s and more."""
    with pytest.raises(IntegrationError, match=r"needs more than \d+ tries of a step at|bends"):
        _pushed(seed, force, tolerance)
    assert len(tries) < 2400


def test_a_bare_flange_may_whirl(tries):
    """1e-5 kg m^2 under random forces of 1 kN: hundreds of rad/s, but 0.11 m from the TCP."""
    whole = make_robot(0, 6)
    light = Body(mass=0.01, com=(0.0, 0.0, 0.01), inertia=(1e-5, 1e-5, 1e-5))
    flange = replace(
        whole.joints[-1], body=light, stiffness=1e3, damping=1e-3, backlash=1e-4, tilt=()
    )
    robot = ElasticRobot(
        replace(whole, joints=(*whole.joints[:-1], flange), tcp_position=(0.05, 0.02, 0.1))
    )
    robot.reset(0.0, STILL, Load())
    rng = np.random.default_rng(1)
    for k in range(3):
        force = np.append(1e3 * rng.normal(size=3), np.zeros(3))
        robot.step((k + 1) * 0.004, STILL, Load(force))
    assert np.abs(tries).max() > 200.0


@pytest.mark.parametrize("seed", range(4))
def test_ten_tons_at_once_are_no_such_motion(tries, seed):
    """No try counts for more than one."""
    robot = _pushed(seed, 1e5)
    speeds = np.linalg.norm(np.array(tries) * robot.chain.reach, axis=1)
    assert speeds.max() < SETTINGS.usual_speed

"""Whether small errors stay small: a motion that rattles itself into chaos is told of, others not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from native_core import Core
from native_fmu import POSTURE

from elastic_robot.description import Robot

STEP = 0.004  # [s]
FORCE = np.array([120.0, 60.0, 200.0, 0.0, 0.0, 0.0])  # pushes and pulls at 5 Hz [N, N m]


def damped(robot: Robot, damping: float) -> Robot:
    """The robot with one damping of all gears and tilts [N m s/rad]."""

    def joint(own):
        tilts = tuple(replace(tilt, damping=damping) for tilt in own.tilt)
        return replace(own, damping=damping if own.stiffness else 0.0, tilt=tilts)

    return replace(robot, joints=tuple(map(joint, robot.joints)))


def shake(robot: Robot, watches: bool, first: float = 1.0) -> tuple[np.ndarray, bool]:
    """TCP of 1.2 s under the force, times `first` in one of the steps, and whether a shift has grown."""
    core, positions = Core(robot), []
    core.reset("backlash", 0.0, POSTURE, np.zeros(6))
    if watches:
        core.watch_growth()
    for k in range(300):
        load = FORCE * (first if k == 3 else 1.0) * (1.0 if (5.0 * STEP * k) % 1.0 < 0.5 else -1.0)
        core.step(STEP * (k + 1), np.array(POSTURE), load)
        positions.append(core.outputs(11)["tcp"][:3])
    return np.array(positions), watches and core.watch_growth()


@pytest.mark.parametrize(("damping", "chaotic"), [(30.0, True), (300.0, True), (3000.0, False)])
def test_a_shift_grows_where_two_runs_part(example, damping, chaotic):
    """Runs that differ by 1e-9 of one step's force; to be watched changes no bit of a run."""
    robot = damped(example, damping)
    watched, has_grown = shake(robot, watches=True)
    run, _ = shake(robot, watches=False)
    other, _ = shake(robot, watches=False, first=1.0 + 1e-9)
    np.testing.assert_array_equal(watched, run)
    assert has_grown is chaotic
    apart = np.abs(run - other).max(axis=1)
    assert bool(apart[-1] > 1e6 * apart[50]) is chaotic


def test_the_log_tells_of_chaos_once(native, capfd):
    slave = native.slave(logging=True)
    native.start(slave)
    damping = {v for v in native.references if v.endswith(".damping")}
    native.set(slave, dict.fromkeys(damping, 30.0))
    for k in range(300):
        sign = 1.0 if (5.0 * STEP * k) % 1.0 < 0.5 else -1.0
        native.set(slave, {f"force.{c}": sign * f for c, f in zip("xyz", FORCE, strict=False)})
        slave.doStep(STEP * k, STEP)
    said = capfd.readouterr().out
    assert said.count("expected small errors to stay small") == 1
    assert "tcp_tolerance does not bound the error" in said

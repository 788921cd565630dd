"""Tries of a step on hard and easy motion, growth of errors, and messages of other instances."""

import gc
from dataclasses import replace

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import defaultCallbacks
from native_core import Core, CoreError, with_settings
from native_fmu import POSTURE
from random_robots import make_robot
from replay_robot import Robot as ReplayedRobot

from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu.stepped import SteppedFmu
from elastic_robot.description import Robot
from elastic_robot.settings import SETTINGS


def _drive(tmp_path, rng, joints):
    """A trajectory of 0.8 Hz, all axes by 0.2 rad, 4 ms samples over half a minute."""
    seconds, turn = np.arange(7501) * 0.004, 2 * np.pi * 0.8
    phase = turn * seconds[:, None] + rng.uniform(0.0, 6.0, joints)
    q = rng.uniform(-1.0, 1.0, joints) + 0.2 * np.sin(phase)
    blocks = {"q": q, "qd": 0.2 * turn * np.cos(phase), "qdd": -0.2 * turn**2 * np.sin(phase)}
    columns = ["time", *(f"{name}{i + 1}" for name in blocks for i in range(joints))]
    np.savez(
        tmp_path / "drive.npz", columns=columns, data=np.column_stack([seconds, *blocks.values()])
    )
    return tmp_path / "drive.npz"


@pytest.mark.parametrize("kind", ["linear", "backlash", "spline"])
def test_what_robots_do_needs_half_the_tries_or_less(kind, tmp_path):
    """Random forces of 2 kN every 0.1, 1 and 4 ms at 1e-9 m, and half a minute in one step at 1e-6 m."""
    half = {
        "most_tries": SETTINGS.most_tries / 2,
        "most_tries_per_longest": SETTINGS.most_tries_per_longest / 2,
        "usual_speed": SETTINGS.usual_speed / 10,
    }
    for robot in (load_robot(find_robot("icme2008")), *(make_robot(seed, 6) for seed in range(2))):
        rng = np.random.default_rng(1)
        core, drive = with_settings(robot, **half), _drive(tmp_path, rng, 6)
        for step, count in ((1e-4, 50), (1e-3, 50), (4e-3, 50)):
            core.reset(kind, 0.0, np.zeros(6), np.zeros(6), path=drive, tolerance=1e-9)
            for k in range(count):
                force = np.append(2e3 * rng.normal(size=3), np.zeros(3))
                core.step((k + 1) * step, np.zeros(6), force)
        core.reset(kind, 0.0, np.zeros(6), np.zeros(6), path=drive)
        core.step(30.0, np.zeros(6), np.array([100.0, 0.0, -300.0, 0.0, 0.0, 0.0]))
    core.reset(kind, 0.0, np.zeros(6), np.zeros(6))
    with pytest.raises(CoreError, match=r"needs more than|beyond"):
        core.step(1.0, np.zeros(6), np.array([0.0, 0.0, -1e9, 0.0, 0.0, 0.0]))


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


def test_the_log_tells_of_chaos_once(native, example_fmu, capfd):
    """Beside a robot of the same process whose logger takes no notice of warnings."""
    ReplayedRobot(example_fmu)
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


def test_instances_of_others_are_heard_beside_and_after_a_robot_that_is_stepped(
    native, example_fmu, capfd
):
    """FMPy's proxy calls the logger of the robot, which may be no more."""
    with SteppedFmu(example_fmu, ("force.x",), ("tcp.x",)) as robot:
        _hear(native, capfd)
        robot.step(np.zeros(1), STEP)
    gc.collect()
    _hear(native, capfd)


def _hear(native, capfd):
    slave = native.slave(logging=True, callbacks=defaultCallbacks)
    with pytest.raises(FMICallException):
        slave.setReal([4_000_000_000], [1.0])
    assert "value reference of a real variable: expected" in capfd.readouterr().out

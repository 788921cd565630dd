"""The Manutec r3 in the native FMU against what Dymola publishes of the same robot [MslR3].

Its results of RobotR3.OneAxis and RobotR3.FullRobot stand in tests/reference/manutec_r3_*.csv, every
10 ms: angles of the axes [rad], wind-up of the springs at the motors [rad], currents [A]. Two things
are different there: a current follows its reference as a second-order system of some 800 Hz does, and
friction at rest is rigid. Here torque is at once what the servo asks for, and friction gives way by
the presliding angle. SciPy solves the published equations with either (helpers/manutec.py).
"""

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fixture_store import stored
from manutec import TORQUE, PointToPoint, PublishedAxis, published
from native_fmu import NativeFmu
from scipy.interpolate import make_interp_spline

from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot
from elastic_robot.drive import Drive

RATIO = np.array([-105.0, 210.0, 60.0])
# From a row of a trajectory to the next where an acceleration jumps [s].
AT_ONCE = 2e-6
ONE_AXIS = PointToPoint([0.0], [np.deg2rad(120.0)], [3.0], [10.0])
ALL_AXES = PointToPoint(
    np.deg2rad([-60.0, 20.0, 90.0, 0.0, -110.0, 0.0]),
    np.deg2rad([60.0, -70.0, -35.0, 45.0, 110.0, 45.0]),
    np.array([3.0, 1.5, 5.0, 3.1, 3.1, 4.1]),
    np.array([15.0, 15.0, 15.0, 60.0, 60.0, 60.0]),
)


def trajectory(times: np.ndarray, jumps, at: Callable[[float], np.ndarray], file: Path) -> str:
    """Write rows of q, q', q''; just behind a jump those from there on, at the start no acceleration."""
    rows = []
    away = np.abs(np.subtract.outer(times, jumps)).min(axis=1) > 1e-5
    for time in np.union1d(times[away], jumps):
        before = at(max(time - AT_ONCE, 0.0))
        now = at(time)
        if time in jumps:
            rows.append([time, *now[:2].ravel(), *(before[2] if time > 0.0 else 0.0 * now[2])])
            now, time = at(time + AT_ONCE), time + AT_ONCE
        rows.append([time, *now.ravel()])
    count = now.shape[1]
    columns = ["time", *(f"{kind}{i + 1}" for kind in ("q", "qd", "qdd") for i in range(count))]
    np.savez(file, columns=columns, data=np.array(rows))
    return str(file)


def simulated(robot: Robot, command: str, times: np.ndarray, folder: Path) -> np.ndarray:
    """Angles of links, wind-ups of gears, torques of motors of the driven joints, (3, n, axes)."""
    fmu = NativeFmu(build_fmu(robot, folder / "R.fmu", BuildOptions("native")), folder / "fmu")
    motors = [i + 1 for i, joint in enumerate(robot.joints) if joint.drive is not None]
    options = {"drive": "servo", "torque_curve": "linear", "trajectory": command}
    slave = fmu.start(fmu.slave(), np.zeros(len(robot.joints)), 1e-10, **options)
    kinds = ("motor_angle", "deflection", "motor_torque")  # there are no tilts
    names = [f"{kind}[{i}]" for kind in kinds for i in motors]
    rows = [fmu.get(slave, *names)]
    for begin, end in itertools.pairwise(times):
        slave.doStep(begin, end - begin)
        rows.append(fmu.get(slave, *names))
    motor, wind_up, torque = np.array(rows).reshape(len(times), 3, -1).transpose(1, 0, 2)
    return np.array([motor + wind_up, wind_up, torque])


def unlimited(drive: Drive | None, slip_angle: float = 2e-5) -> Drive | None:
    """Dymola's currents have no limit in these runs, and pass 9 A."""
    return drive and replace(drive, torque_limit=None, slip_angle=slip_angle)


def manutec() -> Robot:
    return load_robot(find_robot("manutec_r3"))


def one_axis(slip_angle: float, folder: Path) -> tuple[np.ndarray, ...]:
    """Axis 2 with Modelica's load on the published way: link angle, wind-up and torque of the motor."""
    axis, times = manutec().joints[1], published("one_axis")["time"]
    load = Body(mass=1.0, com=(0.0, 0.0, 0.0), inertia=(19.5, 19.5, 19.5))  # 1.3 times 15 kg
    gear = {"stiffness": axis.stiffness, "damping": axis.damping}
    drive = unlimited(axis.drive, slip_angle)
    joint = Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), load, drive=drive, **gear)
    robot = Robot("axis", (joint,), gravity=(0.0, 0.0, 0.0))
    command = trajectory(times, ONE_AXIS.jumps, ONE_AXIS.at, folder / "command.npz")
    return tuple(found[:, 0] for found in simulated(robot, command, times, folder))


def test_the_published_equations_solved_by_scipy_are_dymolas():
    """Angles to 1e-8 rad of 2.1, the current to 1e-5 A of 4.4."""
    own = published("one_axis")
    states = stored(PublishedAxis.run, PublishedAxis(ONE_AXIS), own["time"])
    np.testing.assert_allclose(states[:, 0], own["phi"], rtol=0, atol=1e-8)
    wind_up = (210.0 * states[:, 0] - states[:, 2]) / 210.0
    np.testing.assert_allclose(wind_up, own["spring"] / 210.0, rtol=0, atol=1e-8)
    np.testing.assert_allclose(states[:, 5], own["current"], rtol=0, atol=1e-5)


@pytest.mark.parametrize(("slip_angle", "apart"), [(2e-5, 4e-5), (2e-6, 1.4e-5)])
def test_one_axis_moves_as_the_published_equations_have_it(tmp_path, slip_angle, apart):
    """With torque at once and presliding to 1e-9 rad; of Dymola's what these two make of it is left."""
    own = published("one_axis")
    link, wind_up, torque = one_axis(slip_angle, tmp_path)
    axis = PublishedAxis(ONE_AXIS, 210.0 * slip_angle, with_current=False)
    states = stored(PublishedAxis.run, axis, own["time"])
    np.testing.assert_allclose(link, states[:, 0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(link - wind_up, states[:, 2] / 210.0, rtol=0, atol=1e-9)
    asked = [210.0 * axis.torques(t, y)[0] for t, y in zip(own["time"], states, strict=True)]
    np.testing.assert_allclose(torque[1:], asked[1:], rtol=0, atol=1e-4)
    assert np.abs(link - own["phi"]).max() < apart


@pytest.mark.parametrize(("slip_angle", "bent"), [(2e-5, 7e-5), (2e-6, 2.5e-5)])
def test_the_robot_moves_as_dymola_has_it(tmp_path, slip_angle, bent):
    """Axes 1 to 3 under their servos to 1e-4 rad of 2.2, axes 4 to 6 led as Dymola's went.

    The current loops make 8e-5 of that where accelerations jump; the rest is presliding, at reversals.
    """
    own = published("full_robot")
    times = own["time"]
    axes, springs, currents = (
        np.column_stack([own[f"{kind}{i + 1}"] for i in range(count)])
        for kind, count in (("phi", 6), ("spring", 3), ("current", 3))
    )
    wrist = make_interp_spline(times, axes[:, 3:], k=5)

    def at(time: float) -> np.ndarray:
        rows = ALL_AXES.at(time)
        rows[:, 3:] = [wrist(time, nu) for nu in range(3)]
        rows[:, :3] += made_up_for(springs[0] / RATIO, time)
        return rows

    parts = np.append(np.arange(0.0, len(times) - 1.0, 0.2), len(times) - 1.0)
    grid = np.interp(parts, np.arange(len(times)), times)
    command = trajectory(grid, ALL_AXES.jumps, at, tmp_path / "command.npz")
    joints = (replace(j, drive=unlimited(j.drive, slip_angle)) for j in manutec().joints)
    robot = replace(manutec(), joints=tuple(joints))
    link, wind_up, torque = simulated(robot, command, times, tmp_path)
    # It starts in the same equilibrium, under the same torque.
    np.testing.assert_allclose(wind_up[0], springs[0] / RATIO, rtol=0, atol=1e-12)
    np.testing.assert_allclose(torque[0], TORQUE * RATIO * currents[0], rtol=0, atol=1e-6)
    assert np.abs(link - axes[:, :3]).max() < 1e-4
    assert np.abs(wind_up - springs / RATIO).max() < bent
    # While all axes move evenly, all is nearer, and torques tell of friction, to 0.6 of 500 N m.
    even = (times > 0.4) & (times < 1.2)
    assert np.abs(link - axes[:, :3])[even].max() < 1e-5
    assert np.abs(torque - TORQUE * RATIO * currents)[even].max() < 0.6


def made_up_for(bent: np.ndarray, time: float) -> np.ndarray:
    """What to command besides, so that a servo that starts at its command does as Modelica's.

    There links start at their command, motors the wind-up e behind it, and the servo's first torque is
    that of the gear: its integral is less by Kp Kv e. Here the motor starts at its command, with all of
    the torque in the integral. With u = Kv d + d' the change of w by a change d of the command,
    Kp (u + integral of u / T) makes up for that where u = -Kv e exp(-t / T), from d = -e on.

    Returns:
        d, d', d'' [rad, ...], (3, axes).
    """
    gain, rate = 5.0, 1.0 / 0.05
    driven = -gain * bent / (gain - rate)
    free = -bent - driven
    powers = np.arange(3)[:, None]
    slow = free * np.exp(-gain * time) * (-gain) ** powers
    return slow + driven * np.exp(-rate * time) * (-rate) ** powers

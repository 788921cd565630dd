"""Motors, servos, friction and hysteresis of the native FMU against MuJoCo."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from native_fmu import WRENCH, NativeFmu
from random_robots import driven, make_robot
from scipy.interpolate import BPoly, PPoly

from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.description import Joint, Robot

pytest.importorskip("mujoco", reason="needs the package mujoco, which is in the extra 'test'")
from driven_mujoco import DrivenMujoco

STEP, STEPS = 4e-3, 30


def smooth(robot: Robot) -> Robot:
    """The robot without what bends a torque: friction at rest, hysteresis."""

    def joint(own: Joint) -> Joint:
        return (
            own
            if own.drive is None
            else replace(own, hysteresis=(), drive=replace(own.drive, friction=0.0))
        )

    return replace(robot, joints=tuple(map(joint, robot.joints)))


class Motion:
    """Quintic polynomials between random rows 40 ms apart; wrenches and torques held over 20 ms."""

    def __init__(self, robot: Robot, q: np.ndarray, seed: int) -> None:
        rng = np.random.default_rng(seed)
        moved = np.array([joint.drive is not None for joint in robot.joints])
        self.rows = np.linspace(0.0, STEP * STEPS, 4)
        rows = (
            rng.normal(size=(3, len(self.rows), len(q)))
            * moved
            * np.array([0.003, 0.1, 2.0])[:, None, None]
        )
        rows[:, 0] = 0.0
        self.table = np.moveaxis(rows, 0, 1) + q * np.array([1.0, 0.0, 0.0])[:, None]
        angle = PPoly.from_bernstein_basis(BPoly.from_derivatives(self.rows, self.table))
        rate = np.pad(angle.derivative().c, ((1, 0), (0, 0), (0, 0)))
        self._motion = PPoly(np.stack([angle.c, rate], axis=2), self.rows)
        sizes = [*3 * [300.0], *3 * [30.0]]
        self.wrench = np.repeat(rng.normal(size=(STEPS // 5, 6)) * sizes, 5, axis=0)
        self.torque = np.repeat(rng.normal(size=(STEPS // 5, int(moved.sum()))) * 100.0, 5, axis=0)

    def at(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        q, qd = self._motion(time)
        return q, qd

    def start(self, _: float) -> tuple[np.ndarray, np.ndarray]:
        """The command of drives that get torques: where they begin."""
        return self.at(0.0)

    def write(self, file: Path) -> str:
        """Write the FMU's trajectory."""
        joints = range(1, self.table.shape[2] + 1)
        columns = ["time", *(f"{kind}{i}" for kind in ("q", "qd", "qdd") for i in joints)]
        np.savez(
            file,
            columns=columns,
            data=np.hstack([self.rows[:, None], self.table.reshape(len(self.rows), -1)]),
        )
        return str(file)


def simulated(robot: Robot, motion: Motion, drive: str, curve: str, folder) -> tuple:
    """Return the FMU's start (x, torques, elongations), its states at all steps, and torques there."""
    folder.mkdir(exist_ok=True)
    fmu = NativeFmu(build_fmu(robot, folder / "R.fmu", BuildOptions("native")), folder / "fmu")
    strings = {"drive": drive, "torque_curve": curve}
    if drive == "servo":
        strings["trajectory"] = motion.write(folder / "command.npz")
    slave = fmu.start(fmu.slave(), motion.table[0, 0], 1e-10, **strings)
    motors = [i + 1 for i, joint in enumerate(robot.joints) if joint.drive is not None]
    deflections, elongations = (
        [name for name in fmu.references if name.startswith(kind)]
        for kind in ("deflection[", "elongation[")
    )
    torques = [f"motor_torque[{i}]" for i in motors]
    states = [
        *deflections,
        *(f"motor_angle[{i}]" for i in motors),
        "tcp.x",
        "tcp.y",
        "tcp.z",
    ]
    start = [np.array(fmu.get(slave, *of)) for of in (deflections, torques, elongations)]
    found, exerted = [], []
    for k in range(STEPS):
        values = dict(zip(WRENCH, motion.wrench[k], strict=True))
        if drive == "torque":
            values |= {f"torque_cmd[{i}]": t for i, t in zip(motors, motion.torque[k], strict=True)}
        fmu.set(slave, values)
        slave.doStep(k * STEP, STEP)
        found.append(fmu.get(slave, *states))
        exerted.append(fmu.get(slave, *torques))
    return start, np.array(found), np.array(exerted)


def by_mujoco(
    robot: Robot, motion: Motion, drive: str, curve: str, start: list, parts: int
) -> np.ndarray:
    """Return MuJoCo's states at all steps of the FMU, each made in so many parts."""
    command = motion.at if drive == "servo" else motion.start
    other = DrivenMujoco(robot, command, curve == "backlash", STEP / parts)
    if drive == "torque":
        other.torque = start[1]
    other.start(*start, np.zeros(6))
    # Where the FMU has started, MuJoCo's links rest as well, under servos its motors too.
    assert np.abs(other.acceleration(drive == "servo")).max() < 1e-6
    found = []
    for k in range(STEPS):
        other.wrench = motion.wrench[k]
        if drive == "torque":
            other.torque = motion.torque[k]
        other.run(parts)
        found.append(other.state())
    return np.array(found)


def unlimited_manutec() -> Robot:
    """The shipped robot that has drives; it goes beyond their limits here, which have a test below."""
    robot = load_robot(find_robot("manutec_r3"))
    drives = [j.drive and replace(j.drive, torque_limit=None) for j in robot.joints]
    joints = (replace(j, drive=d) for j, d in zip(robot.joints, drives, strict=True))
    return replace(robot, joints=tuple(joints))


ROBOTS = {
    "random-2": lambda: make_robot(2, 3),
    "random-6": lambda: make_robot(6, 5),
    "icme2008": lambda: load_robot(find_robot("icme2008")),
    "manutec_r3": unlimited_manutec,
}


def with_drives(name: str) -> Robot:
    """A robot with its own drives, or with random ones."""
    robot = ROBOTS[name]()
    own = any(joint.drive for joint in robot.joints)
    return robot if own else driven(robot, np.random.default_rng(1))


def compared(robot: Robot, drive: str, curve: str, folder: Path, *parts: int) -> tuple[float, ...]:
    """Return MuJoCo's changes from each number of parts of a step to the next, and what is then left."""
    motion = Motion(robot, np.random.default_rng(2).uniform(-0.5, 0.5, len(robot.joints)), 3)
    start, ours, _ = simulated(robot, motion, drive, curve, folder)
    assert np.ptp(ours, axis=0).max() > 5e-3
    paths = [by_mujoco(robot, motion, drive, curve, start, n) for n in parts]
    return tuple(float(np.abs(a - b).max()) for a, b in itertools.pairwise([*paths, ours]))


@pytest.mark.parametrize("drive", ["servo", "torque"])
@pytest.mark.parametrize("name", ROBOTS)
def test_mujoco_converges_to_smooth_drives(tmp_path, name, drive):
    """Steps of 1/2, 1/4, 1/8 ms: what the last errs by follows from the fourth order, and is the limit.

    Found are 1e-11 to 3.3e-9 rad and m of 0.01 to 0.08.
    """
    robot = smooth(with_drives(name))
    first, second, apart = compared(robot, drive, "linear", tmp_path, 8, 16, 32)
    assert np.log2(first / second) > 3.8
    assert second < 1e-7
    assert apart < 1.2 * second / 15.0


@pytest.mark.parametrize("drive", ["servo", "torque"])
@pytest.mark.parametrize("name", ROBOTS)
def test_mujoco_converges_to_drives_that_slip_and_stick(tmp_path, name, drive):
    """Runge-Kutta steps over bends, backlash among them: of first order, the last error about the last
    change, the limit.

    Found are 4e-10 to 1.3e-7 rad and m.
    """
    robot = with_drives(name)
    last, apart = compared(robot, drive, "backlash", tmp_path, 32, 64)
    assert last < 2e-7
    assert apart < 1.5 * last


def test_mujoco_limits_a_servo_as_we_do(tmp_path):
    """Motors that stay at their limit for a while, to 4e-6 rad of 0.01.

    That an integral waits, and goes on, both find at the end of their steps only: MuJoCo's steps of
    1/32 and 1/64 ms are 2e-6 rad from a finer one's, ours at a tolerance of 1e-10 m 5e-7.
    """
    robot = with_drives("random-6")
    motion = Motion(robot, np.random.default_rng(2).uniform(-0.5, 0.5, 5), 3)
    start, _, free = simulated(robot, motion, "servo", "linear", tmp_path / "free")
    limits = iter(0.5 * np.abs(start[1]) + 0.5 * np.abs(free).max(axis=0))
    joints = [j.drive and replace(j.drive, torque_limit=float(next(limits))) for j in robot.joints]
    limited = replace(
        robot,
        joints=tuple(replace(j, drive=d) for j, d in zip(robot.joints, joints, strict=True)),
    )
    _, _, torque = simulated(limited, motion, "servo", "linear", tmp_path / "limited")
    at_limit = np.abs(torque) == [d.torque_limit for d in joints if d is not None]
    assert at_limit.sum(axis=0).min() > 1
    assert at_limit.sum() > 20
    last, apart = compared(limited, "servo", "linear", tmp_path / "both", 64, 128)
    assert last < 1e-6
    assert apart < 4e-6

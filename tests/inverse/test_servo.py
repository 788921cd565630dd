"""Servos inverted: closed forms of a motor, a plain simulation of it, robots' native FMUs."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from places import CASES
from scipy.interpolate import CubicSpline
from tuned_fmu import simulate_tuned

from coupling.case.file import load_case
from coupling.errors import PlanningError
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.inverse.drive_limits import DriveLimits
from coupling.inverse.inversion import DesiredMotion, MovingRobot
from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.rows import CommandRows
from coupling.inverse.rows_fit import RowsFit, dense_times
from coupling.inverse.servo import MotorMotion, motor_torque, servo_motion
from coupling.inverse.servo_command import RobotServos
from coupling.inverse.spline import UniformSpline
from coupling.path.controller import Controller
from coupling.path.histories import WrenchHistory
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.inverter import Inverter
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.fmu_pool import FmuPool, cell_of
from elastic_robot.drive import Drive
from elastic_robot.gear_parts import StopElement

J, KV = 50.0, 20.0
KP = J * 2.0 * np.pi * 30.0
PLAIN = Drive(J, KV, KP, KP / 0.02)
RUBBED = replace(PLAIN, friction=60.0, slip_angle=2e-5, viscous=60.0, stribeck=0.3)
HOME = np.array([0.1, -0.2, 0.4, 0.1, 0.7, 0.0])


def motion_of(spline, time, gear_torque=None):
    torque = np.zeros(len(time)) if gear_torque is None else gear_torque
    return MotorMotion(time, *(spline(time, order) for order in range(3)), torque, torque[0])


def turned(drive, command, gear_torque, time, start):
    """A motor under a command, by Runge and Kutta's steps from time to time: q, (n,).

    `command` gives q_cmd and q_cmd' at times and their middles, (2 n - 1,) each, `gear_torque` likewise.
    """
    a, h = drive.slip_angle, float(time[1] - time[0])
    q_cmd, rate_cmd, gear_torque = (np.asarray(x).tolist() for x in (*command, gear_torque))

    def growth(j, q, v, z, s, q0):
        wanted = drive.position_gain * (q_cmd[j] - q) + drive.feed_forward * rate_cmd[j] - v
        stretched = min(max(s + q - q0, -a), a)
        lost = drive.stribeck * (1.0 - math.exp(-((v / drive.stribeck_rate) ** 2)))
        friction = drive.friction * stretched / a * (1.0 - lost) + drive.viscous * v
        torque = drive.rate_gain * wanted + z - gear_torque[j] - friction
        return v, torque / drive.inertia, drive.integral_gain * wanted

    def after(length, growing):
        return [x + length * g for x, g in zip(state, growing, strict=True)]

    state, s, found = start, 0.0, [start[0]]
    for n in range(len(time) - 1):
        q0 = state[0]
        k1 = growth(2 * n, *state, s, q0)
        k2 = growth(2 * n + 1, *after(0.5 * h, k1), s, q0)
        k3 = growth(2 * n + 1, *after(0.5 * h, k2), s, q0)
        k4 = growth(2 * n + 2, *after(h, k3), s, q0)
        whole = zip(k1, k2, k3, k4, strict=True)
        state = after(h / 6.0, [a1 + 2.0 * (a2 + a3) + a4 for a1, a2, a3, a4 in whole])
        s = min(max(s + state[0] - q0, -a), a)
        found.append(state[0])
    return np.array(found)


def test_a_motor_at_a_constant_rate_wants_its_command_ahead_by_rate_over_gain():
    """Told its rate, by nothing; not told, by v / Kv once the integral of the start is gone."""
    time, v = np.linspace(0.0, 0.5, 501), 0.2
    motion = MotorMotion(time, v * time, np.full(501, v), *np.zeros((2, 501)), 0.0)
    told = servo_motion(PLAIN, motion)
    untold = servo_motion(replace(PLAIN, feed_forward=0.0), motion)
    np.testing.assert_allclose(told.angle, motion.angle, rtol=0, atol=1e-15)
    ahead = v / KV * (1.0 - np.exp(-time / 0.02))
    np.testing.assert_allclose(untold.angle - motion.angle, ahead, rtol=0, atol=1e-15)


@pytest.mark.parametrize("feed_forward", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("integral_gain", [0.0, KP / 0.02])
def test_a_motor_that_swings_wants_what_its_frequency_response_says(feed_forward, integral_gain):
    """(J s^3 + (Kp + b) s^2 + (Kp Kv + Ki) s + Ki Kv) / (kff s + Kv) (Kp s + Ki), s = i w."""
    drive = replace(PLAIN, feed_forward=feed_forward, integral_gain=integral_gain, viscous=700.0)
    time, w = np.linspace(0.0, 3.0, 30_001), 40.0
    swing = np.exp(1j * w * time)
    values = ((1j * w) ** order * swing for order in range(3))
    motion = MotorMotion(time, *(np.real(rows) for rows in values), np.zeros(len(time)), 0.0)
    s, ki = 1j * w, integral_gain
    closed = J * s**3 + (KP + 700.0) * s**2 + (KP * KV + ki) * s + ki * KV
    expected = np.real(closed / ((feed_forward * s + KV) * (KP * s + ki)) * swing)
    found = servo_motion(drive, motion)
    late = time > 2.0  # what the start has left is gone
    if ki == 0.0:
        # Nothing brings the torque at the start to zero: an offset.
        expected = expected + np.mean((found.angle - expected)[late])
    np.testing.assert_allclose(found.angle[late], expected[late], rtol=0, atol=3e-6)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=8, deadline=None, derandomize=True)
def test_any_motor_told_its_inverse_moves_as_wanted(seed):
    """Random drives, and motions that turn back under a gear's torque, against a plain simulation."""
    random = np.random.default_rng(seed)
    inertia = random.uniform(5.0, 400.0)
    rate_gain = inertia * 2.0 * np.pi * random.uniform(15.0, 50.0)
    drive = Drive(
        inertia,
        random.uniform(5.0, 40.0),
        rate_gain,
        rate_gain / random.uniform(0.01, 0.1),
        random.uniform(0.2, 1.0),
        friction=inertia * random.uniform(0.0, 1.0),
        slip_angle=random.uniform(2e-5, 1e-4),
        viscous=inertia * random.uniform(0.0, 3.0),
        stribeck=random.uniform(0.0, 0.5),
    )
    knots = np.linspace(0.0, 0.4, 9)
    way = CubicSpline(knots, np.cumsum(random.normal(size=9)) * 2e-3, bc_type="natural")
    gear = CubicSpline(knots, random.normal(size=9) * inertia)
    time = np.linspace(0.0, 0.4, 8001)
    motion = motion_of(way, time, gear(time))
    told = servo_motion(drive, motion)
    # Told the rate at its start, with the torque that goes with it.
    wanted = (drive.feed_forward - 1.0) * motion.rate[0]
    start = motion.angle[0], motion.rate[0], motor_torque(drive, motion)[0] - rate_gain * wanted
    command = told.angle[::2], np.append(motion.rate[0], told.rate[1:])
    moved = turned(drive, (told.angle, command[1]), motion.gear_torque, time[::2], start)
    missed = np.abs(moved - motion.angle[::2]).max()
    assert np.abs(told.angle - motion.angle).max() > 1e-5
    assert missed < 2e-8


@pytest.mark.parametrize("degree", [3, 5])
def test_rows_are_fitted_to_all_of_the_command(degree):
    """Without feed-forward a reversal bends the command: sampled rows leave three times the miss."""
    drive = replace(RUBBED, feed_forward=0.0, friction=200.0)
    rows = CommandRows(0.0, 0.012, 60, degree)
    time = dense_times(rows)
    w = 2.0 * np.pi / 0.36
    swing = 0.5e-3 * (1.0 - np.cos(w * time))
    rates = 0.5e-3 * w * np.sin(w * time), 0.5e-3 * w**2 * np.cos(w * time)
    motion = MotorMotion(time, swing, *rates, np.zeros(len(time)), 0.0)
    told = servo_motion(drive, motion)
    fit = RowsFit(drive, rows, told.angle, (0.0, 0.0, float(rates[1][0])))
    torque = motor_torque(drive, motion)
    start = 0.0, 0.0, torque[0]
    late = time > 0.2

    def missed(angle, rate):
        fine = np.linspace(0.0, time[-1], 2 * len(time) * 8 - 15)
        command = angle(fine), rate(fine)
        q = turned(drive, command, np.zeros(len(fine)), fine[::2], start)
        return np.abs(np.interp(time, fine[::2], q) - motion.angle)[late].max()

    spline = UniformSpline(0.0, 0.012, fit.best(DriveLimits(1))[:, None], degree)
    fitted = missed(lambda t: spline.at(t)[:, 0], lambda t: spline.at(t, 1)[:, 0])
    nodes = spline.nodes
    sampled = CubicSpline(nodes, np.interp(nodes, time, told.angle), bc_type="clamped")
    assert np.abs(told.angle - motion.angle).max() > 1e-4
    assert fitted < missed(sampled, lambda t: sampled(t, 1)) / 3.0


def robot_with_servos(robot, **changed):
    """Rotors, servos and friction in all gears, and hysteresis."""
    inertia, friction = (
        (400.0, 400.0, 300.0, 40.0, 40.0, 30.0),
        (300.0, 300.0, 200.0, 60.0, 50.0, 40.0),
    )
    joints = []
    for joint, j, f in zip(robot.joints, inertia, friction, strict=True):
        if joint.stiffness is None:
            joints.append(joint)
            continue
        gain = j * 2.0 * np.pi * 30.0
        drive = Drive(j, 20.0, gain, gain / 0.02, friction=f, viscous=f)
        stops = tuple(StopElement(0.1 * f, angle) for angle in (2e-5, 6e-5, 1.5e-4))
        joints.append(replace(joint, drive=replace(drive, **changed), hysteresis=stops))
    return replace(robot, joints=tuple(joints))


def stroke(robot, begin=0.0, end=1.2):
    """There and back in all joints from rest to rest, under a force; or a part of that."""
    time = 0.004 * np.arange(round(begin / 0.004), round(end / 0.004) + 1)
    part = time / 1.2
    swing = part**4 * (1.0 - part) ** 4 * 256.0
    q = HOME + np.outer(swing, [0.04, 0.03, -0.05, 0.1, 0.06, -0.1])
    path = InverseKinematics(robot, q[0]).forward(JointPath(time, (q,)), time)
    loads = np.zeros((len(time), 6))
    loads[:, :3] = np.outer(swing, [150.0, -100.0, 300.0])
    return DesiredMotion(
        path, InverseKinematics(robot, q[0]).plan(path), WrenchHistory(time, loads)
    )


class Judge:
    """A robot's FMU, and how far its tool is from a path under a command."""

    def __init__(self, robot, folder):
        self.robot = robot
        file = build_fmu(robot, folder / "R.fmu", BuildOptions("native"))
        self.fmu = RobotFmu(file, "backlash", drive="servo")

    def inverted(self, wanted, drive, controller, polish=0):
        inverter = Inverter(MovingRobot(self.robot, "backlash"), self.fmu, polish, drive)
        return inverter.invert(wanted, controller, 1e-6, lambda event: None).joints

    def missed(self, wanted, command, drive="servo", skipped=0.0):
        """Largest distance after so many seconds [m]."""
        fine = SampledPath.of(wanted.path).refined(0.002).path
        loads = wanted.wrench.refined(fine.time)
        path = simulate_tuned(self.fmu, command, loads, "dynamic", {"drive": drive})
        distance = np.linalg.norm(path.deviation_from(fine)[0][:, :3], axis=1)
        return distance[fine.time >= fine.time[0] + skipped].max()


@pytest.mark.parametrize("interpolation", ["quintic", "cubic"])
@pytest.mark.parametrize("feed_forward", [1.0, 0.0])
def test_a_robot_with_servos_keeps_its_tool_on_the_path(
    example, tmp_path, interpolation, feed_forward
):
    """Friction, rotors and loops make 0.2 mm of a command for ideal drives; told, under 1 um."""
    robot = robot_with_servos(example, feed_forward=feed_forward)
    judge, wanted = Judge(robot, tmp_path), stroke(robot)
    controller = Controller(interpolation=interpolation)
    assert judge.missed(wanted, judge.inverted(wanted, "ideal", controller)) > 2e-4
    told = judge.inverted(wanted, "servo", controller, polish=5)
    assert judge.missed(wanted, told) < 1e-6
    end = told.trajectory.at(told.time[-1:])
    np.testing.assert_allclose(end[1], 0.0, rtol=0, atol=1e-9)  # it rests there


def test_a_path_cut_in_mid_motion_begins_with_the_motors_moving(example, tmp_path):
    """What no command can help at such a start, ideal drives have too: behind it nothing is added."""
    robot = robot_with_servos(example)
    judge, wanted = Judge(robot, tmp_path), stroke(robot, 0.3, 0.9)
    ideal, servo = (judge.inverted(wanted, drive, Controller()) for drive in ("ideal", "servo"))
    assert judge.missed(wanted, servo) < 1e-4
    least = judge.missed(wanted, ideal, "ideal", skipped=0.15)
    assert judge.missed(wanted, servo, skipped=0.15) < 1.05 * least


def test_a_servos_command_keeps_the_limits_between_its_rows(example, tmp_path):
    robot = robot_with_servos(example)
    judge, wanted = Judge(robot, tmp_path), stroke(robot)
    free = judge.inverted(wanted, "servo", Controller())
    dense = np.linspace(free.time[0], free.time[-1], 20_001)
    cap = 0.8 * np.abs(free.trajectory.at(dense)[2]).max()
    held = judge.inverted(wanted, "servo", Controller(max_acceleration=cap))
    assert np.abs(held.trajectory.at(dense)[2]).max() <= cap * (1.0 + 1e-6)
    assert judge.missed(wanted, held) < 2e-5


def test_limits_that_leave_no_command_for_a_servo_are_named(example):
    robot = robot_with_servos(example)
    moving, wanted = MovingRobot(robot, "backlash"), stroke(robot)
    found = moving.invert(wanted, Controller(), JointLimits.of(robot), lambda *event: None)
    slow = JointLimits.of(robot, max_acceleration=0.2)
    with pytest.raises(
        PlanningError,
        match=r"joint 1: expected a command of its servo within 0\.2 rad/s\^2, got none",
    ):
        RobotServos(moving, found, slow, (True, True)).command(found.command)


def test_a_motor_too_weak_for_the_path_is_named_with_time_and_torque(example, tmp_path):
    robot = robot_with_servos(example, torque_limit=500.0)
    judge, wanted = Judge(robot, tmp_path), stroke(robot)
    with pytest.raises(
        PlanningError,
        match=r"joint 1: expected at most 500 N m .* needs \d+.* N m too much, at \d\.\d+ s",
    ):
        judge.inverted(wanted, "servo", Controller())


def test_a_polish_stays_within_what_the_motors_can_do(example, tmp_path):
    """The limit is just above what the path needs: changes beyond it are left out, none is refused."""
    robot = robot_with_servos(example, torque_limit=1.0)
    judge, wanted, seldom = Judge(robot, tmp_path), stroke(robot), Controller(cycle=0.016)
    with pytest.raises(PlanningError) as refused:
        judge.inverted(wanted, "servo", seldom)
    needed = float(re.search(r"needs (\S+) N m", str(refused.value)).group(1))
    free = robot_with_servos(example).joints
    weak = replace(free[0], drive=replace(free[0].drive, torque_limit=1.0001 * needed))
    (tmp_path / "weak").mkdir()
    judge = Judge(replace(robot, joints=(weak, *free[1:])), tmp_path / "weak")
    before = judge.missed(wanted, judge.inverted(wanted, "servo", seldom))
    behind = judge.missed(wanted, judge.inverted(wanted, "servo", seldom, polish=8))
    assert behind < 1.01 * before


def test_a_cell_of_servos_is_inverted_and_simulated_as_one(example):
    robot = robot_with_servos(example)
    wanted = stroke(robot)
    (placed,) = load_case(CASES / "cone.toml").robots
    with FmuPool("native") as models:
        cell, _ = cell_of([replace(placed, description=robot, drive="servo")], models)
        told = cell.inverse(SampledPath.of(wanted.path), wanted.wrench, Controller(), 1e-6).joints
        fine = SampledPath.of(wanted.path).refined(0.002).path
        moved = cell.simulate(told, wanted.wrench.refined(fine.time), "dynamic")
    assert moved.distance_to(fine).max() < 1e-6

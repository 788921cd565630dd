"""Motors with rotor, friction and servo in the native FMU, against Python's and closed forms."""

import itertools
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from fmpy.fmi1 import FMICallException
from native_motors import Both, built, one_joint
from random_robots import driven, limited, make_robot
from tuned_fmu import simulate_tuned

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.path.contact_spring import ContactSpring
from coupling.path.histories import WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.chain import build_chain
from elastic_robot.drive import Drive
from elastic_robot.parameters import Parameters

# Stiff loops of a servo without integral, of which a motor at rest needs none.
LOOPS = {"position_gain": 20.0, "rate_gain": 2e3}


@pytest.mark.parametrize(("seed", "joints"), [(3, 2), (5, 3), (8, 4)])
def test_motors_move_as_in_python(tmp_path, seed, joints):
    """Random robots whose gears and motors slip and stick under force steps: to 1e-11 rad of 1e-4."""
    rng = np.random.default_rng(seed)
    robot = driven(make_robot(seed, joints), rng)
    q, slipped = rng.uniform(-0.5, 0.5, joints), set()
    both = Both(robot, tmp_path, q, "servo", tolerances=(1e-8,))
    began = both.model.deflection(), both.model.motor_angle()
    whole = np.array([joint.drive.slip_angle for joint in robot.joints if joint.drive])
    for _ in range(12):
        both.step(4e-3, q, 0.0 * q, [*(rng.normal(size=3) * 400.0), 0.0, 0.0, 0.0])
        both.require_same(1e-11, "deflection", "motor_angle", "elongation", "presliding")
        both.require_same(1e-4, "motor_torque", "servo_integral")
        elements = both.model.chain.elements
        if np.any(np.abs(both.model.elongation()) >= elements.slip_angle):
            slipped.add("gear")
        if np.any(np.abs(both.model.presliding()) >= whole):
            slipped.add("motor")
    ended = both.model.deflection(), both.model.motor_angle()
    assert max(np.abs(b - a).max() for a, b in zip(began, ended, strict=True)) > 1e-5
    assert slipped == {"gear", "motor"}


@pytest.mark.parametrize(("seed", "joints"), [(5, 3), (8, 4)])
def test_errors_of_slipping_motors_follow_the_tolerance(tmp_path, seed, joints):
    """The TCP's, against Python, within a hundredth of it; ten times less for a hundredth of it."""
    rng = np.random.default_rng(seed)
    robot = driven(make_robot(seed, joints), rng)
    q, forces = rng.uniform(-0.5, 0.5, joints), rng.normal(size=(6, 3)).repeat(5, axis=0) * 400.0
    tolerances = (1e-6, 1e-7, 1e-8, 1e-9)
    both = Both(robot, tmp_path, q, "servo", tolerances=tolerances, exact=1e-10)
    paths = [both.of_all("tcp")]
    for force in forces:
        both.step(4e-3, q, 0.0 * q, [*force, 0.0, 0.0, 0.0])
        paths.append(both.of_all("tcp"))
    found, exact = (np.array(path)[..., :3] for path in zip(*paths, strict=True))
    errors = np.abs(found - exact[:, None]).max(axis=(0, 2))
    assert np.all(errors < 1e-2 * np.array(tolerances))
    assert errors[2] < 0.1 * errors[0]
    assert np.ptp(exact, axis=0).max() > 1e-4


def beyond_the_limits(seed: int, joints: int, limit: float, folder, **options) -> Both:
    """A random weightless robot whose servos have a torque limit [N m], in both."""
    robot = limited(driven(make_robot(seed, joints), np.random.default_rng(seed)), limit)
    robot = replace(robot, gravity=(0.0, 0.0, 0.0))
    return Both(robot, folder, np.zeros(joints), "servo", **options)


@pytest.mark.parametrize(
    ("seed", "curve", "limit", "jump", "force"),
    [
        (5, "linear", 100.0, 0.01, 0.0),
        (8, "backlash", 100.0, 0.01, 0.0),
        (11, "backlash", 60.0, 0.002, 200.0),
    ],
)
def test_servos_at_their_limits_move_as_in_python(tmp_path, seed, curve, limit, jump, force):
    """Torques stay at their limits, leave them and are kept there: to a fiftieth of any tolerance."""
    joints, at_limit, tolerances = 4 if force else 3, [], (1e-6, 1e-8, 1e-10)
    both = beyond_the_limits(
        seed, joints, limit, tmp_path, curve=curve, tolerances=tolerances, exact=1e-11
    )
    for k in range(40):
        wrench = force * np.array([np.sin(0.7 * k), 0.0, np.cos(0.3 * k), 0.0, 0.0, 0.0])
        both.step(4e-3, np.full(joints, jump * (k < 20)), np.zeros(joints), wrench)
        both.require_same(2e-2 * np.array(tolerances), "deflection", "motor_angle")
        at_limit.append(np.abs(both.model.motor_torque()) > limit * (1.0 - 1e-9))
    assert 0.05 < np.mean(at_limit) < 0.95


@pytest.mark.parametrize("seed", [4, 9])
def test_robots_that_their_motors_cannot_hold_fall_as_in_python(tmp_path, seed):
    """Half a radian from their commands links weigh otherwise than at these."""
    robot = limited(driven(make_robot(seed, 3), np.random.default_rng(seed)), 20.0)
    q = np.array([0.3, -0.2, 0.4])
    both = Both(robot, tmp_path, q, "servo", tolerances=(1e-8,), exact=1e-10)
    for _ in range(36):
        both.step(12e-3, q, 0.0 * q, [0.0, 0.0, -400.0, 0.0, 0.0, 0.0])
    both.require_same(1e-8, "deflection", "motor_angle")
    command = [q[int(name[-2]) - 1] for name in both.names["motor_angle"]]
    assert np.abs(both.model.motor_angle() - command).max() > 0.3


def test_a_servo_follows_late_by_rate_over_gain(tmp_path):
    """At a constant rate v q stays v / Kv behind, friction and all; nothing with feed-forward."""
    behind = []
    for feed_forward in (0.0, 1.0):
        drive = Drive(
            10.0, **LOOPS, integral_gain=1e5, feed_forward=feed_forward, friction=20.0, viscous=5.0
        )
        folder = tmp_path / str(feed_forward)
        folder.mkdir()
        fmu = built(one_joint(drive), folder)
        slave = fmu.start(fmu.slave(), [0.0], drive="servo")
        rate, step = 0.2, 0.01
        for k in range(200):
            fmu.set(slave, {"q_cmd[1]": rate * k * step, "qd_cmd[1]": rate})
            slave.doStep(k * step, step)
        behind.append(200 * step * rate - fmu.get(slave, "motor_angle[1]")[0])
    np.testing.assert_allclose(behind, [0.2 / 20.0, 0.0], rtol=0, atol=1e-7)


def test_a_torque_turns_rotor_and_link_together(tmp_path):
    """Without gravity q'' = (tau - F) / (J + I) once friction slips; less than F moves nothing far."""
    drive = Drive(30.0, **LOOPS, friction=20.0)
    fmu = built(one_joint(drive), tmp_path)
    slave = fmu.start(fmu.slave(), [0.0], drive="torque")
    rates, step = [], 1e-3
    for k in range(3000):
        fmu.set(slave, {"torque_cmd[1]": 10.0 if k < 1000 else 100.0})
        slave.doStep(k * step, step)
        rates.append(fmu.get(slave, "motor_rate[1]", "motor_angle[1]", "motor_torque[1]"))
    rate, angle, torque = np.array(rates).T
    assert np.abs(angle[:1000]).max() < 2e-5  # the friction's slip angle
    assert set(torque) == {10.0, 100.0}
    # About the joint: 7.5 kg m^2 at the centre of mass and 10 kg at 0.5 m.
    np.testing.assert_allclose(np.diff(rate[2500:]).mean() / step, 80.0 / 40.0, rtol=1e-4)


def test_a_limited_servo_goes_on_without_winding_up(tmp_path):
    """A command too fast for it: the torque stays at its limit, the angle overshoots little."""
    drive = Drive(10.0, **LOOPS, integral_gain=2e4, torque_limit=50.0)
    fmu = built(one_joint(drive), tmp_path)
    slave = fmu.start(fmu.slave(), [0.0], drive="servo")
    found = []
    for k in range(800):
        fmu.set(slave, {"q_cmd[1]": min(0.1, 0.4 * (k + 1) * 5e-3)})
        slave.doStep(k * 5e-3, 5e-3)
        found.append(fmu.get(slave, "motor_angle[1]", "motor_torque[1]"))
    angle, torque = np.array(found).T
    assert np.abs(torque).max() == 50.0
    assert angle.max() < 0.13
    np.testing.assert_allclose(angle[-1], 0.1, rtol=0, atol=1e-6)


def test_free_motors_keep_their_energy(tmp_path):
    """Kinetic energy of links and rotors and that of the springs, without damping, to 1e-7."""
    rng = np.random.default_rng(4)
    robot = driven(make_robot(4, 3), rng)
    free = tuple(
        replace(
            j,
            damping=0.0,
            hysteresis=(),
            tilt=tuple(replace(t, damping=0.0) for t in j.tilt),
            drive=j.drive and replace(j.drive, friction=0.0, viscous=0.0),
        )
        for j in robot.joints
    )
    robot = replace(robot, joints=free, gravity=(0.0, 0.0, 0.0))
    fmu = built(robot, tmp_path)
    q, chain = rng.uniform(-0.5, 0.5, 3), build_chain(robot)
    data, stiffness = chain.model.createData(), Parameters.of(robot).stiffness
    slave = fmu.start(fmu.slave(), q, 1e-9, drive="torque", torque_curve="linear")
    m, names = chain.elastic_count, []
    for name in ("deflection", "deflection_rate"):
        names += [f"{name}[{k + 1}]" for k in range(m)]
    for name in ("motor_angle", "motor_rate"):
        names += [f"{name}[{i + 1}]" for i in range(3)]
    inertia = np.array([j.drive.inertia if j.drive else 0.0 for j in robot.joints])

    def energy() -> float:
        x, v, angle, rate = np.split(np.array(fmu.get(slave, *names)), [m, 2 * m, 2 * m + 3])
        theta, moving = chain.theta(angle, x), chain.theta(rate, v)
        links = pin.computeKineticEnergy(chain.model, data, theta, moving)
        return links + 0.5 * (inertia @ rate**2) + 0.5 * stiffness @ x**2

    for k in range(10):  # pushed, then free
        fmu.set(slave, {"force.z": 500.0 if k < 9 else 0.0, "force.x": 200.0 if k < 9 else 0.0})
        slave.doStep(k * 4e-3, 4e-3)
    before = energy()
    for k in range(10, 60):
        slave.doStep(k * 4e-3, 4e-3)
    assert before > 0.1
    np.testing.assert_allclose(energy(), before, rtol=1e-7)


def test_a_saved_state_continues_identically(tmp_path):
    """In the middle of slipping, sticking and a torque at its limit, from bytes, in another instance."""
    rng = np.random.default_rng(5)
    fmu = built(limited(driven(make_robot(5, 3), rng), 100.0), tmp_path)
    one, other = (fmu.start(fmu.slave(), np.zeros(3), drive="servo") for _ in range(2))
    names = [v.name for v in fmu.description.modelVariables if v.causality == "output"]

    def go(slave, first: int, last: int) -> list[float]:
        for k in range(first, last):
            fmu.set(slave, {"force.z": 400.0 * np.sin(0.7 * k), "q_cmd[1]": 1e-4 * k})
            slave.doStep(k * 4e-3, 4e-3)
        return fmu.get(slave, *names)

    ended = dict(zip(names, go(one, 0, 25), strict=True))
    assert 100.0 in {abs(value) for name, value in ended.items() if name.startswith("motor_torque")}
    state = one.getFMUstate()
    saved = one.serializeFMUstate(state)
    other.setFMUstate(other.deSerializeFMUstate(saved))
    assert go(one, 25, 60) == go(other, 25, 60)


def test_ideal_drives_ignore_their_motors(tmp_path):
    """The TCP to the last bit; the motor's torque has its friction beside the gear's."""
    found = []
    for name, inertia in (("light", 1e-3), ("heavy", 40.0)):
        drive = Drive(inertia, **LOOPS, friction=30.0, viscous=7.0, stribeck=0.5, stribeck_rate=0.1)
        (tmp_path / name).mkdir()
        fmu = built(one_joint(drive, gravity=9.81), tmp_path / name)
        slave = fmu.started([0.1])
        for k in range(50):
            fmu.set(slave, {"q_cmd[1]": 0.1 + 0.3 * k * 4e-3, "qd_cmd[1]": 0.3, "qdd_cmd[1]": 0.0})
            slave.doStep(k * 4e-3, 4e-3)
        found.append(fmu.get(slave, "tcp.x", "tcp.z", "gear_torque[1]"))
        lost = 1.0 - 0.5 * (1.0 - np.exp(-9.0))
        torque, gear = fmu.get(slave, "motor_torque[1]", "gear_torque[1]")
        assert torque - gear == pytest.approx(30.0 * lost + 7.0 * 0.3, rel=1e-9)
    assert found[0] == found[1]


def test_what_drives_may_not_be_is_said(tmp_path, capfd):
    """No motors, a torque at rest or along a trajectory: a sentence each."""
    plain = one_joint(Drive(1.0, **LOOPS))
    robots = {
        "with": plain,
        "without": replace(plain, joints=(replace(plain.joints[0], drive=None),)),
    }
    fmus = {}
    for name, robot in robots.items():
        (tmp_path / name).mkdir()
        fmus[name] = built(robot, tmp_path / name)
    for name, options, words in (
        ("without", {"drive": "servo"}, "no joint of the robot has a drive"),
        ("with", {"drive": "torque", "mode": "quasistatic"}, "mode dynamic and no trajectory"),
        ("with", {"drive": "fast"}, "expected one of ideal, servo, torque"),
    ):
        with pytest.raises(FMICallException):
            fmus[name].started([0.0], **options)
        assert words in capfd.readouterr().err


def test_a_spring_at_the_tool_of_a_robot_with_servos_is_the_force_that_it_makes(tmp_path):
    """That force, straight from step to step, leads the same way: second order in the step."""
    rng = np.random.default_rng(7)
    file = build_fmu(driven(make_robot(5, 3), rng), tmp_path / "R.fmu", BuildOptions("native"))
    rows = np.linspace(0.0, 0.4, 41)
    command = JointPath(rows, (0.05 * np.sin(10.0 * np.outer(rows, [1.0, 0.8, 1.3])),))
    apart = []
    with RobotFmu(file, "linear", drive="servo") as fmu:
        for steps in (400, 800):
            free = WrenchHistory.none(np.linspace(0.0, 0.4, steps + 1))
            anchor = fmu.simulate(command, free, "dynamic").position + np.array([0.0, 0.0, -1e-4])
            stiffness = np.tile(np.diag([2e5, 1e5, 3e5]), (1, steps + 1, 1, 1))
            held = replace(free, spring=ContactSpring(anchor, stiffness))
            path = simulate_tuned(fmu, command, held, "dynamic", {"tcp_tolerance": 1e-10})
            pushed = replace(held.on(path), spring=None)
            other = simulate_tuned(fmu, command, pushed, "dynamic", {"tcp_tolerance": 1e-10})
            apart.append(np.abs(path.position - other.position).max())
    assert pushed.peak_force > 10.0
    assert apart[0] / apart[1] == pytest.approx(4.0, rel=0.1)
    assert apart[1] < 1e-7


def test_a_row_of_the_command_hardly_behind_a_step_stops_no_motor(tmp_path):
    """Slivers of a step, in which an angle's rounding is more than its motion, show no reversals."""
    time = 0.004 * np.arange(60)
    angle = 0.3 + np.cumsum(np.append(0.0, np.random.default_rng(4).uniform(1e-3, 3e-3, 59)))
    file = tmp_path / "command.npz"
    np.savez(file, columns=["time", "q1"], data=np.column_stack([time, angle]))
    drive = Drive(10.0, **LOOPS, integral_gain=1e5, friction=20.0)
    fmu, ends = built(one_joint(drive), tmp_path), []
    for step in (lambda t: t, lambda t: np.nextafter(t, 0.0)):
        slave = fmu.start(fmu.slave(), [0.3], 1e-9, drive="servo", trajectory=str(file))
        places = [0.0, *(float(step(t)) for t in time[1:-5])]
        for begin, end in itertools.pairwise(places):
            slave.doStep(begin, end - begin)
        ends.append(fmu.get(slave, "motor_angle[1]")[0])
    assert ends[0] > 0.35
    assert ends[0] == pytest.approx(ends[1], abs=1e-10)

"""Random robots, with hysteresis, gear errors and balancers: the core against the model in Python."""

from dataclasses import replace

import numpy as np
import pytest
from native_core import CURVES, Core, CoreError
from native_derivatives import random_stiffness
from native_fmu import NativeFmu
from native_motors import Both, built, geared, one_joint
from pendulum import held
from random_robots import driven, hardly_loaded, make_robot, with_gear_parts, with_hysteresis
from touching import entries

from elastic_robot.description import Robot
from elastic_robot.drive import Drive
from elastic_robot.errors import EquilibriumError
from elastic_robot.gear_parts import KinematicError, StopElement
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import ContactSpring, Load, symmetric

UP = np.array([0.0, 0.0, 1.0])
DEGREE = np.pi / 180.0


def require_same(python: ElasticRobot, core: Core) -> None:
    """Compare all outputs at rest."""
    out = core.outputs(python.chain.elastic_count)
    expected = {"x": python.deflection()}
    expected |= {name: getattr(python, name)() for name in ("tcp", "rigid", "deviation")}
    for name, values in expected.items():
        np.testing.assert_allclose(out[name], values, rtol=0, atol=1e-12, err_msg=name)
    upper = python.compliance()[np.triu_indices(3)]
    scale = np.abs(upper).max()
    np.testing.assert_allclose(out["compliance"], upper, rtol=1e-8, atol=1e-7 * scale)


def loads(robot: ElasticRobot, rng: np.random.Generator) -> list[Load]:
    """Wrenches, alone, with a spring at the TCP, and with a plane there; anchors that move."""
    wrench, found = rng.normal(size=6) * 300.0, []
    for k in range(6):
        place = robot.tcp()[:3] + 1e-4 * rng.normal(size=3)
        stiffness = symmetric(random_stiffness(rng)) * (k % 3 == 1)
        plane = PlaneContact(1e6 * (k % 3 == 2), 0.0, 0.0, 0.0, 1e-3, UP)
        anchor = ContactSpring(place, 1e-4 * rng.normal(size=3), stiffness)
        found.append(Load(wrench * rng.uniform(-2.0, 2.0), anchor, contact=plane))
    return found


@pytest.mark.parametrize("has_elements", [False, True])
@pytest.mark.parametrize("kind", CURVES)
def test_random_robots_rest_as_in_python(kind, has_elements):
    """One equilibrium after another, upright and unloaded gears among them.

    Where Python finds none the core finds none.
    """
    for seed in range(28):
        rng, robot = np.random.default_rng(seed), make_robot(seed, 1 + seed % 8)
        robot = with_hysteresis(robot, seed) if has_elements else robot
        n = len(robot.joints)
        q = hardly_loaded(rng, n)[0] if seed % 2 else rng.uniform(-3.0, 3.0, n)
        python, core = ElasticRobot(robot, kind, quasistatic=True), Core(robot)
        python.reset(0.0, held(q), Load())
        core.reset(kind, 0.0, q, np.zeros(6), quasistatic=True)
        for k, load in enumerate(loads(python, rng), start=1):
            try:
                python.step(float(k), held(q), load)
            except EquilibriumError:
                with pytest.raises(CoreError, match="no static equilibrium"):
                    core.step(float(k), q, entries(load))
                break
            core.step(float(k), q, entries(load))
            require_same(python, core)


@pytest.mark.parametrize("plain", [True, False])
@pytest.mark.parametrize("has_elements", [False, True])
@pytest.mark.parametrize("kind", CURVES)
def test_random_robots_move_as_in_python(kind, has_elements, plain):
    """A force comes and goes; a spring takes hold, is stiffened, jumps and lets go, its anchor moving.

    At a tolerance of 1e-9 m at the TCP.
    """
    for seed in range(1 + plain, 8, 3):
        rng, robot = np.random.default_rng(seed), make_robot(seed, 1 + seed % 8)
        robot = with_hysteresis(robot, seed) if has_elements else robot
        q, wrench = rng.uniform(-2.0, 2.0, len(robot.joints)), rng.normal(size=6) * 300.0
        python, core = ElasticRobot(robot, kind, tolerance=1e-9), Core(robot, plain)
        python.reset(0.0, held(q), Load())
        core.reset(kind, 0.0, q, np.zeros(6), tolerance=1e-9)
        k, anchor = random_stiffness(rng), python.tcp()[:3] + 1e-4 * rng.normal(size=3)
        sprung = seed % 2
        for end, factor in ((0.003, 1.0), (0.007, 1.0), (0.02, 1.5), (0.021, 0.1), (0.06, 0.0)):
            velocity = 0.05 * rng.normal(size=3)
            spring = ContactSpring(anchor, velocity, symmetric(sprung * factor * k))
            load, length = Load(wrench * (factor != 0.1), spring), end - python.time
            python.step(end, held(q), load)
            core.step(end, q, entries(load))
            anchor = anchor + length * velocity
            out = core.outputs(python.chain.elastic_count)
            np.testing.assert_allclose(out["x"], python.deflection(), rtol=0, atol=1e-9)
            np.testing.assert_allclose(out["velocity"], python.velocity(), rtol=0, atol=1e-6)


@pytest.mark.parametrize(("kind", "parts"), [("backlash", (1.0,)), ("spline", (0.5, 1.5))])
def test_slip_angles_on_the_edge_of_the_backlash_are_passed_with_it(example, kind, parts):
    """From the undeflected gear an element slips and its curve bends at one moment: both are seen."""
    joints = tuple(
        replace(j, hysteresis=tuple(StopElement(40.0, part * j.backlash) for part in parts))
        if j.backlash > 0.0
        else j
        for j in example.joints
    )
    robot = replace(example, joints=joints)
    q = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
    python = ElasticRobot(robot, kind, tolerance=1e-8)
    python.reset(0.0, held(q), Load(), undeflected=True)
    core = Core(robot)
    core.reset(kind, 0.0, q, np.zeros(6), tolerance=1e-8, undeflected=True)
    for k in range(30):
        wrench = np.array([300.0 * np.sin(1.1 * k), 0.0, 1500.0 * np.sin(0.5 * k), 0.0, 0.0, 0.0])
        end = 4e-3 * (k + 1)
        python.step(end, held(q), Load(wrench))
        core.step(end, q, wrench)
        out = core.outputs(python.chain.elastic_count)
        np.testing.assert_allclose(out["tcp"], python.tcp(), rtol=0, atol=1e-8)


def command(fmu: NativeFmu, slave, q: np.ndarray, rate: np.ndarray) -> None:
    fmu.set(slave, {f"q_cmd[{i + 1}]": value for i, value in enumerate(q)})
    fmu.set(slave, {f"qd_cmd[{i + 1}]": value for i, value in enumerate(rate)})


@pytest.mark.parametrize(("load_friction", "most"), [(False, 1e-10), (True, 1e-8)])
@pytest.mark.parametrize("drive", ["servo", "torque"])
@pytest.mark.parametrize(("seed", "joints"), [(3, 2), (8, 4)])
def test_gears_and_motors_move_as_in_python(tmp_path, seed, joints, drive, load_friction, most):
    """Turning motors under force steps.  Friction with the load bends where the torque changes its sign,
    which ends no step: to ten times the tolerance of 1e-9 m at a metre."""
    rng = np.random.default_rng(seed)
    robot = geared(driven(make_robot(seed, joints), rng), rng, load_friction)
    start, rate = rng.uniform(-0.5, 0.5, joints), rng.uniform(-1.0, 1.0, joints)
    rate *= drive == "servo"
    both = Both(robot, tmp_path, start, drive)
    motors = len(both.names["torque_cmd"])
    for _ in range(10):
        force, torque = rng.normal(size=3) * 400.0, rng.normal(size=motors) * 100.0
        both.step(4e-3, start + rate * both.time, rate, [*force, 0.0, 0.0, 0.0], torque)
        both.require_same(most, "deflection", "motor_angle", "elongation", "presliding")
    turned = np.abs(both.model.motor_angle() - start).max() * 200.0  # of the errors of high order
    assert turned > (0.3 if drive == "servo" else 0.02)


def losing(seed: int) -> Robot:
    """With errors, balancers, and motors whose friction grows with the load in all gears."""
    robot = with_gear_parts(make_robot(seed, 1 + seed % 6), seed)
    drive = Drive(20.0, 20.0, 2e3, friction=10.0, load_friction=0.1)
    joints = (replace(j, drive=drive if j.stiffness else None) for j in robot.joints)
    return replace(robot, joints=tuple(joints))


@pytest.mark.parametrize("mode", ["dynamic", "quasistatic"])
@pytest.mark.parametrize("curve", ["linear", "backlash"])
@pytest.mark.parametrize("seed", [1, 2, 4, 5])
def test_behind_ideal_drives_they_tell_the_same_as_in_python(tmp_path, seed, curve, mode):
    """Poses and angles to 1e-9, rates and torques to 1e-6 of the largest, over commanded steps."""
    robot, rng = losing(seed), np.random.default_rng(seed)
    q0, rate, bend = rng.uniform(-0.5, 0.5, (3, len(robot.joints))) * [[1.0], [1.0], [4.0]]
    both = Both(robot, tmp_path, q0, "ideal", curve, (1e-8,), 1e-8, mode)
    for _ in range(5):
        t = both.time
        both.step(4e-3, q0 + rate * t + 0.5 * bend * t**2, rate + bend * t, qdd=bend)
        both.require_same(1e-9, "tcp", "rigid", "deviation", "deflection")
        both.require_same(1e-9, "motor_angle", "motor_rate")
        for block in ("velocity", "gear_torque", "motor_torque"):
            size = np.abs(both.of_all(block)[1]).max(initial=1e-3)
            both.require_same(1e-6 * size, block)


@pytest.mark.parametrize("mode", ["dynamic", "quasistatic"])
def test_ideal_drives_turn_their_links_by_the_errors_of_their_gears(tmp_path, mode):
    """Without loads a stiff arm is at q + eps(q); the rigid one, and what motors tell, at q."""
    errors = (KinematicError(2e-3, 3.0, 0.4), KinematicError(1e-3, 7.0))
    own = one_joint(Drive(10.0, position_gain=20.0, rate_gain=2e3), stiffness=1e12)
    robot = replace(own, joints=(replace(own.joints[0], kinematic_error=errors, damping=1e7),))
    fmu = built(robot, tmp_path)
    slave = fmu.start(fmu.slave(), [0.3], mode=mode)
    rate, step = 1.0, 1e-2
    for k in range(50):
        command(fmu, slave, np.array([0.3 + rate * k * step]), np.array([rate]))
        slave.doStep(k * step, step)
        q = 0.3 + rate * (k + 1) * step
        turned = q + 2e-3 * np.sin(3.0 * q + 0.4) + 1e-3 * np.sin(7.0 * q)
        x, z, rigid_x, rigid_z = fmu.get(slave, "tcp.x", "tcp.z", "rigid.x", "rigid.z")
        assert np.arctan2(-z, x) == pytest.approx(turned, abs=1e-8)
        assert np.arctan2(-rigid_z, rigid_x) == pytest.approx(q, abs=1e-12)
        assert fmu.get(slave, "motor_angle[1]")[0] == pytest.approx(q, abs=1e-12)


def test_a_balancer_against_the_weight_leaves_its_gear_without_torque(tmp_path):
    """Of an arm with m g l cos(q); a cubic through points every 2 degrees is that to 1e-6 of it."""
    angles = np.arange(-80.0, 82.0, 2.0) * DEGREE
    weight = 10.0 * 9.81 * 0.5
    table = tuple(zip(angles, -weight * np.cos(angles), strict=True))
    bare = one_joint(Drive(10.0, position_gain=20.0, rate_gain=2e3), gravity=9.81)
    arm = replace(bare, joints=(replace(bare.joints[0], balancer=table),))
    torques = {}
    for name, robot in (("bare", bare), ("balanced", arm)):
        folder = tmp_path / name
        folder.mkdir()
        fmu = built(robot, folder)
        torques[name] = []
        for q in np.array([-60.0, -31.0, 0.5, 44.0]) * DEGREE:
            slave = fmu.start(fmu.slave(), [q])
            torques[name].append(fmu.get(slave, "gear_torque[1]")[0])
    assert np.abs(torques["bare"]).max() > 0.9 * weight
    np.testing.assert_allclose(torques["balanced"], 0.0, atol=1e-6 * weight)


def test_friction_with_the_load_is_what_a_motor_needs_beside_it(tmp_path):
    """At a constant rate a motor that lifts has tau = T (1 + mu), one that lowers T (1 - mu)."""
    drive = Drive(10.0, 20.0, 2e3, 1e5, friction=1e-9, slip_angle=1e-5, load_friction=0.1)
    fmu = built(one_joint(drive, gravity=9.81), tmp_path)
    for kind in ("ideal", "servo"):
        for sign in (1.0, -1.0):
            slave = fmu.start(fmu.slave(), [-0.1 * sign], 1e-9, drive=kind)
            rate, step = sign * 0.05, 4e-3
            for k in range(500):
                q = -0.1 * sign + rate * k * step
                command(fmu, slave, np.array([q]), np.array([rate]))
                slave.doStep(k * step, step)
            torque, motor = fmu.get(slave, "gear_torque[1]", "motor_torque[1]")
            # q turns about y: downwards for positive angles, where the gear holds against the weight.
            assert motor == pytest.approx(torque + 0.1 * abs(torque) * sign, rel=1e-4)
            assert abs(torque) > 40.0

"""What gears and motors carry, and how the tool turns, against inverse dynamics by Pinocchio."""

import numpy as np
import pinocchio as pin
import pytest
from native_fmu import NativeFmu
from random_robots import make_robot
from scipy.spatial.transform import Rotation

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.exchange_blocks import all_blocks
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.torque_curves import TORQUE_CURVES
from elastic_robot.trajectory import HeldCommand

WRENCH = np.array([300.0, -200.0, 500.0, 20.0, 30.0, -10.0])


def drive_torques(robot: Robot, rows: dict[str, np.ndarray], wrench: np.ndarray) -> np.ndarray:
    """Torque that every gear needs for a motion, by recursive Newton-Euler [N m], (torsions,)."""
    chain = build_chain(robot)
    data = chain.model.createData()
    motion = [
        chain.theta(rows[q], rows[x])
        for q, x in (
            ("motor_angle", "deflection"),
            ("motor_rate", "deflection_rate"),
            ("motor_acceleration", "rate_derivative"),
        )
    ]
    torque = pin.rnea(chain.model, data, *motion)
    jacobian = pin.computeFrameJacobian(
        chain.model, data, motion[0], chain.tcp, pin.LOCAL_WORLD_ALIGNED
    )
    needed: np.ndarray = (torque - jacobian.T @ wrench)[chain.elastic[chain.torsions]]
    return needed


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("curve", TORQUE_CURVES)
def test_gears_and_motors_carry_what_the_links_need(tmp_path, seed, curve):
    """In motion, on robots of two to seven joints, some rigid.

    The accelerations are central differences of the model's rates, so that no torque is in them.
    """
    robot = make_robot(seed, 2 + seed)
    n = len(robot.joints)
    fmu = NativeFmu(build_fmu(robot, tmp_path / "R.fmu", BuildOptions("native")), tmp_path / "fmu")
    names = {key: [v.name for v in block.variables] for key, block in all_blocks(robot).items()}
    of = {key: fmu.of(names[key]) for key in names if key != "strings"}
    slave = fmu.slave()
    slave.setupExperiment(startTime=0.0)
    slave.setReal(of["tolerance"], [1e-9])
    slave.setString(fmu.of(names["strings"]), ["", curve, "dynamic", "equilibrium", "ideal"])
    slave.enterInitializationMode()
    slave.setReal(of["q_cmd"], [0.3] * n)
    slave.exitInitializationMode()
    acceleration = np.linspace(1.0, 2.0, n)
    slave.setReal(of["qdd_cmd"], acceleration.tolist())
    slave.setReal(of["wrench"], WRENCH.tolist())
    slave.doStep(0.0, 0.01)
    rows = {key: np.array(slave.getReal(of[key])) for key in of if of[key]}
    slave.terminate()
    slave.freeInstance()

    model, rest, none = ElasticRobot(robot, curve, tolerance=1e-9), np.full(n, 0.3), np.zeros(n)
    model.reset(0.0, HeldCommand(0.0, rest, none, none), Load())
    rates, torque, h = [], none, 1e-5
    for k in (-1, 0, 1):
        model.step(0.01 + k * h, HeldCommand(0.0, rest, none, acceleration), Load(WRENCH))
        rates.append(model.deflection_rate())
        torque = model.gear_torque() if k == 0 else torque
    rows["rate_derivative"] = (rates[2] - rates[0]) / (2.0 * h)
    rows["motor_acceleration"] = acceleration
    needed = drive_torques(robot, rows, WRENCH)
    for found in (rows["gear_torque"], torque):
        np.testing.assert_allclose(found, needed, rtol=0, atol=1e-5 * abs(needed).max())
    np.testing.assert_allclose(rows["gear_torque"], torque, rtol=0, atol=1e-6 * abs(needed).max())
    assert rows["motor_torque"].tolist() == rows["gear_torque"].tolist()
    np.testing.assert_allclose(rows["motor_rate"], 0.01 * acceleration, rtol=1e-12)
    np.testing.assert_allclose(rows["motor_angle"], 0.3 + 0.5e-4 * acceleration, rtol=1e-12)


@pytest.mark.parametrize("quasistatic", [False, True])
def test_at_rest_a_gear_holds_weight_and_wrench(example, quasistatic):
    """The model in Python; quasi-static robots turn no damper, however fast their drives are."""
    robot = ElasticRobot(example, quasistatic=quasistatic)
    q, rate = np.array([0.1, -0.4, 0.6, 0.2, 0.5, 0.3]), np.ones(6)
    robot.reset(0.0, HeldCommand(0.0, q, np.zeros(6), np.zeros(6)), Load(WRENCH))
    if quasistatic:
        robot.step(0.1, HeldCommand(0.0, q, rate, np.zeros(6)), Load(WRENCH))
    rows = {"motor_angle": robot.motor_angle(), "deflection": robot.deflection()}
    none = {"deflection_rate": 0.0 * rows["deflection"], "motor_rate": np.zeros(6)}
    rows |= none | {"rate_derivative": none["deflection_rate"], "motor_acceleration": np.zeros(6)}
    needed = drive_torques(example, rows, WRENCH)
    np.testing.assert_allclose(robot.gear_torque(), needed, atol=1e-7)
    assert robot.motor_torque().tolist() == robot.gear_torque().tolist()
    assert robot.motor_rate().tolist() == (rate * quasistatic).tolist()


def test_the_tool_turns_as_its_orientation_does(example):
    """Central difference over two steps of 0.1 ms: to what the third derivative leaves."""
    robot = ElasticRobot(example, "linear", tolerance=1e-9)
    q, rate = np.array([0.1, -0.4, 0.6, 0.2, 0.5, 0.3]), np.array([1.0, -0.5, 0.7, 2.0, -1.0, 3.0])
    drives = HeldCommand(0.0, q, rate, np.zeros(6))
    robot.reset(0.0, drives, Load(WRENCH))
    poses, spin = [], np.zeros(3)
    for k in range(3):
        robot.step(0.1 + 1e-4 * k, drives, Load(WRENCH))
        poses.append(Rotation.from_quat(robot.tcp()[3:]))
        spin = robot.velocity()[3:] if k == 1 else spin
    np.testing.assert_allclose((poses[2] * poses[0].inv()).as_rotvec() / 2e-4, spin, atol=1e-5)
    assert np.linalg.norm(spin) > 1.0

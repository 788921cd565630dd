"""Derivatives of the states and how they follow everything, against Python and finite differences."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from exchange import DERIVATIVES, STATES, Exchange, exchange_of
from exchanged_robot import ExchangedRobot
from fmpy.fmi2 import FMU2Slave
from native_derivatives import random_stiffness
from random_robots import make_robot

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.kinematics import base_from_tool
from elastic_robot.parameters import Parameters
from elastic_robot.residual import OperatingPoint, residual, residual_derivatives
from elastic_robot.tool_load import Load, ToolLoad, symmetric
from elastic_robot.torque_curves import TORQUE_CURVES
from elastic_robot.trajectory import HeldCommand

CURVES = tuple(TORQUE_CURVES)
INPUTS = ("wrench", "q_cmd", "qd_cmd", "qdd_cmd", "anchor", "anchor_velocity", "anchor_stiffness")
IDENTITY = np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0])


class Setting:
    """A random robot at a random state under random inputs, in the FMU and as arrays."""

    def __init__(self, seed: int, joints: int, curve: str, sprung: bool, folder: Path) -> None:
        rng = np.random.default_rng(seed)
        self.robot, self.curve = make_robot(seed, joints), curve
        self.chain = build_chain(self.robot)
        m, n = self.chain.elastic_count, joints
        # Gears inside their backlash and on both flanks.
        self.state = np.concatenate([3e-4 * rng.normal(size=m), 0.1 * rng.normal(size=m)])
        drives = rng.normal(size=(3, n)) * [[1.5], [0.5], [2.0]]
        theta = self.chain.theta(drives[0])
        tool = base_from_tool(self.chain, self.chain.model.createData(), theta).translation
        self.inputs = {
            "wrench": rng.normal(size=6) * ([1e3] * 3 + [1e2] * 3),
            "q_cmd": drives[0],
            "qd_cmd": drives[1],
            "qdd_cmd": drives[2],
            "anchor": tool + 1e-3 * rng.normal(size=3),
            "anchor_velocity": rng.normal(size=3),
            "anchor_stiffness": random_stiffness(rng) * sprung,
        }
        self.exchange = exchange_of(self.robot, folder)
        self.exchange.start(np.zeros(n), torque_curve=curve, initial_state="undeflected")
        for name, values in self.inputs.items():
            self.exchange.set(name, values)
        self.exchange.state = self.state

    def point(self, acceleration: np.ndarray) -> OperatingPoint:
        inputs, m = self.inputs, self.chain.elastic_count
        x, v = self.state[:m], self.state[m:]
        acting = ToolLoad(inputs["wrench"], inputs["anchor"], symmetric(inputs["anchor_stiffness"]))
        drives = np.stack([inputs["q_cmd"], inputs["qd_cmd"], inputs["qdd_cmd"]])
        region = TORQUE_CURVES[self.curve].build(Parameters.of(self.robot)).region(x)
        return OperatingPoint(drives, np.stack([x, v, acceleration]), acting, region)

    def model(self) -> tuple[Dynamics, object, np.ndarray]:
        parameters = Parameters.of(self.robot)
        curve = TORQUE_CURVES[self.curve].build(parameters)
        return Dynamics(self.chain, parameters.gravity), curve, parameters.damping


@pytest.mark.parametrize("seed", range(16))
def test_accelerations_and_their_jacobians_solve_the_equation_of_motion_of_python(tmp_path, seed):
    """Random robots of 1 to 8 joints, all curves, with and without a spring: to 1e-12 of its terms."""
    given = Setting(seed, 1 + seed % 8, CURVES[seed % 3], seed % 2 == 0, tmp_path)
    m = given.chain.elastic_count
    found = given.exchange.derivatives()
    np.testing.assert_array_equal(found[:m], given.state[m:])
    model, point = given.model(), given.point(found[m:])
    by = residual_derivatives(*model, point)
    still = replace(point, motion=point.motion * [[1.0], [1.0], [0.0]])
    terms = np.abs(by.acceleration @ found[m:]), np.abs(residual(*model, still))
    scale = max(float(np.max(term, initial=1.0)) for term in terms)
    np.testing.assert_allclose(residual(*model, point), 0.0, rtol=0, atol=1e-12 * scale)

    expected = {
        "deflection": by.x,
        "deflection_rate": by.rate,
        "wrench": by.wrench,
        "q_cmd": by.drive,
        "qd_cmd": by.drive_rate,
        "qdd_cmd": by.drive_acceleration,
        "anchor": by.anchor,
        "anchor_velocity": np.zeros((m, 3)),
        "anchor_stiffness": by.spring,
    }
    for name, column in expected.items():
        jacobian = given.exchange.jacobian(DERIVATIVES, name)
        rate = np.eye(m) if name == "deflection_rate" else np.zeros((m, column.shape[1]))
        np.testing.assert_array_equal(jacobian[:m], rate)
        scale = np.max(np.abs(column), initial=1e-300)
        left = by.acceleration @ jacobian[m:] + column
        np.testing.assert_allclose(left, 0.0, rtol=0, atol=1e-12 * scale, err_msg=name)
    assert not given.exchange.jacobian(DERIVATIVES, "time").any()


def test_derivatives_by_time_follow_the_trajectory(tmp_path, example):
    """Central differences within a piece of the motion; commands do nothing along it."""
    time = np.linspace(0.0, 1.0, 6)
    rows = np.column_stack([time, *(np.sin((1.0 + i) * time + i) for i in range(6))])
    path = tmp_path / "motion.csv"
    header = "time,q1,q2,q3,q4,q5,q6"
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.17g")
    exchange = exchange_of(example, tmp_path).start(trajectory=str(path), torque_curve="linear")
    exchange.state = 1e-3 * np.random.default_rng(1).normal(size=exchange.states)
    unknowns = ("tcp", "velocity", "rigid", "deviation", "motor_angle", "motor_rate", *DERIVATIVES)
    at, steps, slopes = 0.33, (2e-4, 1e-4), []
    for step in steps:
        values = []
        for moment in (at + step, at - step):
            exchange.fmu.setTime(moment)
            values.append(exchange.get(*unknowns))
        slopes.append((values[0] - values[1]) / (2.0 * step))
    exchange.fmu.setTime(at)
    assert exchange.get("time") == [at]
    expected = (4.0 * slopes[1] - slopes[0]) / 3.0
    found = exchange.jacobian(unknowns, "time")[:, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8)
    assert np.abs(found[-11:]).min() > 1e-3
    for name in ("q_cmd", "qd_cmd", "qdd_cmd"):
        assert not exchange.jacobian(unknowns, name).any()


def test_what_arrays_are_declared_to_follow_is_all_that_they_do(pair, example):
    """Outputs, derivatives and event indicators by inputs, states and time, from their Jacobians."""
    exchange = Exchange(example, pair.folder2).start(torque_curve="spline")
    rng = np.random.default_rng(0)
    for name in INPUTS[:5]:
        exchange.set(name, rng.normal(size=len(exchange.references[name])))
    exchange.set("anchor_stiffness", 1e5 * IDENTITY)
    exchange.state = 1e-2 * rng.normal(size=22)
    description = pair.description
    listed = [*description.outputs, *description.derivatives, *description.eventIndicators]
    elements = {v.valueReference: int(np.prod(v.shape or 1)) for v in description.modelVariables}
    followed = 0
    for unknown in listed:
        reference = unknown.variable.valueReference
        asked = list(range(reference, reference + elements[reference]))
        declared = {d.valueReference for d in unknown.dependencies}
        for known in description.modelVariables:
            first = known.valueReference
            is_state = known.name.split("[")[0] in STATES
            if first in declared or not (known.causality == "input" or is_state):
                continue
            knowns = list(range(first, first + elements[first]))
            found = exchange.fmu.getDirectionalDerivative(asked, knowns, [1.0] * len(knowns))
            assert not np.any(found), f"{unknown.variable.name} by {known.name}"
            followed += 1
    assert followed > 50


def _tabled(robot: Robot) -> Robot:
    """The first elastic joint on a table of its own: uneven knots, none of them bent twice."""
    place = next(i for i, joint in enumerate(robot.joints) if joint.stiffness is not None)
    joint = robot.joints[place]
    angle = 1e-4 * np.array([-4.0, -2.5, -1.0, 0.2, 1.1, 3.0, 5.0])
    torque = joint.stiffness * (angle + 2e3 * angle**2 * np.sign(angle))
    table = tuple(zip(angle.tolist(), torque.tolist(), strict=True))
    tabled = replace(joint, torque_table=table)
    return replace(robot, joints=(*robot.joints[:place], tabled, *robot.joints[place + 1 :]))


@pytest.mark.parametrize("curve", CURVES)
def test_rates_accelerations_and_ways_to_bends_are_those_of_python(tmp_path, curve):
    """In co-simulation, after steps under a force that starts the robot: one contract for both kinds."""
    robot = _tabled(make_robot(12, 4))
    exchange = exchange_of(robot, tmp_path)
    slave = FMU2Slave(
        guid=exchange.description.guid,
        unzipDirectory=str(exchange.folder),
        modelIdentifier="ElasticRobot",
        instanceName="robot",
    )
    slave.instantiate()
    slave.setupExperiment()
    slave.setReal(exchange.references["tolerance"], [1e-10])
    slave.setString([exchange.strings["torque_curve"]], [curve])
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    model = ExchangedRobot(robot, curve, tolerance=1e-10)
    rest, wrench = HeldCommand(0.0, *np.zeros((3, 4))), np.array([3e2, -2e2, 1e2, 0.0, 10.0, 0.0])
    model.reset(0.0, rest, Load())
    slave.setReal(exchange.of("wrench"), wrench.tolist())
    for k in range(5):
        slave.doStep(0.004 * k, 0.004)
        model.step(0.004 * (k + 1), rest, Load(wrench))
        for name, scale in (("deflection_rate", 1e-7), ("deflection_derivative", 1e-7)):
            found = slave.getReal(exchange.of(name))
            np.testing.assert_allclose(found, getattr(model, name)(), rtol=0, atol=scale)
        expected = model.rate_derivative()
        found = np.array(slave.getReal(exchange.of("rate_derivative")))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
        ways = slave.getReal(exchange.of("bend"))
        np.testing.assert_allclose(ways, model.bend().ravel(), rtol=0, atol=1e-9)
    assert np.abs(found).max() > 0.1
    assert (np.min(ways) < 1.0) == (curve != "linear")


def test_the_initial_state_and_its_outputs_are_those_of_co_simulation(tmp_path, example):
    """The equilibrium of Python, at rest, to the solver's rounding."""
    load = np.array([200.0, -150.0, -1000.0, 10.0, 20.0, -5.0])
    exchange = exchange_of(example, tmp_path)
    exchange.fmu.enterInitializationMode()
    q = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
    exchange.set("q_cmd", q)
    exchange.set("wrench", load)
    exchange.set("qdd_cmd", [0.5] * 6)
    state, accelerations = exchange.state, exchange.derivatives()[11:]
    exchange.fmu.exitInitializationMode()
    np.testing.assert_array_equal(exchange.state, state)
    robot = ExchangedRobot(example)
    robot.reset(0.0, HeldCommand(0.0, q, np.zeros(6), np.full(6, 0.5)), Load(load))
    np.testing.assert_allclose(state[:11], robot.deflection(), rtol=0, atol=1e-15)
    assert not state[11:].any()
    np.testing.assert_allclose(exchange.get("tcp"), robot.tcp(), rtol=0, atol=1e-14)
    expected = robot.rate_derivative()
    np.testing.assert_allclose(accelerations, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    np.testing.assert_array_equal(exchange.nominals(), [1e-3] * 11 + [5e-2] * 11)

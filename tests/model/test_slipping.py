"""Hysteresis of the gears in motion: exact motion of one joint, energy, limits, derivatives, states."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from exchanged_robot import ExchangedRobot
from pendulum import held, pendulum
from random_robots import make_robot, with_hysteresis

from elastic_robot.description import Robot
from elastic_robot.gear_parts import StopElement
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

ELEMENTS = (StopElement(40.0, 2e-5), StopElement(50.0, 6e-5), StopElement(30.0, 15e-5))
FORCE, ANGLE = (
    np.array([getattr(element, key) for element in ELEMENTS])
    for key in ("slip_torque", "slip_angle")
)
STIFFNESS, INERTIA = 1e6, 50.0  # [N m/rad, kg m^2] of the pendulum


def moment(torque: float) -> Load:
    return Load(np.array([0.0, 0.0, 0.0, 0.0, torque, 0.0]))


class ExactGear:
    """A body on a spring and elements, without damping: cosines between the events, in closed form."""

    def __init__(self, x: float) -> None:
        self.x, self.v, self.s = x, 0.0, np.clip(x, -ANGLE, ANGLE)
        self.sticks = np.ones(len(ANGLE), dtype=bool)
        self.events = 0

    def advance(self, length: float, torque: float) -> None:
        """Move on by a time [s] under a torque [N m]."""
        while length > 0.0:
            length -= self._piece(length, torque)

    def _piece(self, length: float, torque: float) -> float:
        stiffness = STIFFNESS + np.sum((FORCE / ANGLE)[self.sticks])
        force = torque - STIFFNESS * self.x - np.sum(FORCE * self.s / ANGLE)
        omega, centre = np.sqrt(stiffness / INERTIA), self.x + force / stiffness
        radius = np.hypot(self.x - centre, self.v / omega)
        phase = np.arctan2(-self.v / omega, self.x - centre)
        phase = phase - 2.0 * np.pi if phase == np.pi else phase
        side = 1.0 if phase < 0.0 else -1.0
        end, first = 0.0 if side > 0.0 else np.pi, None
        for j in np.flatnonzero(self.sticks):
            reached = (self.x + side * ANGLE[j] - self.s[j] - centre) / radius
            if abs(reached) <= 1.0 and -side * np.arccos(reached) < end:
                end, first = float(-side * np.arccos(reached)), j
        time = min((end - phase) / omega, length)
        now = phase + omega * time
        x, self.v = centre + radius * np.cos(now), -radius * omega * np.sin(now)
        self.s = np.where(self.sticks, self.s + x - self.x, self.s)
        self.x = x
        if time < length:
            self.events += 1
            if first is None:  # it reverses
                self.v, self.sticks = 0.0, np.ones(len(ANGLE), dtype=bool)
            else:
                self.s[first], self.sticks[first] = side * ANGLE[first], False
        return time


@pytest.mark.parametrize("torques", [[300.0, 0.0], [700.0, -150.0, 90.0], [40.0, 500.0, -500.0]])
def test_one_joint_moves_as_its_cosines_do(torques):
    """Over some fifty slips and reversals; gear torque, acceleration and s' belong to the motion."""
    robot = ExchangedRobot(
        pendulum(gravity=(0.0, 0.0, 0.0), stiffness=STIFFNESS, hysteresis=ELEMENTS),
        "linear",
        tolerance=1e-9,
    )
    robot.reset(0.0, held([0.0]), moment(torques[0]))
    exact = ExactGear(float(robot.deflection()[0]))
    for k in range(30):
        torque = torques[1 + k // 10 % (len(torques) - 1)]
        robot.step(0.011 * (k + 1), held([0.0]), moment(torque))
        exact.advance(0.011, torque)
        assert robot.deflection()[0] == pytest.approx(exact.x, abs=1e-10)
        assert robot.deflection_rate()[0] == pytest.approx(exact.v, abs=1e-7)
        np.testing.assert_allclose(robot.elongation(), exact.s, rtol=0, atol=1e-10)
        balance = INERTIA * robot.rate_derivative() - robot.gear_torque() - torque
        assert abs(balance) < 1e-9
        rate = exact.sticks * robot.deflection_rate()
        np.testing.assert_array_equal(robot.elongation_derivative(), rate)
        way = np.where(exact.sticks, ANGLE - np.abs(robot.elongation()), 1e-3 * abs(exact.v))
        np.testing.assert_allclose(robot.slip(), way, rtol=0, atol=1e-10)
    assert exact.events > 30


def energy(robot: ExchangedRobot) -> float:
    """Return kinetic and potential energy, and that of springs and elements [J]; no backlash."""
    chain, x, s = robot.chain, robot.deflection(), robot.elongation()
    of, parameters = chain.elements, robot.parameters
    data = chain.model.createData()
    theta = chain.theta(robot.motor_angle(), x)
    rate = chain.theta(0.0 * robot.motor_angle(), robot.deflection_rate())
    total = pin.computeKineticEnergy(chain.model, data, theta, rate)
    total += pin.computePotentialEnergy(chain.model, data, theta)
    slip_torque = parameters.hysteresis[of.coordinate] * of.share
    total += 0.5 * parameters.stiffness @ x**2 + 0.5 * np.sum(slip_torque * s**2 / of.slip_angle)
    return float(total)


@pytest.mark.parametrize("seed", [1, 2, 7])
def test_what_energy_a_free_decay_loses_its_elements_have_rubbed_away(seed):
    """Slip torque times the way x - s that each element slips; undamped robots, let go."""
    model = ExchangedRobot(with_hysteresis(make_robot(seed, 3), seed), "linear", tolerance=1e-9)
    model.parameters = replace(model.parameters, damping=0.0 * model.parameters.damping)
    of, n = model.chain.elements, model.chain.joint_count
    assert of.count > 2
    slip_torque = model.parameters.hysteresis[of.coordinate] * of.share
    model.reset(0.0, held(np.full(n, 0.3)), Load(), undeflected=True)
    before, with_friction, slipped = energy(model), 0.0, np.zeros(of.count)
    for k in range(200):
        model.step(2e-4 * (k + 1), held(np.full(n, 0.3)), Load())
        way = model.deflection()[of.coordinate] - model.elongation()
        with_friction, slipped = with_friction + float(slip_torque @ np.abs(way - slipped)), way
    moving = before - energy(model)
    assert with_friction > 1e-3
    assert moving == pytest.approx(with_friction, rel=1e-9)


def moving(robot: Robot, curve: str = "linear", **options) -> ExchangedRobot:
    """Return a robot whose drives accelerate, in the middle of its motion."""
    model = ExchangedRobot(robot, curve, tolerance=1e-9, **options)
    go_on(model, 0.0, started=False)
    return model


def go_on(model: ExchangedRobot, time: float, started: bool = True) -> None:
    n = model.chain.joint_count
    drives = HeldCommand(0.0, np.full(n, 0.3), np.zeros(n), np.linspace(-3.0, 3.0, n))
    if not started:
        model.reset(0.0, drives, Load(np.array([300.0, -200.0, 500.0, 20.0, 30.0, -10.0])))
    model.step(time + 0.03, drives, Load())


@pytest.mark.parametrize("seed", range(4))
def test_elements_that_never_slip_are_a_stiffer_spring_in_motion(seed):
    robot = make_robot(seed, 4)

    def changed(**change) -> Robot:
        joints = tuple(
            j if j.stiffness is None else replace(j, **{k: f(j) for k, f in change.items()})
            for j in robot.joints
        )
        return replace(robot, joints=joints)

    never = moving(changed(hysteresis=lambda _: (StopElement(3e5, 1.0), StopElement(6e5, 2.0))))
    stiffer = moving(changed(stiffness=lambda j: j.stiffness + 6e5))
    np.testing.assert_allclose(never.deflection(), stiffer.deflection(), rtol=0, atol=1e-12)
    np.testing.assert_allclose(never.velocity(), stiffer.velocity(), rtol=0, atol=1e-9)


@pytest.mark.parametrize("curve", ["linear", "backlash", "spline"])
def test_elements_without_torque_change_no_motion(curve):
    """To the digit: they end no piece, and so no step."""
    robot = make_robot(1, 4)
    model, plain = (
        ExchangedRobot(with_hysteresis(robot, 1), curve, tolerance=1e-9),
        moving(robot, curve),
    )
    model.parameters = replace(model.parameters, hysteresis=0.0 * model.parameters.hysteresis)
    go_on(model, 0.0, started=False)
    assert model.chain.elements.count > 2
    for name in ("deflection", "deflection_rate", "gear_torque"):
        assert getattr(model, name)().tobytes() == getattr(plain, name)().tobytes()


@pytest.mark.parametrize("seed", range(6))
def test_state_space_is_that_of_differences(seed):
    """Sticking elements follow a change of x, slipping ones do not; by the slip torque as well."""
    model = moving(with_hysteresis(make_robot(seed, 4), seed))
    state, of = model._now(), model.chain.elements
    linear, by = model.linearise(), model.residual_derivatives()
    sticks = np.abs(model.elongation()) < of.slip_angle
    m, parameters = model.chain.elastic_count, model.parameters

    def acceleration(x=0.0, v=0.0, hysteresis=0.0) -> np.ndarray:
        change = np.zeros(m) + x
        moved = replace(
            state,
            x=state.x + change,
            v=state.v + v,
            elongation=state.elongation + sticks * change[of.coordinate],
        )
        model.put(moved)
        model.parameters = replace(parameters, hysteresis=parameters.hysteresis + hysteresis)
        return model.rate_derivative()

    def slope(size: float, **direction: np.ndarray) -> np.ndarray:
        ends = [
            acceleration(**{k: sign * size * d for k, d in direction.items()})
            for sign in (1.0, -1.0)
        ]
        return (ends[0] - ends[1]) / (2.0 * size)

    a = linear.state_space[0]
    for k, unit in enumerate(np.eye(m)):
        assert_near(a[m:, k], slope(1e-7, x=unit))
        assert_near(a[m:, m + k], slope(1e-4, v=unit))
    for k in of.gears:
        found = by.parameters[f"{model.chain.elastic_names[k]}.hysteresis"]
        assert_near(-np.linalg.solve(linear.mass, found), slope(1.0, hysteresis=np.eye(m)[k]))
    assert 0 < sticks.sum() < of.count or seed not in (0, 2)


def assert_near(found: np.ndarray, expected: np.ndarray) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max() + 1e-9)


@pytest.mark.parametrize("slipped", [-1, 0, 1])
def test_a_robot_at_rest_stays_there(slipped):
    """With all elements at their slip angles, where rounding might have them slip and stick by turns."""
    robot = ExchangedRobot(with_hysteresis(make_robot(4, 6), 4), "backlash", tolerance=1e-9)
    q = held(np.full(6, 0.3))
    robot.reset(0.0, q, Load(), slipped=slipped)
    x = robot.deflection()
    robot.step(1.0, q, Load())
    np.testing.assert_allclose(robot.deflection(), x, rtol=0, atol=1e-13)
    assert (np.abs(robot.elongation()) <= robot.chain.elements.slip_angle).all()

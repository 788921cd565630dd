"""Hysteresis of the gears at rest: closed forms of one joint, balance and memory of random robots."""

from dataclasses import replace

import numpy as np
import pytest
from exchanged_robot import ExchangedRobot
from hypothesis import given
from hypothesis import strategies as st
from pendulum import dynamics_of, held, pendulum
from random_robots import make_robot, robots, with_hysteresis

from elastic_robot.description import Robot
from elastic_robot.errors import EquilibriumError, ParameterError
from elastic_robot.gear_parts import StopElement
from elastic_robot.hysteresis import Elements, Hysteresis, Past
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.robot import ElasticRobot
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import ContactSpring, Load, ToolLoad
from elastic_robot.torque_curves import TORQUE_CURVES

SEEDS = st.integers(0, 10**6)
CURVES = st.sampled_from(sorted(TORQUE_CURVES))
ELEMENTS = (StopElement(40.0, 2e-5), StopElement(50.0, 6e-5), StopElement(30.0, 15e-5))
FORCE, ANGLE = (
    np.array([getattr(e, key) for e in ELEMENTS]) for key in ("slip_torque", "slip_angle")
)
STIFFNESS = 1e6


def gear(curve: str = "linear", **options) -> ElasticRobot:
    """Return one joint without weight, which a moment about y turns: it carries that moment."""
    joint = {"stiffness": STIFFNESS, "hysteresis": ELEMENTS, "backlash": 5e-5, **options}
    return ElasticRobot(pendulum(gravity=(0.0, 0.0, 0.0), **joint), curve, quasistatic=True)


def moment(torque: float) -> Load:
    return Load(np.array([0.0, 0.0, 0.0, 0.0, torque, 0.0]))


def load_to(robot: ElasticRobot, *torques: float) -> float:
    """Load a gear with torques one after another; return its wind-up at the last."""
    for torque in torques:
        robot.step(robot.time + 1.0, held([0.0]), moment(torque))
    return float(robot.deflection()[0])


def start(curve: str = "linear", torque: float = 0.0, slipped: int = 0, **options) -> ElasticRobot:
    robot = gear(curve, **options)
    robot.reset(0.0, held([0.0]), moment(torque), slipped=slipped)
    return robot


@pytest.mark.parametrize("amplitude", [1e-4, 2e-4, 5e-4])
def test_a_cycle_costs_the_area_of_its_loop(amplitude):
    """Sum of 4 f (A - a) over the elements that slip; the torques at all corners are given."""
    corners = np.append(2.0 * ANGLE - amplitude, amplitude)
    rising = np.sort(corners[corners <= amplitude])
    elongation = (rising[:, None] + amplitude) - np.minimum(amplitude, ANGLE)
    up = STIFFNESS * rising + np.clip(elongation / ANGLE, -1.0, 1.0) @ FORCE
    robot = start(torque=float(up[-1]))
    path = [[float(robot.deflection()[0]), up[-1]]]
    for torque in [*-up, *up]:
        path.append([load_to(robot, torque), torque])
        assert robot.gear_torque()[0] == pytest.approx(-torque, abs=1e-8)
    angle, torque = np.array(path).T
    np.testing.assert_allclose(angle[1:], [*-rising, *rising], rtol=0, atol=1e-14)
    work = np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(angle))
    lost = np.sum(4.0 * FORCE * np.maximum(amplitude - ANGLE, 0.0))
    assert work == pytest.approx(lost, rel=1e-9)


@given(st.floats(-600.0, 600.0), st.floats(0.0, 1.0))
def test_a_branch_is_the_virgin_curve_at_twice_the_scale(peak, part):
    """Masing's rule, where the torque curve is straight."""
    robot = start(torque=peak)
    turned, torque = float(robot.deflection()[0]), peak * (1.0 - 2.0 * part)
    virgin = float(start(torque=0.5 * (peak - torque)).deflection()[0])
    assert load_to(robot, torque) == pytest.approx(turned - 2.0 * virgin, abs=1e-13)


@given(st.lists(st.floats(-700.0, 700.0), min_size=1, max_size=4), SEEDS, CURVES)
def test_a_minor_loop_closes_and_leaves_no_trace(torques, seed, curve):
    """Return-point memory, on all curves: from any history, out, back inside it, and out again."""
    low, high, beyond = np.sort(np.random.default_rng(seed).uniform(-900.0, 900.0, 3))
    first, loop = start(curve), start(curve)
    load_to(first, *torques, low, high)
    load_to(loop, *torques, low, high, 0.5 * (low + high), high)
    np.testing.assert_allclose(loop.deflection(), first.deflection(), rtol=0, atol=1e-13)
    np.testing.assert_allclose(loop.elongation(), first.elongation(), rtol=0, atol=1e-13)
    assert load_to(loop, beyond) == pytest.approx(load_to(first, beyond), abs=1e-13)


@given(st.floats(-700.0, 700.0), st.floats(-700.0, 700.0), CURVES)
def test_a_monotone_load_ends_where_its_parts_do(first, last, curve):
    once, parts = start(curve, first), start(curve, first)
    load_to(parts, *np.linspace(first, last, 7))
    assert load_to(once, last) == pytest.approx(float(parts.deflection()[0]), abs=1e-13)


@given(st.floats(-500.0, 500.0))
def test_starts_from_above_and_below_are_twice_the_slip_torque_apart(torque):
    """x = (t -+ F) / k: from above all elements push up, from below they hold back."""
    above, middle, below = (start(torque=torque, slipped=slipped) for slipped in (-1, 0, 1))
    difference = above.deflection() - below.deflection()
    np.testing.assert_allclose(difference, 2.0 * FORCE.sum() / STIFFNESS, rtol=1e-12)
    assert below.deflection() - 1e-15 < middle.deflection() < above.deflection() + 1e-15
    np.testing.assert_array_equal(below.elongation(), ANGLE)
    np.testing.assert_array_equal(above.elongation(), -ANGLE)
    x = middle.deflection()[0]
    np.testing.assert_allclose(middle.elongation(), np.clip(x, -ANGLE, ANGLE), rtol=0, atol=1e-18)


def test_undeflected_elements_are_too():
    robot = gear()
    robot.reset(0.0, held([0.0]), moment(500.0), undeflected=True)
    assert not robot.deflection().any()
    assert not robot.elongation().any()


def hysteretic(robot: Robot, seed: int, curve: str, **options) -> ElasticRobot:
    return ElasticRobot(with_hysteresis(robot, seed), curve, quasistatic=True, **options)


def loads(robot: ElasticRobot, q: np.ndarray, seed: int) -> list[Load]:
    """Return loads one after another: wrenches, with springs that hold the TCP, or a plane below it."""
    rng, found = np.random.default_rng(seed), []
    robot.reset(0.0, held(q), Load())
    for k in range(6):
        wrench = rng.normal(size=6) * [300.0, 300.0, 300.0, 30.0, 30.0, 30.0]
        place = robot.tcp()[:3] + 1e-4 * rng.normal(size=3)
        spring = ContactSpring(place, np.zeros(3), np.diag(10.0 ** rng.uniform(4.0, 7.0, 3)))
        plane = PlaneContact(1e6, 0.0, 0.0, 0.0, 1e-3, np.array([0.0, 0.0, 1.0]))
        loose = ContactSpring(place, np.zeros(3), np.zeros((3, 3)))
        loads_of = (Load(wrench), Load(wrench, spring), Load(wrench, loose, contact=plane))
        found.append(loads_of[k % 3])
    return found


@given(robots(), SEEDS, CURVES)
def test_gears_rest_where_they_balance_their_load_along_monotone_ways(robot, seed, curve):
    model = hysteretic(robot, seed, curve)
    chain, dynamics = model.chain, model._dynamics
    q = np.random.default_rng(seed).uniform(-3.0, 3.0, chain.joint_count)
    law = Hysteresis(chain.elements, model.parameters.hysteresis)
    torque_curve = TORQUE_CURVES[curve].build(model.parameters)
    for k, load in enumerate(loads(model, q, seed)):
        before = Past(law, model.deflection(), model.elongation())
        model.step(k + 1.0, held(q), load)
        x, s = model.deflection(), model.elongation()
        np.testing.assert_array_equal(s, before.elongation_at(x))
        torque = dynamics.static_torque(chain.theta(q, x), load.at(0.0))
        shared = np.zeros(len(x))
        of = chain.elements
        np.add.at(
            shared, of.coordinate, law.slip_torque[of.coordinate] * of.share * s / of.slip_angle
        )
        left = np.abs(torque - torque_curve.torque(x) - shared).max(initial=0.0)
        assert left < 2e-6 + 1e-10 * np.abs(torque).max(initial=0.0)


@given(robots(), SEEDS, CURVES)
def test_elements_without_torque_are_not_there(robot, seed, curve):
    """To the digit, at rest, with springs and contacts as well."""
    model, plain = hysteretic(robot, seed, curve), ElasticRobot(robot, curve, quasistatic=True)
    model.parameters = replace(model.parameters, hysteresis=0.0 * model.parameters.hysteresis)
    q = np.random.default_rng(seed).uniform(-3.0, 3.0, len(robot.joints))
    for k, load in enumerate(loads(plain, q, seed)):
        for one in (model, plain):
            one.reset(0.0, held(q), load) if k == 0 else one.step(float(k), held(q), load)
        assert model.deflection().tobytes() == plain.deflection().tobytes()
        assert model.gear_torque().tobytes() == plain.gear_torque().tobytes()
        assert model.compliance().tobytes() == plain.compliance().tobytes()


@pytest.mark.parametrize("seed", range(8))
def test_elements_that_never_slip_are_a_stiffer_spring(seed):
    robot = make_robot(seed, 5)
    angle, torque = 1.0, 3e5
    never = tuple(
        j if j.stiffness is None else replace(j, hysteresis=(StopElement(torque, angle),) * 2)
        for j in robot.joints
    )
    stiffer = tuple(
        j if j.stiffness is None else replace(j, stiffness=j.stiffness + 2.0 * torque / angle)
        for j in robot.joints
    )
    q = np.random.default_rng(seed).uniform(-3.0, 3.0, len(robot.joints))
    both = [
        ElasticRobot(replace(robot, joints=joints), "linear", quasistatic=True)
        for joints in (never, stiffer)
    ]
    for k, load in enumerate(loads(both[1], q, seed)):
        for one in both:
            one.reset(0.0, held(q), load) if k == 0 else one.step(float(k), held(q), load)
        np.testing.assert_allclose(both[0].deflection(), both[1].deflection(), rtol=0, atol=1e-11)
        np.testing.assert_allclose(both[0].compliance(), both[1].compliance(), rtol=1e-9)


def test_an_equilibrium_without_the_past_of_its_elements_is_refused():
    dynamics, parameters = dynamics_of(pendulum(hysteresis=ELEMENTS))
    curve = TORQUE_CURVES["linear"].build(parameters)
    with pytest.raises(ParameterError, match="expected where the gears come from"):
        equilibrium(dynamics, curve, np.zeros(1), ToolLoad())


def test_a_robot_that_buckles_is_an_error_with_the_load():
    """The sentence of robots without hysteresis: elements that slip hold nothing upright."""
    robot = ElasticRobot(pendulum(stiffness=4e2, hysteresis=ELEMENTS), "linear", quasistatic=True)
    with pytest.raises(EquilibriumError, match=r"no static equilibrium found at q = .*too soft"):
        robot.reset(0.0, held([-np.pi / 2 + 0.1]), Load(np.array([0, 0, -1e6, 0, 0, 0.0])))


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("curve", TORQUE_CURVES)
def test_static_sensitivities_are_those_of_the_step_taken_again(seed, curve):
    """Central differences of a step of the quasi-static robot, by wrench, drives and parameters."""
    robot = with_hysteresis(make_robot(seed, 1 + seed % 6), seed)
    model = ExchangedRobot(robot, curve, quasistatic=True)
    rng, n = np.random.default_rng(seed), len(robot.joints)
    q, wrench = rng.uniform(-3.0, 3.0, n), rng.normal(size=6) * 2000.0
    model.reset(0.0, held(q), Load(-wrench))
    before, parameters = model._now(), model.parameters

    def step(angles=q, loads=wrench, **numbers) -> ElasticRobot:
        model.put(before)
        model.parameters = replace(parameters, **numbers)
        model.step(1.0, held(angles), Load(loads))
        return model

    by = step().static_sensitivities()
    np.testing.assert_array_equal(model.compliance(), by.tcp.wrench)
    law, x = TORQUE_CURVES[curve].build(parameters), model.deflection()
    # Inside its backlash a gear counts with its flank's stiffness.
    np.testing.assert_array_equal(law.slope(x), law.flank_slope(x))

    def slope(change: np.ndarray, **given) -> np.ndarray:
        ends = []
        for sign in (1.0, -1.0):
            moved = {key: value + sign * 1e-4 * change for key, value in given.items()}
            ends.append(step(**moved).deflection())
        return (ends[0] - ends[1]) / 2e-4

    for k in range(6):
        unit = np.eye(6)[k]
        assert_near(by.x.wrench[:, k], slope(unit, loads=wrench))
    for k in range(n):
        assert_near(by.x.drives[:, k], slope(1e-2 * np.eye(n)[k], angles=q) * 1e2)
    for k in model.chain.elements.gears:
        found = by.x.parameters[f"{model.chain.elastic_names[k]}.hysteresis"]
        unit = np.eye(model.chain.elastic_count)[k]
        assert_near(found, slope(unit, hysteresis=parameters.hysteresis))


def assert_near(found: np.ndarray, expected: np.ndarray) -> None:
    """To the rounding of x, 1e-14 rad over 1e-4, and the curvature within that."""
    scale = np.abs(expected).max(initial=0.0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-10 + 1e-6 * scale)


def test_an_element_at_its_slip_angle_sticks_where_its_gear_goes_back():
    law = Hysteresis(Elements.of(pendulum(hysteresis=ELEMENTS)), np.array([FORCE.sum()]))
    for side in (-1.0, 1.0):
        s, back, on = side * ANGLE, np.array([-side * 0.2]), np.array([side * 0.2])
        np.testing.assert_array_equal(law.rate(s, back), back.repeat(3))
        np.testing.assert_array_equal(law.rate(s, on), np.zeros(3))
        np.testing.assert_array_equal(law.ways(s, back), np.zeros(3))
        np.testing.assert_array_equal(law.ways(s, on), np.full(3, 1e-3 * 0.2))
        np.testing.assert_allclose(law.at_state(s, back).slope, np.sum(FORCE / ANGLE), rtol=1e-15)
        np.testing.assert_array_equal(law.at_state(s, on).slope, np.zeros(1))


def test_elements_are_those_of_their_gears():
    robot = with_hysteresis(make_robot(3, 6), 3)
    of, names = Elements.of(robot), ElasticRobot(robot).chain.elastic_names
    told = [
        (f"joint[{i}]", j, stop.slip_angle, stop.slip_torque / total)
        for i, joint in enumerate(robot.joints, start=1)
        for total in [sum(stop.slip_torque for stop in joint.hysteresis)]
        for j, stop in enumerate(joint.hysteresis, start=1)
    ]
    assert len(told) > 3
    rows = zip(of.coordinate, of.number, of.slip_angle, of.share, strict=True)
    assert [(names[k], *row) for k, *row in rows] == told

"""Directional derivatives of the native FMU against the independent model in complex arithmetic."""

from dataclasses import replace

import numpy as np
import pytest
from native_core import LANES, Core
from native_derivative_errors import errors
from native_derivatives import (
    CURVES,
    SEEDS,
    SPRING_INPUTS,
    SPRING_SEEDS,
    Case,
    instance_of,
    make_case,
    make_sprung_case,
    through_fmu,
)
from random_robots import make_robot

from elastic_robot.chain import build_chain
from elastic_robot.dynamics import Dynamics
from elastic_robot.tool_load import ToolLoad

LOAD = np.array([200.0, -150.0, -1000.0, 10.0, 20.0, -5.0])
POSTURE = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
# Places in Case.inputs, and of the inputs in the order of the FMU.
FORCE_Z, Q_CMD, ANCHOR = 2, 6, 24


@pytest.mark.parametrize("plain", [True, False])
def test_tangents_of_the_loads_are_those_of_pinocchio(plain):
    """1 to 8 joints in four random states, along random directions: to 1e-12 of the largest term."""
    rng = np.random.default_rng(0)
    for seed in range(200):
        robot = make_robot(seed + 200 * plain, 1 + seed % 8)
        core, chain = Core(robot, plain), build_chain(robot)
        dynamics, n = Dynamics(chain, np.array(robot.gravity)), chain.model.nv
        motion = rng.normal(size=(3, LANES, n)) * [[[1.5]], [[1.0]], [[5.0]]]
        directions = rng.normal(size=(3, LANES, n))
        wrench, push = rng.normal(size=(2, 6)) * [1e3, 1e3, 1e3, 1e2, 1e2, 1e2]
        loaded, pushed = bool(seed % 3), bool(seed % 2)
        by = dynamics.load_derivatives(*motion, ToolLoad(wrench * loaded))
        matrices = zip((by.angle, by.rate, by.acceleration), directions, strict=True)
        terms = [np.einsum("kij,kj->ki", matrix, direction) for matrix, direction in matrices]
        terms.append(by.wrench @ push * pushed)
        found = core.tangent(
            motion,
            wrench if loaded else None,
            directions,
            push if pushed else None,
            chain.elastic_count,
        )
        scale = np.abs(terms).max(initial=1.0)
        np.testing.assert_allclose(found, np.sum(terms, axis=0), rtol=0, atol=1e-12 * scale)


@pytest.mark.parametrize("length", [0.001, 0.004, 0.012])
@pytest.mark.parametrize("curve", ["linear", "backlash"])
def test_refinements_gain_three_digits_each(example, curve, length):
    """The wrench's columns, solved with the matrix of the step's start once, refined once and twice.

    The curve `spline` bends within the step, and gains less.
    """
    core, m = Core(example), build_chain(example).elastic_count
    core.reset(curve, 0.0, POSTURE, np.zeros(6))
    core.step(0.02, POSTURE, LOAD)

    def columns(accuracy: float) -> tuple[np.ndarray, int]:
        return core.columns(0.02 + length, POSTURE, LOAD, m, accuracy)

    exact, _ = columns(1e-13)
    for accuracy, solutions, left in ((2.0, 1, 1e-3), (1e-2, 2, 1e-6), (1e-9, 3, 1e-9)):
        found, passes = columns(accuracy)
        assert passes <= solutions
        assert np.abs(found - exact).max() < left * np.abs(exact).max()
    # With this one, for the accelerations, the FMU works.
    found, passes = columns(1e-11)
    assert passes <= 4
    assert np.abs(found - exact).max() < 1e-10 * np.abs(exact).max()


def _example_case(example, **changes) -> Case:
    inputs = np.concatenate([LOAD, POSTURE, [0.05] * 6, [0.3] * 6, np.zeros(SPRING_INPUTS)])
    given = Case(
        robot=example,
        curve="backlash",
        mode="dynamic",
        initial_state="equilibrium",
        tolerance=1e-6,
        length=0.004,
        before=inputs * (np.arange(len(inputs)) >= 6),
        inputs=inputs,
        seed=np.zeros(len(inputs)),
    )
    return replace(given, **changes)


@pytest.mark.parametrize("number", range(24))
def test_equilibria_follow_their_inputs(tmp_path, number):
    """Initial states and quasi-static steps of 1 to 8 joints, all outputs, to 1e-9 of the largest.

    The reference is the independent model's equilibrium, solved in complex arithmetic.
    """
    mode, length = (("quasistatic", 0.004), ("dynamic", 0.0))[number % 2]
    seeds = SEEDS[number % 5]
    case = make_case(1000 + number, 1 + number % 8, CURVES[number % 3], mode, length, seeds)
    found, _ = errors(case, through_fmu(case, tmp_path))
    assert max(found.values()) < 1e-9, found


@pytest.mark.parametrize("number", range(24))
def test_equilibria_on_a_spring_follow_their_inputs(tmp_path, number):
    """The same on springs of 1 to 1e8 N/m, by anchor, velocity and stiffness too."""
    mode, length = (("quasistatic", 0.004), ("dynamic", 0.0))[number % 2]
    seeds = SPRING_SEEDS[number % 4]
    case = make_sprung_case(2000 + number, 1 + number % 8, CURVES[number % 3], mode, length, seeds)
    found, _ = errors(case, through_fmu(case, tmp_path))
    assert max(found.values()) < 1e-9, found


def test_a_gear_without_load_stays_in_the_middle_of_its_backlash(example, tmp_path):
    """That of the vertical axis under weight alone; the others follow, to 1e-9."""
    inputs = np.concatenate([np.zeros(6), POSTURE, np.zeros(12 + SPRING_INPUTS)])
    seed = np.zeros(len(inputs))
    seed[[0, 1, 2, Q_CMD + 1]] = 1.0, 2.0, 3.0, 1e-6
    case = _example_case(example, length=0.0, inputs=inputs, seed=seed)
    found = through_fmu(case, tmp_path)
    relative, _ = errors(case, found)
    assert found.values["deflection"][0] == found.derivatives["deflection"][0] == 0.0
    assert max(relative.values()) < 1e-9, relative


def test_a_rigid_robot_follows_its_drives(tmp_path):
    robot = make_robot(16, 1)
    assert build_chain(robot).elastic_count == 0
    case = make_case(16, 1, "backlash", "dynamic", 0.004, "all")
    relative, _ = errors(case, through_fmu(case, tmp_path))
    assert max(relative.values()) < 1e-9, relative


# Number of the robot, joints, curve, and what is in the step: passages of a knot of the curve.
STEPS = [
    (3, 4, "linear", 0),
    (9, 2, "linear", 0),
    (7, 8, "backlash", 0),
    (104, 3, "backlash", 0),
    (102, 1, "backlash", 1),
    (114, 1, "backlash", 1),
    (112, 2, "backlash", 1),
    (103, 2, "spline", 0),
    (105, 1, "spline", 0),
    (109, 2, "spline", 0),
]


@pytest.mark.parametrize(("number", "joints", "curve", "crossings"), STEPS)
def test_steps_follow_their_inputs(tmp_path, number, joints, curve, crossings):
    """A step of 4 ms, all outputs, to 1e-9 of the largest; so tight a tolerance takes many inner steps.

    The reference is the exact flow of the independent model in complex arithmetic.
    """
    case = make_case(number, joints, curve, "dynamic", 0.004, SEEDS[number % 5])
    found, flow = errors(case, through_fmu(case, tmp_path))
    assert flow is not None
    assert flow.crossings == crossings
    assert max(found.values()) < 1e-9, found


# The same on a spring of 6e1 to 9e7 N/m, whose anchor moves.
SPRUNG_STEPS = [
    (0, 1, "linear", "anchor", 0),
    (1, 2, "backlash", "anchor", 0),
    (17, 2, "spline", "anchor_velocity", 0),
    (25, 2, "backlash", "anchor", 0),
    (8, 1, "spline", "anchor_stiffness", 1),
    (9, 2, "linear", "all", 0),
    (10, 3, "backlash", "all", 2),
    (11, 4, "spline", "all", 1),
]


@pytest.mark.parametrize(("number", "joints", "curve", "seeds", "crossings"), SPRUNG_STEPS)
def test_steps_on_a_spring_follow_their_inputs(tmp_path, number, joints, curve, seeds, crossings):
    case = make_sprung_case(number, joints, curve, "dynamic", 0.004, seeds)
    found, flow = errors(case, through_fmu(case, tmp_path))
    assert flow is not None
    assert flow.crossings == crossings
    assert max(found.values()) < 1e-9, found


def test_stiffness_is_differentiated_by_where_there_is_no_spring_yet(tmp_path):
    """Steps and equilibria with the anchor off the tool and K = 0."""
    for mode in ("dynamic", "quasistatic"):
        case = make_sprung_case(25, 2, "backlash", mode, 0.004, "anchor_stiffness")
        inputs, before = case.inputs.copy(), case.before.copy()
        inputs[-6:] = before[-6:] = 0.0
        case = replace(case, inputs=inputs, before=before)
        found = through_fmu(case, tmp_path / mode)
        relative, _ = errors(case, found)
        assert np.abs(found.derivatives["tcp"]).max() > 1e-9
        assert max(relative.values()) < 1e-9, relative


def test_where_the_rounded_curve_bends_the_step_limits_its_derivatives(tmp_path):
    """The curve's second derivative jumps at 3B/2, where no step ends: 1e-6 at a tolerance of 1e-12."""
    case = make_case(133, 2, "spline", "dynamic", 0.004, SEEDS[133 % 5])
    found, flow = errors(case, through_fmu(case, tmp_path))
    assert flow is not None
    assert flow.crossings == 1
    assert max(found.values()) < 1e-6, found


@pytest.mark.parametrize("tolerance", [1e-6, 1e-5])
def test_a_passage_of_the_backlash_keeps_the_accuracy_at_any_tolerance(tmp_path, tolerance):
    """The law changes a little beyond the edge; not told so, the columns miss 2e-8 and 2e-7 here."""
    case = make_case(102, 1, "backlash", "dynamic", 0.004, SEEDS[102 % 5], tolerance)
    found, flow = errors(case, through_fmu(case, tmp_path))
    assert flow is not None
    assert flow.crossings == 1
    assert found["deflection"] < 1e-9


def _jacobian(native, slave) -> np.ndarray:
    """Rows of inputs; the instance is one of the example robot's FMU."""
    outputs = native.outputs
    rows = [slave.getDirectionalDerivative(outputs, [known], [1.0]) for known in native.inputs]
    return np.array(rows)


def _bytes(slave) -> bytes:
    return bytes(slave.serializeFMUstate(slave.getFMUState()))


def test_a_call_leaves_every_byte_of_the_state(native, example, tmp_path):
    slave, _ = instance_of(_example_case(example), tmp_path)
    for k in range(5):
        native.set(slave, {"force.z": -400.0 * (k % 2)})
        slave.doStep(0.004 * k, 0.004)
        values, before = slave.getReal(native.reals), _bytes(slave)
        first = _jacobian(native, slave)
        assert _bytes(slave) == before
        assert slave.getReal(native.reals) == values
        np.testing.assert_array_equal(_jacobian(native, slave), first)


@pytest.mark.parametrize("mode", ["dynamic", "quasistatic"])
def test_derivatives_are_those_of_the_present_state_after_every_change(
    native, example, tmp_path, mode
):
    """Of an instance that is asked after every call, and of one that is not, the same bits."""
    case = _example_case(example, mode=mode)
    asked, other, copy = (instance_of(case, tmp_path / name)[0] for name in ("a", "o", "c"))
    seen = []

    def agree() -> None:
        """The other, which is never asked itself, is in a copy of its state."""
        now = _jacobian(native, asked)
        copy.setFMUState(copy.deSerializeFMUstate(_bytes(other)))
        np.testing.assert_array_equal(now, _jacobian(native, copy))
        assert not any(np.array_equal(now, past) for past in seen)
        seen.append(now)

    def begin(inputs: np.ndarray) -> None:
        for one in (asked, other):
            one.reset()
            one.setupExperiment(startTime=0.0)
            one.setString(native.of(["mode"]), [mode])
            one.enterInitializationMode()
            one.setReal(native.inputs[: len(inputs)], inputs.tolist())
            one.exitInitializationMode()

    begin(case.inputs)
    agree()
    first = asked.getFMUState()
    for k in range(3):
        for one in (asked, other):
            native.set(one, {"force.z": -300.0 * k, "joint[1].stiffness": 1.1e6 + 1e5 * k})
            one.doStep(0.004 * k, 0.004)
        agree()
    asked.setFMUState(first)
    np.testing.assert_array_equal(_jacobian(native, asked), seen[0])
    begin(1.1 * case.inputs)
    agree()


def test_along_a_trajectory_only_the_wrench_matters(native, example, tmp_path):
    """With kinks of the drives inside the step; against differences of four points at a force."""
    file = tmp_path / "motion.csv"
    rows = ["time,q1,q2,q3,q4,q5,q6"]
    for k in range(40):
        zigzag = 1e-3 * (k % 3)
        rows.append(",".join(f"{value:.17g}" for value in (0.0015 * k, *(POSTURE + zigzag))))
    file.write_text("\n".join(rows) + "\n")
    case = _example_case(example, curve="linear", tolerance=1e-10)
    slave, _ = instance_of(case, tmp_path, trajectory=str(file))
    slave.doStep(0.0, 0.005)
    before = slave.getFMUState()

    def outputs(force: float) -> np.ndarray:
        slave.setFMUState(before)
        native.set(slave, {"force.z": force})
        slave.doStep(0.005, 0.007)
        return np.array(slave.getReal(native.outputs))

    h = 50.0
    far, near = (outputs(f * h) - outputs(-f * h) for f in (2, 1))
    expected = (8.0 * near - far) / (12.0 * h)
    outputs(0.0)
    found = _jacobian(native, slave)
    assert not found[Q_CMD:ANCHOR].any()
    for block in (slice(0, 3), slice(3, 7), slice(7, 10), slice(17, 20), slice(23, 29)):
        scale = np.abs(expected[block]).max()
        np.testing.assert_allclose(
            found[FORCE_Z][block], expected[block], rtol=0, atol=1e-8 * scale
        )

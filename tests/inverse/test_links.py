"""Motion of the links: gradient, order, rest, windows; on random robots."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

from coupling.inverse.band import NormalEquations
from coupling.inverse.link_model import LinkModel
from coupling.inverse.link_task import LinkTask
from coupling.inverse.links import LinkProblem
from coupling.inverse.loads import SmoothWrench
from coupling.inverse.windows import solve_links
from coupling.path.histories import ToolPath, WrenchHistory, poses
from coupling.robot.inverse_kinematics import InverseKinematics
from tests.helpers.random_robots import make_robot

_POSE = np.array([0.1, -0.3, 0.5, 0.2, 0.6, -0.1])


def bump(time, end):
    """A motion from rest to rest, 0 to 1 and back, with four continuous derivatives."""
    u = np.clip(time / end, 0.0, 1.0)
    return (4.0 * u * (1.0 - u)) ** 5


def task_of(robot, spacing, end=0.8):
    """A path around a posture: the tool moves and turns, its load rises and falls."""
    model = LinkModel(robot)
    home = _POSE[: model.chain.joint_count]
    (middle,), (axes,) = model.placement(model.chain.theta(home)[None])
    nodes = spacing * np.arange(round(end / spacing) + 1)
    along, axis = np.array([0.004, -0.006, 0.002]), np.array([0.01, 0.004, -0.008])
    load = np.array([100.0, -50.0, 200.0, 5.0, 3.0, -2.0])

    def position(t):
        return middle + np.outer(bump(t, end), along)

    def rotation(t):
        return Rotation.from_rotvec(np.outer(bump(t, end), axis)) * Rotation.from_matrix(axes)

    def wrench(t):
        return np.outer(bump(t, end), load)

    path = ToolPath(nodes, poses(position(nodes), rotation(nodes)))
    guess = InverseKinematics(robot, home).plan(path).q[0]
    return LinkTask(0.0, spacing, len(nodes) - 1, position, rotation, wrench, guess)


@pytest.fixture(scope="module", params=[3, 8])
def robot(request):
    return make_robot(request.param, joints=6)


@pytest.fixture(scope="module")
def model(robot):
    return LinkModel(robot)


def test_the_normal_equations_are_those_of_the_dense_problem():
    """Two groups of points and a condition, assembled by basis functions of another program."""
    rng = np.random.default_rng(1)
    intervals, size, spacing = 7, 3, 0.3
    knots = spacing * np.arange(-5, intervals + 6)
    basis = BSpline(knots, np.eye(intervals + 5), 5)
    equations = NormalEquations(intervals, size, 5, spacing)
    matrix, right = [], []
    for first, count, place in ((0, 7, 0.0), (2, 4, 0.5), (6, 1, 1.0)):
        rows, errors = rng.normal(size=(count, 12, 3, size)), rng.normal(size=(count, 12))
        flat = rows.reshape(count, 12, -1)
        squares = (flat.swapaxes(1, 2) @ flat).reshape(count, 3, size, 3, size)
        gradient = np.einsum("kr,krmq->kmq", errors, rows)
        equations.add(first, place, squares, gradient)
        for k in range(count):
            t = spacing * (first + k + place)
            values = np.stack([basis(t, nu=m) for m in range(3)])  # (3, coefficients)
            matrix.append(np.einsum("rmq,mc->rcq", rows[k], values).reshape(12, -1))
            right.append(errors[k])
    row, residual = rng.normal(size=5), rng.normal(size=2)
    quantities = np.array([0, 2])
    equations.add_condition(7, row, quantities, residual)
    for q, value in zip(quantities, residual, strict=True):
        entry = np.zeros((intervals + 5, size))
        entry[7:12, q] = row
        matrix.append(entry.reshape(1, -1))
        right.append([value])
    dense, errors = np.vstack(matrix), np.concatenate(right)
    np.testing.assert_allclose(equations.gradient.ravel(), dense.T @ errors, rtol=1e-9)
    expected = np.linalg.lstsq(dense, -errors, rcond=None)[0]
    np.testing.assert_allclose(equations.solve().ravel(), expected, rtol=1e-6, atol=1e-6)


def test_the_gradient_is_that_of_the_sum_of_squares(robot, model):
    """Against central differences along random directions, away from the solution, to 1e-6."""
    rng = np.random.default_rng(2)
    problem = LinkProblem(model, task_of(robot, 0.02))
    motion = problem.guess()
    motion = replace(
        motion, coefficients=motion.coefficients + 1e-4 * rng.normal(size=motion.coefficients.shape)
    )
    for _ in range(3):
        direction = rng.normal(size=motion.coefficients.shape)

        def cost(step, direction=direction):
            moved = replace(motion, coefficients=motion.coefficients + step * direction)
            return 0.5 * float(np.sum(problem.residuals(moved) ** 2))

        h = 1e-6
        expected = (cost(h) - cost(-h)) / (2.0 * h)
        got = float(np.sum(problem.gradient(motion) * direction))
        assert got == pytest.approx(expected, rel=1e-6)


def test_the_tool_is_on_its_path_and_the_tilts_are_in_balance(robot, model):
    """Evaluated between the nodes, where nothing was asked for; the ends stand still."""
    task = task_of(robot, 0.004)
    motion = solve_links(model, task)
    assert len(motion.iterations) <= 5
    assert motion.iterations[-1].step < 1e-7
    t = np.linspace(0.0, 0.8, 1003)
    theta, rate, acceleration = (motion.theta.at(t, m) for m in range(3))
    state = model.state(theta, rate, acceleration, task.wrench(t))
    assert np.linalg.norm(state.position - task.position(t), axis=1).max() < 2e-7
    balance = state.load[:, model.tilts] + model.tilt_stiffness * theta[:, model.tilts]
    balance += model.tilt_damping * rate[:, model.tilts]
    torque = np.abs(state.load).max()
    assert np.abs(balance).max(initial=0.0) < 1e-3 * torque
    for end in (0, -1):
        assert np.abs(rate[end]).max() < 1e-8
        assert np.abs(acceleration[end]).max() < 1e-5


def test_windows_give_the_motion_of_the_whole_path(robot, model):
    task = task_of(robot, 0.004, end=6.0)
    whole = solve_links(model, task)
    parts = solve_links(model, task, window=500)
    np.testing.assert_allclose(parts.theta.coefficients, whole.theta.coefficients, atol=1e-9)
    assert parts.error.shape == whole.error.shape == (task.intervals + 1,)


def test_a_smoothed_force_moves_a_mass_to_the_same_place_at_the_same_rate():
    """Twice integrated, long after the last jump; and a force without corners is left as it is."""
    rng = np.random.default_rng(4)
    time = np.concatenate([[0.0], np.sort(rng.uniform(0.1, 0.8, 20)).round(5), [1.0]])
    before, behind = rng.normal(size=(2, 22, 6))
    before[:2] = behind[0] = before[-1] = behind[-2:] = 0.0
    behind[::3] = before[::3]  # a corner without a jump
    sides = np.stack([before, behind], axis=1).reshape(-1, 6)
    history = WrenchHistory(np.repeat(time, 2), sides)
    smooth = SmoothWrench(history, 0.01)
    step = 1e-6
    t = np.arange(0.5 * step, 1.0, step)
    after = np.searchsorted(time, t)
    part = ((t - time[after - 1]) / np.diff(time)[after - 1])[:, None]
    straight = (1.0 - part) * behind[after - 1] + part * before[after]
    error = smooth(t) - straight
    late = 0.9
    early = t < late
    rate = error[early].sum(axis=0) * step
    place = ((late - t[early])[:, None] * error[early]).sum(axis=0) * step
    # A mean over the width alone would leave the place off by width^2 / 24 of the steps: 4e-6.
    assert np.abs(rate).max() < 1e-7
    assert np.abs(place).max() < 5e-7
    quiet = np.abs(t[:, None] - time).min(axis=1) > 0.021
    np.testing.assert_allclose(smooth(t[quiet]), straight[quiet], atol=1e-9)


def test_the_teeth_of_a_mill_are_left_out():
    """1 - (1 - sinc^2)^2 of a sine of 667 Hz at nodes 4 ms apart: 2.0 % of it."""
    time = np.arange(0.0, 0.2, 1e-4)
    force = np.zeros((len(time), 3))
    force[:, 0] = np.sin(2.0 * np.pi * 667.0 * time)
    smooth = SmoothWrench(WrenchHistory.of_forces(time, [force]), 0.004)
    inner = np.linspace(0.05, 0.15, 5001)
    share = np.sinc(667.0 * 0.004) ** 2
    expected = 1.0 - (1.0 - share) ** 2
    assert np.abs(smooth(inner)[:, 0]).max() == pytest.approx(expected, rel=0.1)


def test_a_robot_without_tilts_follows_from_inverse_kinematics_alone():
    """No tilts: the links are where inverse kinematics of the rigid robot puts them."""
    robot = make_robot(3, joints=6)
    stiff = replace(robot, joints=tuple(replace(joint, tilt=()) for joint in robot.joints))
    model = LinkModel(stiff)
    task = task_of(robot, 0.01)
    motion = solve_links(model, task)
    for t in (0.2, 0.4, 0.55):
        (placed,), _ = model.placement(motion.theta.at(np.array([t])))
        np.testing.assert_allclose(placed, task.position(np.array([t]))[0], atol=1e-8)

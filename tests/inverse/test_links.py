"""Motion of the links: the dense problem, order, rest, parts of a path; on random robots."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from coupling.files.robot_file import load_robot, shipped_robots
from coupling.inverse.link_model import LinkModel
from coupling.inverse.link_task import LinkTask
from coupling.inverse.links import equilibrium_angles, link_path, rigid_motion, solve_links
from coupling.inverse.smooth_wrench import SmoothWrench
from coupling.native.desk_links import LinkIterations
from coupling.native.desk_robot import DeskRobot
from coupling.path.histories import ToolPath, WrenchHistory, poses
from coupling.robot.inverse_kinematics import InverseKinematics
from tests.helpers.random_robots import make_robot, with_gear_parts
from tests.inverse import link_oracle

_POSE = np.array([0.1, -0.3, 0.5, 0.2, 0.6, -0.1])


def bump(time, end):
    """A motion from rest to rest, 0 to 1 and back, with four continuous derivatives."""
    u = np.clip(time / end, 0.0, 1.0)
    return (4.0 * u * (1.0 - u)) ** 5


def task_of(robot, spacing, end=0.8):
    """A path around a posture: the tool moves and turns, its load rises and falls."""
    model = LinkModel(robot)
    home = np.resize(_POSE, model.chain.joint_count)
    (middle,), (axes,) = model.desk.placements(model.chain.theta(home)[None])
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


@pytest.mark.parametrize("seed", range(8))
def test_an_iteration_is_that_of_the_dense_problem(seed):
    """Random robots of 6 to 8 joints, some with balancers, ends of all kinds, away from the solution."""
    robot = make_robot(seed, joints=6 + seed % 3)
    robot = with_gear_parts(robot, seed) if seed % 2 else robot
    model, rng = LinkModel(robot), np.random.default_rng(seed)
    kinds = {"begins": ["rest", "loaded", "free"][seed % 3], "ends": ["rest", "free"][seed % 2]}
    task = replace(task_of(robot, 0.02, end=0.4 + 0.02 * seed), **kinds)
    path, motion = link_path(model, task), rigid_motion(model, task)
    coefficients = motion.coefficients + 1e-4 * rng.normal(size=motion.coefficients.shape)
    change, _ = LinkIterations(model.desk, path, lag=1000).change(coefficients)
    residuals, rows = link_oracle.equations(model, task, path.rigid, coefficients)
    expected = np.linalg.lstsq(rows, -residuals, rcond=None)[0]
    # What both make of the residuals: coefficients beyond a free end are hardly determined.  Normal
    # equations, dense ones as well, square the condition of 1e5 to 1e7: up to 3e-9 here.
    apart = rows @ (change.ravel() - expected)
    assert np.linalg.norm(apart) < 1e-8 * np.linalg.norm(rows @ expected)


@pytest.mark.parametrize("plain", [False, True])
@pytest.mark.parametrize("seed", range(0, 12))
def test_loads_and_their_derivatives_are_those_of_pinocchio(seed, plain):
    """Random robots of 1 to 9 joints, half with balancers, any motion and wrench; to rounding."""
    robot = make_robot(seed, joints=1 + seed % 9)
    robot = with_gear_parts(robot, seed) if seed % 2 else robot
    rng, model, desk = np.random.default_rng(seed), LinkModel(robot), DeskRobot(robot, plain)
    motion = [scale * rng.normal(size=(7, model.size)) for scale in (1.0, 2.0, 5.0)]
    wrench = rng.normal(size=(7, 6)) * [500.0, 500.0, 500.0, 50.0, 50.0, 50.0]
    load, by, jacobian, position, rotation = desk.linearised(*motion, wrench)
    expected = [link_oracle.loads(model, *rows) for rows in zip(*motion, wrench, strict=True)]
    found = (load, by, jacobian, position, rotation)
    for values, wanted in zip(found, zip(*expected, strict=True), strict=True):
        np.testing.assert_allclose(values, wanted, atol=1e-12 * np.abs(wanted).max(), rtol=0.0)
    np.testing.assert_allclose(desk.loads(*motion, wrench), load, atol=1e-12 * np.abs(load).max())
    np.testing.assert_allclose(desk.placements(motion[0])[0], position, atol=1e-14)


def test_the_plain_kernel_gives_the_same_motion(robot, model):
    """Where the processor has no AVX2.

    A change alone is only known to 1e-4 of it, by the condition of the equations; the next one makes up
    for that.
    """
    task, plain = task_of(robot, 0.004), copy(model)
    plain.desk = DeskRobot(robot, plain=True)
    fast, slow = (solve_links(each, task).theta.coefficients for each in (model, plain))
    np.testing.assert_allclose(slow, fast, atol=1e-11, rtol=0.0)


def test_a_smoothed_wrench_is_that_of_means_on_a_grid():
    """Means over cells by SciPy's integral, means over 16 of them by convolution; times in any order."""
    rng, width = np.random.default_rng(4), 0.03
    time = np.array([1.0, 1.1, 1.1, 1.17, 1.3, 1.3, 1.5])
    rows = 100.0 * rng.normal(size=(7, 6))
    smooth = SmoothWrench(WrenchHistory(time, rows[None]), width)
    cell = width / 16
    edges = 1.0 + cell * np.arange(-300, 600)
    pieces = [slice(0, 2), slice(2, 5), slice(5, 7)]

    def means(column):
        total = np.zeros(len(edges))
        for piece in pieces:
            dense = np.linspace(time[piece][0], time[piece][-1], 3001)
            area = cumulative_trapezoid(
                np.interp(dense, time[piece], column[piece]), dense, initial=0.0
            )
            total += CubicSpline(dense, area)(np.clip(edges, dense[0], dense[-1]))
        total += column[0] * np.minimum(edges - 1.0, 0.0) + column[-1] * np.maximum(
            edges - 1.5, 0.0
        )
        return np.diff(total) / cell

    box = np.full(16, 1.0 / 16.0)
    twice = np.convolve(box, box)
    expected = []
    for column in rows.T:
        narrow = np.convolve(means(column), twice, mode="same")
        expected.append(2.0 * narrow - np.convolve(narrow, twice, mode="same"))
    times = rng.permutation(np.concatenate([np.linspace(0.8, 1.8, 301), [1.1, 1.3]]))
    middles = edges[:-1] + 0.5 * cell
    found = smooth(times)
    for axis in range(6):
        values = np.interp(times, middles, expected[axis])
        np.testing.assert_allclose(found[:, axis], values, atol=1e-5)
    assert smooth(np.array([-1e9, 1e9]))[0] == pytest.approx(rows[0])


def test_the_tool_is_on_its_path_and_the_tilts_are_in_balance(robot, model):
    """Evaluated between the nodes, where nothing was asked for; the ends stand still."""
    task = task_of(robot, 0.004)
    motion = solve_links(model, task)
    assert len(motion.iterations) <= 5
    assert motion.iterations[-1].step < 1e-7
    t = np.linspace(0.0, 0.8, 1003)
    theta, rate, acceleration = (motion.theta.at(t, m) for m in range(3))
    state = model.desk.linearised(theta, rate, acceleration, task.wrench(t))
    assert np.linalg.norm(state.position - task.position(t), axis=1).max() < 2e-7
    balance = state.load[:, model.tilts] + model.tilt_stiffness * theta[:, model.tilts]
    balance += model.tilt_damping * rate[:, model.tilts]
    torque = np.abs(state.load).max()
    assert np.abs(balance).max(initial=0.0) < 1e-3 * torque
    for end in (0, -1):
        assert np.abs(rate[end]).max() < 1e-8
        assert np.abs(acceleration[end]).max() < 1e-5


def test_parts_give_the_motion_of_the_whole_path(robot, model):
    """However much of it is solved at once: to what the iterations leave, everywhere on the path."""
    task = task_of(robot, 0.004, end=6.0)
    whole = solve_links(model, task, lag=task.intervals)
    for lag in (16, 100):
        parts = solve_links(model, task, lag=lag)
        np.testing.assert_allclose(parts.theta.coefficients, whole.theta.coefficients, atol=1e-11)
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
        (placed,), _ = model.desk.placements(motion.theta.at(np.array([t])))
        np.testing.assert_allclose(placed, task.position(np.array([t]))[0], atol=1e-8)


def test_a_symmetric_robot_stands_symmetric_with_its_tool_on_the_pose():
    """Axes 1 and 4 stay at zero to rounding, so their gears carry less than the neutral torque."""
    model = LinkModel(load_robot(shipped_robots()["icme2008"]))
    q = np.array([0.0, 0.24, 0.63, 0.0, -0.87, 0.0])
    (position,), (axes,) = model.desk.placements(model.chain.theta(q[None]))
    rotation, load = Rotation.from_matrix(axes), np.array([0.0, 0, -300.0, 0, 0, 0])
    theta = equilibrium_angles(model, q, position, rotation, load)[None]
    rest = np.zeros_like(theta)
    state = model.desk.linearised(theta, rest, rest, load[None])
    np.testing.assert_allclose(state.position[0], position, atol=1e-14)
    np.testing.assert_allclose(state.rotation[0], axes, atol=1e-13)
    balance = state.load[0, model.tilts] + model.tilt_stiffness * theta[0, model.tilts]
    assert np.abs(balance).max() < 1e-7
    gears = np.abs(state.load[0, model.gears])
    assert max(gears[0], gears[3]) < 1e-10
    assert np.abs(theta[0, model.tilts]).max() > 1e-5

"""The inverse of the moving robot, run on the simulated one: order, closed form, hard robots, limits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation
from tuned_fmu import simulate_tuned

from coupling.errors import PlanningError
from coupling.events import unwatched
from coupling.files.robot_file import load_robot, shipped_robots
from coupling.inverse.gears import gears_of, solve_wind_up
from coupling.inverse.inversion import DesiredMotion, MovingRobot, joint_path
from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.link_task import LinkTask
from coupling.inverse.links import solve_links
from coupling.inverse.polish_step import Step
from coupling.inverse.spline import UniformSpline
from coupling.path.controller import Controller
from coupling.path.deviation import DeviationParts
from coupling.path.histories import ToolPath, WrenchHistory, poses
from coupling.path.joint_path import JointPath
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.inverter import Inverter
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot
from elastic_robot.torque_curves import TORQUE_CURVES

HOME = np.array([0.0, -0.2, 0.4, 0.1, 0.7, 0.0])


@pytest.fixture(scope="module")
def robot():
    return load_robot(shipped_robots()["icme2008"])


def stroke(time, end):
    """From rest to rest, 0 to 1, with four continuous derivatives."""
    u = np.clip(time / end, 0.0, 1.0)
    return u**5 * (126.0 - 420.0 * u + 540.0 * u**2 - 315.0 * u**3 + 70.0 * u**4)


@pytest.fixture(scope="module")
def fmu(robot, models) -> RobotFmu:
    return models.of(robot, "backlash").fmu


def wanted(robot, end=1.2, sample=0.004, length=0.1, force=300.0):
    """A straight stroke under a force that rises and falls."""
    model = MovingRobot(robot, "linear").model
    home = HOME[: model.chain.joint_count]
    (middle,), (axes,) = model.desk.placements(model.chain.theta(home)[None])
    time = sample * np.arange(round(end / sample) + 1)
    along = length * np.array([0.3, 0.8, -0.5])
    position = middle + np.outer(stroke(time, 0.9 * end), along)
    turned = Rotation.from_matrix(np.tile(axes, (len(time), 1, 1)))
    path = ToolPath(time, poses(position, turned))
    loads = np.zeros((len(time), 6))
    loads[:, :3] = np.outer(np.sin(np.pi * time / end) ** 4, force * np.array([0.5, -0.3, 1.0]))
    return DesiredMotion(
        path, InverseKinematics(robot, home).plan(path), WrenchHistory(time, loads)
    )


def inverted(robot, curve, task, controller=Controller(), cap=None):  # noqa: B008
    inverse = MovingRobot(robot, curve).invert(
        task, controller, JointLimits.of(robot, cap), lambda what, done, total: None
    )
    return joint_path(inverse.command), inverse


def distances(fmu, task, command, tolerance=1e-9):
    """Distance of the simulated tool from the path at its times [m], (k,)."""
    values = {"tcp_tolerance": tolerance}
    return simulate_tuned(fmu, command, task.wrench, "dynamic", values).distance_to(task.path)


@pytest.mark.parametrize("curve", ["linear", "backlash", "spline"])
@pytest.mark.parametrize("interpolation", ["quintic", "cubic"])
def test_the_moving_robot_stays_on_its_path(robot, models, curve, interpolation):
    """Uncorrected it sags by more than a millimetre; the command leaves less than 2 um."""
    task, fmu = wanted(robot), models.of(robot, curve).fmu
    command, _ = inverted(robot, curve, task, Controller(interpolation=interpolation))
    assert distances(fmu, task, command).max() < 2e-6
    assert distances(fmu, task, task.rigid).max() > 5e-4


@pytest.mark.parametrize("frequency", [200.0, 300.0])
def test_teeth_that_are_faster_than_the_rows_are_not_taken_for_a_slow_motion(
    robot, models, frequency
):
    """Seen every 4 ms, a ripple of 300 Hz is one of 50 Hz, which a command could follow."""
    task = wanted(robot, end=0.8, sample=2e-4)
    time = task.path.time
    teeth = 3000.0 * np.sin(np.pi * time / 0.8) ** 4 * np.sin(2.0 * np.pi * frequency * time)
    loads = task.wrench.wrench + np.outer(teeth, [0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    task = replace(task, wrench=WrenchHistory(time, loads))
    fmu = models.of(robot, "linear").fmu
    inverter = Inverter(MovingRobot(robot, "linear"), fmu)
    command = inverter.invert(task, Controller(), 1e-7, unwatched).joints
    actual = fmu.simulate(command, task.wrench, "dynamic")
    deviation = (actual.position - task.path.position)[0]
    parts = DeviationParts.of(time, deviation, 1.0 / frequency)
    assert parts.largest_ripple > 2e-6
    assert parts.largest_slow < 0.1 * parts.largest_ripple


def test_the_error_falls_with_the_nodes_distance(robot, models):
    """Links on nodes 16 and 8 ms apart, exact drives of linear gears at 1 kHz: third order at least."""
    task, errors = wanted(robot, end=0.8, length=0.15, force=0.0), []
    moving = MovingRobot(robot, "linear")
    model, tor = moving.model, moving.model.chain.torsions
    path = task.path
    for spacing in (0.016, 0.008):
        nodes = spacing * np.arange(round(0.8 / spacing) + 1)
        rows = np.searchsorted(path.time, nodes - 1e-9)

        def position(t):
            along = path.position[0, -1] - path.position[0, 0]
            return path.position[0, 0] + np.outer(stroke(t, 0.72), along)

        links = solve_links(
            model,
            LinkTask(
                0.0,
                spacing,
                len(nodes) - 1,
                position,
                lambda t: Rotation.from_quat(np.tile(path.pose[0, 0, 3:], (len(t), 1))),
                lambda t: np.zeros((len(t), 6)),
                task.rigid.q[0][rows],
            ),
        ).theta
        t = np.linspace(0.0, 0.8, 801)
        load = model.desk.loads(*(links.at(t, m) for m in range(3)), np.zeros((801, 6)))
        torque = -load[:, model.gears]
        gears = gears_of(model.parameters, model.chain)
        curve = TORQUE_CURVES["linear"].build(gears)
        wind_up = solve_wind_up(t, torque, curve, gears.damping, torque[0] / gears.stiffness)
        q, qd, qdd = (links.at(t, m)[:, model.chain.drive] for m in range(3))
        joints = model.chain.elastic_joint[tor]
        q[:, joints] -= wind_up.angle
        qd[:, joints] -= wind_up.rate
        qdd[:, joints] -= np.gradient(wind_up.rate, t, axis=0)
        command = JointPath(t, (q,), (qd,), (qdd,))
        errors.append(distances(models.of(robot, "linear").fmu, task, command, 1e-10).max())
    assert errors[0] / errors[1] > 2.0**3


def test_one_gear_with_backlash_has_its_closed_form():
    """A flywheel on a vertical axis swings sideways as cos; the wind-up solves d e' + S(e) = -J phi''.

    Torque J a w^2 cos(w t): on a flank e = B sign + k-d-filtered cosine, in the backlash its integral;
    the steady part on a flank, long after the last crossing, is known to the last digit.
    """
    inertia, k, d, backlash, amplitude, w = 20.0, 2e5, 1e3, 5e-4, 2e-2, 2.0
    wheel = Body(mass=1.0, com=(0.0, 0.0, 0.0), inertia=(inertia, inertia, inertia))
    joint = Joint((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), wheel, k, d, backlash)
    moving = MovingRobot(Robot("wheel", (joint,), tcp_position=(1.0, 0.0, 0.0)), "backlash")
    t = np.linspace(0.0, np.pi, 20_001)
    torque = inertia * amplitude * w**2 * np.cos(w * t)
    gears = gears_of(moving.model.parameters, moving.model.chain)
    curve = TORQUE_CURVES["backlash"].build(gears)
    lag = np.arctan(d * w / k)
    size = inertia * amplitude * w**2 / np.hypot(k, d * w)
    start = backlash + size * np.cos(lag)
    wind_up = solve_wind_up(t, torque[:, None], curve, np.array([d]), np.array([start]))
    first = wind_up.reversals[0]
    on_flank = t < first.begins
    expected = backlash + size * np.cos(w * t - lag)
    np.testing.assert_allclose(wind_up.angle[on_flank, 0], expected[on_flank], rtol=0.0, atol=1e-9)
    # In the backlash nothing but the damper holds: d e' = T, from the flank on.
    inside = (t > first.begins) & (t < first.ends)
    rise = inertia * amplitude * w / d * (np.sin(w * t) - np.sin(w * first.begins))
    np.testing.assert_allclose(
        wind_up.angle[inside, 0], backlash + rise[inside], rtol=0.0, atol=1e-9
    )
    # The flank is left where the spring's torque is gone.
    assert first.begins == pytest.approx((np.pi / 2.0 + lag) / w, abs=1e-7)
    assert (first.before, first.after) == (1, -1)


@pytest.mark.parametrize("damping", [0.05, 1.0])
def test_gears_with_little_damping_cross_as_well(robot, models, damping):
    """A small damper makes a crossing violent: rates of T/d in the backlash."""
    joints = tuple(
        replace(joint, damping=damping * joint.damping) if joint.stiffness else joint
        for joint in robot.joints
    )
    soft = replace(robot, joints=joints)
    task = wanted(soft)
    command, inverse = inverted(soft, "backlash", task)
    assert len(inverse.reversals) > 0
    assert distances(models.of(soft, "backlash").fmu, task, command).max() < 1e-5


def test_a_path_cut_in_mid_motion_is_not_forced_to_rest(robot, fmu):
    """After the first tenth of a second, in which no command can help, the tool is on its path."""
    task = wanted(robot)
    keep = np.flatnonzero((task.path.time >= 0.3) & (task.path.time <= 0.8))
    cut = DesiredMotion(
        task.path.at_rows(keep),
        JointPath(task.rigid.time[keep], (task.rigid.q[0][keep],)),
        WrenchHistory(task.path.time[keep], task.wrench.wrench[:, keep]),
    )
    inverter = Inverter(MovingRobot(robot, "backlash"), fmu)
    command = inverter.invert(cut, Controller(), 5e-6, lambda event: None).joints
    distance = distances(fmu, cut, command)
    assert distance[0] < 1e-6
    assert distance.max() < 1e-4
    assert distance[26:].max() < 5e-6


def test_the_polish_lowers_what_limited_drives_leave(robot, fmu):
    """Hardly more acceleration than the links have: what crossings leave then is halved."""
    task = wanted(robot, length=0.25)
    free, inverse = inverted(robot, "backlash", task)
    drive = inverse.links.theta.at(free.time, 2)[:, MovingRobot(robot, "linear").model.chain.drive]
    cap = 1.05 * np.abs(drive).max()
    assert np.abs(free.qdd[0]).max() > cap
    limited, _ = inverted(robot, "backlash", task, cap=cap)
    inverter = Inverter(MovingRobot(robot, "backlash"), fmu)
    controller = Controller(max_acceleration=cap)
    polished = inverter.invert(task, controller, 1e-7, lambda event: None).joints

    left = [distances(fmu, task, command).max() for command in (polished, limited)]
    assert left[0] < 0.5 * left[1]
    dense = np.linspace(polished.time[0], polished.time[-1], 20_001)
    assert np.abs(polished.trajectory.at(dense)[2]).max() <= cap * (1.0 + 1e-6)


def test_a_path_that_asks_for_more_than_a_drive_can_do_is_refused_with_joint_and_time(robot):
    task = wanted(robot)
    with pytest.raises(
        PlanningError, match=r"joint 6: expected at most 0\.1 rad/s\^2 .* at 0\.\d+ s"
    ):
        inverted(robot, "backlash", task, cap=0.1)


CYCLE, JOINTS = 0.01, 3


def step_of(degree: int, seed: int, part: float) -> Step:
    """A random model of a window in the middle of a wave, whose limits are a part more than it uses."""
    rng = np.random.default_rng(seed)
    places = CYCLE * np.arange(80)
    waves = 0.1 * np.sin(np.outer(places, 2.0 * np.pi * np.array([0.7, 1.1, 1.9])))
    command, free = UniformSpline(0.0, CYCLE, waves, degree), range(20, 50)
    fine = np.linspace(0.0, command.end, 4001)
    most = [np.abs(command.at(fine, order)).max(axis=0) * (1.0 + part) for order in (1, 2)]
    limits = JointLimits(np.full(JOINTS, -1.0), np.full(JOINTS, 1.0), *most)
    size = len(free) * JOINTS
    promised = rng.standard_normal((2 * size, size))
    return Step(
        free, promised.T @ promised, 1e-3 * size * rng.standard_normal(size), limits, command
    )


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("seed", range(5))
def test_a_step_within_limits_is_the_best_one(degree: int, seed: int):
    """Karush, Kuhn and Tucker: limits that bind hold against the gradient, and none is passed."""
    step = step_of(degree, seed, 0.05)
    change = step.change(0.0)
    free = -np.linalg.solve(step.hessian, step.gradient).reshape(change.shape)
    rows, slack = [], []
    for joint, own in enumerate(np.eye(JOINTS)):
        drive = UniformSpline(0.0, CYCLE, step.command.coefficients[:, [joint]], degree)
        each, low, high = step.limits.of_joint(joint).rows(drive)
        moved = each[:, step.free.start : step.free.stop]
        rows += [np.kron(moved.toarray(), own), -np.kron(moved.toarray(), own)]
        slack += [high - moved @ change[:, joint], moved @ change[:, joint] - low]
        assert np.any((moved @ free[:, joint] > high) | (moved @ free[:, joint] < low))
    room = np.concatenate(slack)
    assert room.min() > -1e-14
    pushed = step.hessian @ change.ravel() + step.gradient
    pushes, rest = nnls(np.vstack(rows)[room < 1e-9].T, -pushed)
    assert np.count_nonzero(pushes) > JOINTS
    assert rest < 1e-6 * np.abs(step.gradient).max()


def test_a_command_at_its_limits_can_stay_as_it_is():
    """Limits that the command passes by rounding do not forbid the change that is none."""
    step = step_of(5, 0, -1e-6)
    change = step.change(0.0)
    gain = 0.5 * change.ravel() @ step.hessian @ change.ravel() + step.gradient @ change.ravel()
    assert np.all(np.isfinite(change))
    assert gain <= 0.0

"""The inverse of robots with kinematic errors, friction with the load and balancers."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_robots import make_robot, with_gear_parts
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.inverse.command import rigid_command
from coupling.inverse.diagnosis import loads_along
from coupling.inverse.drive_limits import DriveLimits
from coupling.inverse.gear_drive import GearDrive, GearTask
from coupling.inverse.inversion import DesiredMotion, MovingRobot, joint_path
from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.link_model import LinkModel
from coupling.inverse.links import rigid_motion
from coupling.inverse.response import AlongMotion
from coupling.inverse.rows import CommandRows
from coupling.inverse.servo import MotorMotion, motor_torque
from coupling.inverse.spline import UniformSpline
from coupling.path.controller import Controller
from coupling.path.histories import ToolPath, WrenchHistory, poses
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.robot.batch.rigid_robot import RigidRobot
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.inverter import Inverter
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.exact_command import exact_command
from coupling.run.predicted_motor_torques import predict_motor_torques
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot
from elastic_robot.drive import Drive
from elastic_robot.dynamics import Dynamics
from elastic_robot.gear_parts import KinematicError
from elastic_robot.kinematic_errors import KinematicErrors
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TORQUE_CURVES

HOME = np.array([0.0, -0.2, 0.4, 0.1, 0.7, 0.0])
END = 0.8  # [s]
SEEDS = st.integers(0, 10**6)


def errors_of(*sines: tuple[float, float, float]) -> KinematicErrors:
    """Those of one joint."""
    numbers = np.array(sines, dtype=float).reshape(-1, 3).T
    return KinematicErrors(1, np.zeros(len(sines), dtype=int), *numbers)


sines = st.lists(
    st.tuples(st.floats(1e-3, 1.0), st.floats(1e-2, 1e6), st.floats(-10.0, 10.0)),
    min_size=1,
    max_size=4,
)


@given(sines, SEEDS, st.floats(1e-3, 1e4))
def test_motors_are_found_whatever_the_sines_are(parts, seed, reach):
    """Orders from 0.01 to 1e6 with all of the slope of 0.5 that a gear may have; angles to 1e4 rad."""
    share = 0.5 / sum(part for part, _, _ in parts)
    errors = errors_of(*((share * part / order, order, phase) for part, order, phase in parts))
    drives = np.random.default_rng(seed).normal(size=(3, 50, 1)) * reach
    outputs = errors.at_output(drives)
    # Angles are rounded, which an order of 1e6 feels.
    rounding = 1e-15 * (1.0 + np.abs(drives[0]).max() + errors.amplitude.sum())
    np.testing.assert_allclose(errors.motor_angle(outputs[0]), drives[0], rtol=0, atol=8 * rounding)
    found = errors.at_output(errors.at_motor(outputs))
    steepest = 1.0 + np.sum(errors.amplitude * errors.order**2)
    np.testing.assert_allclose(found[1], outputs[1], rtol=0, atol=1e-12 * reach)
    most = 1e-12 * reach * (1.0 + steepest * reach)
    np.testing.assert_allclose(found[2], outputs[2], rtol=0, atol=most)


def test_a_robot_without_errors_has_the_angles_that_it_had():
    drives = np.random.default_rng(1).normal(size=(3, 5, 1))
    assert errors_of().at_output(drives) is drives
    assert errors_of().at_motor(drives) is drives


@given(SEEDS)
@settings(max_examples=25)
def test_loads_and_their_derivatives_have_the_balancers(seed):
    """Rows of the elastic coordinates are those of the model, whose slopes are tested elsewhere."""
    rng = np.random.default_rng(seed)
    robot = with_gear_parts(make_robot(seed, 4), seed)
    model = LinkModel(robot)
    dynamics = Dynamics(model.chain, np.array(robot.gravity))
    theta, rate, bend = rng.normal(size=(3, 5, model.size))
    wrench = rng.normal(size=(5, 6)) * 100.0
    expected = dynamics.loads(theta, rate, bend, ToolLoad(wrench))
    by = dynamics.load_derivatives(theta, rate, bend, ToolLoad(wrench))
    scale = 1.0 + np.abs(expected).max(initial=0.0)
    state = model.desk.linearised(theta, rate, bend, wrench)
    rows = model.chain.elastic
    for found in (model.desk.loads(theta, rate, bend, wrench), state.load):
        np.testing.assert_allclose(found[:, rows], expected, rtol=0, atol=1e-11 * scale)
    np.testing.assert_allclose(state.by_motion[:, 0, rows], by.angle, rtol=0, atol=1e-10 * scale)


@given(SEEDS)
@settings(max_examples=25)
def test_torques_of_places_have_the_balancers(seed):
    """The batch of `place` against the links' model of a robot without tilts."""
    robot = with_gear_parts(make_robot(seed, 5), seed)
    robot = replace(robot, joints=tuple(replace(j, tilt=()) for j in robot.joints))
    model, own = LinkModel(robot), RigidRobot(robot)
    q, rate, bend = np.random.default_rng(seed).normal(size=(3, 5, 7))
    gravity = np.repeat(np.array(robot.gravity)[:, None], 7, axis=1)
    found = own.load(own.posture(q, np.zeros((3, 7))), rate, bend, gravity)
    expected = model.desk.loads(q.T, rate.T, bend.T, np.zeros((7, 6))).T
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-8)


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("kind", TORQUE_CURVES)
def test_gradients_of_a_gears_equations_are_those_of_differences(kind, degree):
    rng = np.random.default_rng(2)
    rows = CommandRows(0.0, 0.004, 12, degree)
    link = UniformSpline(0.0, 0.004, rng.normal(size=(17, 1)) * 1e-3, 5)
    time = np.linspace(0.0, 0.048, 97)
    link_body = Body(10.0, (0.5, 0.0, 0.0), (0.1, 1.0, 1.0))
    joint = Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), link_body, stiffness=1e5, backlash=1e-4)
    curve = MovingRobot(Robot("one", (joint,)), kind).curve
    errors = errors_of((2e-4, 300.0, 0.4), (1e-3, 2.0, 1.0))
    torque = 30.0 * np.sin(200.0 * time)
    task = GearTask(
        link, time, torque, 0.0 * time, curve, 500.0, time, np.full(97, 20.0), errors=errors
    )
    drive = GearDrive.of(task, rows)
    layout = drive.layout
    unknowns = rng.normal(size=(layout.size,)) * 1e-3
    place, miss = layout.coefficient, layout.miss

    def defects(values: np.ndarray) -> np.ndarray:
        return drive.defects(values[place], values[miss]).ravel()

    blocks = drive.gradient(unknowns[place], unknowns[miss])
    dense = np.zeros((layout.count * layout.parts, layout.size))
    for interval in range(layout.count):
        for part in range(layout.parts):
            begin = interval * layout.stride
            width = min(layout.width, layout.size - begin)
            dense[interval * layout.parts + part, begin : begin + width] = blocks[
                interval, part, :width
            ]
    for column in [*place, *miss]:
        step = np.zeros(layout.size)
        step[column] = 1e-8
        difference = (defects(unknowns + step) - defects(unknowns - step)) / 2e-8
        np.testing.assert_allclose(dense[:, column], difference, rtol=0, atol=2e-5)


def test_a_rigid_joint_is_driven_to_where_its_link_is():
    """u(q) = phi within 0.1 urad though the error is 300 urad, 40 times in a turn."""
    errors = errors_of((3e-4, 40.0, 0.2))
    time = np.linspace(0.0, 1.0, 251)
    swing = 0.4 * time**4 * (1.0 - time) ** 4 * 256.0
    phi = CubicSpline(time, swing, bc_type="clamped")
    link = UniformSpline(0.0, 0.004, _coefficients(phi, 250), 5)
    rows = CommandRows(0.0, 0.004, 250, 5)
    fine = np.linspace(0.0, 1.0, 3001)
    wanted = link.at(fine)
    missed = [
        np.abs(
            errors.output_angle(rigid_command(link, rows, DriveLimits(1), own).at(fine)) - wanted
        )
        for own in (errors, errors_of())
    ]
    assert missed[0].max() < 1e-7
    assert missed[1].max() > 2.5e-4


def _coefficients(curve: CubicSpline, count: int) -> np.ndarray:
    """Coefficients of a quintic spline near a curve: its values where they stand."""
    return curve(np.clip(0.004 * (np.arange(count + 5) - 2.0), 0.0, 1.0))[:, None]


def test_a_motor_needs_what_its_gear_and_its_friction_ask_for():
    """J q'' + (1 + eps') (-T) + (F + mu |T|) sign(q') + b q', once friction has slipped."""
    drive = Drive(50.0, 20.0, 1e4, friction=30.0, viscous=4.0, load_friction=0.2)
    time = np.linspace(0.0, 0.2, 201)
    angle, rate, bend = 0.3 * time + 0.2 * time**2, 0.3 + 0.4 * time, np.full(201, 0.4)
    carried, slope = 200.0 * np.cos(20.0 * time), 1.0 + 0.02 * np.cos(90.0 * angle)
    found = motor_torque(drive, MotorMotion(time, angle, rate, bend, carried, 200.0, slope))
    expected = 50.0 * bend + slope * carried + 30.0 + 0.2 * np.abs(carried) + 4.0 * rate
    np.testing.assert_allclose(found[2:], expected[2:], rtol=1e-13)


def with_parts(robot: Robot) -> Robot:
    """The example robot with two sines in every gear, motors, and a balancer at axis 2."""
    angle = np.linspace(-2.0, 2.0, 25)
    lifted = tuple(zip(angle.tolist(), (-2500.0 * np.cos(angle)).tolist(), strict=True))

    def joint(number: int) -> Joint:
        own = robot.joints[number]
        slow = KinematicError(1e-4, 1.0, 0.5)
        if own.stiffness is None:
            return replace(own, kinematic_error=(slow,))
        inertia = (400.0, 400.0, 300.0, 40.0, 40.0, 30.0)[number]
        gain = inertia * 2.0 * np.pi * 30.0
        drive = Drive(inertia, 20.0, gain, gain / 0.02, friction=0.5 * inertia, load_friction=0.1)
        return replace(
            own,
            kinematic_error=(KinematicError(5e-5, 400.0, 0.1 * number), slow),
            balancer=lifted if number == 1 else None,
            drive=drive,
        )

    return replace(robot, joints=tuple(joint(number) for number in range(len(robot.joints))))


def stroke(robot: Robot) -> DesiredMotion:
    """To and fro along a line under a force that comes and goes."""
    model = LinkModel(robot)
    (middle,), (axes,) = model.desk.placements(model.chain.theta(HOME)[None])
    time = np.linspace(0.0, END, 201)
    along = np.sin(np.pi * np.clip(time / (0.9 * END), 0.0, 1.0)) ** 5
    position = middle + np.outer(along, [0.04, 0.08, -0.06])
    path = ToolPath(time, poses(position, Rotation.from_matrix(np.tile(axes, (201, 1, 1)))))
    loads = np.zeros((201, 6))
    loads[:, :3] = np.outer(np.sin(np.pi * time / END) ** 4, [150.0, -90.0, 300.0])
    rigid = InverseKinematics(robot, HOME).plan(path)
    return DesiredMotion(path, rigid, WrenchHistory(time, loads))


@pytest.fixture(scope="module")
def case(example, tmp_path_factory):
    """Robot, desired motion and FMU."""
    robot = with_parts(example)
    file = tmp_path_factory.mktemp("parts") / "R.fmu"
    build_fmu(robot, file, BuildOptions("native"))
    return robot, stroke(robot), file


def missed(fmu: RobotFmu, wanted: DesiredMotion, command: JointPath) -> float:
    """Largest distance of the simulated tool from its path [m]."""
    fine = SampledPath.of(wanted.path).refined(0.002).path
    path = fmu.simulate(command, wanted.wrench.refined(fine.time), "dynamic")
    return float(np.linalg.norm(path.deviation_from(fine)[0][:, :3], axis=1).max())


@pytest.mark.parametrize("part", ["kinematic_error", "balancer"])
@pytest.mark.parametrize("interpolation", ["quintic", "cubic"])
def test_the_tool_stays_on_its_path_behind_gears_with_errors_and_a_balancer(
    case, interpolation, part
):
    """To 0.5 um without any polish; a command that does not know them leaves over 50."""
    robot, wanted, file = case
    none = None if part == "balancer" else ()
    unknown = replace(robot, joints=tuple(replace(j, **{part: none}) for j in robot.joints))
    controller, commands = Controller(interpolation=interpolation), []
    for own in (robot, unknown):
        limits = JointLimits.of(own, None)
        moving = MovingRobot(own, "backlash")
        found = moving.invert(wanted, controller, limits, lambda *progress: None)
        commands.append(joint_path(found.command))
    with RobotFmu(file, "backlash") as fmu:
        assert missed(fmu, wanted, commands[0]) < 5e-7
        assert missed(fmu, wanted, commands[1]) > 5e-5


def test_the_exact_drive_is_behind_its_gears_errors(case):
    """Its rows are a millisecond apart."""
    robot, wanted, file = case
    exact = exact_command(MovingRobot(robot, "backlash"), wanted)
    with RobotFmu(file, "backlash") as fmu:
        assert missed(fmu, wanted, exact) < 2e-7


def test_servos_are_told_what_their_gears_errors_and_losses_ask_for(case):
    """To 4 um, of which rows leave half; told by who does not know friction with the load over 20."""
    robot, wanted, file = case
    lossless = replace(
        robot,
        joints=tuple(
            replace(j, drive=j.drive and replace(j.drive, load_friction=0.0)) for j in robot.joints
        ),
    )
    with RobotFmu(file, "backlash", drive="servo") as fmu:
        told = [
            Inverter(MovingRobot(own, "backlash"), fmu, 0, "servo")
            .invert(wanted, Controller(), 1e-6, lambda event: None)
            .joints
            for own in (robot, lossless)
        ]
        assert missed(fmu, wanted, told[0]) < 4e-6
        assert missed(fmu, wanted, told[1]) > 2e-5


def test_motors_are_asked_for_what_the_simulated_ones_need(case):
    """Without a run, along the stroke: largest torques to 5 %, of which errors make up to two thirds."""
    robot, wanted, file = case
    moving = MovingRobot(robot, "linear")
    task = moving.task(wanted)
    links = rigid_motion(moving.model, task)
    demands = predict_motor_torques(moving, links, loads_along(moving, links, task.wrench))
    time = np.linspace(0.0, END, 801)
    with RobotFmu(file, "linear") as fmu:
        command = exact_command(moving, wanted)
        joints = [d.joint - 1 for d in demands]
        _, found = fmu.with_motors(command, wanted.wrench.refined(time), joints)
    largest = np.abs(found.torque).max(axis=0)
    np.testing.assert_allclose([d.torque[1.0] for d in demands], largest, rtol=0.05)


def test_the_tool_answers_a_change_of_the_command_as_the_simulation_does(case, tmp_path):
    """The response that the polish takes, by motors, beside the difference of two simulations.

    The gears' outputs are 20 % faster and slower than their motors.
    """
    rough, wanted = (KinematicError(5e-4, 400.0),), case[1]
    robot = replace(
        case[0], joints=tuple(replace(j, kinematic_error=rough) for j in case[0].joints)
    )
    file = build_fmu(robot, tmp_path / "R.fmu", BuildOptions("native"))
    moving = MovingRobot(robot, "linear")
    found = moving.invert(wanted, Controller(), JointLimits.of(robot, None), lambda *progress: None)
    command, begin, joint, change = found.command, 60, 1, 1e-7
    outputs = command.start + 0.004 * np.arange(begin - 5, begin + 20)
    along = AlongMotion(
        moving.model, moving.curve, found.links.theta, found.wrench, moving.elements
    )
    none = np.zeros((len(outputs), moving.model.chain.elastic_count))
    told = along.response(command, range(begin, begin + 1), outputs, none, none[:1])[:, :, 0, joint]
    seen = []
    with RobotFmu(file, "linear") as fmu:
        for sign in (-1.0, 1.0):
            coefficients = command.coefficients.copy()
            coefficients[begin, joint] += sign * change
            own = joint_path(replace(command, coefficients=coefficients))
            fine = SampledPath.of(wanted.path).refined(0.004).path
            path = fmu.simulate(own, wanted.wrench.refined(fine.time), "dynamic")
            rows = np.searchsorted(fine.time, outputs - 1e-9)
            seen.append(path.position[0][rows])
    difference = (seen[1] - seen[0]) / (2.0 * change)
    np.testing.assert_allclose(told[:, :3], difference, rtol=0, atol=5e-3)
    assert np.abs(difference).max() > 0.2

"""Inverse kinematics in C; robots of more than six axes: one posture for each pose, at any sampling."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from coupling.errors import PlanningError
from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.link_model import LinkModel
from coupling.native.desk_robot import ReachRules
from coupling.path.histories import ToolPath
from coupling.robot.batch.following import following
from coupling.robot.batch.part_placement import part_placements
from coupling.robot.batch.redundancy import NearHome
from coupling.robot.batch.rigid_robot import RigidRobot, TipMotion
from coupling.robot.inverse_kinematics import InverseKinematics
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot
from elastic_robot.kinematics import base_from_tool
from tests.helpers.random_robots import make_robot

LINK = Body(2.0, (0.0, 0.0, 0.1), (0.02, 0.02, 0.01))
AXES = {"z": (0.0, 0.0, 1.0), "y": (0.0, 1.0, 0.0), "x": (1.0, 0.0, 0.0)}
HOME = np.deg2rad([10.0, 40.0, -10.0, 90.0, 5.0, 50.0, 5.0])
_RULES = ReachRules(1e-10, 60, 1e-3, 1e-12, 0.3)


def arm(axes: str, limits: tuple[float, float] = (-2.8, 2.8)) -> Robot:
    """Return an arm of so many axes, a little aside of each other, made up."""
    joints = [
        Joint((0.01 * k, 0.0, 0.2), AXES[axis], LINK, 1e4, 10.0, limits=limits)
        for k, axis in enumerate(axes)
    ]
    return Robot("arm", tuple(joints), tcp_position=(0.05, 0.0, 0.15), tcp_rpy=(0.0, -1.2, 0.3))


SEVEN = arm("zyzyzyz")


def pinocchio_of(robot: Robot) -> pin.Model:
    """Return the rigid chain as Pinocchio reads it from a URDF, with the tool as its last frame."""
    links = ["<link name='link0'/>"]
    for k, joint in enumerate(robot.joints, start=1):
        xyz, axis = (" ".join(map(str, values)) for values in (joint.origin, joint.axis))
        links.append(
            f"<link name='link{k}'/><joint name='j{k}' type='revolute'><parent link='link{k - 1}'/>"
            f"<child link='link{k}'/><origin xyz='{xyz}'/><axis xyz='{axis}'/>"
            "<limit lower='-9' upper='9' effort='1' velocity='1'/></joint>"
        )
    xyz, rpy = (" ".join(map(str, v)) for v in (robot.tcp_position, robot.tcp_rpy))
    links.append(
        f"<link name='tool'/><joint name='t' type='fixed'><parent link='link{len(robot.joints)}'/>"
        f"<child link='tool'/><origin xyz='{xyz}' rpy='{rpy}'/></joint>"
    )
    return pin.buildModelFromXML(f"<robot name='r'>{''.join(links)}</robot>")


def tool_at(robot: Robot, q: np.ndarray) -> pin.SE3:
    """Return base_from_tool of the URDF's robot."""
    model = pinocchio_of(robot)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId("tool")].copy()


def line(robot: Robot, home: np.ndarray, way: np.ndarray, turn: np.ndarray, count: int) -> ToolPath:
    """Return a line from the home posture's pose that also turns the tool, at rest at both ends."""
    time = np.linspace(0.0, 2.0, count)
    s = (time / 2.0) ** 3 * (10.0 - 7.5 * time + 1.5 * time**2)
    begin = tool_at(robot, home)
    rotation = Rotation.from_rotvec(s[:, None] * turn) * Rotation.from_matrix(begin.rotation)
    position = begin.translation + s[:, None] * way
    return ToolPath(time, np.hstack([position, rotation.as_quat(canonical=True)]))


def seven_line(count: int) -> ToolPath:
    return line(SEVEN, HOME, np.array([0.1, 0.15, -0.1]), np.array([0.2, -0.1, 0.3]), count)


@pytest.mark.parametrize("count", [12, 400])  # from pose to pose, and between some of them
def test_the_tool_of_a_robot_of_seven_axes_is_on_its_path_by_another_engine(count):
    path = seven_line(count)
    q = InverseKinematics(SEVEN, HOME).plan(path).q[0]
    for k in range(0, count, 5):
        tool = tool_at(SEVEN, q[k])
        np.testing.assert_allclose(tool.translation, path.position[0][k], atol=1e-9)
        np.testing.assert_allclose(tool.rotation, path.rotations[0][k].as_matrix(), atol=1e-9)


def test_a_plan_does_not_depend_on_the_sampling_and_goes_back_the_way_it_came():
    """Ten and a hundred samples of one motion agree to rounding, and so do both directions."""
    few, many = (InverseKinematics(SEVEN, HOME).plan(seven_line(n)).q[0] for n in (21, 401))
    np.testing.assert_allclose(many[::20], few, atol=1e-8)
    path = seven_line(201)
    both = ToolPath(
        np.linspace(0.0, 4.0, 401), np.concatenate([path.pose[0], path.pose[0][-2::-1]])
    )
    q = InverseKinematics(SEVEN, HOME).plan(both).q[0]
    np.testing.assert_allclose(q[::-1], q, atol=1e-8)


@pytest.mark.parametrize("axes", ["zyzyzyz", "zyzyzyzx", "zyzyxyzyz"])
def test_every_posture_is_the_one_nearest_to_home_of_its_pose(axes):
    """SLSQP, on distances by another engine, finds no nearer one around it."""
    robot, home = arm(axes), np.append(HOME, [0.2, -0.3])[: len(axes)]
    path = line(robot, home, np.array([0.05, 0.1, -0.05]), np.array([0.1, 0.0, 0.2]), 6)
    q = InverseKinematics(robot, home).plan(path).q[0]
    model = pinocchio_of(robot)
    data, frame = model.createData(), model.getFrameId("tool")

    for k in (2, 5):
        target = pin.SE3(path.rotations[0][k].as_matrix(), path.position[0][k])

        def missed(angles: np.ndarray, target: pin.SE3 = target) -> np.ndarray:
            pin.framesForwardKinematics(model, data, angles)
            return pin.log6(target.actInv(data.oMf[frame])).vector

        nearest = minimize(
            lambda angles: 0.5 * np.sum((angles - home) ** 2),
            q[k] + 0.02,
            constraints={"type": "eq", "fun": missed},
            options={"ftol": 1e-13, "maxiter": 200},
        )
        np.testing.assert_allclose(q[k], nearest.x, atol=2e-5)


def test_joints_are_kept_within_limits_that_the_nearest_posture_would_break():
    path = seven_line(200)
    free = InverseKinematics(arm("zyzyzyz", (-9.0, 9.0)), HOME).plan(path).q[0]
    joint = 2
    edge = 0.5 * (free[0, joint] + free[-1, joint])
    limits = (edge, 3.0) if free[-1, joint] < edge else (-3.0, edge)
    joints = [
        replace(own, limits=limits) if k == joint else own for k, own in enumerate(SEVEN.joints)
    ]
    held = InverseKinematics(replace(SEVEN, joints=tuple(joints)), HOME).plan(path).q[0]
    assert limits[0] < held[:, joint].min()
    assert held[:, joint].max() < limits[1]
    tool = tool_at(SEVEN, held[-1])
    np.testing.assert_allclose(tool.translation, path.position[0][-1], atol=1e-9)


def test_rates_and_accelerations_are_those_of_the_planned_motion():
    """Central differences of a plan at samples a millisecond apart."""
    step, path = 0.005, seven_line(401)
    q = InverseKinematics(SEVEN, HOME).plan(path).q[0]
    k = 170
    near = NearHome(HOME, JointLimits.of(SEVEN))
    position = path.position[0][k - 1 : k + 2]
    velocity = (position[2] - position[0]) / (2.0 * step)
    acceleration = (position[2] - 2.0 * position[1] + position[0]) / step**2
    turn = path.rotations[0]
    before, after = ((turn[k + n] * turn[k].inv()).as_rotvec() for n in (-1, 1))
    motion = TipMotion(
        velocity[:, None],
        acceleration[:, None],
        ((after - before) / (2.0 * step))[:, None],
        ((after + before) / step**2)[:, None],
    )
    moving = following(RigidRobot(SEVEN), q[k][:, None], np.zeros((3, 1)), motion, near)
    np.testing.assert_allclose(moving.rate[:, 0], (q[k + 1] - q[k - 1]) / (2.0 * step), atol=1e-4)
    second = (q[k + 1] - 2.0 * q[k] + q[k - 1]) / step**2
    np.testing.assert_allclose(moving.acceleration[:, 0], second, atol=2e-3)


def test_conditioning_is_zero_at_singular_postures_alone():
    still = np.zeros((3, 2))
    stretched = np.column_stack([np.zeros(7), HOME])
    at = following(RigidRobot(SEVEN), stretched, still, TipMotion(still, still, still, still))
    straight = replace(
        SEVEN, joints=tuple(replace(j, origin=(0.0, 0.0, 0.2)) for j in SEVEN.joints)
    )
    zero = following(RigidRobot(straight), stretched, still, TipMotion(still, still, still, still))
    assert zero.conditioning[0] < 1e-5
    assert at.conditioning[1] > 0.05


def test_random_lines_are_planned_or_refused_with_their_reason():
    rng, planned, refusals = np.random.default_rng(3), 0, []
    for _ in range(20):
        home = rng.uniform(-1.6, 1.6, 7)
        path = line(SEVEN, home, 0.1 * rng.normal(size=3), 0.2 * rng.normal(size=3), 20)
        try:
            q = InverseKinematics(SEVEN, home).plan(path).q[0]
        except PlanningError as error:
            refusals.append(str(error))
            continue
        planned += 1
        tool = tool_at(SEVEN, q[-1])
        np.testing.assert_allclose(tool.translation, path.position[0][-1], atol=1e-9)
    assert planned >= 10
    reasons = ("out of reach", "singular", "jump", "limits")
    assert all(any(reason in said for reason in reasons) for said in refusals)


def test_parts_are_placed_before_a_robot_of_seven_axes():
    down = Rotation.from_matrix(tool_at(SEVEN, HOME).rotation)
    seats = part_placements(SEVEN, down, 0.03, 3)
    tool = tool_at(SEVEN, seats[0].home)
    np.testing.assert_allclose(tool.translation, seats[0].position, atol=1e-6)


def test_a_robot_of_fewer_axes_follows_what_it_can_and_says_why_it_cannot():
    five = arm("zyyyz")
    home = np.deg2rad([10.0, 20.0, 60.0, 30.0, 5.0])
    still = line(five, home, np.zeros(3), np.zeros(3), 5)
    np.testing.assert_allclose(InverseKinematics(five, home).plan(still).q[0][-1], home, atol=1e-9)
    turned = line(five, home, np.zeros(3), np.array([0.3, 0.4, 0.0]), 5)
    with pytest.raises(PlanningError, match="5 joints hold a tool at few of the orientations"):
        InverseKinematics(five, home).plan(turned)


@pytest.mark.parametrize("seed", range(6))
def test_a_pose_is_reached_as_pinocchio_sees_it(seed: int):
    """To rounding, by 5 to 7 joints from 0.1 rad beside, the tilts bent."""
    robot = make_robot(seed, joints=5 + seed % 3)
    model, rng = LinkModel(robot), np.random.default_rng(seed)
    chain, data = model.chain, model.chain.model.createData()
    theta = chain.theta(rng.normal(size=(9, chain.joint_count)))
    theta[:, model.tilts] = 1e-2 * rng.normal(size=(9, len(model.tilts)))
    poses = np.array([pin.SE3ToXYZQUAT(base_from_tool(chain, data, row)) for row in theta])
    start = theta.copy()
    start[:, chain.drive] += rng.uniform(-0.1, 0.1, size=(9, chain.joint_count))
    found = model.desk.reach(_RULES, poses[:, :3], poses[:, 3:], start)
    came = found.error < _RULES.tolerance
    assert came.mean() > 0.8  # a random posture may be singular
    np.testing.assert_array_equal(found.theta[:, model.tilts], theta[:, model.tilts])
    for row, pose in zip(found.theta[came], poses[came], strict=True):
        apart = base_from_tool(chain, data, row).actInv(pin.XYZQUATToSE3(pose))
        assert np.linalg.norm(pin.log6(apart).vector) < 1e-12


def test_a_pose_out_of_reach_tells_how_far_the_tool_stays_away():
    model = LinkModel(make_robot(1, joints=6))
    away = 3.0 * model.reach
    start, turned = np.zeros((1, model.size)), np.array([[0.0, 0.0, 0.0, 1.0]])
    found = model.desk.reach(_RULES, np.array([[away, 0.0, 0.0]]), turned, start)
    assert found.error[0] > 1.9 * model.reach
    assert 1.9 * model.reach < found.away[0] < 4.1 * model.reach

"""Thousands of settings at once against Pinocchio, NumPy and closed forms, one at a time."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
import tomlkit
from hypothesis import given, settings
from hypothesis import strategies as st
from random_robots import make_robot
from scipy.spatial.transform import Rotation

from coupling.case.file import load_case
from coupling.files.robot_file import load_robot, shipped_robots
from coupling.place.coarse_screen import select_places
from coupling.place.moved_path import waves_of
from coupling.place.placing import placing
from coupling.place.screen import Screen
from coupling.place.settings import NAMES, CellLayout
from coupling.robot.batch.desk_poses import DeskPoses
from coupling.robot.batch.following import Targets, angles_from_home, following, solve_poses
from coupling.robot.batch.rigid_robot import RigidRobot, TipMotion
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.run.gear_loads import diagnose_robots
from docs.scripts.runs import example
from elastic_robot.body import Body
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.kinematics import base_from_tool, tcp_jacobian
from elastic_robot.parameters import Parameters

BATCH = 7


def six_joints(seed: int) -> Robot:
    load = Body(12.0, (0.1, 0.0, 0.2), (0.4, 0.5, 0.6))
    return replace(make_robot(seed, 6), payload=load if seed % 2 else None)


@given(st.integers(0, 10**6))
@settings(max_examples=25, deadline=None)
def test_torques_are_those_of_pinocchio(seed):
    rng = np.random.default_rng(seed)
    robot = six_joints(seed)
    chain, own = build_chain(robot), RigidRobot(robot)
    data = chain.model.createData()
    q, rate, acceleration = rng.normal(size=(3, 6, BATCH))
    gravity = np.repeat(np.array(robot.gravity)[:, None], BATCH, axis=1)
    load = own.load(own.posture(q, np.zeros((3, BATCH))), rate, acceleration, gravity)
    for k in range(BATCH):
        theta = (chain.theta(values[:, k]) for values in (q, rate, acceleration))
        expected = pin.rnea(chain.model, data, *theta)[chain.drive]
        np.testing.assert_allclose(load[:, k], expected, rtol=1e-10, atol=1e-8)


@given(st.integers(0, 10**6))
@settings(max_examples=25, deadline=None)
def test_joints_that_follow_give_the_tool_the_motion_asked_for(seed):
    """J q' = v and J q'' + J' q' = a, J and J' q' being Pinocchio's, with the TCP moved on the tool."""
    rng = np.random.default_rng(seed)
    robot, shift = six_joints(seed), rng.normal(size=3) * 0.05
    turned = Rotation.from_euler("xyz", robot.tcp_rpy).apply(shift)
    moved = replace(robot, tcp_position=tuple((np.array(robot.tcp_position) + turned).tolist()))
    chain, own = build_chain(moved), RigidRobot(robot)
    data = chain.model.createData()
    q, wanted = rng.normal(size=(6, BATCH)), rng.normal(size=(4, 3, BATCH))
    motion = TipMotion(wanted[0], wanted[1], wanted[2], wanted[3])
    found = following(own, q, np.repeat(shift[:, None], BATCH, axis=1), motion)
    for k in np.flatnonzero(found.conditioning > 0.02):
        theta, rate = chain.theta(q[:, k]), chain.theta(found.rate[:, k])
        jacobian = tcp_jacobian(chain, data, theta)
        np.testing.assert_allclose(jacobian @ rate, [*wanted[0, :, k], *wanted[2, :, k]], atol=1e-6)
        pin.forwardKinematics(chain.model, data, theta, rate, chain.theta(found.acceleration[:, k]))
        pin.updateFramePlacements(chain.model, data)
        frame = (chain.model, data, chain.tcp, pin.LOCAL_WORLD_ALIGNED)
        linear = pin.getFrameClassicalAcceleration(*frame)
        size = 1.0 + np.abs(found.rate[:, k]).max() ** 2
        np.testing.assert_allclose(linear.linear, wanted[1, :, k], atol=1e-7 * size)
        np.testing.assert_allclose(linear.angular, wanted[3, :, k], atol=1e-7 * size)
        scaled = jacobian[:, chain.drive] / np.array([own.reach] * 3 + [1.0] * 3)[:, None]
        least = np.linalg.svd(scaled)[1][-1]
        assert 0.4 * least <= found.conditioning[k] <= least * (1 + 1e-6)


@pytest.mark.parametrize("name", shipped_robots())
def test_a_robot_finds_the_poses_that_it_has_been_in(name):
    rng = np.random.default_rng(3)
    robot = load_robot(shipped_robots()[name])
    own, home = RigidRobot(robot), np.deg2rad([0.0, 10.0, 20.0, 0.0, 60.0, 0.0])
    limits = np.array([joint.limits or (-3.0, 3.0) for joint in robot.joints])
    home = np.clip(home, limits[:, 0] + 0.5, limits[:, 1] - 0.5)
    q = home[:, None] + rng.uniform(-0.4, 0.4, (6, 200))
    none = np.zeros((3, 200))
    posture = own.posture(q, none)
    targets = Targets(posture.tip, posture.tool, none)
    start = np.repeat(home[:, None], 200, axis=1)
    found, came = solve_poses(own, targets, start)
    assert came.mean() > 0.97
    again = own.posture(found[:, came], none[:, came])
    np.testing.assert_allclose(again.tip, posture.tip[:, came], atol=1e-7)
    desk = DeskPoses.of(robot)
    same, came_too = desk.solve(targets, start, 30)
    assert came_too.mean() > 0.97
    again = own.posture(same[:, came_too], none[:, came_too])
    np.testing.assert_allclose(again.tip, posture.tip[:, came_too], atol=1e-8)
    # Some are reached in another configuration.
    assert np.mean(np.abs(same - found).max(axis=0) < 1e-6) > 0.9
    far, came = angles_from_home(own, targets, home, desk.solve)
    assert came.mean() > 0.97
    np.testing.assert_allclose(own.posture(far, none).tip[:, came], posture.tip[:, came], atol=1e-7)


def test_the_tool_is_where_a_shifted_tcp_is_to_be():
    robot = load_robot(shipped_robots()["icme2008"])
    own, rng = RigidRobot(robot), np.random.default_rng(8)
    q = np.deg2rad([[0.0], [10.0], [20.0], [0.0], [60.0], [0.0]]) + rng.uniform(-0.2, 0.2, (6, 20))
    shift = rng.normal(size=(3, 20)) * 0.02
    there = own.posture(q, shift)
    found, came = DeskPoses.of(robot).solve(Targets(there.tip, there.tool, shift), q + 0.1, 30)
    assert came.all()
    np.testing.assert_allclose(found, q, atol=1e-9)


def test_a_pose_that_is_out_of_reach_is_said_to_be():
    robot = load_robot(shipped_robots()["icme2008"])
    own = RigidRobot(robot)
    here = own.posture(np.zeros((6, 1)), np.zeros((3, 1)))
    away = Targets(here.tip + np.array([[9.0], [0.0], [0.0]]), here.tool, np.zeros((3, 1)))
    home = np.deg2rad([0.0, 10.0, 20.0, 0.0, 60.0, 0.0])
    _, came = angles_from_home(own, away, home, DeskPoses.of(robot).solve)
    assert not came.any()


@pytest.fixture(scope="module")
def cone():
    """The example cone with two contours."""
    case = example("cone", tool_path={"depth_m": 0.001})
    return placing(case, case.process, "both")


def test_displacement_and_compliance_are_those_of_all_springs(cone):
    """x = J K^-1 J^T w with the Jacobian of gears and tilts, Pinocchio's."""
    few = cone.stations.chosen(np.array([0, 200, 700]))
    rng = np.random.default_rng(4)
    tried = cone.ranges.sampled(64, 1)[rng.choice(64, 5, replace=False)]
    screen = cone.screen(few)
    batch, figures = screen.batch(tried), screen.figures(tried)
    assert np.isfinite(batch.deviation).all()
    chain, springs = build_chain(cone.robot), Parameters.of(cone.robot)
    placed = cone.cell.placed(tried)
    for k in range(len(tried)):
        moved, soft = [], []
        for place in range(few.count):
            data = chain.model.createData()
            theta = chain.theta(batch.q[place, :, k])
            jacobian = tcp_jacobian(chain, data, theta)
            pose = base_from_tool(chain, data, theta)
            target = placed.position[k] + placed.part[k].apply(few.position[place])
            # The TCP is the lowest point of the tool's sphere, not the tip along its axis.
            lowest = target - pose.translation
            jacobian[:3] += np.cross(jacobian[3:], lowest, axis=0)
            elastic = jacobian[:, chain.elastic]
            wrench = few.wrench[place].reshape(2, 3)
            push = elastic.T @ np.concatenate([placed.part[k].apply(v) for v in wrench])
            moved.append(np.linalg.norm(elastic[:3] @ (push / springs.stiffness)))
            matrix = elastic[:3] @ np.diag(1.0 / springs.stiffness) @ elastic[:3].T
            soft.append(np.linalg.eigvalsh(matrix)[-1])
        np.testing.assert_allclose(figures.deviation[k], max(moved), rtol=1e-6)
        np.testing.assert_allclose(figures.compliance[k], max(soft), rtol=1e-6)


def test_the_places_looked_at_know_the_extremes_of_the_whole_path(cone):
    """On settings that had no say in their choice: torques to a twelfth of what they pass through."""
    every = cone.stations.strongest()
    chosen = every.chosen(select_places(cone.screen, every, cone.ranges, seed=1))
    assert chosen.count <= 24
    fresh = cone.ranges.sampled(24, seed=9)
    few, all_ = (cone.screen(s).figures(fresh) for s in (chosen, every))
    good = all_.reached & few.reached & (all_.conditioning > 0.03)
    assert good.sum() >= 20
    missed = (few.margin[good] - all_.margin[good]) / all_.swing[good]
    assert missed.max() < 1.0 / 12.0
    assert missed.min() > -1e-6
    np.testing.assert_allclose(few.deviation[good], all_.deviation[good], rtol=0.03)


def test_margins_are_those_of_the_diagnosis(cone):
    """That one solves the links' motion at 4 ms, tilts at rest under their loads."""
    present = cone.present[None]
    figures = cone.screen(cone.stations).figures(present)
    wrench = cone.case.process.evaluate(cone.case.desired).wrench
    (gears,) = diagnose_robots(cone.case.robots, cone.case.desired, wrench)
    exact = np.array([gear.margin for gear in gears])
    np.testing.assert_allclose(figures.margin[0], exact, atol=0.03 * figures.swing[0].max())
    np.testing.assert_allclose(
        figures.backlash_error[0], [gear.backlash_error for gear in gears], rtol=5e-3
    )


def test_a_part_turned_with_its_robot_is_the_same_part(cone):
    """Yaw about the base's axis: robot, path and wrench turn; gravity does not."""
    few = cone.stations.chosen(np.arange(0, cone.stations.count, 150))
    rng = np.random.default_rng(1)
    one = np.tile(cone.present, (6, 1))
    one[:, NAMES.index("lead")] = rng.uniform(-0.3, 0.3, 6)
    other, turns = one.copy(), rng.uniform(-0.8, 0.8, 6)
    other[:, :3] = Rotation.from_rotvec(np.outer(turns, [0, 0, 1])).apply(one[:, :3])
    other[:, NAMES.index("yaw")] += turns
    before, after = (cone.screen(few).figures(each) for each in (one, other))
    np.testing.assert_allclose(after.margin, before.margin, rtol=1e-5, atol=1e-3)
    np.testing.assert_allclose(after.deviation, before.deviation, rtol=1e-6)


def test_settings_do_not_depend_on_their_neighbours(cone):
    """Few settings are solved many places at once, many settings place by place."""
    few = cone.stations.chosen(np.arange(0, cone.stations.count, 130))
    many = cone.ranges.sampled(2048, seed=2)
    screen = cone.screen(few)
    together, alone = screen.figures(many), screen.figures(many[:3])
    np.testing.assert_allclose(together.margin[:3], alone.margin, rtol=1e-4, atol=0.01)
    np.testing.assert_array_equal(together.reached[:3], alone.reached)


def test_joint_limits_and_rates_are_those_of_the_planned_path():
    case = example("iso9283", tool_path={"size_m": 0.3, "feed_m_s": 0.5})
    base = case.robots[0].description
    joints = [replace(joint, limits=(-2.0, 2.5), max_rate=0.5) for joint in base.joints]
    robot = replace(base, joints=tuple(joints))
    place = placing(case, case.process)
    screen = Screen(robot, place.gears, place.arm, place.cell, place.stations)
    figures = screen.figures(place.present[None])
    planned = InverseKinematics(robot, case.robots[0].home).plan(case.desired)
    q = planned.q[0]
    np.testing.assert_allclose(
        figures.limit_margin[0], np.minimum(q + 2.0, 2.5 - q).min(), atol=1e-5
    )
    rates = np.abs(np.gradient(q, planned.time, axis=0)).max()
    np.testing.assert_allclose(figures.rate_share[0], rates / 0.5, rtol=0.02)


@given(st.integers(0, 10**6), st.integers(1, 40), st.floats(0.01, 3.0))
@settings(max_examples=30, deadline=None)
def test_every_place_is_reached_once_from_one_before_it(seed, count, near):
    """From one that is near, or where none is from as near a one as there is."""
    position = np.random.default_rng(seed).normal(size=(count, 3))
    done: list[int] = []
    for places, before in waves_of(position, near):
        left = [k for k in range(count) if k not in done]
        if before is None:
            assert not done
        else:
            assert set(before.tolist()) <= set(done)
            away = np.linalg.norm(position[places] - position[before], axis=1)
            nearest = np.linalg.norm(position[left][:, None] - position[done], axis=2).min()
            assert np.all(away <= max(near, nearest * (1.0 + 1e-12)))
        done += places.tolist()
    assert sorted(done) == list(range(count))


def test_a_cell_places_part_tool_and_base_as_a_case_does(cone, tmp_path):
    """The same poses and gravity as those of the case file of the setting, in the frame of the base."""
    place, case = cone, cone.case
    setting = place.ranges.sampled(8, 3)[5].copy()
    setting[NAMES.index("base_roll")] = 0.1
    file = tmp_path / "placed.toml"
    file.write_text(tomlkit.dumps(place.content(setting, case.robots[0].home)))
    other = load_case(file)
    robot, rows = other.robots[0], np.array([100, 700])
    path = other.desired.transformed(robot.world_from_base.inverse())
    placed: CellLayout = place.cell
    screen = place.screen(place.stations.chosen(rows))
    batch = screen.batch(setting[None])
    chain = build_chain(robot.description)
    data = chain.model.createData()
    for k, row in enumerate(rows):
        pose = base_from_tool(chain, data, chain.theta(batch.q[k, :, 0]))
        np.testing.assert_allclose(pose.translation, path.position[0, row], atol=1e-7)
        turn = Rotation.from_matrix(pose.rotation) * path.rotations[0][int(row)].inv()
        assert turn.magnitude() < 1e-6
    gravity = placed.placed(setting[None]).gravity[0]
    np.testing.assert_allclose(robot.description.gravity, gravity, atol=1e-12)

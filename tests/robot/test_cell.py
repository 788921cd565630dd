"""Two robots in a cell: placements, support paths, the pinch in closed form, a case by name."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from spring_robot import SpringPlanner, SpringRobot, upright

from coupling.path.contact_spring import ContactSpring
from coupling.path.deviation import measure
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory, poses
from coupling.process import ProcessResponse
from coupling.process.isf_force_law import DoubleSided
from coupling.robot.cell import Cell, Member
from coupling.solve.coupling import couple
from coupling.solve.fixed_point import Loop, Tolerance
from coupling.solve.schemes import SCHEMES
from coupling.toolpaths import Cone
from coupling.toolpaths.support import STRATEGIES, Pinch, SupportingTool, support_along

TIME = np.linspace(0.0, 1.0, 20)


def random_path(rng: np.random.Generator) -> ToolPath:
    turned = Rotation.random(len(TIME), random_state=rng.integers(2**31))
    return ToolPath(TIME, poses(rng.normal(size=(len(TIME), 3)), turned))


@given(st.integers(0, 10**6))
def test_a_wrench_and_its_spring_do_the_same_work_in_all_frames(seed):
    """A load in world axes does on motions in the world what its image does in the base."""
    rng = np.random.default_rng(seed)
    rotation = Rotation.random(random_state=rng.integers(2**31))
    world_from_base, path = Frame(rng.normal(size=3), rotation), random_path(rng)
    base_from_world = world_from_base.inverse()
    back = path.transformed(world_from_base).transformed(base_from_world)
    np.testing.assert_allclose(back.pose, path.pose, rtol=0, atol=1e-12)
    root = rng.normal(size=(1, len(TIME), 3, 3))
    spring = ContactSpring(rng.normal(size=(1, len(TIME), 3)), root @ root.swapaxes(-1, -2))
    wrench = WrenchHistory(TIME, rng.normal(size=(len(TIME), 6)), spring)
    moved = path.displaced(1e-6 * rng.normal(size=(1, len(TIME), 6)))
    in_world = [own.transformed(world_from_base) for own in (path, moved)]
    loads = wrench.on(in_world[0])
    image = wrench.transformed(base_from_world).on(path)
    work = np.sum(loads.wrench * in_world[1].deviation_from(in_world[0]), axis=2)
    own = np.sum(image.wrench * moved.deviation_from(path), axis=2)
    np.testing.assert_allclose(own, work, rtol=0, atol=1e-13)


@given(st.integers(0, 10**6))
def test_tools_side_by_side_deviate_each_for_itself(seed):
    rng = np.random.default_rng(seed)
    first, second = random_path(rng), random_path(rng)
    both = ToolPath.of_tools([first, second])
    by = 0.1 * rng.normal(size=(2, len(TIME), 6))
    moved = both.displaced(by)
    np.testing.assert_allclose(moved.deviation_from(both), by, rtol=0, atol=1e-12)
    for k, alone in enumerate((first, second)):
        expected = alone.displaced(by[k][None])
        assert np.array_equal(moved.tools[k].pose, expected.pose)
    distances = np.linalg.norm(by[..., :3], axis=2)
    np.testing.assert_allclose(moved.distance_to(both), distances.max(axis=0), atol=1e-12)
    assert measure(moved, both).maximum == pytest.approx(distances.max(), rel=1e-9)


def test_paths_of_tools_that_do_not_belong_together_are_refused():
    both = ToolPath.of_tools([ToolPath(TIME, upright(np.zeros((20, 3))))] * 2)
    with pytest.raises(ValueError, match="different times"):
        ToolPath.of_tools([both.tools[0], ToolPath(2.0 * TIME, both.tools[0].pose)])
    with pytest.raises(ValueError, match=r"values \(tools, n, 7\), .*, got shape \(20, 13\)"):
        ToolPath(TIME, np.zeros((20, 13)))


class ConstantForce:
    """A forming force of 400 N against +z, wherever the tool is."""

    identity = ""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        wrench = np.tile([0, 0, -400.0, 0, 0, 0], (len(path.time), 1))
        return ProcessResponse(WrenchHistory(path.time, wrench))


@pytest.mark.parametrize("scheme", ["aitken", "anderson"])
def test_springs_on_both_sides_of_a_sheet_rest_at_the_closed_form(scheme):
    """c (1 + k (C_f + C_s)) = -F (C_f + s C_s): both give way, the gap opens by -c.

    The supporting robot stands upside down, so that signs of its frame would show.
    """
    compliance = {"forming": 2e-6, "support": 1e-6}  # [m/N]
    force, share, stiffness = 400.0, 0.6, 1e5
    placements = {
        "forming": Frame(np.array([0.1, 0.2, 0.3]), Rotation.from_euler("z", 0.7)),
        "support": Frame(np.array([-1.0, 0.5, 2.0]), Rotation.from_euler("x", np.pi)),
    }
    cell = Cell(
        tuple(
            Member(name, placements[name], SpringRobot(c * np.eye(3)), SpringPlanner())
            for name, c in compliance.items()
        )
    )
    line = np.column_stack([0.1 * TIME, 0.0 * TIME, 0.0 * TIME])
    forming, behind = (
        ToolPath(TIME, upright(line + np.array([0.0, 0.0, height]))) for height in (0.0, 1e-3)
    )
    up = np.tile([0.0, 0.0, 1.0], (len(TIME), 1))  # from the forming tool to the sheet's back
    support = SupportingTool(forming, behind, up, gap=1e-3, tool_diameter=0.01)
    process = DoubleSided(ConstantForce(), support, share, stiffness)
    desired = ToolPath.of_tools([forming, behind])
    command = cell.plan(desired)
    start = cell.simulate(command, WrenchHistory.none(TIME, tools=2), "quasistatic")
    np.testing.assert_allclose(start.distance_to(desired), 0.0, atol=1e-12)
    tolerance = Tolerance(1e-12, 1e-12, 1e-9)
    loop = Loop(cell, process, "quasistatic", SCHEMES[scheme](1.0), tolerance, 60)
    result = couple(loop, command)
    assert result.converged, result.reason
    both = compliance["forming"] + compliance["support"]
    opening = (
        force * (compliance["forming"] + share * compliance["support"]) / (1.0 + stiffness * both)
    )
    np.testing.assert_allclose(support.opening(result.path), opening, rtol=1e-6)
    borne = share * force - stiffness * opening
    on_forming, on_support = result.response.wrench.force[..., 2]
    np.testing.assert_allclose(on_support, borne, rtol=1e-6)
    pinch = borne - share * force
    np.testing.assert_allclose(on_forming, -force - pinch, rtol=1e-6)


def cone_task() -> tuple[Frame, ToolPath]:
    part = Frame(np.array([1.0, 0.2, 0.5]), Rotation.from_euler("x", 0.3))
    cone = Cone(
        kind="cone",
        radius_m=0.03,
        wall_angle_deg=40.0,
        step_down_m=0.001,
        depth_m=0.008,
        feed_m_s=0.1,
        sample_s=0.01,
    )
    return part, cone.path(part)


R_FORMING, R_SUPPORT, GAP = 5e-3, 6e-3, 1.2e-3


def supported(strategy: str) -> tuple[np.ndarray, np.ndarray, SupportingTool]:
    part, desired = cone_task()
    pinch = Pinch(np.deg2rad(40.0), GAP, 2 * R_FORMING, 2 * R_SUPPORT)
    found = support_along(strategy, part, desired, 0.0, pinch)
    forming, behind = (part.coordinates(path.position[0]) for path in (desired, found.desired))
    return forming, behind, found


def test_a_following_support_keeps_the_gap_between_the_spheres_across_the_wall():
    """Distance of the centres less both radii, wherever the forming tool is in the sheet."""
    forming, behind, found = supported("following")
    up = np.array([0.0, 0.0, 1.0])
    centres = forming + R_FORMING * up, behind - R_SUPPORT * up
    distance = np.linalg.norm(centres[1] - centres[0], axis=1) - R_FORMING - R_SUPPORT
    end = np.argmin(forming[:, 2]) + 50  # then the tool leaves
    inside = forming[:end, 2] <= 0.0
    np.testing.assert_allclose(distance[:end][inside], GAP, rtol=0, atol=1e-12)
    assert behind[:, 2].max() <= -GAP + 1e-12  # never through the flat sheet
    part, _ = cone_task()
    across = part.rotation.inv().apply(found.direction)
    deep = forming[:, 2] < -7e-3
    np.testing.assert_allclose(across[deep, 2], -np.cos(np.deg2rad(40.0)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(across, axis=1), 1.0, atol=1e-12)


def test_a_support_at_fixed_height_stays_below_the_rim():
    forming, behind, _ = supported("fixed-height")
    inside = forming[:, 2] < 0.0
    before_leaving = np.arange(len(inside)) <= np.flatnonzero(forming[:, 2] <= -8e-3 + 1e-12)[-1]
    rim = np.linalg.norm(behind[inside & before_leaving, :2], axis=1)
    np.testing.assert_allclose(rim, 0.03, atol=1e-12)
    np.testing.assert_allclose(behind[:, 2], -GAP, rtol=0, atol=1e-12)


def test_supporting_tools_look_at_the_forming_tool():
    """Approach axes are opposite, z axes alike: a robot that stands face to face holds it upright."""
    for strategy in STRATEGIES:
        _, desired = cone_task()
        *_, found = supported(strategy)
        forming, behind = (path.rotations[0].as_matrix()[0] for path in (desired, found.desired))
        np.testing.assert_allclose(behind[:, 0], -forming[:, 0], atol=1e-12)
        np.testing.assert_allclose(behind[:, 2], forming[:, 2], atol=1e-12)


def test_opening_is_the_drift_of_the_tools_across_the_sheet():
    _, desired = cone_task()
    *_, found = supported("following")
    both = ToolPath.of_tools([desired, found.desired])
    assert np.all(found.opening(both) == 0.0)
    drift = np.zeros((2, len(desired.time), 6))
    drift[..., :3] = [1e-4 * found.direction, 3e-4 * found.direction]
    np.testing.assert_allclose(found.opening(both.displaced(drift)), 2e-4, atol=1e-12)

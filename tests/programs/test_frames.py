"""Poses of programs: products, and their expression in other bases and tools."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from coupling.errors import ProgramError
from coupling.programs.frames import ControllerFrame, PoseFrames
from coupling.programs.poses import inverse, pose_of_quaternion, pose_of_zyx, product
from coupling.programs.program import ProgramMove

ANGLES = st.tuples(*[st.floats(-360.0, 360.0)] * 3)
PLACES = st.tuples(*[st.floats(-3000.0, 3000.0)] * 3)
POSES = st.builds(pose_of_zyx, PLACES, ANGLES)


def matrix(pose):
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = Rotation.from_quat(pose[3:]).as_matrix(), pose[:3]
    return result


@given(POSES, POSES)
def test_products_and_inverses_are_those_of_matrices(a, b):
    np.testing.assert_allclose(matrix(product(a, b)), matrix(a) @ matrix(b), atol=1e-12)
    np.testing.assert_allclose(matrix(inverse(a)), np.linalg.inv(matrix(a)), atol=1e-12)
    assert product(a, b)[6] >= 0.0
    assert inverse(a)[6] >= 0.0


@given(PLACES, ANGLES)
def test_angles_are_about_z_then_y_then_x(place, angles):
    expected = Rotation.from_euler("ZYX", angles, degrees=True).as_matrix()
    pose = pose_of_zyx(place, angles)
    np.testing.assert_allclose(matrix(pose)[:3, :3], expected, atol=1e-12)
    x, y, z, w = pose[3:]
    np.testing.assert_allclose(
        pose_of_quaternion(place, (3 * w, 3 * x, 3 * y, 3 * z)), pose, atol=1e-12
    )


@given(POSES, POSES, POSES, POSES, POSES)
def test_a_pose_in_another_base_and_of_another_tool_is_the_same_flange(
    base, other, tool, second, pose
):
    """World from flange is base * pose * tool^-1, whichever pair the pose is expressed in."""
    frames = PoseFrames()
    first = ControllerFrame("B1", base), ControllerFrame("T1", tool)
    assert frames.express(pose, *first, True, "here") == pose
    changed = ControllerFrame("B2", other), ControllerFrame("T2", second)
    expressed = frames.express(pose, *changed, False, "here")
    flange = matrix(other) @ matrix(pose) @ np.linalg.inv(matrix(second))
    found = matrix(base) @ matrix(expressed) @ np.linalg.inv(matrix(tool))
    np.testing.assert_allclose(found, flange, atol=1e-11)


@given(POSES, POSES, POSES, POSES, POSES)
def test_what_leads_to_the_first_line_is_expressed_in_its_frames(base, other, tool, second, pose):
    """The flange stays; later lines are expressed in those of the first one as well."""
    frames = PoseFrames()
    home = ControllerFrame("world", base), ControllerFrame("flange", tool)
    moves = [ProgramMove("joint", frames.express(pose, *home, False, "here"))]
    line = ControllerFrame("part", other), ControllerFrame("mill", second)
    frames.begin_line(moves, *line, "there")
    assert frames.express(pose, *line, True, "there") == pose
    flange = matrix(base) @ matrix(pose) @ np.linalg.inv(matrix(tool))
    led = matrix(other) @ matrix(moves[0].pose) @ np.linalg.inv(matrix(second))
    np.testing.assert_allclose(led, flange, atol=1e-11)
    frames.begin_line(moves, *home, "behind")
    assert (frames.base, frames.tool) == line


def test_a_base_that_the_program_does_not_tell_is_refused_by_name():
    frames, pose = PoseFrames(), pose_of_zyx([1.0, 2.0, 3.0], [0.0, 0.0, 0.0])
    tool = ControllerFrame("$TOOL", pose)
    frames.express(pose, ControllerFrame("BASE_DATA[1]", None), tool, True, "line 1")
    with pytest.raises(ProgramError, match=r"line 2: .*BASE_DATA\[2\] behind BASE_DATA\[1\]"):
        frames.express(pose, ControllerFrame("BASE_DATA[2]", pose), tool, True, "line 2")


def test_another_tool_that_turns_on_a_line_is_refused():
    """A line of one point of a turning tool is none of another."""
    frames, base = PoseFrames(), ControllerFrame("$BASE", pose_of_zyx([0.0] * 3, [0.0] * 3))
    tools = [
        ControllerFrame(f"TOOL {k}", pose_of_zyx([0, 0, 100.0 * k], [0.0] * 3)) for k in (1, 2)
    ]
    frames.express(pose_of_zyx([0.0] * 3, [0.0] * 3), base, tools[0], True, "line 1")
    frames.express(pose_of_zyx([50.0, 0, 0], [0.0] * 3), base, tools[1], True, "line 2")
    with pytest.raises(ProgramError, match=r"line 3: .*TOOL 2 behind TOOL 1"):
        frames.express(pose_of_zyx([50.0, 9.0, 0], [0.0, 1.0, 0]), base, tools[1], True, "line 3")

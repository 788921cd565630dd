"""Programs as text: what is written is read back, to the digits of the text and of single precision."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from coupling.programs.angles import abc_of, pose_of_abc, pose_of_wpr, wpr_of
from coupling.programs.languages import LANGUAGES
from coupling.programs.program import Configuration, ProgramMove, RobotProgram

POSED = [name for name, own in LANGUAGES.items() if "cartesian" in own.targets]
# Half of the last decimal, 1e-4 mm and 1e-5 deg, and of single precision at 3 m and 180 deg.
POSITION, ANGLE = 0.5e-7 + 1.3e-7, np.deg2rad(0.5e-5 + 0.8e-5)

unit = st.floats(-1.0, 1.0)
positions = st.tuples(*[st.floats(-3.0, 3.0)] * 3)
# Any rotation, and those where two of three Euler angles turn about one axis.
quaternions = st.one_of(
    st.tuples(unit, unit, unit, unit).filter(lambda q: sum(x * x for x in q) > 0.01),
    st.tuples(st.sampled_from([90.0, -90.0, 89.9999, -89.99999]), *[st.floats(-180, 180)] * 2).map(
        lambda a: tuple(Rotation.from_euler("ZYX", [a[1], a[0], a[2]], degrees=True).as_quat())
    ),
)


def pose_of(position, quaternion):
    turned = Rotation.from_quat(quaternion).as_quat()
    turned *= 1.0 if turned[3] >= 0.0 else -1.0
    return (*position, *turned.tolist())


poses = st.builds(pose_of, positions, quaternions)
# Joints 4 and 6 turn more than once.
joints = st.tuples(*[st.floats(-7.0, 7.0)] * 6)
durations = st.integers(1, 2000).map(lambda ms: 1e-3 * ms)


def apart(pose, other) -> tuple[float, float]:
    """Return distance [m] and angle [rad] between poses."""
    turn = Rotation.from_quat(pose[3:]) * Rotation.from_quat(other[3:]).inv()
    return float(np.linalg.norm(np.subtract(pose[:3], other[:3]))), float(turn.magnitude())


def require_close(pose, other) -> None:
    distance, angle = apart(pose, other)
    assert distance <= np.sqrt(3.0) * POSITION
    assert angle <= 3.0 * ANGLE


@pytest.mark.parametrize("name", POSED)
@given(
    base=poses,
    tool=poses,
    start=joints,
    path=st.lists(poses, min_size=2, max_size=3),
    time=durations,
)
def test_poses_frames_and_times_come_back(name, base, tool, start, path, time):
    language = LANGUAGES[name]
    motion = "spline" if language.between == "spline" else "linear"
    posture = Configuration(False, True, -1, start)
    moves = [
        ProgramMove("joint", joints=start),
        ProgramMove("linear", path[0], speed=0.01, configuration=posture),
    ]
    times = [time, 0.5 + time][: len(path) - 1]
    moves += [
        ProgramMove(motion, pose, duration=duration, configuration=posture)
        for pose, duration in zip(path[1:], times, strict=True)
    ]
    found = language.read(language.write(RobotProgram("WAY", tuple(moves), base, tool)))
    assert found.name == "WAY"
    require_close(found.base, base)
    require_close(found.tool, tool)
    assert [move.motion for move in found.moves] == [move.motion for move in moves]
    np.testing.assert_allclose(found.moves[0].joints, start, atol=ANGLE + 1e-5 * ANGLE, rtol=1e-7)
    for move, written in zip(found.timed, moves[1:], strict=True):
        require_close(move.pose, written.pose)
    assert found.timed[0].speed == pytest.approx(0.01, rel=1e-6)
    assert [move.duration for move in found.timed[1:]] == pytest.approx(times, rel=3e-7, abs=1e-9)


@pytest.mark.parametrize("name", LANGUAGES)
@given(path=st.lists(joints, min_size=2, max_size=4), time=durations)
def test_joint_angles_and_times_come_back_turns_and_all(name, path, time):
    language = LANGUAGES[name]
    motion = "spline" if language.between == "spline" else "joint"
    moves = [ProgramMove("joint", joints=path[0])]
    moves += [ProgramMove(motion, joints=angles, duration=time) for angles in path[1:]]
    found = language.read(language.write(RobotProgram("WAY", tuple(moves))))
    assert [move.motion for move in found.moves] == [move.motion for move in moves]
    np.testing.assert_allclose([move.joints for move in found.moves], path, atol=ANGLE, rtol=1e-7)
    for move in found.moves[1:]:
        assert move.duration == pytest.approx(time, rel=2e-7, abs=1e-9)


@given(pose=poses)
def test_the_makers_angles_are_products_of_single_turns(pose):
    """KUKA: Rz(A) Ry(B) Rx(C), each about the new axis; FANUC: W, P, R about the fixed x, y, z."""
    wanted = Rotation.from_quat(pose[3:]).as_matrix()

    def about(axis: str, angle: float) -> np.ndarray:
        return Rotation.from_euler(axis, angle, degrees=True).as_matrix()

    row = np.array([pose])
    a, b, c = abc_of(row)[0]
    np.testing.assert_allclose(about("z", a) @ about("y", b) @ about("x", c), wanted, atol=1e-8)
    w, p, r = wpr_of(row)[0]
    np.testing.assert_allclose(about("z", r) @ about("y", p) @ about("x", w), wanted, atol=1e-8)
    for read, angles in ((pose_of_abc, (a, b, c)), (pose_of_wpr, (w, p, r))):
        millimetres = 1e3 * np.array(pose[:3])
        distance, angle = apart(read((*millimetres, *angles)), pose)
        assert distance < 1e-12
        assert angle < 2e-8


def test_turns_beyond_half_a_turn_are_counted():
    """Angles of joints 1, 4, 6 from their quarter (ABB) and from their turn (FANUC)."""
    posture = Configuration(True, False, 1, tuple(np.deg2rad([-91.0, 0, 0, 200.0, 30.0, -541.0])))
    assert posture.quadrants == (-2, 2, -7)
    assert posture.turns == (0, 1, -2)
    pose = (1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    moves = [
        ProgramMove("joint", joints=posture.angles),
        ProgramMove("linear", pose, configuration=posture),
    ]
    program = RobotProgram(
        "WAY", (*moves, ProgramMove("linear", pose, duration=1.0, configuration=posture))
    )
    (rapid,) = LANGUAGES["rapid"].write(program)
    assert "[-2,2,-7,4]" in rapid.text  # behind axis 1, joint 5 positive
    (fanuc,) = LANGUAGES["fanuc"].write(program)
    assert "CONFIG : 'F U B, 0, 1, -2'" in fanuc.text


@pytest.mark.parametrize("border_deg", [0.0, 90.0, -180.0, 360.0])
def test_a_posture_does_not_change_its_turns_by_rounding(border_deg):
    """A joint that rests on a border of its turns is computed a few 1e-16 rad to either side of it."""

    def named(off: float) -> tuple:
        found = Configuration(False, False, 1, (np.deg2rad(border_deg) + off,) * 6)
        return found.quadrants, found.turns, found.turn

    assert named(-1e-12) == named(0.0) == named(1e-12)
    assert named(-1e-6) != named(0.0)


def test_krl_points_have_status_and_turn_where_the_posture_is_known():
    posture = Configuration(True, False, -1, (-0.1, -1.0, 1.5, 0.0, -0.4, 3.0))
    pose = (1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

    def points(named: Configuration | None) -> str:
        moves = [
            ProgramMove("joint", joints=posture.angles),
            ProgramMove("linear", pose, configuration=named),
        ]
        moves.append(ProgramMove("spline", pose, duration=1.0, configuration=named))
        return LANGUAGES["krl"].write(RobotProgram("WAY", tuple(moves)))[1].text

    assert "DECL POS P[2]" in points(posture)
    assert points(posture).count(",S 7,T 19}") == 2
    assert "DECL FRAME P[2]" in points(None)
    assert ",S " not in points(None)


def test_a_long_fanuc_program_is_called_in_parts():
    poses = [(1.0 + 1e-4 * k, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0) for k in range(10_100)]
    posture = Configuration(False, False, -1, (0.0,) * 6)
    moves = [
        ProgramMove("joint", joints=posture.angles),
        ProgramMove("linear", poses[0], configuration=posture),
    ]
    moves += [
        ProgramMove("linear", pose, duration=0.004, configuration=posture) for pose in poses[1:]
    ]
    files = LANGUAGES["fanuc"].write(RobotProgram("LONG", tuple(moves)))
    assert [file.name for file in files] == ["LONG.ls", "LONG_1.ls", "LONG_2.ls"]
    assert max(len(re.findall(r"^ *\d+:", file.text, re.MULTILINE)) for file in files) == 9999
    assert max(len(re.findall(r"^P\[", file.text, re.MULTILINE)) for file in files) == 9999
    assert all(len(line) <= 254 for file in files for line in file.text.splitlines())
    found = LANGUAGES["fanuc"].read(files)
    assert len(found.timed) == len(poses)
    np.testing.assert_allclose([m.pose[0] for m in found.timed], [p[0] for p in poses], atol=2e-7)

"""Arcs of robot programs: chords on the circle through three points, with the tool as it is turned."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from krl_programs import places, program
from scipy.spatial.transform import Rotation

from coupling.errors import ProgramError
from coupling.programs.circles import add_arc
from coupling.programs.program import ProgramMove

UPRIGHT = Rotation.from_euler("y", 0.5 * np.pi)
angles = st.floats(0.3, 6.0)


def move(place: np.ndarray, rotation: Rotation = UPRIGHT, **keys: float) -> ProgramMove:
    return ProgramMove("linear", (*place.tolist(), *rotation.as_quat().tolist()), **keys)


def arc(start: ProgramMove, via: np.ndarray, end: ProgramMove, turning, angle=None):
    """Return places [m], (n, 3), and rotations, (n,), at the ends of the chords, the start first."""
    moves = [start]
    add_arc(moves, move(via).pose, end, turning, angle)
    poses = np.array([chord.pose for chord in moves])
    return poses[:, :3], Rotation.from_quat(poses[:, 3:])


def circle(radius: float, turned: Rotation, centre: np.ndarray, angle: float) -> np.ndarray:
    return centre + turned.apply(radius * np.array([np.cos(angle), np.sin(angle), 0.0]))


@given(st.floats(1e-3, 2.0), angles, st.floats(0.1, 0.9), st.integers(0, 10**6))
def test_chords_go_along_the_circle_through_three_points(radius, sweep, part, seed):
    """By an independent measure: distances to the centre, and the way of the arc, radius times angle."""
    draw = np.random.default_rng(seed)
    turned, centre = Rotation.random(random_state=draw), draw.uniform(-1.0, 1.0, 3)
    start, via, end = (circle(radius, turned, centre, a) for a in (0.0, part * sweep, sweep))
    places_, rotations = arc(move(start), via, move(end), "base")
    np.testing.assert_allclose(np.linalg.norm(places_ - centre, axis=1), radius, rtol=1e-9)
    np.testing.assert_allclose(places_[-1], end, atol=1e-12)
    halves = 0.5 * (places_[1:] + places_[:-1])
    assert np.abs(np.linalg.norm(halves - centre, axis=1) - radius).max() <= 1.01e-7
    way = np.linalg.norm(np.diff(places_, axis=0), axis=1).sum()
    assert way == pytest.approx(radius * sweep, rel=2e-4 / min(radius, 1.0) ** 0.5)
    assert np.linalg.norm(places_ - via, axis=1).min() < np.linalg.norm(places_[1] - places_[0])
    assert (rotations * UPRIGHT.inv()).magnitude().max() < 1e-12


@given(angles, st.floats(-3.0, 3.0))
def test_a_tool_turns_evenly_relative_to_the_base_or_to_the_tangent(sweep, turn):
    """About the circle's axis: in the base by `turn` in all; on the path as the tangent and the rest."""
    assume(sweep <= np.pi and abs(turn - sweep) < 3.1)
    points = [circle(0.1, Rotation.identity(), np.zeros(3), a) for a in (0.0, 0.4 * sweep, sweep)]
    about = np.array([0.0, 0.0, 1.0])
    end = move(points[2], Rotation.from_rotvec(turn * about) * UPRIGHT)
    for turning in ("base", "path"):
        _, rotations = arc(move(points[0]), points[1], end, turning)
        part = np.linspace(0.0, 1.0, len(rotations))[:, None]
        expected = Rotation.from_rotvec(part * turn * about) * UPRIGHT
        assert (rotations * expected.inv()).magnitude().max() < 1e-9
    tilt = Rotation.from_euler("x", 0.3) * UPRIGHT
    tangent = Rotation.from_rotvec(sweep * about)
    _, rotations = arc(move(points[0], tilt), points[1], move(points[2], tangent * tilt), "path")
    expected = Rotation.from_rotvec(np.linspace(0.0, 1.0, len(rotations))[:, None] * sweep * about)
    assert (rotations * (expected * tilt).inv()).magnitude().max() < 1e-9


def test_half_a_circle_keeps_the_rotation_that_its_ends_have():
    """Relative to the tangent the tool turns by half a turn, backwards, not forwards to a whole one."""
    for side in (1.0, -1.0):
        via = np.array([0.0, side, 0.0])
        _, rotations = arc(move(np.array([1.0, 0, 0])), via, move(np.array([-1.0, 0, 0])), "path")
        assert (rotations * UPRIGHT.inv()).magnitude().max() < 1e-9


def test_an_angle_of_krl_ends_the_arc_and_its_sign_is_its_direction():
    start = "$VEL.CP=0.1\nLIN {X 0,Y 0,Z 0,A 0,B 90,C 0}"
    for angle, end in ((90, [5, 5, 0]), (-90, [5, -5, 0]), (360, [0, 0, 0]), (270, [5, -5, 0])):
        found = program(f"{start}\nCIRC {{X 5,Y 5}},{{X 10,Y 0}},CA {angle} C_DIS")
        assert places(found)[-1] == end
        assert len(found.moves) > abs(angle) // 3


def test_time_and_stop_of_an_arc_are_those_of_all_its_chords():
    moves = [move(np.zeros(3))]
    end = move(np.array([0.02, 0.0, 0.0]), duration=3.0)
    add_arc(moves, move(np.array([0.01, 0.01, 0.0])).pose, end, "none")
    assert sum(chord.duration or 0.0 for chord in moves) == pytest.approx(3.0)
    found = program("$VEL.CP=0.1\nLIN {X 0,Y 0,Z 0,A 0,B 90,C 0}\nCIRC {X 5,Y 5},{X 10,Y 0}")
    assert [chord.is_stop for chord in found.moves].count(True) == 2
    assert found.moves[-1].is_stop


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "FOR I=1 TO 9\nCIRC {X 5,Y 5},{X 10,Y 0}\nCIRC {X 5,Y -5},{X 0,Y 0}\nENDFOR",
            "1000 chords",
        ),
        ("CIRC {X 5},{X 5}", "points on a line"),
        ("CIRC {X 1E7,Y 1},{X -1E7}", "points on a line"),
        ("CIRC {Y 1},{X 2,A 9},CA $POS_ACT.X", "POS_ACT"),
    ],
)
def test_an_arc_that_is_none_or_one_too_many_is_refused(monkeypatch, text, said):
    monkeypatch.setattr("coupling.programs.circles._MAX_MOVES", 1000)
    start = "INT I\n$VEL.CP=0.1\nLIN {X 0,Y 0,Z 0,A 0,B 90,C 0}"
    with pytest.raises(ProgramError, match=said) as told:
        program(f"{start}\n{text}")
    assert "\n" not in str(told.value)


def test_an_arc_begins_at_a_pose():
    whole = "{X 5,Y 5,Z 0,A 0,B 0,C 0},{X 10,Y 0,Z 0,A 0,B 0,C 0}"
    with pytest.raises(ProgramError, match="got none of A, B, C"):
        program(f"PTP {{A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}}\n$VEL.CP=0.1\nCIRC {whole}")
    with pytest.raises(ProgramError, match="motion to a pose before an arc"):
        add_arc([], move(np.zeros(3)).pose, move(np.ones(3)), "base")

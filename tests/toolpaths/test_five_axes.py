"""G-code of five-axis machines, each against forward kinematics by matrices of its own."""

import re
from functools import reduce

import numpy as np
import pytest
from five_axes import (
    MACHINES,
    PART,
    START,
    about,
    course,
    part_from_tip,
    path,
    table,
    tool,
    words,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from coupling.toolpaths.gcode_course import GcodeCourse
from coupling.toolpaths.gcode_program import read_program
from coupling.toolpaths.roll import upright

FIVE = [axes for axes in MACHINES if len(axes) == 2]
angles_deg = st.floats(-400.0, 400.0).map(lambda value: round(value, 6))
places_mm = st.floats(-300.0, 300.0).map(lambda value: round(value, 6))


def degrees_of(axes: list[str], v: np.ndarray) -> list[float]:
    """Angles of two axes that turn the tool's axis to a unit vector [deg]."""
    x, y, z = v
    first, second = axes[0][-1], axes[1][-1]
    if first == "C":
        tilt = np.arccos(z)
        angles = [np.arctan2(x, -y) if second == "A" else np.arctan2(y, x), tilt]
    elif first == "A":
        angles = [np.arctan2(-y, z), np.arcsin(x)]
    else:
        angles = [np.arctan2(x, z), np.arcsin(-y)]
    signs = [-1.0 if "-" in axis else 1.0 for axis in axes]
    return np.rad2deg(np.multiply(signs, angles)).tolist()


@pytest.mark.parametrize("axes", MACHINES, ids=" ".join)
@settings(
    max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)
@given(data=st.data())
def test_machine_coordinates_are_where_the_machine_moves_the_tool(tmp_path, axes, data):
    """All axes go evenly from point to point; the tip's path in the part follows from them."""
    count = data.draw(st.integers(2, 4))
    rows = [
        (data.draw(st.tuples(*[places_mm] * 3)), data.draw(st.tuples(*[angles_deg] * len(axes))))
        for _ in range(count)
    ]
    letters = "XYZ" + "".join(axis[-1] for axis in axes)
    lines = [
        f"{'G0' if k == 0 else 'G1'} {words(letters, [*p, *q])} F900"
        for k, (p, q) in enumerate(rows)
    ]
    places, turns = (np.array([row[k] for row in rows]) for k in (0, 1))
    if not (np.abs(np.diff(places, axis=0)).max(axis=1) > 1e-3).all():
        return
    built = course(tmp_path, lines, table(axes, coordinates="machine"))
    ends = np.append(0.0, np.cumsum(built.lengths))
    parts = np.linspace(0.0, count - 1, 7 * (count - 1) + 1)
    tips, vectors = built.points(np.interp(parts, np.arange(count), ends))
    for part, tip, vector in zip(parts, tips, vectors, strict=True):
        place = [np.interp(part, np.arange(count), column) for column in 1e-3 * places.T]
        turn = [np.interp(part, np.arange(count), column) for column in turns.T]
        there = part_from_tip(axes, np.array(place), np.array(turn))
        np.testing.assert_allclose(tip, there[:3, 3], atol=1e-10)
        np.testing.assert_allclose(vector, there[:3, 2], atol=1e-9)


@pytest.mark.parametrize("axes", FIVE, ids=" ".join)
@pytest.mark.parametrize("word", ["G43.4 H1", "TRAORI", "M128", "G234", ""])
def test_tips_and_tool_vectors_come_back_from_the_words_of_each_machine(tmp_path, axes, word):
    """Random tips and vectors, written by the machine's inverse; the tip goes straight between."""
    rng = np.random.default_rng(len(word))
    tips, vectors = rng.uniform(-0.2, 0.2, (12, 3)), rng.normal([0.0, 0.0, 2.0], size=(12, 3))
    vectors /= np.linalg.norm(vectors, axis=1)[:, None]
    letters = "XYZ" + "".join(axis[-1] for axis in axes)
    lines = [
        words(letters, [*1e3 * tip, *degrees_of(axes, v)])
        for tip, v in zip(tips, vectors, strict=True)
    ]
    keys = {} if word else {"coordinates": "tool-tip"}
    built = course(tmp_path, [word, f"G0 {lines[0]}", "G1 F900", *lines[1:]], table(axes, **keys))
    ends = np.append(0.0, np.cumsum(built.lengths))
    read, turned = built.points(ends)
    np.testing.assert_allclose(read, tips, atol=1e-9)
    np.testing.assert_allclose(turned, vectors, atol=1e-9)
    np.testing.assert_allclose(
        built.lengths, np.linalg.norm(np.diff(tips, axis=0), axis=1), rtol=1e-9
    )
    middle, _ = built.points(0.5 * (ends[1:] + ends[:-1]))
    np.testing.assert_allclose(middle, 0.5 * (tips[1:] + tips[:-1]), atol=1e-9)


def test_named_directions_are_those_of_iso_841(tmp_path):
    """B+30 leans the tool towards +x on a head, and the part the other way on a table: the same."""
    for axes in (["table C", "table B"], ["head C", "head B"], ["table C", "head B"]):
        built = course(tmp_path, ["G43.4", "G0 X0 Y0 Z0 B30", "G1 X1 F60"], table(axes))
        np.testing.assert_allclose(built.points(np.zeros(1))[1], [[0.5, 0.0, np.sqrt(0.75)]])
    built = course(tmp_path, ["G43.4", "G0 X0 Y0 Z0 B30", "G1 X1 F60"], table(["head -B"]))
    np.testing.assert_allclose(built.points(np.zeros(1))[1], [[-0.5, 0.0, np.sqrt(0.75)]])


@pytest.mark.parametrize(
    ("begin", "names", "end"),
    [("TRAORI", ("A3=", "B3=", "C3="), "TRAFOOF"), ("G43.5 H1", ("I", "J", "K"), "G49")],
)
def test_a_tool_vector_needs_no_kinematics_and_turns_in_its_plane(tmp_path, begin, names, end):
    """Of any length; what is not given is zero; half way it is along the sum of its ends."""
    i, j, k = names
    lines = [begin, f"G0 X0 Y0 Z0 {k}5", f"G1 X10 {j}3 {k}4 F600", "Y10", f"X0 {i}-0.6 {k}0.8", end]
    built = course(tmp_path, lines, None)
    vectors = np.array([[0, 0, 1], [0, 0.6, 0.8], [0, 0.6, 0.8], [-0.6, 0, 0.8]])
    np.testing.assert_allclose(
        built.points(np.array([0.0, 0.01, 0.02, 0.03]))[1], vectors, atol=1e-12
    )
    middle = vectors[1:] + vectors[:-1]
    middle /= np.linalg.norm(middle, axis=1)[:, None]
    np.testing.assert_allclose(built.points(np.array([0.005, 0.015, 0.025]))[1], middle, atol=1e-12)


@pytest.mark.parametrize(
    ("mode", "is_plane"),
    [("ORIVECT", True), ("ORIAXES", False), ("ORIWKS", True), ("ORIMKS", False), ("", False)],
)
def test_siemens_words_say_how_the_tool_turns_between_rotary_positions(tmp_path, mode, is_plane):
    """In the plane of both directions, or as the rotary axes turn evenly."""
    lines = [f"TRAORI {mode}", "G0 X0 Y0 Z0 C0 A40", "G1 X10 C90 F600"]
    built = course(tmp_path, lines, table(["table C", "table A"]))
    (first, middle, last) = built.points(np.array([0.0, 0.005, 0.01]))[1]
    expected = part_from_tip(["table C", "table A"], np.zeros(3), np.array([45.0, 40.0]))[:3, 2]
    if is_plane:
        expected = (first + last) / np.linalg.norm(first + last)
    np.testing.assert_allclose(middle, expected, atol=1e-12)


def test_a_parallel_tool_does_not_turn_about_its_axis(tmp_path):
    """Round a cone of half angle 30 deg it has turned by the solid angle within, 2 pi (1 - cos 30)."""
    lines = ["G43.4", "G0 X0 Y0 Z0 A30 C0", "G1 C360 F3600"]
    rotary = {"axes": ["table C", "table A"]}
    for roll, angle in (("upright", 0.0), ("parallel", 2.0 * np.pi * (1.0 - np.sqrt(0.75)))):
        held = path(tmp_path, lines, rotary=rotary, roll=roll).path(PART).rotations[0]
        turned = held[-1] * held[0].inv()
        # Every 4 ms of the circle is a chord of the sphere.
        assert turned.magnitude() == pytest.approx(angle, abs=2e-5)


def test_a_jump_of_the_angular_velocity_is_told(tmp_path):
    """20 deg/s about y, and then back, along one straight line at 10 mm/s."""
    lines = ["TRAORI", "G0 X0 Y0 Z0", "G1 X10 B20 F600", "X20 B0"]
    (remark,) = [
        remark
        for remark in path(tmp_path, lines, rotary={"axes": ["head B"]}).task(PART).remarks
        if "jumps" in remark
    ]
    assert "the tool's angular velocity jumps, by up to 40 deg/s" in remark


def test_a_tool_passes_the_pole_without_a_jump(tmp_path):
    """A from -10 to 10 deg goes through upright; C180 A10 then is the same tool as A-10."""
    lines = ["TRAORI", "G0 X0 Y0 Z0 A-10 C0", "G1 X20 A10 F600", "X40 A-10"]
    rotary = {"axes": ["head C", "head A"]}
    _, vectors = tool(path(tmp_path, lines, rotary=rotary).path(PART))
    assert vectors[:, 2].max() == pytest.approx(1.0, abs=1e-5)
    lines = ["TRAORI", "G0 X0 Y0 Z0 A10 C180", "G1 X20 A-10 F600", "X40 A10"]
    _, others = tool(path(tmp_path, lines, rotary=rotary).path(PART))
    np.testing.assert_allclose(vectors, others, atol=1e-12)


def test_an_axis_turns_as_it_is_written_or_the_shortest_way(tmp_path):
    """From 359 deg, 361 is 2 deg further, and 1 is 358 back unless C goes the shortest way."""

    def turned(target: float, **keys: object) -> tuple[float, list[str]]:
        lines = ["G43.4", "G0 X0 Y0 Z0 A90 C359", f"G1 X10 C{target} F600"]
        rotary = table(["table C", "table A"], **keys)
        (tmp_path / "wrap.ngc").write_text("\n".join([*START, *lines, ""]))
        read = read_program(tmp_path / "wrap.ngc", rotary)
        ways = np.linspace(0.0, 0.01, 50)
        _, vectors = GcodeCourse(read, rotary.kinematics, 0.1, upright).points(ways)
        angle = np.unwrap(np.arctan2(vectors[:, 0], -vectors[:, 1]))
        return float(np.rad2deg(angle[-1] - angle[0])), list(read.assumptions)

    assert turned(361.0) == (pytest.approx(2.0), [])
    back, remarks = turned(1.0)
    assert back == pytest.approx(-358.0)
    assert re.search(r'C turns by more than 180 deg .* write shortest = \["C"\]', remarks[0])
    assert turned(1.0, shortest=["C"]) == (pytest.approx(2.0), [])


def test_inverse_time_is_the_time_of_each_move(tmp_path):
    """F12 is 5 s, whether X goes far or not, or only the axes turn; G0 has its own speed."""
    rotary = {"axes": ["table C", "table A"], "coordinates": "tool-tip"}
    for move in ("X10", "X0.01 C20", "A30 C20", "X10 Y10 C300"):
        lines = ["G0 X0 Y0 Z0 A5 C0", f"G93 G1 {move} F12", "G94"]
        built = path(tmp_path, lines, rotary=rotary).path(PART)
        assert built.time[-1] == pytest.approx(5.0 + 0.2), (
            move
        )  # and a start, half a blend at each end
    lines = ["G0 X0 Y0 Z0", "G93 G1 X10 F12", "X20 F6", "G94 X30 F600"]
    assert path(tmp_path, lines).path(PART).time[-1] == pytest.approx(16.2, abs=0.21)


def test_degrees_per_minute_where_only_rotary_axes_turn(tmp_path):
    """F600 turns B by 20 deg in 2 s, in inches as in millimetres; a path that stays at its tip waits."""
    rotary = {"axes": ["head C", "head B"], "coordinates": "tool-tip"}
    for unit in ("G20", "G21"):
        lines = [unit, "G0 X0 Y0 Z0", "G1 B20 F600"]
        made = path(tmp_path, lines, rotary=rotary)
        assert made.path(PART).time[-1] == pytest.approx(2.2)
        assert any("F is in degrees per minute" in remark for remark in made.task(PART).remarks)
        assert np.ptp(made.path(PART).position[0], axis=0).max() < 1e-12


def test_a_rotary_cut_in_machine_coordinates_goes_round(tmp_path):
    """C360 with the tool 50 mm off a table's axis is a circle of that radius, without X, Y, Z."""
    lines = ["G0 X50 Y0 Z0", "G1 C360 F7200"]
    rotary = {"axes": ["table C"], "coordinates": "machine", "points_m": {"C": [0.0, 0.0, 0.0]}}
    tips, vectors = tool(path(tmp_path, lines, rotary=rotary).path(PART))
    np.testing.assert_allclose(np.linalg.norm(tips, axis=1), 0.05, rtol=1e-12)
    angle = np.unwrap(np.arctan2(tips[:, 1], tips[:, 0]))
    assert angle[-1] - angle[0] == pytest.approx(2.0 * np.pi)
    np.testing.assert_allclose(vectors, np.tile([0.0, 0.0, 1.0], (len(tips), 1)), atol=1e-12)


def test_an_arc_of_the_linear_axes_turns_with_the_table(tmp_path):
    """Half a circle of X, Y at radius 10 mm while C and B turn; ORIVECT says nothing without TRAORI."""
    axes = ["table C", "head B"]
    lines = ["ORIVECT", "G0 X10 Y0 Z0 B0 C0", "G3 X-10 Y0 I-10 J0 C80 B-30 F600"]
    built = course(tmp_path, lines, table(axes, coordinates="machine"))
    parts = np.linspace(0.0, 1.0, 9)
    tips, vectors = built.points(parts * built.lengths[0])
    for part, tip, vector in zip(parts, tips, vectors, strict=True):
        place = 0.01 * np.array([np.cos(np.pi * part), np.sin(np.pi * part), 0.0])
        there = part_from_tip(axes, place, part * np.array([80.0, -30.0]))
        np.testing.assert_allclose(tip, there[:3, 3], atol=1e-12)
        np.testing.assert_allclose(vector, there[:3, 2], atol=1e-12)


def test_a_move_that_is_cut_in_two_is_the_same_motion(tmp_path):
    """In machine coordinates: the tip's curve goes on, so that it is not a corner.  Another C is one."""
    rotary = {"axes": ["table C"], "coordinates": "machine", "points_m": {"C": [0.0, 0.0, 0.0]}}
    durations = [
        path(tmp_path, ["G0 X50 Y0 Z0", "G1 F600", *moves], rotary=rotary).path(PART).time[-1]
        for moves in (["X60 C90"], ["X55 C45", "X60 C90"], ["X55 C45", "X60 C0"])
    ]
    np.testing.assert_allclose(durations, [1.2, 1.2, 1.4], rtol=1e-6)


def test_a_rapid_of_a_table_moves_the_part_no_faster_than_a_rapid(tmp_path):
    """C180 half a metre off its axis at 0.1 m/s: pi / 2 m."""
    rotary = {"axes": ["table C"], "coordinates": "machine", "points_m": {"C": [0.0, 0.0, 0.0]}}
    made = path(tmp_path, ["G0 X500 Y0 Z0", "G0 C180"], rotary=rotary, rapid_m_s=0.1)
    assert made.path(PART).time[-1] == pytest.approx(0.5 * np.pi / 0.1 + 0.2, rel=1e-6)


def test_turns_in_place_join_where_they_go_on(tmp_path):
    """Ten turns by 4 deg take as long as one by 40 deg; one back is a rest."""
    rotary = {"axes": ["table C"], "coordinates": "machine", "points_m": {"C": [0.0, 0.0, 0.0]}}
    ten = [f"C{4 * k}" for k in range(1, 11)]
    durations = [
        path(tmp_path, ["G0 X50 Y0 Z0", "G1 F1200", *turns], rotary=rotary).path(PART).time[-1]
        for turns in (ten, ["C40"], ["C40", "C36", "C40"])
    ]
    np.testing.assert_allclose(durations, [2.2, 2.2, 2.2 + 2 * 0.4], rtol=1e-6)


def test_the_tip_is_slower_where_the_tool_would_turn_too_fast(tmp_path):
    """60 deg within 1 mm: at 30 deg/s it takes 2 s, whatever F says."""
    lines = ["TRAORI", "G0 X0 Y0 Z0 B0", "G1 X1 B60 F6000"]
    made = path(tmp_path, lines, rotary={"axes": ["head B"]}, max_turn_deg_s=30.0)
    built = made.path(PART)
    rate = (built.rotations[0][1:] * built.rotations[0][:-1].inv()).magnitude() / np.diff(
        built.time
    )
    # In this plane the tool turns about y alone, at the rate of B.
    assert np.rad2deg(rate.max()) == pytest.approx(30.0, rel=0.16)
    assert np.rad2deg(rate.max()) < 30.01
    assert built.time[-1] >= 2.2


@pytest.mark.parametrize("order", ["ZXZ", "XYZ"])
def test_a_tilted_plane_is_a_frame_of_the_part(tmp_path, order):
    """Euler angles of G68.2 and the axes of CYCLE800, as matrices one after the other."""
    degrees, origin = [20.0, -35.0, 50.0], np.array([0.01, 0.02, -0.03])
    letters = ["ABC"["XYZ".index(axis)] for axis in order]
    turn = reduce(
        np.matmul,
        [about(k, np.deg2rad(v), [0, 0, 0])[:3, :3] for k, v in zip(letters, degrees, strict=True)],
    )
    if order == "ZXZ":
        begin = ["G68.2 X10 Y20 Z-30 I20 J-35 K50", "G53.1"]
    else:
        begin = ['CYCLE800(1,"TC1",100000,57,10,20,-30,20,-35,50,1,2,3,-1,100,1) ; plane']
        origin = origin + turn @ [0.001, 0.002, 0.003]
    lines = [
        *begin,
        "G0 X0 Y0 Z5",
        "G1 X10 F600",
        "G2 X10 Y0 I5 J0",
        "G69" if order == "ZXZ" else "CYCLE800()",
    ]
    tips, vectors = tool(path(tmp_path, lines, rapid_m_s=0.1).path(PART))
    np.testing.assert_allclose(tips[0], origin + turn @ [0.0, 0.0, 0.005], atol=1e-12)
    np.testing.assert_allclose(tips[-1], origin + turn @ [0.01, 0.0, 0.005], atol=1e-12)
    np.testing.assert_allclose(vectors, np.tile(turn[:, 2], (len(tips), 1)), atol=1e-12)
    np.testing.assert_allclose((tips - origin) @ turn[:, 2], 0.005, atol=1e-12)


def test_axes_that_turn_before_tip_control_are_where_the_tool_stands(tmp_path):
    """As posts write it: home, turn, tip control with the first point, home at the end."""
    lines = [
        "G49 G69 G94",
        "G53 G0 Z0",
        "G0 A-30 C45",
        "G0 X99 Y99",
        "G43.4 H1 Z80",
        "G0 X0 Y0 Z50",
    ]
    lines += ["G1 X10 A-20 F600", "G49", "G53 Z0", "G0 A0 C0", "M30"]
    built = course(tmp_path, lines, table(["table C", "table A"]))
    there = [
        part_from_tip(["table C", "table A"], np.zeros(3), np.array(q))
        for q in ([45, -30], [45, -20])
    ]
    tips, vectors = built.points(np.array([0.0, built.lengths.sum()]))
    np.testing.assert_allclose(tips, [[0.0, 0.0, 0.05], [0.01, 0.0, 0.05]], atol=1e-12)
    np.testing.assert_allclose(vectors, [matrix[:3, 2] for matrix in there], atol=1e-12)


def test_where_an_axis_begins_is_said_if_nothing_gives_it(tmp_path):
    rotary = {"axes": ["head A", "head B"], "coordinates": "tool-tip"}
    made = path(tmp_path, ["G0 X0 Y0 Z0", "G1 X10 A5 B10 F1200"], rotary=rotary)
    _, vectors = tool(made.path(PART))
    there = part_from_tip(["head A", "head B"], np.zeros(3), np.array([5.0, 10.0]))
    np.testing.assert_allclose(vectors[[0, -1]], [[0.0, 0.0, 1.0], there[:3, 2]], atol=1e-12)
    for letter in "AB":
        assert f"program.ngc: {letter} is at 0 until it is given" in made.task(PART).remarks


def test_an_axis_that_is_not_sent_home_stays(tmp_path):
    """G28 with Z alone leaves C where it is; with C it is at zero until it is given, which is said."""
    for home, c in (("G28 Z0", 45.0), ("G28 C0", 0.0)):
        lines = ["TRAORI", "G0 C45 A30", home, "A30", "G0 X0 Y0 Z0", "G1 X5 F600"]
        rotary = table(["table C", "table A"])
        built = course(tmp_path, lines, rotary)
        there = part_from_tip(["table C", "table A"], np.zeros(3), np.array([c, 30.0]))
        np.testing.assert_allclose(built.points(np.zeros(1))[1][0], there[:3, 2], atol=1e-12)
        said = read_program(tmp_path / "program.ngc", rotary).assumptions
        assert ("C is at 0 until it is given" in said) == (c == 0.0)

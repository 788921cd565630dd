"""G-code of five-axis machines, each against forward kinematics by matrices of its own."""

from __future__ import annotations

import re
from functools import reduce
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError
from coupling.files.toml_file import validate
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.toolpaths.gcode import GcodePath
from coupling.toolpaths.gcode_course import Course
from coupling.toolpaths.gcode_program import read_program
from coupling.toolpaths.rotary import RotaryTable

PART = Frame(np.zeros(3), Rotation.identity())
MACHINES = [
    ["table C", "table A"],
    ["table C", "table B"],
    ["table -C", "table -A"],
    ["head C", "head A"],
    ["head C", "head -B"],
    ["head A", "head B"],
    ["table C", "head B"],
    ["table A", "head B"],
    ["table B", "head A"],
    ["table C", "table B", "head A"],
    ["table A"],
]
FIVE = [axes for axes in MACHINES if len(axes) == 2]
POINTS = {"A": [0.02, -0.3, -0.11], "B": [-0.04, 0.05, 0.26], "C": [0.013, -0.007, 0.4]}
START = ("G21 G90 G17",)
angles_deg = st.floats(-400.0, 400.0).map(lambda value: round(value, 6))
places_mm = st.floats(-300.0, 300.0).map(lambda value: round(value, 6))


def table(axes: list[str], **keys: object) -> RotaryTable:
    points = {axis[-1]: POINTS[axis[-1]] for axis in axes}
    return RotaryTable.model_validate({"axes": axes, "points_m": points} | keys)


def about(letter: str, angle: float, point: list[float]) -> np.ndarray:
    """Homogeneous matrix of a right-handed rotation about an axis through a point."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = {"A": (1, 2), "B": (2, 0), "C": (0, 1)}[letter]
    turn, there, back = np.eye(4), np.eye(4), np.eye(4)
    turn[i, i] = turn[j, j] = c
    turn[j, i], turn[i, j] = s, -s
    there[:3, 3], back[:3, 3] = point, -np.array(point)
    return there @ turn @ back


def part_from_tip(axes: list[str], place: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """Machine as it is built: the bed carries table upon table, and the slide head upon head.

    By ISO 841 a table that turns by +q turns the part by -q, a head the tool by +q.
    """
    bed_from_part, slide_from_tip, bed_from_slide = np.eye(4), np.eye(4), np.eye(4)
    bed_from_slide[:3, 3] = place
    for axis, value in zip(axes, np.deg2rad(degrees), strict=True):
        q, letter = (-value if "-" in axis else value), axis[-1]
        if axis.startswith("table"):
            bed_from_part = about(letter, -q, POINTS[letter]) @ bed_from_part
        else:
            slide_from_tip = slide_from_tip @ about(letter, q, POINTS[letter])
    return np.linalg.inv(bed_from_part) @ bed_from_slide @ slide_from_tip


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


def words(letters: str, values: list[float]) -> str:
    return " ".join(f"{k}{v:.12f}" for k, v in zip(letters, values, strict=True))


def course(folder: Path, lines: list[str], rotary: RotaryTable | None) -> Course:
    file = folder / "program.ngc"
    file.write_text("\n".join([*START, *lines]))
    return Course(read_program(file, rotary), rotary.kinematics if rotary else None)


def path(folder: Path, lines: list[str], **keys: object) -> GcodePath:
    file = folder / "program.ngc"
    file.write_text("\n".join([*START, *lines]))
    raw = {"kind": "gcode", "file": str(file)} | keys
    return validate(raw, GcodePath, CaseError, "tool_path")


def tool(built: ToolPath) -> tuple[np.ndarray, np.ndarray]:
    """Tips and vectors from tip to holder."""
    return built.position[0], -built.rotations[0].apply([1.0, 0.0, 0.0])


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
        (tmp_path / "wrap.ngc").write_text("\n".join([*START, *lines]))
        read = read_program(tmp_path / "wrap.ngc", rotary)
        ways = np.linspace(0.0, 0.01, 50)
        _, vectors = Course(read, rotary.kinematics).points(ways)
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


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["G93 G1 X10"], "line 3: expected a feed F in its line, as G93 has it"),
        (["F600", "G93 G1 X10"], "line 4: expected a feed F in its line"),
        (["G93 G1 X10 F5", "X20"], "line 4: expected a feed F in its line"),
        (["F600", "G93 G1 X10 F5", "G94", "X20"], "line 6: expected a feed F before"),
        (["G93 G1 X10 F0"], "expected a move of 0.0001 to 360000 s under G93, got F0 1/min"),
        (["G93 G1 X10 F-3"], "got F-3"),
        (["G95 G1 X10 F1"], "feed per revolution"),
    ],
)
def test_a_feed_that_is_missing_is_not_guessed(tmp_path, lines, said):
    with pytest.raises(CaseError, match=said):
        course(tmp_path, ["G0 X0 Y0 Z0", *lines], None)


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


AC: dict[str, object] = {"axes": ["table C", "table A"]}
MACHINE = AC | {"coordinates": "machine", "points_m": {"A": [0.0, 0.0, 0.1], "C": [0.0, 0.0, 0.0]}}


@pytest.mark.parametrize(
    ("rotary", "lines", "said"),
    [
        (None, ["G1 X10 A5 F600"], "axis A to stand still at 0, got A5: name the machine's axes"),
        (AC, ["G1 X10 B5 F600"], "axis B to stand still at 0, got B5"),
        (AC, ["G1 X10 A5 F600"], 'got none of G43.4, .* write coordinates = "tool-tip" or "machine"'),
        (MACHINE, ["G43.4 H1"], "expected machine coordinates, as .* says, got G43.4"),
        (MACHINE, ["TRAORI"], "expected machine coordinates, as .* says, got TRAORI"),
        (None, ["G1 X5 F600 A3=0 B3=0 C3=1"], "expected TRAORI or G43.5 before a tool vector"),
        (None, ["TRAORI", "G1 X5 F600 A3=0 B3=0 C3=0"], "a tool vector, got length 0"),
        (None, ["TRAORI", "G1 X5 F600 A3=1 A3=0"], "expected one of each A3, B3, C3, got two"),
        (None, ["TRAORI", "G1 X5 F600 A3=1EX2"], "a direction of the tool in another form 'A3=1EX2'"),
        (None, ["TRAORI ORIMKS", "G1 X5 F600 C3=1"], "expected ORIWKS and ORIVECT .* got ORIMKS"),
        (None, ["TRAORI ORIAXES", "G1 X5 F600 C3=1"], "expected ORIWKS and ORIVECT .* got ORIAXES"),
        (None, ["TRAORI", "G1 X5 F600 A3=1 C3=1", "A3=-1 C3=-1 X9"], "less than 180 deg apart"),
        (AC, ["TRAORI", "G1 X5 F600 C3=1 A3=1", "X9 A5"], "turn from known angles, got a tool vector"),
        (None, ["G43.5", "G2 X5 I2 J1 F600"], "expected lines under G43.5, got an arc"),
        (AC, ["TRAORI", "G1 X5 A20 F600", "TRAFOOF", "X0 Y0 Z0", "X1"], "TRAFOOF, the end of TRAORI"),
        (AC, ["G43.4", "G1 X5 A20 F600", "G49", "G0 X0 Y0 Z0", "X1"], "behind G49, the end of G43.4"),
        (AC, ["G43.4 A1e9"], "numbers without exponents"),
        (AC, ["G43.4 A99999999"], "A: expected at most 1e[+]06 deg"),
        (AC, ["TRAORI A2=30"], "a direction of the tool in another form 'A2=30'"),
        (AC, ["TRAORI LEAD=5"], "a direction of the tool in another form 'LEAD=5'"),
        (AC, ["ORICONCW"], "a way of the tool's direction 'ORICONCW'"),
        (AC, ["TRAORI", "G1 C=DC(90)"], "a rotary position in another form"),
        (AC, ["TRAORI(1,0,0,1)"], "TRAORI without a base orientation"),
        (None, ["TRAORI(3)", "TRACYL(20)"], "a transformation of axes 'TRACYL"),
        (None, ["G1 X5 F600", "G68.2 X0 Y0 Z0 I0 J30 K0"], "one plane for all moves, got G68.2"),
        (None, ["G68.2 P1 X0 Y0 Z0 I0 J30 K0"], "another form of it: write Euler angles"),
        (None, ["G68.2 J30", "G0 X0 Y0 Z0", "G1 X5 F600"], "expected G53.1 behind G68.2"),
        (None, ["G53.1"], "expected G68.2 before G53.1"),
        (AC, ["G68.2 J30", "G53.1", "G0 X0 Y0 Z0 A30"], "along the z axis of its tilted plane"),
        (None, ["CYCLE800(1,\"T\",0,39,0,0,0,0,30,0,0,0,0,1)"], "with mode 57, .* got 39"),
        (None, ["CYCLE800(1,\"T\",1,57,0,0,0,0,30,0,0,0,0,1)"], "got status 1, an additive one"),
        (None, ["CYCLE800(1,\"T\",0,57,0,0,0,0,R1,0,0,0,0,1)"], "expected numbers in CYCLE800"),
        (None, ["CYCLE800(1,\"T\",0,57,0,0,0,0,nan,0,0,0,0,1)"], "angles .deg. within 720, got nan"),
        (None, ["G43.4", "G0 A30", "G1 X5 F600"], r"axes in \[tool_path.rotary\], got A30 under G43.4"),
    ],
)  # fmt: skip
def test_what_is_not_known_of_the_tool_is_refused_by_its_name(tmp_path, rotary, lines, said):
    keys = {} if rotary is None else {"rotary": rotary}
    first = "G0 A30" if lines[-2:-1] == ["G0 A30"] else ""
    lines = [first, "G0 X0 Y0 Z0", *[line for line in lines if line != first or not first]]
    with pytest.raises(CaseError, match=said):
        path(tmp_path, lines, **keys).path(PART)


@pytest.mark.parametrize(
    ("rotary", "said"),
    [
        ({"axes": []}, "axes"),
        ({"axes": ["table X"]}, "axes: .*a letter A, B or C, as .table -A., got 'table X'"),
        ({"axes": ["C table"]}, "got 'C table'"),
        ({"axes": ["table C", "head C"]}, "expected each letter once"),
        ({"axes": ["head B", "table C"]}, "those of the table first"),
        ({"axes": ["table C"], "shortest": ["A"]}, "expected letters of axes, C, got A"),
        ({"axes": ["table C"], "coordinates": "machine"}, "points_m of all axes .* got none of C"),
        ({"axes": ["table C"], "pivot": 3}, "pivot"),
    ],
)
def test_a_table_of_axes_that_is_no_machine_is_refused(tmp_path, rotary, said):
    with pytest.raises(CaseError, match=said):
        path(tmp_path, ["G0 X0 Y0 Z0", "G1 X1 F60"], rotary=rotary)


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


WORDS = (
    "G0 G1 G2 G43.4 G43.5 G49 G93 G94 TRAORI TRAFOOF ORIVECT ORIAXES G68.2 G53.1 G69 G53 G28 G91 M128"
    " M129 CYCLE800() X1 X-5 Y2 Z3 A10 B-20 C400 C1 A3=1 B3=-2 C3=1 I1 J2 K-1 F5 F900 R9"
)


@settings(
    max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)
@given(
    st.lists(st.sampled_from([*WORDS.split(), "\n"]), max_size=60),
    st.sampled_from([None, AC, MACHINE, {"axes": ["table C", "head B"], "shortest": ["C"]}]),
)
def test_any_words_are_a_path_or_a_sentence(tmp_path, drawn, rotary):
    keys = {} if rotary is None else {"rotary": rotary}
    try:
        built = path(tmp_path, ["G0 X0 Y0 Z0", " ".join(drawn)], **keys).path(PART)
    except CaseError:
        return
    assert np.isfinite(built.pose).all()
    assert (np.diff(built.time) > 0.0).all()

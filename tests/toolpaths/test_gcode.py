"""G-code as a tool path: closed forms of its curves, and one sentence for what is not read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from places import EXAMPLES
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError
from coupling.files.toml_file import validate
from coupling.path.frame import Frame
from coupling.toolpaths.gcode import GcodePath
from coupling.toolpaths.gcode_moves import GcodeMove
from coupling.toolpaths.gcode_program import read_program

PART = Frame(np.zeros(3), Rotation.identity())
some = settings(
    max_examples=40,
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
# Radius, angle at the start and sweep of arcs [mm, rad].
ARCS = (st.floats(1.0, 200.0), st.floats(-3.0, 3.0), st.floats(0.05, 6.2))
# Axes of arcs in each plane, the letters of their centre, and the axis of helices.
PLANES = {"G17": ("XY", "IJ", "Z"), "G18": ("ZX", "KI", "Y"), "G19": ("YZ", "JK", "X")}


def moves(folder: Path, *lines: str) -> list[GcodeMove]:
    file = folder / "program.ngc"
    file.write_text("\n".join(lines))
    return [step for step in read_program(file).steps if isinstance(step, GcodeMove)]


def path(folder: Path, *lines: str, **keys: float):
    file = folder / "program.ngc"
    file.write_text("\n".join(lines))
    data = {"kind": "gcode", "file": str(file), **keys}
    return validate(data, GcodePath, CaseError, "tool_path").path(PART)


def number(value: float) -> str:
    """A number with six decimals: a nanometre."""
    return f"{value:.6f}"


def arc_lines(plane: str, radius: float, start: float, sweep: float, rise: float, how: str):
    """An arc about (5, -3) in a plane as a program, by its centre or by its radius."""
    (a, b), (i, j), c = PLANES[plane]
    centre, ends = np.array([5.0, -3.0]), np.array([start, start + sweep])
    points = centre[:, None] + radius * np.array([np.cos(ends), np.sin(ends)])
    (u, v), (x, y) = points.T.tolist()
    code = "G3" if sweep > 0.0 else "G2"
    goal = f"{a}{number(x)} {b}{number(y)} {c}{number(rise)}"
    yield f"G21 G90 {plane} F1000"
    yield f"G0 {a}{number(u)} {b}{number(v)} {c}0"
    if how == "centre":
        yield f"{code} {goal} {i}{number(centre[0] - u)} {j}{number(centre[1] - v)}"
    elif how == "absolute":
        yield f"G90.1 {code} {goal} {i}{number(centre[0])} {j}{number(centre[1])}"
    else:
        yield f"{code} {goal} R{number(radius if abs(sweep) < np.pi else -radius)}"


@some
@given(*ARCS, st.sampled_from([-1.0, 1.0]), st.floats(-20.0, 20.0), st.sampled_from(list(PLANES)))
def test_an_arc_is_the_same_by_its_centre_and_its_radius(
    tmp_path, radius, start, sweep, sign, rise, plane
):
    """A helix of hypot(r sweep, rise); every point a radius from its axis, its middle half way round."""
    if abs(sweep - np.pi) < 0.05 or sweep > 6.0:
        return  # by its radius nearly straight: what is printed does not tell its centre
    found = {}
    for how in ("centre", "absolute", "radius"):
        (arc,) = moves(tmp_path, *arc_lines(plane, radius, start, sign * sweep, rise, how))
        found[how] = arc.segment.point(np.linspace(0.0, arc.segment.length, 41))
        assert arc.segment.length == pytest.approx(1e-3 * np.hypot(radius * sweep, rise), abs=2e-7)
    np.testing.assert_allclose(found["absolute"], found["centre"], atol=1e-8)
    np.testing.assert_allclose(found["radius"], found["centre"], atol=2e-6)
    letters, _, along = PLANES[plane]
    axes = ["XYZ".index(letter) for letter in letters]
    away = found["centre"][:, axes] - 1e-3 * np.array([5.0, -3.0])
    np.testing.assert_allclose(np.hypot(*away.T), 1e-3 * radius, atol=3e-9)
    half = start + 0.5 * sign * sweep
    middle = 1e-3 * radius * np.array([np.cos(half), np.sin(half)])
    np.testing.assert_allclose(away[20], middle, atol=1e-8)
    height = found["centre"][:, "XYZ".index(along)]
    np.testing.assert_allclose(height, np.linspace(0.0, 1e-3 * rise, 41), atol=1e-9)


@pytest.mark.parametrize("code", ["G2", "G3"])
def test_equal_ends_are_a_full_circle(tmp_path, code):
    (arc,) = moves(tmp_path, "G21 G90 F600", "G0 X10 Y0 Z0", f"{code} X10 Y0 Z-1 I-10")
    assert arc.segment.length == pytest.approx(np.hypot(2.0 * np.pi * 0.01, 1e-3), rel=1e-12)
    quarter = arc.segment.point(np.array([0.25 * arc.segment.length]))[0]
    expected = [0.0, 0.01 if code == "G3" else -0.01, -0.25e-3]
    np.testing.assert_allclose(quarter, expected, atol=1e-12)


points_mm = st.lists(
    st.tuples(*[st.integers(-5000, 5000)] * 3), min_size=2, max_size=8, unique=True
)


@some
@given(points_mm)
def test_inches_increments_and_modal_words_say_the_same(tmp_path, points):
    """Thousandths of an inch, printed exactly in millimetres as well."""
    inch = np.array(points) / 1000.0
    absolute = ["G20 G90 F10", *(f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f}" for x, y, z in inch)]
    metric = ["G21 F254 G1", *(f"X{x:.4f}Y{y:.4f}Z{z:.4f}" for x, y, z in 25.4 * inch)]
    first, *steps = [inch[0], *np.diff(inch, axis=0)]
    lines = [f"N7 g1 x{x:.4f} y {y:.4f} z{z:.4f} (step) ; on" for x, y, z in steps]
    relative = ["g20 g90 f10", f"g0 x{first[0]} y{first[1]} z{first[2]}", "G91", *lines]
    ends = []
    for program in (absolute, metric, relative):
        found = moves(tmp_path, *program)
        feeds = np.array([move.feed for move in found])
        np.testing.assert_allclose(feeds, 10 * 0.0254 / 60.0, rtol=1e-12)
        ends.append([move.segment.point(np.array([move.segment.length]))[0] for move in found])
    np.testing.assert_allclose(ends[0], 0.0254 * inch[1:], atol=1e-12)
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-12)
    np.testing.assert_allclose(ends[2], ends[0], atol=1e-12)


@pytest.mark.parametrize(
    ("halves", "rests"),
    [
        (("G1 X50 F600", "G1 X100"), False),
        (("G1 X50 F600", "M0", "G1 X100"), True),
        (("G1 X50 F600 M0", "G1 X100"), True),
        (("G9 G1 X50 F600", "G1 X100"), True),
        (("G1 X50 F600", "G1 X100 M0"), False),
    ],
)
def test_the_tool_stands_where_the_program_stops(tmp_path, halves, rests):
    """Two collinear lines of 50 mm at 10 mm/s: a rest in the middle costs one more blend of 0.2 s."""
    driven = path(tmp_path, "G21 G90 G0 X0 Y0 Z0", *halves)
    assert driven.time[-1] == pytest.approx(10.2 + 0.2 * rests, abs=1e-9)


def test_the_feed_is_kept_through_tangents_and_the_tool_rests_in_corners(tmp_path):
    """A line, its half circle and a line back; then a corner of 90 degrees."""
    found = path(
        tmp_path,
        "G21 G90 G0 X0 Y0 Z0",
        "G1 X100 F3000",
        "G3 X100 Y40 J20",
        "G1 X0",
        "G1 Y0",
        blend_s=0.1,
        sample_s=0.01,
    )
    speed = np.linalg.norm(np.diff(found.position[0], axis=0), axis=1) / np.diff(found.time)
    assert speed.max() == pytest.approx(0.05, rel=0.01)
    slow = np.flatnonzero(speed < 0.025)
    corner = int(np.argmin(np.linalg.norm(found.position[0] - [0.0, 0.04, 0.0], axis=1)))
    near = np.abs(slow[:, None] - np.array([0, corner, len(speed)])).min(axis=1)
    assert near.max() < 30
    assert speed[corner - 1 : corner + 1].max() < 0.002
    length = np.linalg.norm(np.diff(found.position[0], axis=0), axis=1).sum()
    assert length == pytest.approx(0.24 + 0.02 * np.pi, rel=1e-4)


def test_a_feed_in_every_line_is_no_rest_in_every_line(tmp_path):
    """20 mm at about 1010 mm/min: 1.2 s and a start, where a rest at each change took 8 s."""
    lines = [f"G1 X{k} F{1000 + k}" for k in range(1, 21)]
    found = path(tmp_path, "G21 G90 G17", "G0 X0 Y0 Z0", *lines, "M2")
    ideal = sum(1e-3 / ((1000 + k) / 60_000) for k in range(1, 21))
    assert ideal + 0.2 <= found.time[-1] < ideal + 0.21
    speed = np.linalg.norm(np.diff(found.position[0], axis=0), axis=1) / np.diff(found.time)
    line = np.clip((found.position[0][1:, 0] * 1e3).astype(int), 0, 19)
    assert np.all(speed <= (1001 + line) / 60_000 * (1.0 + 1e-6))
    corner = path(tmp_path, "G21 G90", "G0 X0 Y0 Z0", "G1 X10 F1000", "G1 Y10 F1100", "M2")
    at_corner = np.argmin(np.linalg.norm(corner.position[0] - [0.01, 0.0, 0.0], axis=1))
    speed = np.linalg.norm(np.diff(corner.position[0], axis=0), axis=1) / np.diff(corner.time)
    assert speed[at_corner] < 1e-4


def test_a_rapid_ends_at_rest(tmp_path):
    """It is a positioning: straight on at a feed begins with a start, as after a wait."""
    rapid = ("G21 G90", "G0 X0 Y0 Z0", "G0 X50")
    found = path(tmp_path, *rapid, "G1 X100 F1200")
    waited = path(tmp_path, *rapid, "G4 P1", "G1 X100 F1200")
    assert waited.time[-1] - found.time[-1] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("lines", "jump"),
    [
        (("G1 X20 F1200", "G3 X30 Y10 J10", "G1 Y20"), 0.02**2 / 0.01),  # v^2/r
        (("G1 X20 F600", "G3 X30 Y10 J10", "G1 Y20"), 0.01**2 / 0.01),
        (("G3 X10 Y10 J10 F1200", "G2 X15 Y15 I5"), 0.02**2 * (1 / 0.01 + 1 / 0.005)),  # S
        (("G1 X20 F1200", "G1 Y20"), 0.0),  # a corner
        (("G1 X20 F1200", "G3 X30 Y10 J10 F600"), 0.01**2 / 0.01),  # at the lower feed
        (("G0 X20", "G3 X30 Y10 J10 F600"), 0.0),  # a rapid ends at rest
        (("G1 X20 F1200", "G3 X20 Y0 Z6 J10"), 0.0),  # the helix turns away by 5.5 deg and more
    ],
)
def test_the_jump_of_the_acceleration_is_told(tmp_path, lines, jump):
    """As the driven path has it: second differences far within the pieces, at a fine period."""
    program = ("G21 G90 G17", "G0 X0 Y0 Z0", *lines, "M2")
    (tmp_path / "part.ngc").write_text("\n".join(program))
    table = GcodePath(
        kind="gcode", file=tmp_path / "part.ngc", sample_s=0.001, corner_deg=3.0, blend_s=1.0
    )
    remarks = table.task(PART).remarks
    told = [remark for remark in remarks if "acceleration jumps" in remark]
    assert bool(told) == (jump > 0.0)
    if not told:
        return
    assert f"by up to {jump:.3g} m/s^2" in told[0]
    points = table.untilted(PART).path.position[0]
    second = np.diff(points, 2, axis=0) / 0.001**2
    # Over ten periods the acceleration of a start of 1 s changes by far less.
    seen = np.linalg.norm(second[10:] - second[:-10], axis=1).max()
    assert seen == pytest.approx(jump, rel=0.05)


def test_a_dwell_waits_and_a_rapid_has_its_own_speed(tmp_path):
    lines = ("G21 G90 G0 X0 Y0 Z0", "G0 X50", "G4 P1.5", "G1 X100 F600")
    with_wait = path(tmp_path, *lines, rapid_m_s=0.05)
    without = path(tmp_path, lines[0], lines[1], lines[3], rapid_m_s=0.05)
    assert with_wait.time[-1] - without.time[-1] == pytest.approx(1.5, abs=1e-9)
    slower = path(tmp_path, *lines, rapid_m_s=0.01)
    assert slower.time[-1] - with_wait.time[-1] == pytest.approx(
        0.05 / 0.01 - 0.05 / 0.05, abs=0.05
    )


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["G0 X1"], "line 1: expected G20 or G21 before"),
        (["G21", "X1"], "line 2: expected G0, G1, G2 or G3"),
        (["G21 G90 G0 X0 Y0 Z0", "G1 X1"], "line 2: expected a feed F"),
        (["G21", "G92 X0"], "line 2: expected no G92, got a shift"),
        (["G21", "G41 D1"], "expected no G41, got cutter radius"),
        (["G21", "#1=#2"], "line 2: expected a value of #2 before"),
        (["G21 G0 X1 X2"], "expected one word X, got two"),
        (["G21 G0 G1 X1"], "expected one of G0 and G1 in a line, got both"),
        (["G21 G0 X0 Y0 Z0", "G2 X1 F9"], "line 2: expected R or a centre I, J"),
        (["G21 G0 X0 Y0 Z0", "G2 X10 R1 F9"], "expected ends at most 2 mm apart, got 10 mm"),
        (["G21 G0 X0 Y0 Z0", "G2 X0 R1 F9"], "a full circle: give I, J, K"),
        (["G21 G0 X0 Y0 Z0", "G2 X10 I4 F9"], "equally far from both ends, got 4 and 6 mm"),
        (["G21 G0 X0 Y0 Z0", "G2 X10 I4 R9 F9"], "both R and I"),
        (["G21 G0 X0 Y0 Z0", "G2 X10 K4 F9"], "in this plane, got K"),
        (["G21 G91 G0 X1"], "expected a place to go on from"),
        (["G21 G0 X999999999"], "expected 0 to 100 m"),
        (["G21 G0 X0 Y0 Z0", "G1 X1 F-5"], "F: expected"),
        (["G21 G0 X0 Y0 Z0", "G1 X1 F999999999"], "F: expected"),
        (["G21 G0 X0 Y0 Z0", "G1 X9 A4 F5"], "the rotary axis A to stand still at 0, got A4"),
        (["G21 G4"], "a wait G4 P in seconds, got none"),
        (["G21", "M98 P1000"], "line 2: expected no M98, got a call of a sub-program"),
        (
            ["G21", "G81 X1"],
            "expected no G81, got a cycle: let the post-processor write its moves out",
        ),
        (["G21 G0 X0 Y0 Z0"], "expected moves from one point to another, got none$"),
        (["G21 G0 X0 Y0", "G1 X10 F600"], "one point to another, got none: Z never given"),
        (["G21 G0 X0 Y0", "G2 X10 R9 F9"], "line 2: expected a place to begin .* none for Z"),
        ([""], "expected moves"),
        (["(open comment G0 X1"], "expected a comment to be closed"),
    ],
)
def test_what_is_not_read_is_told_with_its_line(tmp_path, lines, said):
    with pytest.raises(CaseError, match=said):
        moves(tmp_path, *lines)


def test_what_is_cut_before_the_place_is_known_is_told(tmp_path):
    file = tmp_path / "program.ngc"
    file.write_text("G21 G0 X0 Y0\nG1 X10 F600\nG1 Z-1\nG1 Y5\n")
    program = read_program(file)
    assert len(program.steps) == 1
    assert program.left_out == {"G1 from an unknown Z": 2}


def test_a_program_with_a_mark_of_its_encoding_and_a_number_is_read(tmp_path):
    lines = ["%", "O1000 (PART)", "G21 G90", "G0 X0 Y0 Z0", "G1 X10 F600", "M30"]
    plain, marked = moves(tmp_path, *lines), moves(tmp_path, "\ufeff" + lines[0], *lines[1:])
    ends = [move.segment.point(np.array([0.0, move.segment.length])) for move in plain + marked]
    np.testing.assert_allclose(ends, 2 * [[[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]]], atol=1e-15)


def test_a_feed_that_would_fill_the_memory_is_told(tmp_path):
    with pytest.raises(CaseError, match="at most 2000000 samples"):
        path(tmp_path, "G21 G0 X0 Y0 Z0", "G1 X90000 F0.1")


@settings(some, max_examples=150)
@given(
    st.one_of(
        st.binary(max_size=200),
        st.text("GXYZIJKRFNM0123456789.-+ ()\n;%", max_size=120).map(str.encode),
    )
)
def test_any_bytes_are_moves_or_one_sentence(tmp_path, content):
    file = tmp_path / "program.ngc"
    file.write_bytes(b"G21 G90 F100\nG0 X0 Y0 Z0\n" + content)
    said, lengths = f"{file}: ", []
    try:
        steps = read_program(file).steps
        lengths = [step.segment.length for step in steps if isinstance(step, GcodeMove)]
    except CaseError as error:
        said = str(error)
    assert said.startswith(f"{file}: ")
    assert "\n" not in said
    assert np.all(np.isfinite(lengths))


def test_the_example_tells_what_it_leaves_out():
    table = {"kind": "gcode", "file": str(EXAMPLES / "toolpaths" / "groove.ngc")}
    task = validate(table, GcodePath, CaseError, "tool_path").task(PART)
    assert task.remarks[0] == "groove.ngc: read and left out: G94, T1, M6, G43, H1, M30"
    assert "the acceleration jumps, by up to" in task.remarks[1]


def test_a_program_without_a_unit_has_that_of_the_case_until_it_sets_one(tmp_path):
    file = tmp_path / "plain.ngc"
    file.write_text("G0 X0 Y0 Z0\nG1 X2 F60\nG21 X1\n")
    keys = {"kind": "gcode", "file": "plain.ngc"}
    part = Frame.of_rpy([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    table = GcodePath
    with pytest.raises(CaseError, match=r'unit = "mm" or "inch" in \[tool_path\]'):
        table.model_validate(keys, context={"folder": tmp_path}).path(part)
    for unit, metres in (("mm", 1e-3), ("inch", 0.0254)):
        path = table.model_validate({**keys, "unit": unit}, context={"folder": tmp_path}).path(part)
        assert path.position[0, :, 0].max() == pytest.approx(2.0 * metres)
        assert path.position[0, -1, 0] == pytest.approx(1e-3)

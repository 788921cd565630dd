"""G-code that others write: what changes no path is listed, what does is refused by its name."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from counted_calls import require_proportional
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError
from coupling.path.frame import Frame
from coupling.toolpaths.gcode import GcodePath
from coupling.toolpaths.gcode_moves import Dwell, GcodeMove, GcodeProgram
from coupling.toolpaths.gcode_program import read_program

PART = Frame(np.zeros(3), Rotation.identity())
START = ("G21 G90 G17", "G0 X0 Y0 Z0", "G1 X10 F1200")


def program(folder: Path, *lines: str) -> GcodeProgram:
    file = folder / "program.ngc"
    # Behind DOS' mark of a file's end stands nothing.
    file.write_text("\n".join(lines) + "\n" * (not lines[-1].endswith("\x1a")))
    return read_program(file)


def ends_mm(read: GcodeProgram) -> list[list[float]]:
    """Ends of the moves [mm]."""
    return [
        (1e3 * step.end).round(9).tolist() for step in read.steps if isinstance(step, GcodeMove)
    ]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("G64 P0.01", ["G64 P0.01"]),
        ("G64 P0.01 Q0.02", ["G64 P0.01 Q0.02"]),
        ("G61", ["G61"]),
        ("G98", ["G98"]),
        ("G97 S1000 M3", ["G97", "M3"]),
        ("G54", ["G54"]),
        ("G43 H1 D2", ["G43", "H1", "D2"]),
        ("G49 G40 G80 G94 G15 G69 G50", ["G49", "G40", "G80", "G94", "G15", "G69", "G50"]),
        ("G50 S3000", ["G50", "S"]),
        ("G92 S3000", ["G92", "S"]),
        ("G5.1 Q1", ["G5.1 Q1"]),
        ("G08 P1", ["G8 P1"]),
        ("G05 P10000", ["G5 P10000"]),
        ("G60", ["G60"]),
        ("N5 TRANS ; none", ["TRANS"]),
        ("M301 P22 I1.1 D100", ["M301"]),
        ("G187 P1 E0.1", ["G187 P1 E0.1"]),
        ("M64 P1", ["M64"]),
        ("M104 S200 T0", ["M104"]),
        ("M205 X8 Y8 Z0.4", ["M205"]),
        ("M117 now G1 X50", ["M117"]),
        ("M84 X Y E", ["M84"]),
        ("G92 E0", ["G92", "E"]),
        ("A0 B0", ["A0, a rotary axis that stands still", "B0, a rotary axis that stands still"]),
        ("U0 W0", ["U0", "W0"]),
        ('MSG("face; (a)")', ["MSG"]),
        ('T="MILL 10"', ["T="]),
        ("CYCLE832(0.01,_FINISH,1)", ["CYCLE832"]),
        ("$X", ["$X"]),
        ("G52 X0 Y0 Z0", ["G52 of zeros"]),
        ("G641 ADIS=0.5", ["ADIS=, CTOL=", "G641"]),
        ("G643 CTOL=.01 OTOL=2", ["ADIS=, CTOL=", "G643"]),
        ("CUT2DF", ["CUT2DF"]),
        ("T2 (at hand)", ["T2"]),
    ],
)
def test_words_that_change_no_path_are_listed(tmp_path, line, words):
    """Wherever they stand: the moves are those without them, and the list names them."""
    lines = [*START, line, "G1 Y20"]
    read = program(tmp_path, *lines)
    assert ends_mm(read) == [[10.0, 0.0, 0.0], [10.0, 20.0, 0.0]]
    assert sorted(read.left_out) == sorted(words)


@pytest.mark.parametrize(
    ("line", "end"),
    [
        ("N10 G1 X20.0000000000000000001 N20", [20.0, 0.0, 0.0]),
        ("/G1 X20", [20.0, 0.0, 0.0]),
        ("N7 /2 G1 X20", [20.0, 0.0, 0.0]),
        ("(a (nested) G1 X90) G1 X20", [20.0, 0.0, 0.0]),
        ("( a ( G1 X90 )\nG1 X20", [20.0, 0.0, 0.0]),
        ("G1 X20 ; (open", [20.0, 0.0, 0.0]),
        ("(; G1 X90)G1X20(b)", [20.0, 0.0, 0.0]),
        ("g 1 x 2 0.", [20.0, 0.0, 0.0]),
        ("N3 G1 X20*71", [20.0, 0.0, 0.0]),
        ("G2 X20 Y10 I10 J0 K0", [20.0, 10.0, 0.0]),
        ("G2 X20 Y10 I10 P1", [20.0, 10.0, 0.0]),
        ("G2 X20 Y10 CR=10", [20.0, 10.0, 0.0]),
        ("G70 G1 X1", [25.4, 0.0, 0.0]),
        ("G700 X1", [25.4, 0.0, 0.0]),
        ("G1 X=20 Y=-1.5", [20.0, -1.5, 0.0]),
        ("X20 Y5 M21", [20.0, 5.0, 0.0]),
        ("M106 X20", [20.0, 0.0, 0.0]),
        ("X20 M84", [20.0, 0.0, 0.0]),
        ("X20\n\x1a", [20.0, 0.0, 0.0]),
        ("X20;", [20.0, 0.0, 0.0]),
        ("X20 ;P5 of tool T1", [20.0, 0.0, 0.0]),
    ],
)  # fmt: skip
def test_other_ways_to_write_a_move_are_read(tmp_path, line, end):
    assert ends_mm(program(tmp_path, *START, line))[1:] == [end]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("G80 X5", "expected G80 without coordinates, got X"),
        ("G80\nX5", "G80 ended the one before"),
        ("G90 G91", "expected one of G90 and G91 in a line, got both"),
        ("G17 G18", "expected one of G17 and G18"),
        ("G2 X20 Y10 I10 K2", "got K2, an offset across it"),
        ("G2 X20 Y10 I10 P3", "an arc of one turn at most, got P3"),
        ("G55", "expected one work offset, got G55 behind moves in G54"),
        ("G54.1 P2", "expected one work offset, got G54.1 P2 behind moves in G54"),
        ("G15 H2", "expected one work offset, got G15 H2 behind moves in G54"),
        ("G5 X5 P1", "no G5, got a spline"),
        ("G1 X=IC(5)", "a parameter or an assignment"),
        ("G4 P1 X5", "expected G4 without coordinates"),
        ("G1 X20 /G1 Y5", "a / within a line"),
        ("G1 X20; Y5;", "one block in a line, got Y5 behind ';'"),
        ("G90;G1 X20;G1 Y5", "one block in a line, got G1X20 behind ';'"),
        ("G1 X20 A5", "rotary axis A to stand still at 0, got A5"),
        ("G91 C2", "rotary axis C to stand still at 0, got C2"),
        ("G1 X20 W5", "got W5, a second linear axis or an increment"),
        ("G95", "feed per revolution"),
        ("G41 D1", "cutter radius compensation: compensate the radius"),
        ("G10 L2 P1 X5", "an offset set by the program"),
        ("G52 X5", "a shift of the coordinates"),
        ("G92 X0 Y0 Z0", "a shift of the coordinates"),
        ("G59 X5", "no G59, got a shift of the coordinates"),
        ("G62 X1 Y0", "no G62, got a mirror"),
        ("M17\nG1 X20", "no moves behind M17, the end of a sub-program, in line 4"),
        ("G20 N5.1", "before its words, got N5.1, a call of blocks"),
        ("T2 M6\nG0 Y5\nG1 X20", "a cut behind the change to tool 2 in line 4"),
        ("M6 (an end mill by hand)\nG1 X20", "a cut behind the change to another tool in line 4"),
        ('T="B" M6\nG1 X20', "a cut behind the change to tool B in line 4"),
        ("E1\nG1 X20\nE2\nG1 X30", "one offset, got E2 behind E1"),
        ("G1 X20 E0.5\nG61", "no G61 of a printer, got a place"),
        ("G53 Z0\nG0 X20 Y5\nG1 Z-5", "no moves behind G53"),
        ("G50 X5", "G50 without coordinates, got X"),
        ("G5.1 X1 Y1 I1", "G5.1 without coordinates, got X"),
        ("G81 Z-1 R2", "a cycle: let the post-processor"),
        ("G68 R30", "a rotation of the coordinates"),
        ("G51 X0 P2", "scaling"),
        ("G53.6", "a turn of the tool to its plane"),
        ("G68.3", "a tilted plane by the tool"),
        ("G65 P9010", "a call of a macro"),
        ("G123", "expected no G123, got a word that is not known here"),
        ("M98 P1", "a call of a sub-program"),
        ("M99", "a return to a calling program"),
        ("M72", "stored modes"),
        ("M220 S50", "an override of the feed"),
        ("M999", "functions of the machine M0 to M99, got M999"),
        ("G4 S3", "a wait G4 P in seconds, got S"),
        ("IF R1==0 GOTOF END", "a loop or a condition"),
        ("G1 X=10+5", r"an expression '\+5'"),
        ("G98 L1", "the word L: let the post-processor write the moves out"),
        ("R1=5", "an R parameter 'R1=5'"),
        ("Q1 = 5", "a Q parameter"),
        ("G1 X=R1", "a parameter or an assignment"),
        ("G1 X20 A3=0 B3=0 C3=1", "TRAORI or G43.5 before a tool vector, got neither"),
        ("TRACYL", "a transformation of axes"),
        ("TRANS X10", "a frame of the program"),
        ("CYCLE81(1,2,3)", "a cycle"),
        ("CYCLE800(1,2)", "CYCLE800 with mode 57"),
        ("G1 CYCLE800(1,2)", "a tilted plane within a line"),
        ("DEF REAL A", "a declaration"),
        ("G1 X20,C5", "a chamfer"),
        ("G1 X2,5", "a decimal comma"),
        ("G1 X1e1", "numbers without exponents"),
        ("G1 X1.5E-05", "numbers without exponents"),
        ("G1 X", "a word without a number 'X'"),
        ("G1 X5 RND=2", "a rounded corner 'RND=2'"),
        ("SPOS=90", "a word of another control 'SPOS=90': take it out"),
        ("$32=1", "a setting of the control"),
        ("G1 X20 (open", "a comment to be closed"),
        ("(a (b) G1 X20", "a comment to be closed"),
        ("G1 X20) ", "the end of a comment that has no beginning"),
        ("G1 X20 ^", "not G-code that is known here"),
        ("G1 X20 X30", "one word X, got two"),
    ],
)  # fmt: skip
def test_what_would_change_the_path_is_refused_by_its_name_and_line(tmp_path, line, said):
    first = len(START) + 1
    with pytest.raises(CaseError, match=rf"line [{first}-{first + 3}]: .*{said}"):
        program(tmp_path, *START, line)


def test_what_stands_behind_the_end_is_not_executed(tmp_path):
    behind = ("G1 X10 Y90", "G1 Y0")
    for head, tail in ((("%",), "%"), (("(part)", "%"), "%"), ((), "%"), ((), "M30"), ((), "M2")):
        read = program(tmp_path, *head, *START, tail, *behind, "%")
        assert ends_mm(read) == [[10.0, 0.0, 0.0]]
        (count,) = [n for word, n in read.left_out.items() if word.startswith("lines behind the")]
        assert count == 2
    with pytest.raises(CaseError, match="got none: 5 lines behind the closing %"):
        program(tmp_path, "%", "%", *START, *behind)


@pytest.mark.parametrize("name", ["%_N_PART_MPF", "%PART G71 *", ":1001", "$PART.MIN%", "O1001"])
def test_the_name_of_a_program_is_no_line_of_it(tmp_path, name):
    unit = "G90" if "G71" in name else "G21"
    read = program(tmp_path, name, unit, *[line.replace("G21 ", "") for line in START])
    assert ends_mm(read) == [[10.0, 0.0, 0.0]]
    assert any(name[:4] in word for word in read.left_out)


@pytest.mark.parametrize(
    "away", ["G28 G91 Z0", "G91 G28 X0 Y0", "G53 G0 Z0", "G30", "G0 SUPA Z0 D0", "$H", "G28 X Y"]
)
def test_a_return_to_the_reference_may_begin_and_end_a_program(tmp_path, away):
    """The part's coordinates are not known behind it: a place that was given before is none."""
    read = program(tmp_path, "G21 G0 X9 Y9 Z9", away, "G90", *START, "G0 Z5", away, "G90", "M30")
    assert ends_mm(read) == [[10.0, 0.0, 0.0], [10.0, 0.0, 5.0]]
    parked = program(tmp_path, *START, away, "G90 G0 X0 Y0", "M30")
    assert ends_mm(parked) == [[10.0, 0.0, 0.0]]
    with pytest.raises(CaseError, match=r"no moves behind G\d+, .*, in line 4, got some: take it"):
        program(tmp_path, *START, away, "G90 G0 X0 Y0", "Z5", "G1 X20")


@pytest.mark.parametrize("offset", ["G54", "G59.3", "G54.1 P12", "G154 P2", "G505"])
def test_a_work_offset_for_all_moves_is_that_of_the_part(tmp_path, offset):
    """A place that was given in another one is not known in it."""
    read = program(tmp_path, "G21 G0 X9 Y9 Z9", offset, *START, offset, "G1 Y1")
    assert ends_mm(read)[-2:] == [[10.0, 0.0, 0.0], [10.0, 1.0, 0.0]]
    assert len(ends_mm(read)) == (3 if offset == "G54" else 2)
    assert read.left_out == {offset: 2}


def test_axes_that_stand_still_are_left_out_and_may_not_move(tmp_path):
    read = program(
        tmp_path, "G21 G90", "G0 A90 C-5", "G0 X0 Y0 Z5 A90", "G1 X10 F600 C-5", "G91 A0"
    )
    stand = "a rotary axis that stands still"
    assert (len(read.steps), read.left_out) == (1, {f"A90, {stand}": 3, f"C-5, {stand}": 2})
    with pytest.raises(CaseError, match="A to stand still at 90, got A91"):
        program(tmp_path, "G21 G0 X0 Y0 Z5 A90", "G1 X10 F600 A91")


@pytest.mark.parametrize(
    ("wait", "seconds", "said"),
    [
        ("G4 P500", 500.0, "line 4: G4 P500 waits 500 s; .* milliseconds, write G4 P0.5"),
        ("G4 P20\nG4 P100\nG4 P3", 20.0, "G4 P20 waits 20 s; .* so do 1 others"),
        ("G4 P10", 10.0, None),
        ("G4 X1.5", 1.5, "G4 X is a wait in seconds"),
        ("G4 F2", 2.0, "G4 F is a wait in seconds"),
    ],
)
def test_a_wait_is_in_seconds_and_a_long_one_is_remarked(tmp_path, wait, seconds, said):
    read = program(tmp_path, *START, wait, "G1 X20")
    assert read.steps[1].duration == seconds
    assert ends_mm(read)[1] == [20.0, 0.0, 0.0]
    assert read.steps[-1].feed == pytest.approx(0.02, rel=1e-15)
    remarks = (
        GcodePath(kind="gcode", file=tmp_path / "program.ngc", sample_s=0.1).task(PART).remarks
    )
    told = [remark for remark in remarks if "wait" in remark]
    assert bool(told) == (said is not None)
    assert said is None or re.search(said, told[0])


@pytest.mark.parametrize("word", ["G60", "G61"])
def test_exact_stops_are_remarked_with_what_makes_them(tmp_path, word):
    """They are stops at all points on many controls, and nothing of that on others."""

    def remarks(*lines: str) -> str:
        program(tmp_path, *START, *lines, "G1 X20 Y1")
        table = GcodePath(kind="gcode", file=tmp_path / "program.ngc", sample_s=0.1)
        return " ".join(table.task(PART).remarks)

    assert f"{word}, exact stops on many controls" in remarks(word)
    assert "exact stops" not in remarks()


comments = st.recursive(
    st.text(" xX9;G1", max_size=6),
    lambda inner: st.builds("{}({}){}".format, inner, inner, inner),
    max_leaves=6,
)


@given(comments)
@settings(max_examples=100, derandomize=True, deadline=None,
          suppress_health_check=[HealthCheck.function_scoped_fixture])  # fmt: skip
def test_a_comment_however_nested_is_no_part_of_its_line(tmp_path, comment):
    assert ends_mm(program(tmp_path, *START, f"({comment})G1 X20"))[1:] == [[20.0, 0.0, 0.0]]


def test_work_grows_in_proportion_to_length(tmp_path):
    def read_moves(count: int) -> None:
        lines = [f"G1 X{0.01 * k:.4f} Y{0.02 * (k % 7):.4f}" for k in range(1, count)]
        (tmp_path / "long.ngc").write_text("\n".join([*START, *lines]))
        read_program(tmp_path / "long.ngc")

    require_proportional(read_moves)


def test_a_line_of_two_hundred_thousand_digits_is_refused(tmp_path):
    with pytest.raises(CaseError, match="line 4: "):
        program(tmp_path, *START, "G1 X" + 200_000 * "1")


def test_a_heading_of_tnc_means_a_blank_and_places_of_centres(tmp_path):
    """The circle about (10, 10) through (20, 10); as an offset its centre would be (30, 20)."""
    head = ("%PART G71 *", "N1 G30 G17 X+0 Y+0 Z-9*", "N2 G31 G90 X+99 Y+99 Z+0*")
    start = ("N3 G00 G40 G90 Z+0*", "N4 X+20 Y+10*")
    read = program(tmp_path, *head, *start, "N5 G03 X+20 Y+10 I+10 J+10 F300*", "N9 %PART G71 *")
    (circle,) = (step for step in read.steps if isinstance(step, GcodeMove))
    assert circle.arc is not None
    np.testing.assert_allclose(circle.arc.centre, [0.01, 0.01])
    for line, said in (("G28 X", "a mirror"), ("G54 X+5", "a shift"), ("G91 X+5", "write places")):
        with pytest.raises(CaseError, match=f"line 6: .*{said}"):
            program(tmp_path, *head, *start, line)


def test_a_printer_waits_seconds_by_s(tmp_path):
    read = program(tmp_path, *START, "G1 X20 E1", "G4 S3", "G1 X30")
    assert [step.duration for step in read.steps if isinstance(step, Dwell)] == [3.0]


def test_a_coordinate_without_a_point_among_pointed_ones_is_told(tmp_path):
    """FANUC and HAAS may take Y5 for 5 increments."""
    (sentence,) = program(
        tmp_path, "G21 G90 (Y7)", "G0 X0. Y0. Z0.", "G1 F9 X10.", "Y5"
    ).assumptions
    assert sentence.startswith("line 4: Y5 is a whole number")
    for lines in (START, ("G21 G90", "G0 X0. Y0 Z0.", "G1 X1.5 Y5. F1")):
        assert not program(tmp_path, *lines).assumptions


def test_a_tool_that_is_changed_for_itself_or_behind_the_cuts_is_one_tool(tmp_path):
    lines = ["T1 M6", *START, "T2 M6", "T1 M6", "G1 X20", "T2 M6", "G0 Z5", "M30"]
    assert ends_mm(program(tmp_path, *lines)) == [
        [10.0, 0.0, 0.0],
        [20.0, 0.0, 0.0],
        [20.0, 0.0, 5.0],
    ]
    tnc = (
        "%PART G71 *",
        "T1 G17 S99*",
        "G00 G90 X+0 Y+0 Z+0*",
        "G01 X+1 F9*",
        "T2 G17 S99*",
        "X+2*",
    )
    with pytest.raises(CaseError, match=r"line 6: .* the change to tool 2 in line 5"):
        program(tmp_path, *tnc)


def test_a_printers_words_may_be_whole_and_its_motors_be_switched_on(tmp_path):
    printed = program(tmp_path, "M83", *START, "G1 X20 E1", "M17", "G1 X30 E2")
    assert ends_mm(printed) == [[10.0, 0.0, 0.0], [20.0, 0.0, 0.0], [30.0, 0.0, 0.0]]


def test_a_program_that_may_be_cut_off_is_told(tmp_path):
    """A tape has % at both ends; a file cut within a line may have lost the end of a number."""
    file = tmp_path / "cut.ngc"
    whole = "%\nG21 G1 X0 Y0 Z0 F100\nX12.5"
    for text, is_told in (
        (whole, True),
        (f"{whole}\n", True),
        (f"{whole}\n%", False),
        (f"{whole}\nM30", False),
        (whole[2:], True),
        (f"{whole[2:]}\n", False),
    ):
        file.write_text(text)
        remarks = ["'X12.5', without M2, M30" in text for text in read_program(file).assumptions]
        assert remarks == [True] * is_told


def test_feeds_under_g70_are_told(tmp_path):
    (sentence,) = program(tmp_path, "G70 G0 X0 Y0 Z0", "G1 X1 F5").assumptions
    assert "SINUMERIK" in sentence

"""Parameters, expressions and loops in G-code: as the lines that they stand for."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from coupling.errors import CaseError
from coupling.toolpaths.gcode_moves import GcodeMove
from coupling.toolpaths.gcode_program import read_program

START = ("G21 G90 G94 F600", "G0 X0 Y0 Z5")


def places_mm(folder: Path, *lines: str) -> np.ndarray:
    """Return where the tool goes [mm], (moves, 3)."""
    file = folder / "program.ngc"
    file.write_text("\n".join([*START, *lines, "M2", ""]))
    moves = [step for step in read_program(file).steps if isinstance(step, GcodeMove)]
    return 1e3 * np.array([move.end for move in moves])


def on_x(folder: Path, *lines: str) -> list[float]:
    return places_mm(folder, *lines)[:, 0].round(9).tolist()


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        # What LinuxCNC 2.9 computes.
        ("[1 LT 2 + 3]", 1.0), ("[2 * 3 ** 2]", 18.0), ("[1 EQ 1 AND 0 EQ 1]", 0.0), ("[8/4/2]", 1.0),
        ("[2 ** 3 ** 2]", 64.0), ("[-2 ** 2]", 4.0), ("[1 OR 1 AND 0]", 0.0), ("[0 AND 0 OR 1]", 1.0),
        ("[7 MOD 3]", 1.0), ("[-7 MOD 3]", 2.0), ("[7 MOD -3]", 1.0), ("FIX[-2.8]", -3.0),
        ("FUP[-2.8]", -2.0), ("ROUND[-2.5]", -3.0), ("ROUND[2.5]", 3.0), ("ATAN[-1]/[-1]", -135.0),
        ("[1 NE 1.00005]", 0.0), ("[1 LT 1.0000001]", 1.0), ("-[3]", -3.0), ("[2--1]", 3.0),
        ("-sin[30]", -0.5), ("[1 XOR 1]", 0.0), ("[2 AND 3]", 1.0), ("EXISTS[#<A>]", 1.0),
        ("[2 - 3 * 2 + 1]", -3.0), ("[1 LT 2 LT 3]", 1.0), ("##8", 3.5), ("#[4 * #8 - 4]", 3.5),
    ],
)  # fmt: skip
def test_expressions_have_the_values_that_linuxcnc_gives_them(tmp_path, expression, value):
    given = ("#7=3.5", "#<a>=4", "#8=7", "#24=3.5")
    (place,) = on_x(tmp_path, *given, f"G1 X[100+{expression}]")
    assert place == pytest.approx(100.0 + value, abs=1e-9)


@pytest.mark.parametrize(
    ("program", "places"),
    [
        ("#1=0| o1 while [#1 LT 3]| #1=[#1+1]| G1 X#1| o1 endwhile", [1, 2, 3]),
        ("#1=9| o1 while [#1 LT 3]| G1 X1| o1 endwhile| G1 X2", [2]),
        ("#1=0| o1 do| #1=[#1+1]| G1 X#1| o1 while [#1 LT 3]| G1 X9", [1, 2, 3, 9]),
        ("G91| o2 repeat [3]| G1 X1.5| o2 endrepeat", [1.5, 3, 4.5]),
        ("o2 repeat [0]| G1 X1.5| o2 endrepeat| G1 X2", [2]),
        (
            "#1=0| o9 do| #1=[#1+1]| o1 if [#1 EQ 1]| G1 X11| o1 elseif [#1 EQ 2]| G1 X22| o1 else"
            "| G1 X[50+#1]| o1 endif| o9 while [#1 LT 4]",
            [11, 22, 53, 54],
        ),
        (
            "o<p> sub| G1 X[#1+#2]| o<p> endsub [7]| #2=5| o<p> call [1]| G1 X#<_value>| G1 X#2",
            [1, 7, 5],
        ),
        (
            "o1 call [3]| G1 X9| M2| o1 sub| G1 X#1| o2 if [#1 GT 1]| o1 call [#1-1]| o2 endif"
            "| o1 endsub",
            [3, 2, 1, 9],
        ),
        (
            "#1=0| o1 while [1]| #1=[#1+1]| o2 if [#1 EQ 2]| o1 continue| o2 endif| o3 if [#1 GT 3]"
            "| o1 break| o3 endif| G1 X#1| o1 endwhile",
            [1, 3],
        ),
        ("#3=15| #3=6 G1 X#3| G1 X#3", [15, 6]),
        # FANUC's.
        (
            "#1=0| WHILE [#1 LT 3] DO1| #1=#1+1| #2=0| WHILE[#2LT2]DO2| #2=#2+1| G1 X[10*#1+#2]"
            "| END2| END1",
            [11, 12, 21, 22, 31, 32],
        ),
        ("#1=0| N10 #1=#1+1 * 2| G1 X#1| IF [#1 LT 6] GOTO 010| G1 X-#1", [2, 4, 6, -6]),
        ("#1=5.| IF [#1 GT 2] THEN #1=2| GOTO 7| G1 X99| N7 G1 X#1", [2]),
        ("#4=0./2.+1| #7= - #4 -85.| G1 X[#7]", [-86]),
    ],
)
def test_loops_and_sub_programs_do_what_their_lines_say(tmp_path, program, places):
    assert on_x(tmp_path, *program.split("|")) == places


def test_a_circle_of_holes_is_where_its_angles_say(tmp_path):
    """What a comment has is none of it."""
    lines = ("#<n>=7 (holes [#1])", "#<k>=0 ; #2", "o1 while [#<k> LT #<n>]", "#<a>=[360*#<k>/#<n>]",
             "G0 X[20*cos[#<a>]] Y[20*sin[#<a>]]", "#<k>=[#<k>+1]", "o1 endwhile")  # fmt: skip
    angles = 2.0 * math.pi * np.arange(7) / 7
    places = places_mm(tmp_path, *lines)
    np.testing.assert_allclose(
        places,
        np.column_stack([20 * np.cos(angles), 20 * np.sin(angles), np.full(7, 5)]),
        atol=1e-9,
    )


def test_a_sub_program_alone_is_named(tmp_path):
    file = tmp_path / "hole.ngc"
    file.write_text("(a hole)\no<hole> sub\nG1 Z-#1\no<hole> endsub\n")
    with pytest.raises(
        CaseError, match="line 2: expected a program that calls it, got a sub-program"
    ):
        read_program(file)


def test_other_lines_of_such_a_program_are_read_as_ever(tmp_path):
    lines = ("(#1 is [none])", "M117 Layer #3 [1/9]", 'MSG("#1")', "G1 X1", "#1=2", "/G1 X#1")
    assert on_x(tmp_path, *lines) == [1, 2]


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (("G1 X#5",), "line 3: expected a value of #5 before, got none"),
        (("#1=#<_x>",), r"line 3: expected a value of #<_x> before"),
        (("#5221=3",), "a parameter #1 to #999, got #5221, one of the control"),
        (("#1=#0",), "got #0, one of the control"),
        (("o<cut> call [1]",), r"the sub-program O<CUT> in this file, got its call alone"),
        (("o1 while [1]", "o1 endwhile"), "ends with at most 100000 repeated lines"),
        (("#1=1", "o1 if [#1]", "G1 X1"), "O1 to begin and end one block or more, got if$"),
        (("#1=1", "o1 endwhile"), "got endwhile$"),
        (("o1 do", "o1 continue", "o1 while [0]"), "got do continue while$"),
        (("#1=0", "GOTO 5"), "line 4: expected a line N5 to go to"),
        (("#1=0", "WHILE[#1LT3]DO1"), "expected END1 behind"),
        (("#1=1", "IF [#1 LT 3] DO1"), "IF with GOTO or THEN"),
        (("G1 X[1/0]",), "got 1 / 0"),
        (("G1 X[ACOS[2]]",), r"got ACOS\[2\]"),
        (("G1 X[1+",), "got 'the end'"),
        (("#1=1e-3",), "numbers without exponents, got '1E-3'"),
        (("G1 X[1e1]",), "numbers without exponents"),
        (("#<q>=1", "G1 X[exists[#<q>1]"), r"expected EXISTS\[#<name>\]"),
        (("G1 X" + 3000 * "[",), "fewer brackets in each other"),
        (("#1=1", "IF [#1 EQ 1] GOTOF LABEL"), "a loop or a condition"),
        # What controls compute in different ways, where nothing tells which it is.
        (("G1 X[FIX[-2.5]]",), "controls compute FIX"),
        (("G1 X[-7 MOD 3]",), "controls compute MOD"),
        (("G1 X[ATAN[-1]/[1]]",), "controls compute ATAN"),
        (("#1=0.1", "#2=#1*3", "IF [#2 EQ 0.3] GOTO 1"), "which depends on the control's rounding"),
        (("#1=[3 AND 1]",), "expected conditions beside AND"),
        (("#1=[1 AND 1 OR 1]",), "expected brackets between AND and OR"),
        (("o1 sub", "o1 call", "o1 endsub", "o1 call"), "at most 10 sub-programs in each other"),
    ],
)  # fmt: skip
def test_what_depends_on_the_control_or_does_not_end_is_refused(tmp_path, lines, said):
    with pytest.raises(CaseError, match=said):
        places_mm(tmp_path, *lines)

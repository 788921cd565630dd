"""G-code of five-axis machines: what is not known of the tool is refused by its name."""

import numpy as np
import pytest
from five_axes import (
    PART,
    course,
    path,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from coupling.errors import CaseError


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
        (AC, ["M126"], "no M126, got the shortest way of rotary axes: take it out, and name them"),
        (AC, ["M116"], "no M116, got a feed of rotary axes in millimetres"),
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

"""FANUC TP of others: every instruction is executed, left out by its name, or refused."""

import numpy as np
import pytest
from counted_calls import require_proportional
from damage import read_or_refused
from fanuc_programs import (
    CHOSEN,
    FIRST,
    POINTS,
    SECOND,
    ZEROES,
    cartesian,
    places,
    read,
    text_of,
)
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from coupling.errors import ProgramError
from coupling.programs.fanuc import reader as fanuc_reader
from coupling.programs.languages import read_program
from coupling.programs.program import ProgramFile

MM = 1e-3
# Instructions, and the positions that the robot gets to [mm].
EXECUTED = {
    "increment": (f"{FIRST}\n{SECOND} INC\n{SECOND} INC", [[0, 0, 0], [100, 0, 0], [200, 0, 0]]),
    "offset": (f"{ZEROES}PR[5,2]=7\n{SECOND} Offset,PR[5]", [[100, 7, 0]]),
    "offset of a condition": (
        f"{ZEROES}PR[5,2]=7\nOFFSET CONDITION PR[5]\n{FIRST}\n{SECOND} Offset",
        [[0, 0, 0], [100, 7, 0]],
    ),
    "offset of the tool": (f"{ZEROES}PR[5,3]=7\n{SECOND} Tool_Offset,PR[5]", [[100, 0, -7]]),
    "offset of the tool by a condition": (
        f"{ZEROES}PR[5,3]=7\nTOOL_OFFSET CONDITION PR[5],UTOOL[1]\n{SECOND} Tool_Offset",
        [[100, 0, -7]],
    ),
    "both offsets": (
        f"{ZEROES}PR[5,3]=7\n{SECOND} Tool_Offset,PR[5] Offset,PR[5] ACC50",
        [[100, 0, 0]],
    ),
    "position by a register": ("R[4]=3\nL P[R[4]] 50mm/sec FINE", [[200, 0, 0]]),
    "position register": ("PR[6:there]=P[3:end]\nL PR[6:there] 50mm/sec FINE", [[200, 0, 0]]),
    "element of one": (
        "PR[6]=P[3]\nPR[6,3]=PR[6,1]/2-10\nL PR[6] 50mm/sec FINE",
        [[200, 0, 90]],
    ),
    "sum": ("PR[6]=P[3]\nPR[7]=PR[6]-P[2]\nPR[7,4]=0\nL PR[7] 5mm/sec FINE", [[100, 0, 0]]),
    "last position": (
        f"{SECOND}\nPR[6]=LPOS\nPR[6,2]=(PR[6,2]+3)\nL PR[6] 5mm/sec FINE",
        [[100, 0, 0], [100, 3, 0]],
    ),
    "loop": (
        "PR[6]=P[1]\nFOR R[1:i]=1 TO 3\nPR[6,1]=R[1]*10\nL PR[6] 50mm/sec FINE\nENDFOR",
        [[10, 0, 0], [20, 0, 0], [30, 0, 0]],
    ),
    "loop down": (
        "PR[6]=P[1]\nFOR R[1]=2 DOWNTO 1\nPR[6,1]=R[1]\nL PR[6] 50mm/sec FINE\nENDFOR",
        [[2, 0, 0], [1, 0, 0]],
    ),
    "loop of none": (f"FOR R[1]=2 TO 1\n{FIRST}\nENDFOR\n{SECOND}", [[100, 0, 0]]),
    "jumps": (
        f"R[1]=0\nLBL[7:again]\n{FIRST}\nR[1]=R[1]+1\nIF R[1]<2,JMP LBL[7]\n{SECOND}",
        [[0, 0, 0], [0, 0, 0], [100, 0, 0]],
    ),
    "branch": (
        f"R[1]=2\nIF (R[1]=1 OR !(R[1]<3)) THEN\n{FIRST}\nELSE\n{SECOND}\nENDIF",
        [[100, 0, 0]],
    ),
    "branch in another": (
        f"R[1]=1\nIF R[1]=1 THEN\nIF R[1]=2 THEN\n{FIRST}\nELSE\n{SECOND}\nENDIF\nELSE\n{FIRST}\nENDIF",
        [[100, 0, 0]],
    ),
    "selection": (
        f"R[1]=2\nSELECT R[1]=1,JMP LBL[1]\n=2,JMP LBL[2]\nELSE,JMP LBL[3]\nLBL[1]\n{FIRST}\n"
        f"LBL[2]\n{SECOND}\nLBL[3]",
        [[100, 0, 0]],
    ),
    "known despite an input": (
        f"R[1]=2\nIF (R[1]=1 AND DI[3]=ON),JMP LBL[1]\n{SECOND}\nLBL[1]",
        [[100, 0, 0]],
    ),
    "branch without an effect": (
        f"{FIRST}\nIF (DI[3]) THEN\nDO[1]=ON\nELSE\nUALM[1]\nENDIF\nIF DI[2]=ON,PAUSE\n{SECOND}",
        [[0, 0, 0], [100, 0, 0]],
    ),
    "end": (f"{FIRST}\nEND\n{SECOND}", [[0, 0, 0]]),
    "remarks": (f"!L P[3] 5mm/sec FINE\n//{SECOND}\n--eg:{SECOND}\n{FIRST}", [[0, 0, 0]]),
    "point logic": (
        f"J P[1] 100% CNT100 TB .10sec,P-SPS\nDO[2]=ON\n------\n{SECOND}",
        [[0, 0, 0], [100, 0, 0]],
    ),
    "harmless options": (
        f"{FIRST} PTH ACC R[1] BREAK Arc Start[1,2] EV50% TA 0.10sec,DO[3]=ON"
        " DB  5.0mm,RO[1]=PULSE,.5sec",
        [[0, 0, 0]],
    ),
    "lower case": ("l p[1] 50MM/SEC fine\nuframe_num=1\nl p[2] 50mm/sec cnt100 inc", None),
}


RADIUS = 30.0
# Places on a circle of RADIUS about (0, 0, 5), at these angles [deg].
AROUND = (0.0, 40.0, 130.0, 250.0)
ROUND = "".join(
    cartesian(k, RADIUS * np.cos(a), RADIUS * np.sin(a), 5.0, w=180.0)
    for k, a in enumerate(np.deg2rad(AROUND), start=1)
)


@pytest.mark.parametrize(
    ("instructions", "swept"),
    [
        ("L P[1] 50mm/sec FINE\nC P[2] P[3] 20mm/sec CNT100", 130.0),
        ("J P[1] 50% FINE\nC P[2] P[3] 6.5sec FINE", 130.0),
        ("L P[1] 50mm/sec FINE\nC P[2] P[4] 20mm/sec FINE\nC P[1] P[3] 20mm/sec FINE", 490.0),
        ("\n".join(f"A P[{k}] 20mm/sec CNT100" for k in (1, 2, 3, 4)), 250.0),
        ("\n".join(f"A P[{k}] 20mm/sec CNT50\nDO[1]=ON" for k in (3, 2, 1)), 130.0),
    ],
)
def test_circles_are_followed_through_their_positions(instructions, swept):
    """Chords are on the circle to the rounding of the positions, and make up its arc's length."""
    text = text_of(CHOSEN + instructions, ROUND).replace("P[2] P[3]", "P[2]    \n    :  P[3]")
    found = fanuc_reader.read([ProgramFile("main.ls", text)])
    points = 1e3 * np.array([move.pose[:3] for move in found.moves])
    np.testing.assert_allclose(np.linalg.norm(points[:, :2], axis=1), RADIUS, atol=2e-3)
    np.testing.assert_allclose(points[:, 2], 5.0, atol=1e-9)
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert length == pytest.approx(RADIUS * np.deg2rad(swept), abs=2e-2)
    assert {move.motion for move in found.moves[1:]} == {"linear"}
    if "sec FINE" in instructions and "6.5sec" in instructions:
        assert sum(move.duration for move in found.moves[1:]) == pytest.approx(6.5)
    else:
        assert {round(move.speed, 9) for move in found.moves[1:]} == {0.02}


def test_speeds_whose_numbers_stand_elsewhere_are_none():
    """feed_m_s is asked for where such a line is driven."""
    found = read("L P[1] 50mm/sec FINE\nL P[2] max_speed CNT100\nL P[3] WELD_SPEED FINE")
    assert [move.speed for move in found.moves] == [0.05, None, None]


def test_a_run_of_arcs_keeps_its_rests_and_is_held_to_one_circle():
    found = read("A P[1] 20mm/sec FINE\nA P[2] 20mm/sec FINE\nA P[3] 20mm/sec CNT100", ROUND)
    stops = [1e3 * np.array(move.pose[:2]) for move in found.moves if move.is_stop]
    expected = [[RADIUS * np.cos(a), RADIUS * np.sin(a)] for a in np.deg2rad(AROUND[:2])]
    np.testing.assert_allclose(stops, expected, atol=1e-3)
    off = ROUND + cartesian(5, RADIUS + 0.05, 0.0, 5.0, w=180.0)
    with pytest.raises(ProgramError, match=r"expected all A .* 0\.05 mm off it"):
        read("\n".join(f"A P[{k}] 20mm/sec FINE" for k in (1, 2, 3, 5)), off)
    turned = ROUND + cartesian(5, RADIUS, 0.0, 5.0, w=180.0, r=1.0)
    for arc in ("C P[3] P[5] 9mm/sec FINE", "C P[5] P[3] 9mm/sec FINE"):
        with pytest.raises(ProgramError, match="a tool that turns"):
            read(f"L P[2] 20mm/sec FINE\n{arc}", turned)
    with pytest.raises(ProgramError, match="a tool that turns"):
        read("\n".join(f"A P[{k}] 20mm/sec FINE" for k in (2, 3, 5)), turned)


@pytest.mark.parametrize("name", EXECUTED)
def test_instructions_are_executed_as_a_controller_does(name):
    instructions, expected = EXECUTED[name]
    program = read(instructions)
    assert places(program) == (expected or [[0, 0, 0], [100, 0, 0]])


@pytest.mark.parametrize(
    ("between", "stands"),
    [("DO[1]=ON", False), ("WAIT DI[1]=ON", True), ("PAUSE", True)],
)
def test_a_wait_for_a_signal_ends_the_look_ahead(between, stands):
    """Behind CNT100 the robot comes to rest: no motion is planned before the wait is over."""
    program = read(f"L P[1] 50mm/sec CNT100\n{between}\nL P[2] 50mm/sec CNT100")
    assert [move.is_stop for move in program.moves] == [stands, False]


def test_what_is_left_out_is_listed_by_name():
    program = read(
        "PAYLOAD[1]\nDO[1]=ON\nDO[2]=OFF\nWAIT DI[1]=ON TIMEOUT,LBL[9]\nMESSAGE[A: B]\n"
        f"{FIRST} ACC80\nLBL[9]"
    )
    assert dict(program.left_out) == {"PAYLOAD": 1, "DO[]": 2, "WAIT": 1, "MESSAGE": 1, "ACC": 1}
    assert program.assumptions == ("what WAIT waits for comes before its TIMEOUT",)


ANGLES = st.tuples(*[st.floats(-170.0, 170.0)] * 3)
PLACES = st.tuples(*[st.floats(-900.0, 900.0)] * 3)


def matrix(values) -> np.ndarray:
    """Return the transform of X, Y, Z [mm], W, P, R [deg]: about the fixed x, y, z in turn."""
    result = np.eye(4)
    result[:3, :3] = Rotation.from_euler("xyz", values[3:], degrees=True).as_matrix()
    result[:3, 3] = MM * np.array(values[:3])
    return result


def matrix_of(pose) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = Rotation.from_quat(pose[3:]).as_matrix(), pose[:3]
    return result


def assigned(index: int, values) -> str:
    return "".join(f"PR[{index},{k}]=({v:.4f})\n" for k, v in enumerate(values, start=1))


@given(st.tuples(PLACES, ANGLES), st.tuples(PLACES, ANGLES), st.tuples(PLACES, ANGLES))
def test_offsets_increments_and_last_positions_are_those_of_matrices_and_sums(a, b, c):
    """Offset and INC add number by number, Tool_Offset multiplies by a frame in the tool."""
    first, second, shift = ([round(x, 4) for x in (*p, *q)] for p, q in (a, b, c))
    first[4] *= 0.5  # within 90 deg, as a controller holds it
    program = read(
        assigned(1, first)
        + assigned(2, second)
        + assigned(3, shift)
        + "L PR[1] 5mm/sec FINE\nL PR[2] 5mm/sec FINE INC\nL PR[1] 5mm/sec FINE Offset,PR[3]\n"
        "L PR[1] 5mm/sec FINE Tool_Offset,PR[3]\nPR[4]=LPOS\nL PR[4] 5mm/sec FINE"
    )
    added, offset = np.add(first, second), np.add(first, shift)
    tool = matrix(first) @ matrix(shift)
    for move, expected in zip(
        program.moves, [matrix(first), matrix(added), matrix(offset), tool, tool], strict=True
    ):
        np.testing.assert_allclose(matrix_of(move.pose), expected, atol=2e-6)


def test_an_increment_may_tilt_over_but_none_may_follow():
    """Beyond P = 90 deg a controller holds the pose by other angles, to which it adds."""
    start, tilt = [1.0, 2.0, 3.0, 10.0, 60.0, 20.0], [4.0, 0.0, 0.0, 5.0, 50.0, 7.0]
    text = (
        assigned(1, start) + assigned(2, tilt) + "L PR[1] 5mm/sec FINE\nL PR[2] 5mm/sec FINE INC\n"
    )
    over = read(text).moves[1]
    np.testing.assert_allclose(matrix_of(over.pose), matrix(np.add(start, tilt)), atol=2e-6)
    with pytest.raises(ProgramError, match="P within 90 deg before INC, got 110"):
        read(text + "L PR[2] 5mm/sec FINE INC")
    text += assigned(2, [4.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    moved = read(text + "L PR[2] 5mm/sec FINE INC").moves[2]
    np.testing.assert_allclose(moved.pose, [over.pose[0] + 4e-3, *over.pose[1:]], atol=1e-7)
    held = read(text + "PR[3]=LPOS\nPR[3,1]=PR[3,5]\nL PR[3] 5mm/sec FINE").moves[2]
    assert held.pose[0] == pytest.approx(
        0.070
    )  # P = 110 deg is 70 deg, with W and R turned by 180 deg


@given(st.tuples(PLACES, ANGLES), st.tuples(PLACES, ANGLES), st.tuples(PLACES, ANGLES))
def test_positions_in_another_frame_and_of_another_tool_are_the_same_flange(a, b, c):
    frame, tool, point = ([round(x, 4) for x in (*p, *q)] for p, q in (a, b, c))
    program = read(
        assigned(1, [0.0] * 6)
        + "UFRAME[1]=PR[1]\nUTOOL[1]=PR[1]\n"
        + assigned(2, frame)
        + "UFRAME[2]=PR[2]\n"
        + assigned(3, tool)
        + "UTOOL[2]=PR[3]\n"
        + assigned(4, point)
        + "J PR[4] 10% FINE\nUFRAME_NUM=2\nUTOOL_NUM=2\nJ PR[4] 10% FINE\nPR[5]=LPOS\n"
        + "UFRAME_NUM=1\nUTOOL_NUM=1\nPR[6]=LPOS\nJ PR[6] 10% FINE"
    )
    flange = matrix(frame) @ matrix(point) @ np.linalg.inv(matrix(tool))
    np.testing.assert_allclose(matrix_of(program.moves[0].pose), matrix(point), atol=2e-6)
    for move in program.moves[1:]:
        np.testing.assert_allclose(matrix_of(move.pose), flange, atol=2e-6)


def test_speeds_and_times_are_in_their_units_and_scaled_by_the_override():
    program = read(
        "R[1]=300\nL P[1] 60cm/min FINE\nL P[2] 2inch/min CNT50\nL P[1] R[1]mm/sec CNT R[1]\n"
        "L P[2] 1.5sec FINE\nL P[1] 250msec CD20\nOVERRIDE=50%\nL P[2] 60cm/min FINE\n"
        "L P[3] 2sec FINE"
    )
    speeds = [0.01, 2 * 0.0254 / 60, 0.3, None, None, 0.005, None]
    assert [move.speed for move in program.moves] == pytest.approx(speeds)
    assert [move.duration for move in program.moves] == [None, None, None, 1.5, 0.25, None, 4.0]
    assert program.assumptions == ("OVERRIDE=50% scales the speeds behind it",)


def test_frames_of_the_first_group_are_those_of_the_robot():
    """As Roboguide writes them."""
    grouped = "UTOOL_NUM[GP1]= 1\nUFRAME_NUM[GP1]= 1\n"
    assert read(f"{grouped}{FIRST}\n{SECOND}") == read(f"{CHOSEN}{FIRST}\n{SECOND}")


def test_a_turn_in_degrees_per_second_has_its_time():
    points = cartesian(1) + cartesian(2, r=90.0)
    program = read("L P[1] 5mm/sec FINE\nL P[2] 45deg/sec FINE", points)
    assert program.moves[1].duration == pytest.approx(2.0, rel=1e-6)


def test_axes_beside_the_robot_are_read_where_they_stand():
    stands = ",\n\tE1= -12.5  mm\n   GP2:\n\tUF : 0, UT : 0,\t\n\tJ1=     6.378 deg"
    points = cartesian(1, more=stands) + cartesian(2, x=9.0, more=stands)
    assert places(read(f"{FIRST}\n{SECOND}", points)) == [[0, 0, 0], [9, 0, 0]]
    for moved, name in (
        (stands.replace("-12.5", "7"), "E1"),
        (stands.replace("6.378", "6"), "GP2 J1"),
    ):
        points = cartesian(1, more=stands) + cartesian(2, x=9.0, more=moved)
        with pytest.raises(ProgramError, match=f"line 7: expected {name} to stand"):
            read(f"{FIRST}\n{SECOND}", points)
    points = cartesian(1) + cartesian(2, x=9.0, more=stands)
    with pytest.raises(ProgramError, match="line 7: expected E1 from the first target on"):
        read(f"{FIRST}\n{SECOND}", points)


def test_positions_of_any_frame_and_names_in_quotes_are_read():
    points = cartesian(1, uf="F", ut="F") + cartesian('2:"near [x]"', x=9.0)
    assert places(read(f"{FIRST}\nL P[2:near] 5mm/sec FINE", points)) == [[0, 0, 0], [9, 0, 0]]


def test_frames_that_positions_alone_state_are_an_assumption():
    program = fanuc_reader.read([ProgramFile("a.ls", text_of(FIRST))])
    assert program.assumptions == (
        "UFRAME 1 is in use at the start, as positions say",
        "UTOOL 1 is in use at the start, as positions say",
    )


def test_programs_that_are_called_have_arguments_positions_and_labels_of_their_own():
    program = read(
        "CALL DEEP(2,R[1])\nCALL OUTPUTS\nL P[1] 5mm/sec FINE TB .1sec,CALL OUTPUTS",
        DEEP="JMP LBL[1]\nLBL[1]\nIF AR[1]=0,END\nR[2]=AR[1]-1\nL P[AR[1]] 5mm/sec FINE\n"
        "CALL DEEP(R[2])",
        OUTPUTS="IF DI[1]=ON,JMP LBL[1]\nDO[1]=ON\nLBL[1]",
    )
    assert places(program) == [[100, 0, 0], [0, 0, 0], [0, 0, 0]]
    assert dict(program.left_out) == {"CALL of outputs": 2}
    with pytest.raises(ProgramError, match="runs during a motion, got 'PR"):
        read(f"{FIRST} TB .1sec,CALL SHIFTS", SHIFTS="DO[1]=ON\nPR[1,1]=3")
    with pytest.raises(ProgramError, match=r"main\.ls: line 7: expected OFFSET CONDITION"):
        read(f"CALL SETS\n{FIRST} Offset", SETS=f"{ZEROES}OFFSET CONDITION PR[5]")


def test_files_that_called_files_call_are_found_beside(tmp_path):
    for name, line in (("a", "CALL B"), ("b", "CALL C"), ("c", FIRST)):
        (tmp_path / f"{name}.ls").write_text(text_of(line, name=name.upper()))
    assert places(read_program(tmp_path / "a.ls")) == [[0, 0, 0]]


def test_line_styles_of_others_are_read():
    """CRLF, lines without numbers or semicolons, instructions over two lines, sections before /MN."""
    body = [
        "/APPL",
        "  SOMETHING : 1;",
        "/MN",
        ": UFRAME_NUM=1;",
        "   2:  UTOOL_NUM=1 ;",
        "   3:L P[1] 50mm/sec CNT100",
        "    :  ACC80 ;",
        "   4://L P[3] 50mm/sec CNT100",
        "    :  ACC80 ;",
        "L P[2] 50mm/sec FINE ; ! the end",
        "/POS",
    ]
    text = "/PROG  STYLES\tMacro\r\n" + "\r\n".join(body) + "\r\n" + POINTS
    assert places(fanuc_reader.read([ProgramFile("a.ls", text)])) == [[0, 0, 0], [100, 0, 0]]


def test_work_grows_in_proportion_to_length():
    def read_moves(count: int) -> None:
        points = "".join(cartesian(k, x=0.1 * k) for k in range(1, count + 1))
        lines = "\n".join(f"L P[{k}] 50mm/sec CNT100" for k in range(1, count + 1))
        read(lines, points)

    require_proportional(read_moves)


def test_damaged_programs_are_read_or_refused():
    whole = CHOSEN + "\n".join(
        instructions
        for name, (instructions, _) in EXECUTED.items()
        if name not in ("end", "lower case")
    )
    text = text_of(whole.replace("LBL[7", "LBL[8"))
    read_or_refused(lambda broken: fanuc_reader.read([ProgramFile("a.ls", broken)]), text)

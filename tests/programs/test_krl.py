"""KRL of others: every statement is executed, left out because it cannot change the path, or refused."""

import numpy as np
import pytest
from counted_calls import require_proportional
from damage import read_or_refused
from hypothesis import given
from hypothesis import strategies as st
from krl_programs import POINTS, START, ZERO, places, program
from scipy.spatial.transform import Rotation

from coupling.errors import ProgramError
from coupling.programs.krl.reader import read
from coupling.programs.languages import read_program
from coupling.programs.program import ProgramFile


def matrix(x, y, z, a, b, c) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3] = Rotation.from_euler("ZYX", [a, b, c], degrees=True).as_matrix()
    result[:3, 3] = x, y, z
    return result


def matrix_of(pose) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3] = Rotation.from_quat(pose[3:]).as_matrix()
    result[:3, 3] = 1e3 * np.array(pose[:3])
    return result


def aggregate(values) -> str:
    return "{" + ",".join(f"{k} {v:.12f}" for k, v in zip("XYZABC", values, strict=True)) + "}"


# Statements behind a first line to the origin, and where the tool goes, in mm.  The tool is turned by
# 90 deg about y: its z axis is the base's x, its x axis the base's -z.
COMPUTED = {
    "offset of a frame": ("LIN PT[2]:{Y 40}", [[50, 40, 0]]),
    "offset along the tool": ("LIN PT[2]:{X 10,Z 3}", [[53, 0, -10]]),
    "chain of offsets": ("LIN P2:SHIFT:{Y 2}", [[50, 42, 0]]),
    "offset from the base's side": ("LIN SHIFT:PT[2]", [[50, 40, 0]]),
    "offset that is assigned": ("PT[3]=PT[2]:SHIFT\nLIN PT[3]", [[50, 40, 0]]),
    "inverse of a frame": ("LIN INV_POS(SHIFT):PT[2]", [[50, -40, 0]]),
    "component": ("P2.Y=40\nLIN P2", [[50, 40, 0]]),
    "component of itself": ("P2.X = P2.X + 10/4.0\nLIN P2", [[52.5, 0, 0]]),
    "component of an element": ("PT[N].Z=-7\nLIN PT[2]", [[50, 0, -7]]),
    "whole assignment": ("P2=PT[1]\nP2.X=1\nLIN P2\nLIN PT[1]", [[1, 0, 0], [0, 0, 0]]),
    "element by an index": ("LIN PT[N*2-3]\nLIN PT[N]", [[0, 0, 0], [50, 0, 0]]),
    "components left out": ("LIN {X 3}\nLIN {Y 4}", [[3, 0, 0], [3, 4, 0]]),
    "relative to the base": ("LIN_REL {X 5}\nLIN_REL {Y 2,X 1} #BASE", [[5, 0, 0], [6, 2, 0]]),
    "relative to the tool": (
        "LIN_REL {X 10} #TOOL\nSLIN_REL {Z 2} #TOOL",
        [[0, 0, -10], [2, 0, -10]],
    ),
    "counted loop": (
        "INT I\nFOR I=1 TO 3\nLIN {X 0}:{X 0}\nP2.X=I*10\nLIN P2\nENDFOR",
        [[0, 0, 0], [10, 0, 0], [0, 0, 0], [20, 0, 0], [0, 0, 0], [30, 0, 0]],
    ),
    "loop that counts down": (
        "FOR N=4 TO 0 STEP -2\nP2.Y=N\nLIN P2\nENDFOR",
        [[50, y, 0] for y in (4, 2, 0)],
    ),
    "while": (
        "WHILE P2.X<70\nLIN P2\nP2.X=P2.X+10\nENDWHILE",
        [[50, 0, 0], [60, 0, 0]],
    ),
    "repeat": ("REPEAT\nP2.X=P2.X*2\nLIN P2\nUNTIL P2.X>150", [[100, 0, 0], [200, 0, 0]]),
    "loop with exit": (
        "LOOP\nN=N+1\nIF N==4 THEN\nEXIT\nENDIF\nP2.Z=N\nLIN P2\nENDLOOP",
        [[50, 0, 3]],
    ),
    "branches": (
        "IF (N==2) AND NOT FALSE THEN\nLIN PT[2]\nELSE\nLIN PT[1]\nENDIF",
        [[50, 0, 0]],
    ),
    "cases": (
        "SWITCH N\nCASE 1\nLIN PT[1]\nCASE 2,3\nLIN PT[2]\nDEFAULT\nLIN {X 9}\nENDSWITCH",
        [[50, 0, 0]],
    ),
    "digits in binary": ("P2.X='B101'+'HF'\nLIN P2", [[20, 0, 0]]),
    "functions": ("P2.X=SQRT(16)+10*SIN(30)+ABS(-1)\nLIN P2", [[10, 0, 0]]),
    "integers round": ("INT K\nK=2.6\nP2.X=K\nLIN P2", [[3, 0, 0]]),
    "quotient of integers": ("INT K\nK=6/3\nP2.X=K\nLIN P2", [[2, 0, 0]]),
    "a change of the base": (
        "$BASE={X 100,Y 0,Z 0,A 90,B 0,C 0}\nLIN {X 1,Y 0,Z 0,A 0,B 90,C 0}",
        [[100, 1, 0]],
    ),
    "a base moved": ("$BASE.Z=-5\nLIN P2\n$BASE=$BASE:{X 1}\nLIN P2", [[50, 0, -5], [51, 0, -5]]),
    "a numbered base of the data": (
        "BASE_DATA[4]={X 0,Y 7,Z 0,A 0,B 0,C 0}\nBAS(#BASE,4)\nLIN P2\n$BASE=$NULLFRAME\nLIN P2",
        [[50, 7, 0], [50, 0, 0]],
    ),
    # Another tool, 100 mm longer along its z, which is the base's x here: the first one stays behind.
    "a change of the tool": ("$TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}\nLIN P2", [[-50, 0, 0]]),
    "external axes at rest": ("LIN {X 1,E1 0}\nLIN {X 2,E1 0.0}", [[1, 0, 0], [2, 0, 0]]),
    "rounding behind clauses": ("SLIN {Y 4} WITH $VEL.CP=0.1,$ACC={CP 1.0} C_SPL", [[0, 4, 0]]),
    "label and empty lines": ("HERE:\n\n ; nothing\nLIN {X 1}", [[1, 0, 0]]),
}


@pytest.mark.parametrize("name", COMPUTED)
def test_what_a_program_computes_is_computed(name):
    body, expected = COMPUTED[name]
    first = f"$BASE=$NULLFRAME\n$TOOL=$NULLFRAME\n{START}"
    assert places(program(f"{first}\n{body}", POINTS)) == [[0, 0, 0], *expected]


def test_what_cannot_change_the_path_is_left_out_and_listed():
    lines = """GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )
INTERRUPT ON 3
BAS (#INITMOV,0 )
$OUT[4]=NOT $IN[2]
WAIT FOR $IN[3] AND NOT $IN[4]
WAIT SEC 0.5
PULSE($OUT[1],TRUE,0.2)
$APO.CDIS=5
$ACC.CP=1
$VEL.ORI1=200
BAS(#VEL_PTP,20)
MsgNotify("ready; set")
TRIGGER WHEN DISTANCE=0 DELAY=-20 DO $OUT[5]=TRUE
WHILE NOT $IN[7]
  WAIT SEC 0.1
ENDWHILE
PTP HOME
HALT"""
    found = program(f"{lines}\n{START}\nLIN {{X 1}}\nPTP HOME")
    assert places(found) == [[0, 0, 0], [1, 0, 0]]
    assert dict(found.left_out) == {
        "INTERRUPT": 2,
        "$OUT": 1,
        "WAIT": 1,
        "PULSE": 1,
        "$APO": 1,
        "$ACC": 1,
        "$VEL.ORI": 1,
        "BAS(#VEL_PTP)": 1,
        "MSGNOTIFY": 1,
        "TRIGGER": 1,
        "WHILE": 1,
        "PTP HOME": 2,
        "HALT": 1,
    }
    assert found.assumptions == ()


def test_what_is_assumed_is_stated():
    body = """IF $MODE_OP==#T1 THEN
$VEL.CP=0.01
ENDIF
IF $T2 THEN
LIN {X 9}
ENDIF
$OV_PRO=50
LIN {X 1} C_DIS"""
    found = program(f"{START}\n{body}")
    assert places(found) == [[0, 0, 0], [1, 0, 0]]
    assert found.moves[1].speed == pytest.approx(0.025)
    mode, override, rounding = found.assumptions
    assert "automatic" in mode
    assert "50 %" in override
    assert "C_DIS" in rounding
    with pytest.raises(ProgramError, match=r"line 4: .*\$MODE_OP"):
        program(f"{START}\nIF $MODE_OP==#AUT THEN\nLIN {{X 1}}\nENDIF")


def test_technology_packages_of_an_ini_fold_are_taken_as_inactive():
    ini = """IF ARC20==TRUE THEN
A20 (ARC_INI)
INTERRUPT DECL 6 WHEN $CYCFLAG[3]==FALSE DO A20(TECH_STOP2)
ENDIF
IF A10_OPTION==#ACTIVE THEN
A10_INI ( )
ENDIF
IF H70_OPTION THEN
H70 (1,CD0)
ENDIF"""
    found = program(f"{ini}\n{START}")
    assert [text.split()[4] for text in found.assumptions] == ["ARC20", "A10_OPTION", "H70_OPTION"]
    with pytest.raises(ProgramError, match=r"line 7: .*A10_INI"):
        program(f"{ini}\n{START}", "DECL INT A\nA10_OPTION=#ACTIVE")


def test_without_an_advance_run_the_robot_rests_at_every_target():
    """$ADVANCE=0 lets no motion pass into the next one, whatever C_DIS says."""
    body = """LIN {X 1} C_DIS
N=$ADVANCE
$ADVANCE=0
LIN {X 2} C_DIS
SPLINE
SLIN {X 3}
SLIN {X 4}
ENDSPLINE C_SPL
$ADVANCE=N
LIN {X 5} C_DIS
LIN {X 6}"""
    found = program(f"DECL INT N\n{START}\n{body}")
    assert [move.is_stop for move in found.moves[1:]] == [False, True, False, True, False, True]
    with pytest.raises(ProgramError, match=r"line 4: expected \$ADVANCE from 0 to 5, got 6"):
        program(f"{START}\n$ADVANCE=6")


def test_a_line_that_keeps_its_rotation_does_not_turn():
    found = program(f"{START}\n$ORI_TYPE=#CONSTANT\nLIN {{X 5,B 10}}\n$ORI_TYPE=#VAR\nLIN {{X 9}}")
    np.testing.assert_allclose(found.moves[1].pose[3:], found.moves[0].pose[3:])
    np.testing.assert_allclose(found.moves[2].pose[3:], found.moves[0].pose[3:])
    with pytest.raises(ProgramError, match=r"line 3: expected a pose .* that keeps its rotation"):
        program(f"$ORI_TYPE=#CONSTANT\nLIN {ZERO}")


def test_an_interrupt_whose_routine_only_stops_is_left_out():
    stop = "DEF stop()\nDECL INT K\nBRAKE\ntell()\nEND\nDEF tell()\nHALT\n"
    body = f"{START}\nINTERRUPT DECL 9 WHEN $IN[1] DO stop()\nINTERRUPT ON 9\nEND\n"
    assert dict(program(body + stop).left_out) == {"INTERRUPT": 2}
    with pytest.raises(ProgramError, match=r"line 5: .*stop\(\)"):
        program(body + stop.replace("HALT", "PTP_REL {A1 5}"))


CALLED = """DEF step(DX:IN, P:OUT)
REAL DX
DECL FRAME P
P.X=P.X+DX
LIN P
IF DX>5 THEN
RETURN
ENDIF
inner()
END
DEF inner()
LIN_REL {Z 1}
END
"""


def test_routines_of_the_file_and_beside_it_are_executed_with_their_arguments():
    body = f"DECL FRAME Q\n{START}\nQ={ZERO}\nstep(5,Q)\nstep(2*5,Q)\nLIN Q"
    expected = [[0, 0, 0], [5, 0, 0], [5, 0, 1], [15, 0, 0], [15, 0, 0]]
    assert places(program(body, step=CALLED)) == expected
    local = program(f"{body}\nEND\n{CALLED.removesuffix('END' + chr(10))}")
    assert places(local) == expected
    with pytest.raises(ProgramError, match=r"way\.src: line 9: .*INNER"):
        program(f"{body}\ninner()", step=CALLED)


def test_functions_of_the_file_return_their_results():
    text = (
        f"{START}\nLIN up({ZERO},TWICE(4))\nEND\nDEFFCT FRAME up(P:IN,H:IN)\nDECL FRAME P\nREAL H\n"
    )
    text += "P.Z=P.Z+H\nRETURN P\nENDFCT\nDEFFCT REAL TWICE(H:IN)\nREAL H\nRETURN 2*H\nENDFCT\n"
    text += "DEF last()"
    assert places(program(text)) == [[0, 0, 0], [0, 0, 8]]


def test_numbers_of_tool_and_base_come_from_points_and_clauses():
    data = """DECL FDAT FP1={TOOL_NO 1,BASE_NO 2,IPO_FRAME #BASE,POINT2[] " ",TQ_STATE FALSE}
DECL FDAT FP2={TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE}
DECL E6POS XP={X 2,Y 0,Z 0,A 0,B 90,C 0}
DECL LDAT LP1={VEL 2.0,ACC 100.0,APO_DIST 5.0,ORI_TYP #CONSTANT}
BASE_DATA[2]={X 10,Y 0,Z 0,A 0,B 0,C 0}"""
    body = f"""FDAT_ACT=FP1
LDAT_ACT=LP1
PTP {ZERO}
BAS(#CP_PARAMS,0.3)
PTP {ZERO}
LIN {{X 1,B 0}}
$ORI_TYPE=#VAR
SLIN XP WITH $VEL=SVEL_CP(0.1, , LP1), $TOOL=STOOL2(FP2), $BASE=SBASE(FP2.BASE_NO)
LIN {ZERO}
BAS(#CP_DAT)
LIN {{X 4}}"""
    found = program(f"$BASE=BASE_DATA[2]\n$TOOL=TOOL_DATA[1]\n{body}", data)
    assert places(found) == [[0, 0, 0], [0, 0, 0], [1, 0, 0], [-8, 0, 0], [0, 0, 0], [4, 0, 0]]
    assert [move.speed for move in found.moves[2:]] == pytest.approx([0.3, 0.1, 0.3, 2.0])
    np.testing.assert_allclose(found.moves[2].pose, (1e-3, *found.moves[1].pose[1:]))
    assert (found.tool, found.base[0]) == (None, 0.01)


@given(*[st.tuples(*[st.floats(-900.0, 900.0)] * 3, *[st.floats(-180.0, 180.0)] * 3)] * 4)
def test_frames_and_offsets_are_products_of_matrices(base, other, point, offset):
    """base other^-1 point offset: the point seen from the first base.

    Numbers of KRL have single precision: each of twelve angles is off by 1.9e-7 rad at most.
    """
    near = f"$BASE={aggregate(base)}\n$TOOL=$NULLFRAME\n$VEL.CP=1\nLIN {ZERO}"
    found = program(f"{near}\n$BASE={aggregate(other)}\nLIN {aggregate(point)}:{aggregate(offset)}")
    expected = np.linalg.inv(matrix(*base)) @ matrix(*other) @ matrix(*point) @ matrix(*offset)
    np.testing.assert_allclose(matrix_of(found.moves[1].pose)[:3, :3], expected[:3, :3], atol=3e-6)
    np.testing.assert_allclose(matrix_of(found.moves[1].pose)[:3, 3], expected[:3, 3], atol=2e-2)


def test_a_folder_gives_the_programs_that_are_called_and_the_data_of_all(tmp_path):
    (tmp_path / "main.src").write_text(f"DEF main()\nBAS(#BASE,1)\n{START}\nSIDE()\nEND\n")
    (tmp_path / "Side.src").write_text("DEF side()\nBAS(#BASE,2)\nLIN XA\nEND\n")
    (tmp_path / "SIDE.DAT").write_text(f"DEFDAT side\nDECL E6POS XA={ZERO}\nENDDAT\n")
    (tmp_path / "other.src").write_text("this is not KRL")
    with pytest.raises(ProgramError, match=r"Side\.src: line 3: .*BASE_DATA\[2\]"):
        read_program(tmp_path / "main.src")
    frames = [f"BASE_DATA[{k}]={{X {k}.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}}" for k in (1, 2)]
    odd = ["DEFDAT $CONFIG", "DECL FRAME BASE_DATA[32]", "what is this", *frames, "ENDDAT"]
    (tmp_path / "$config.dat").write_text("\n".join(odd))
    assert places(read_program(tmp_path / "main.src")) == [[0, 0, 0], [1, 0, 0]]


def test_structures_and_enumerations_of_all_modules_are_declarations(tmp_path):
    types = "GLOBAL STRUC SPOT_T REAL DEPTH,INT NO\nGLOBAL ENUM SIDE_T LEFTWARD,RIGHTWARD\n"
    values = f"DECL GLOBAL SPOT_T SPOT={{DEPTH 5.0,NO 1}}\nDECL GLOBAL FRAME XA={ZERO}\n"
    (tmp_path / "main.dat").write_text(f"DEFDAT main PUBLIC\n{types}{values}ENDDAT\n")
    (tmp_path / "main.src").write_text(f"DEF main()\n{START}\nXA.X=SPOT.DEPTH\nLIN XA\nEND\n")
    assert places(read_program(tmp_path / "main.src")) == [[0, 0, 0], [5, 0, 0]]


def test_an_archive_of_a_controller_gives_the_modules_of_its_other_folders(tmp_path):
    """A neighbour counts before another folder's module of its name; of two others none is chosen."""
    root = tmp_path / "KRC" / "R1"
    for folder in ("Program/Jobs", "Program/Moves", "Program/Old", "TP/Mill", "System"):
        (root / folder).mkdir(parents=True)
    main = root / "Program" / "Jobs" / "main.src"
    main.write_text(f"DEF main()\nBAS(#BASE,1)\n{START}\nSIDE()\nMILL()\nEND\n")
    config = ["DEFDAT $CONFIG", "DECL FRAME BASE_DATA[32]", f"BASE_DATA[1]={ZERO}", "ENDDAT"]
    (root / "System" / "$config.dat").write_text("\n".join(config))
    (root / "System" / "bas.src").write_text("DEF bas(COMMAND :IN)\nLIN {X 99}\nEND\n")
    mill = root / "TP" / "Mill" / "mill.src"
    mill.write_text("DEF mill()\nLIN {Z 3}\nEND\n")
    (root / "Program" / "Moves" / "Side.src").write_text("DEF side()\nLIN XA\nEND\n")
    data = f"DEFDAT side\nDECL E6POS XA={ZERO.replace('X 0', 'X 2')}\nENDDAT\n"
    (root / "Program" / "Moves" / "SIDE.DAT").write_text(data)
    assert places(read_program(main)) == [[0, 0, 0], [2, 0, 0], [2, 0, 3]]
    (root / "Program" / "Old" / "side.src").write_text("DEF side()\nLIN {X 7}\nEND\n")
    with pytest.raises(
        ProgramError, match=r"one module Side\.src, got several, in .*Moves and .*Old"
    ):
        read_program(main)
    (main.parent / "side.src").write_text("DEF side()\nLIN {X 8}\nEND\n")
    assert places(read_program(main)) == [[0, 0, 0], [8, 0, 0], [8, 0, 3]]


def test_data_of_all_programs_come_from_a_dat_whose_src_is_not_called(tmp_path):
    """A name that two of them define is known only if the called one is among them."""
    points = f"DEFDAT p PUBLIC\nDECL GLOBAL FRAME XA={ZERO}\nDECL FRAME XB={ZERO}\n?\nENDDAT\n"
    (tmp_path / "main.src").write_text(f"DEF main()\n{START}\nLIN XA\nLIN XA:{{X 7}}\nEND\n")
    (tmp_path / "p.dat").write_text(points.replace("X 0", "X 5", 1))
    shared = read_program(tmp_path / "main.src")
    (tmp_path / "main.src").write_text(f"DEF main()\n{START}\nLIN XB\nEND\n")
    with pytest.raises(ProgramError, match=r"got 'XB': give the \.dat"):
        read_program(tmp_path / "main.src")
    (tmp_path / "main.src").write_text(f"DEF main()\n{START}\nLIN XA\nLIN XA:{{X 7}}\nEND\n")
    (tmp_path / "old.dat").write_text(points)
    with pytest.raises(ProgramError, match=r"XA, which is GLOBAL in several \.dat"):
        read_program(tmp_path / "main.src")
    (tmp_path / "main.dat").write_text(points.replace("?\n", "").replace("X 0", "X 5", 1))
    assert (
        places(read_program(tmp_path / "main.src"))
        == places(shared)
        == [[0, 0, 0], [5, 0, 0], [5, 0, -7]]
    )


def test_damaged_programs_are_read_or_refused():
    whole = "\n".join(body for body, _ in COMPUTED.values())
    read_or_refused(lambda text: program(f"{START}\n{text}", POINTS), whole)
    read_or_refused(lambda data: program(f"{START}\nLIN P2", data), POINTS)


def test_work_grows_in_proportion_to_length():
    def read_moves(count: int) -> None:
        lines = "\n".join(f"LIN {{X {k}.5,Y 2,Z 3,A 0,B 90,C 0,E1 0}} C_DIS" for k in range(count))
        program(f"{START}\n{lines}")

    require_proportional(read_moves)


def test_the_routine_of_the_file_s_name_is_started_wherever_it_stands():
    helper = f"DEF other()\n{START}\nLIN {{X 99}}\nEND"
    started = read([ProgramFile("way.src", f"{helper}\nDEF way()\n{START}\nLIN {{X 1}}\nEND\n")])
    assert places(started) == [[0, 0, 0], [1, 0, 0]]

"""Loops that never end: one pass is the path where all passes make the same motions."""

from pathlib import Path

import pytest

from coupling.errors import ProgramError
from coupling.programs.languages import read_program

_TAIL = "[0.70710678,0,0.70710678,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
# Text around statements, a motion to x [mm], a jump of the next target, an output, a loop, by endings.
FORMS = {
    ".src": {
        "text": "DEF way()\n$VEL.CP=0.05\nDECL FRAME P\nP={{X 7,Y 0,Z 0,A 0,B 90,C 0}}\n{}\nEND\n",
        "to": "LIN {{X {},Y 0,Z 0,A 0,B 90,C 0}}",
        "changing": "P.X=P.X+1\nLIN P",
        "output": "$OUT[1]=TRUE",
        "loop": "LOOP\n{}\nENDLOOP",
    },
    ".mod": {
        "text": f"MODULE m\nVAR robtarget p:=[[7,0,0],{_TAIL};\nPROC main()\n{{}}\nENDPROC\nENDMODULE\n",
        "to": f"MoveL [[{{}},0,0],{_TAIL},v50,fine,tool0;",
        "changing": "p.trans.x:=p.trans.x+1;\nMoveL p,v50,fine,tool0;",
        "output": "SetDO do1,1;",
        "loop": "WHILE TRUE DO\n{}\nENDWHILE",
    },
    ".ls": {
        "text": "/PROG WAY\n/MN\nUFRAME_NUM=1;\nUTOOL_NUM=1;\n"
        + "".join(f"PR[1,{k}]=0;\n" for k in range(1, 7))
        + "{}\n/POS\n/END\n",
        "to": "PR[1,1]={};\nL PR[1] 50mm/sec FINE;",
        "changing": "PR[1,2]=PR[1,2]+1;\nL PR[1] 50mm/sec FINE;",
        "output": "DO[1]=ON;",
        "loop": "LBL[1];\n{}\nJMP LBL[1];",
    },
}


def read(folder: Path, ending: str, *statements: str):
    file = folder / f"way{ending}"
    file.write_text(FORMS[ending]["text"].format("\n".join(statements)))
    return read_program(file)


def looped(ending: str, *statements: str) -> str:
    return FORMS[ending]["loop"].format("\n".join(statements))


def to(ending: str, x: int) -> str:
    return FORMS[ending]["to"].format(x)


@pytest.mark.parametrize("ending", FORMS)
def test_one_pass_of_an_endless_loop_is_the_path(tmp_path, ending):
    output = FORMS[ending]["output"]
    loop = looped(ending, to(ending, 10), output, to(ending, 20))
    found = read(tmp_path, ending, to(ending, 0), loop)
    assert [round(1e3 * move.pose[0], 6) for move in found.moves] == [0.0, 10.0, 20.0]
    assert [count for _, count in found.left_out] == [1]
    (sentence,) = [text for text in found.assumptions if "for ever" in text]
    lines = FORMS[ending]["text"].partition("{}\n")[0].count("\n") + to(ending, 0).count("\n")
    assert sentence == f"the loop of line {lines + 2} runs for ever: one pass of it is the path"


@pytest.mark.parametrize("ending", FORMS)
def test_an_endless_loop_in_which_the_next_pass_moves_elsewhere_is_refused(tmp_path, ending):
    loop = looped(ending, to(ending, 10), FORMS[ending]["changing"])
    with pytest.raises(ProgramError, match="got other motions in its second pass"):
        read(tmp_path, ending, to(ending, 0), loop)


@pytest.mark.parametrize("ending", FORMS)
def test_an_endless_loop_without_motions_is_refused(tmp_path, ending):
    loop = looped(ending, FORMS[ending]["output"])
    with pytest.raises(ProgramError, match="got no motion in it"):
        read(tmp_path, ending, to(ending, 0), loop)


def test_a_loop_from_home_to_home_that_the_controller_holds_is_one_pass(tmp_path):
    loop = looped(".src", "PTP HOME", to(".src", 10), to(".src", 20), "PTP HOME")
    assert len(read(tmp_path, ".src", loop).moves) == 2


@pytest.mark.parametrize(
    "leaving", ["IF R[1]>1,JMP LBL[2];", "IF R[1]>1,END;", "IF (R[1]>1) THEN;\nABORT;\nENDIF;"]
)
def test_a_loop_that_a_known_condition_leaves_is_executed_until_then(tmp_path, leaving):
    loop = looped(".ls", to(".ls", 10), "R[1]=R[1]+1;", leaving)
    found = read(tmp_path, ".ls", "R[1]=0;", loop, "LBL[2];")
    assert len(found.moves) == 2
    assert not any("for ever" in text for text in found.assumptions)

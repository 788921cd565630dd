"""Programs as post processors and pendants write them: frames and speeds that are set on the way."""

from contextlib import suppress

import numpy as np
import pytest
from damage import damaged, read_or_refused

from coupling.errors import ProgramError
from coupling.programs.languages import LANGUAGES
from coupling.programs.program import ProgramFile

# As post processors write it: a header, data changed on the way, a comma before an option.
RAPID_POSTED = """%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%
MODULE MOD_Way
LOCAL PERS tooldata tl := [TRUE,[[0,0,0],[1,0,0,0]],[2,[0,0,15],[1,0,0,0],0,0,0.005]];
LOCAL PERS wobjdata wo := [FALSE, TRUE, "", [[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
VAR speeddata sp := [250,500,5000,1000]; ! at first
PROC Way()
wo.uframe := [[1000,0,0],[0,0,0,1]];
tl.tframe := [[0,0,200],[1,0,0,0]];
MoveL [[500,0,300],[0,0,1,0],[0,0,0,0],[9E+09,9E9,9E9,9E9,9E9,9E9]],sp,z1,tl,\\WObj:=wo;
sp := [50.00,500,5000,1000];
MoveL [[510,0,300],[0,0,1,0],[0,0,0,0],[9E+09,9E9,9E9,9E9,9E9,9E9]],sp,z1,tl, \\WObj:=wo;
sp.v_tcp := 40;
MoveL [[520,0,300],[0,0,1,0],[0,0,0,0],[9E+09,9E9,9E9,9E9,9E9,9E9]],sp,z1,tl\\WObj:=wo;
ENDPROC
ENDMODULE
"""
# As a pendant writes it: numbers of tool and base belong to points, speeds to routines and clauses.
KRL_TAUGHT = """DEF TAUGHT()
BAS(#INITMOV,0)
BAS(#VEL_CP,0.3)
FDAT_ACT=FP1
LDAT_ACT=LCPDAT1
BAS(#CP_PARAMS,0.2)
LIN XP1 C_DIS
SLIN XP2 WITH $VEL=SVEL_CP(0.05, , LCPDAT1), $TOOL=STOOL2(FP2), $BASE=SBASE(FP2.BASE_NO)
END
"""
KRL_TAUGHT_POINTS = """DEFDAT TAUGHT PUBLIC
DECL E6POS XP1={X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0,S 'B110',T 'B100011',E1 0.0}
DECL FDAT FP1={TOOL_NO 3,BASE_NO 2,IPO_FRAME #BASE,POINT2[] " ",TQ_STATE FALSE}
DECL E6POS XP2={X 2.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0,S 2,T 35,E1 0.0}
DECL FDAT FP2={TOOL_NO 3,BASE_NO 2,IPO_FRAME #BASE,POINT2[] " ",TQ_STATE FALSE}
DECL LDAT LCPDAT1={VEL 2.0,ACC 100.0,APO_DIST 100.0,ORI_TYP #VAR}
ENDDAT
"""


def read_rapid(text: str):
    return LANGUAGES["rapid"].read([ProgramFile("way.mod", text)])


def read_krl(source: str, points: str):
    return LANGUAGES["krl"].read([ProgramFile("way.src", source), ProgramFile("way.dat", points)])


def test_rapid_that_sets_its_frames_and_speeds_on_the_way_is_read():
    found = read_rapid(RAPID_POSTED)
    np.testing.assert_allclose(found.base, [1.0, 0, 0, 0, 0, 1, 0], atol=1e-9)
    np.testing.assert_allclose(found.tool, [0, 0, 0.2, 0, 0, 0, 1], atol=1e-8)
    assert [move.speed for move in found.moves] == pytest.approx([0.25, 0.05, 0.04])


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("sp.v_max := 3;", "expected a component of speeddata, got 'v_max'"),
        ("sp := Faster(sp,1);", "expected a function of RAPID or of the program, got Faster"),
        ("wo.uframe := 3;", "expected a value of pose, got one of num"),
    ],
)
def test_data_that_rapid_sets_to_what_is_not_known_are_refused(line, words):
    text = RAPID_POSTED.replace("ENDPROC", f"{line}\nENDPROC")
    with pytest.raises(ProgramError, match=f"line 17: {words}"):
        read_rapid(text)


def test_krl_taught_with_a_pendant_is_read_with_its_speeds_and_in_one_frame():
    found = read_krl(KRL_TAUGHT, KRL_TAUGHT_POINTS)
    assert [move.speed for move in found.moves] == pytest.approx([0.2, 0.05])
    assert (found.base, found.tool) == (None, None)  # numbers 2 and 3 of the controller
    other = KRL_TAUGHT_POINTS.replace("FP2={TOOL_NO 3,BASE_NO 2", "FP2={TOOL_NO 3,BASE_NO 1")
    here = KRL_TAUGHT.replace("FDAT_ACT=FP1", "$BASE={X 1,Y 2,Z 3,A 0,B 0,C 0}")
    for source, points in ((KRL_TAUGHT, other), (here, KRL_TAUGHT_POINTS)):
        with pytest.raises(ProgramError, match=r"line 8: expected one base for all poses"):
            read_krl(source, points)


def test_damaged_ones_are_read_or_refused():
    read_or_refused(read_rapid, RAPID_POSTED)
    for source, points in zip(
        damaged(KRL_TAUGHT, 300), damaged(KRL_TAUGHT_POINTS, 300, seed=19), strict=True
    ):
        with suppress(ProgramError):
            read_krl(source, points)

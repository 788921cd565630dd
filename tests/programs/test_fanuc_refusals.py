"""FANUC TP of others: what cannot be computed is refused by its name."""

import pytest
from fanuc_programs import (
    CHOSEN,
    FIRST,
    ZEROES,
    cartesian,
    read,
    text_of,
)

from coupling.errors import ProgramError
from coupling.programs.fanuc import reader as fanuc_reader
from coupling.programs.program import ProgramFile

MOVING = "R[3]=1\nL P[1] 5mm/sec FINE"
# What stands in a program, and what the message must name.
REFUSED = {
    "unset register": (f"{FIRST} Offset,PR[3]", ["PR[3]", "PR[3,1]=.."]),
    "unset element": (f"PR[5,1]=3\n{FIRST} Offset,PR[5]", ["PR[5,2]"]),
    "increment at first": (f"{FIRST} INC", ["begin with a motion"]),
    "increment of joints": (f"{FIRST}\nJ P[9] 10% FINE INC", ["one of each"]),
    "no condition": (f"{FIRST} Offset", ["OFFSET CONDITION"]),
    "condition elsewhere": (f"{ZEROES}OFFSET CONDITION PR[5],UFRAME[4]", ["UFRAME[4]"]),
    "skip": (f"{FIRST} Skip,LBL[1]", ["Skip,LBL[1]"]),
    "skip with a place": (f"{FIRST} Skip,LBL[1],PR[1]=LPOS", ["Skip,LBL[1],PR[1]=LPOS"]),
    "wrist": (f"{FIRST} Wjnt", ["Wjnt", "divide"]),
    "coordinated": (f"{FIRST} COORD PTH", ["COORD"]),
    "remote tool": (f"{FIRST} RTCP", ["RTCP"]),
    "camera": (f"{FIRST} VOFFSET,VR[1]", ["VOFFSET,VR[1]"]),
    "process speed": (f"{FIRST} PSPD50", ["PSPD50"]),
    "unknown option": (f"{FIRST} Wobble[3]", ["line 6", "Wobble[3]"]),
    "circle without a start": ("C P[1] P[2] 5mm/sec FINE", ["a pose before an arc"]),
    "circle of one position": (f"{FIRST}\nC P[2] 5mm/sec FINE", ["got one in 'C P[2]"]),
    "circle on a line": (f"{FIRST}\nC P[2] P[3] 5mm/sec FINE", ["points on a line"]),
    "circle to joint angles": (f"{FIRST}\nC P[2] P[9] 5mm/sec FINE", ["joint angles"]),
    "circle through joint angles": (f"{FIRST}\nC P[9] P[2] 5mm/sec FINE", ["joint angles"]),
    "circle with an increment": (f"{FIRST}\nC P[2] P[3] 5mm/sec FINE INC", ["C to its", "INC"]),
    "percent on a circle": (f"{FIRST}\nC P[2] P[3] 5% FINE", ["a speed of C in mm/sec"]),
    "one arc": (f"{FIRST}\nA P[2] 5mm/sec FINE", ["line 7", "three A", "got 1"]),
    "two arcs": (f"A P[1] 5mm/sec FINE\nA P[2] 5mm/sec FINE\n{FIRST}", ["line 7", "got 2"]),
    "arcs on a line": (
        "\n".join(f"A P[{k}] 5mm/sec FINE" for k in (1, 2, 3)),
        ["line 7", "positions on a line"],
    ),
    "spline": ("S P[1] 5mm/sec FINE", ["S, a motion on a spline", "lines"]),
    "joints on a line": ("L P[9] 5mm/sec FINE", ["joint angles", "J"]),
    "unknown speed": ("L P[1] R[7:feed]mm/sec FINE", ["R[7]"]),
    "word for a speed": ("L P[1] fast_speed CNT100", ["fast_speed"]),
    "percent on a line": ("L P[1] 100% FINE", ["100%"]),
    "weaving": ("Weave Sine[1]", ["Weave Sine[1]"]),
    "another frame": ("UFRAME_NUM=2\nL P[1] 5mm/sec FINE", ["UF : 1", "UFRAME_NUM=1"]),
    "another tool": ("UTOOL_NUM=3\nL P[1] 5mm/sec FINE", ["UT : 1", "UTOOL_NUM=1"]),
    "unknown frame number": ("UFRAME_NUM=R[8]", ["R[8]"]),
    "frames that nobody knows": (
        f"{FIRST}\nPR[6]=LPOS\nUFRAME_NUM=2\nL PR[6] 5mm/sec FINE",
        ["UFRAME 2", "UFRAME 1"],
    ),
    "input": (f"IF DI[1]=ON,CALL DETOUR\n{FIRST}", ["DI[1]"]),
    "input in a branch": (f"IF (DI[1]) THEN\n{FIRST}\nENDIF", ["DI[1]"]),
    "register behind an input": (
        "R[1]=1\nIF (DI[1]=ON),R[1]=(2)\nL P[R[1]] 5mm/sec FINE",
        ["R[1]", "unknown condition"],
    ),
    "missing program": (f"CALL GRIPPER_OPEN\n{FIRST}", ["GRIPPER_OPEN.ls"]),
    "missing program on the way": (f"{FIRST} TB .10sec,CALL SPRAY", ["SPRAY.ls"]),
    "task that is missing": (f"RUN LOGGER\n{FIRST}", ["LOGGER"]),
    "program by a string": ("CALL SR[2]", ["SR[2]"]),
    "string": ("R[1]=STRLEN SR[1]\nL P[R[1]] 5mm/sec FINE", ["STRLEN SR[1]"]),
    "endless": ("R[1]=1\nLBL[1]\nIF R[1]=1,JMP LBL[1]", ["for ever", "LBL[1]"]),
    "endless with a counter": (
        "R[1]=1\nLBL[1]\nR[1]=R[1]+1\nIF R[1]>1,JMP LBL[1]",
        ["100000"],
    ),
    "no label": ("JMP LBL[4]", ["LBL[4]"]),
    "label twice": ("LBL[4]\nLBL[4]\nJMP LBL[4]", ["LBL[4]", "once"]),
    "no end of a block": (f"R[1]=1\nIF R[1]=2 THEN\n{FIRST}", ["got none"]),
    "end of no block": (f"{FIRST}\nENDFOR", ["ENDFOR"]),
    "system variable": (f"$MCR.$SINGLE=1\n{FIRST}", ["$MCR.$SINGLE=1"]),
    "macro": ("TOOL OPEN", ["TOOL OPEN"]),
    "other language": ("BENUTZER_NUM=1", ["BENUTZER_NUM=1"]),
    "override of none": ("OVERRIDE=0%", ["1 to 100 %"]),
    "copy of a frame": (
        f"{ZEROES}UFRAME[3]=PR[5]\nPR[6]=UFRAME[3]\nPR[6,1]=4",
        ["PR[6]", "matrix"],
    ),
    "frame of the controller": ("PR[6]=UFRAME[3]", ["UFRAME[3]"]),
    "division by zero": ("R[1]=0\nR[2]=3/R[1]", ["divisor"]),
    "huge": ("R[1]=1e7\nFOR R[2]=1 TO 90\nR[1]=R[1]*R[1]\nENDFOR", ["at most 3.4e+38"]),
    "half a register": ("R[1]=1.5\nL P[R[1]] 5mm/sec FINE", ["whole number", "1.5"]),
    "last joints": ("J P[9] 10% FINE\nPR[1]=LPOS", ["LPOS", "joint angles"]),
    "speed of turning without a turn": (f"{FIRST}\nL P[2] 5deg/sec FINE", ["deg/sec"]),
    "element beyond": ("PR[6]=P[1]\nPR[6,7]=2", ["1 to 6", "other axes"]),
    "open point logic": (f"{FIRST} TB .10sec,P-SPS\nDO[1]=ON", ["dashes"]),
    "missing program in point logic": (
        f"{FIRST} TB .10sec,P-SPS\nCALL SPRAY\n------",
        ["line 7", "SPRAY.ls"],
    ),
    "moving point logic": (f"{FIRST} TB .10sec,P-SPS\nPR[1,1]=3\n------", ["PR[1,1]=3"]),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_computed_is_refused_by_its_name(name):
    instructions, words = REFUSED[name]
    with pytest.raises(ProgramError, match=r"main\.ls: line \d+: ") as raised:
        read(instructions)
    assert len(str(raised.value)) < 330
    for word in words:
        assert word in str(raised.value)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (cartesian(1).replace("0.000  mm,\tY", "********  mm,\tY"), "taught position"),
        (cartesian(1).replace("W =", "S ="), "got none of W|got S"),
        (cartesian(1).replace("X =", "RX ="), "RTCP"),
        (cartesian(1).replace("0.000  mm,\tY", "0.000  deg,\tY"), "X in mm"),
        (cartesian(1).replace("GP1", "GP2"), "GP2 alone"),
        (cartesian(1) * 2, r"P\[1\] again"),
        (cartesian(1, uf="banana"), "banana"),
        ("P[1]{\n GP1:\n X = 1 mm", r"P\[number\]"),
    ],
)
def test_positions_that_are_not_whole_are_refused(data, words):
    with pytest.raises(ProgramError, match=words):
        read(FIRST, data)


def test_a_program_of_another_group_is_refused():
    text = text_of(CHOSEN + FIRST).replace("/ATTR", "/ATTR\nDEFAULT_GROUP\t= *,1,*,*,*;")
    with pytest.raises(ProgramError, match="group 1, the robot"):
        fanuc_reader.read([ProgramFile("a.ls", text)])

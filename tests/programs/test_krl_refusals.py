"""KRL whose path is not known from the program: refused in one sentence, with line and word."""

import pytest
from krl_programs import POINTS, START, program

from coupling.errors import ProgramError

# Statements behind a first line, and words of the message.
REFUSED = {
    "missing program": ("DETOUR()", ["line 4", "DETOUR", ".src"]),
    "missing function for an output": ("$OUT[1]=MOVED()", ["line 4", "MOVED"]),
    "missing function in a wait": ("WAIT FOR MOVED()", ["line 4", "WAIT without a call", "MOVED"]),
    "name like a known one": ("STROKE()", ["line 4", "STROKE"]),
    "second statement in a line": ("$OUT[1]=TRUE LIN P2", ["line 4", "TRUE LIN P2"]),
    "second statement behind a wait": ("WAIT SEC 1 LIN P2", ["line 4", "'WAIT'"]),
    "open spline": ("SPLINE\nSPL P2", ["ENDSPLINE", "end of the file"]),
    "twice the same component": ("LIN {X 1,X 2}", ["line 4", "X twice"]),
    "long row of operators": ("N=" + "1+" * 999 + "1", ["line 4", "200 operators"]),
    "input that asks for a point": (
        'IF $IN[1] THEN\nEKI_GetFrame("a","b",P2)\nENDIF\nLIN P2',
        ["line 4", "$IN[1]"],
    ),
    "point that is received": ('EKI_GetFrame("a","b",P2)\nLIN P2', ["line 5", "'P2'"]),
    "condition with a call": ("IF $IN[1] AND MOVED() THEN\nENDIF", ["line 4", "MOVED"]),
    "branch behind ELSE": ("IF N==2 THEN\nELSE IF N==3 THEN\nENDIF", ["line 5", "ELSE alone"]),
    "statement behind a word": ("LOOP LIN P2\nENDLOOP", ["line 4", "LOOP alone"]),
    "missing function": ("P2.X=SHIFTED(3)\nLIN P2", ["line 4", "SHIFTED"]),
    "arc on a line": ("CIRC {X 1},{X 2}", ["line 4", "points on a line"]),
    "arc of the path": ("$CIRC_TYPE=#PATH\nCIRC {Y 1},{X 2}", ["line 5", "got #PATH"]),
    "way behind an angle": ("CIRC {Y 1},{X 2},CA 9\nLIN {X 1}", ["line 5", "got none of Y"]),
    "arc by its angle that turns": ("CIRC {Y 1},{X 2,A 9},CA 90", ["line 4", "one rotation"]),
    "spline's arc that turns": ("SCIRC {Y 1},{X 2,A 9}", ["line 4", "one rotation"]),
    "jump": ("GOTO HERE\nHERE:", ["line 4", "got GOTO"]),
    "unknown word": ("WEAVE ON 3", ["line 4", "'WEAVE'", "take it out"]),
    "unknown system variable": ("$TECH.MODE[1]=#CYCLE", ["line 4", "$TECH"]),
    "external tool centre point": ("$IPO_MODE=#TCP", ["line 4", "$IPO_MODE", "#TCP"]),
    "rotation by the wrist": ("$ORI_TYPE=#JOINT", ["line 4", "$ORI_TYPE", "#JOINT"]),
    "measured point": ("P2=$POS_ACT\nLIN P2", ["line 5", "'P2'", "$POS_ACT"]),
    "measured point with a component set": (
        "P2=$POS_ACT\nP2.Y=4\nLIN P2",
        ["line 6", "X of $POS_ACT"],
    ),
    "point elsewhere with a component set": ("P2=XP9\nP2.Y=4\nLIN P2", ["line 6", "X of XP9"]),
    "component of a base elsewhere": (
        "$BASE=BASE_DATA[3]\n$BASE.Y=4\nLIN P2",
        ["X of BASE_DATA[3]"],
    ),
    "speed of a variable without a value": ("$VEL.CP=FAST\nLIN P2", ["line 5", "a speed", "FAST"]),
    "variable that an interrupt sets": (
        "INTERRUPT DECL 3 WHEN $IN[1] DO N=3\nN=0\nINTERRUPT ON 3\nLIN {X 0,Y 0}:{X N}",
        ["line 7"],
    ),
    "variable that a trigger sets": (
        "TRIGGER WHEN PATH=10 DELAY=0 DO P2.Y=3\nP2.Y=0\nLIN P2",
        ["line 6", "P2"],
    ),
    "measured component": ("P2.X=$POS_ACT.X\nLIN P2", ["line 5", "'P2'", "$POS_ACT.X"]),
    "offset that is not known": ("LIN P2:CAMERA", ["line 4", "'P2:CAMERA'", "CAMERA is not known"]),
    "component of a point elsewhere": ("XP9.Y=3\nLIN XP9", ["line 5", "'XP9'"]),
    "input": ("IF $IN[1] THEN\nLIN P2\nENDIF", ["line 4", "$IN[1]"]),
    "input that sets a point": ("IF $IN[1] THEN\nP2.Y=4\nENDIF\nLIN P2", ["line 4", "$IN[1]"]),
    "input in a loop": ("REPEAT\nLIN P2\nUNTIL $IN[1]", ["line 4", "$IN[1]"]),
    "endless while": ("WHILE N==N\nN=N+0\nENDWHILE", ["line 5", "at most 100000"]),
    "endless wait": ("WHILE N==2\nWAIT SEC 1\nENDWHILE", ["line 4", "waits for ever"]),
    "unknown base": ("$BASE=BASE_DATA[3]\nLIN P2", ["line 5", "one base", "BASE_DATA[3]"]),
    "unknown tool": ("BAS(#TOOL,3)\nLIN P2", ["line 5", "one tool", "TOOL_DATA[3]"]),
    "base shifted by what is not known": ("$BASE=BASE_DATA[1]:SHIFT\nLIN P2", ["one base"]),
    "interrupt that moves": (
        "INTERRUPT DECL 5 WHEN $IN[2]==TRUE DO AWAY()\nINTERRUPT ON 5",
        ["line 5", "AWAY()"],
    ),
    "trigger that moves": (
        "TRIGGER WHEN DISTANCE=0 DELAY=0 DO AWAY() PRIO=-1",
        ["line 4", "TRIGGER"],
    ),
    "external axis": ("LIN {X 1,E1 0}\nLIN {X 2,E1 3}", ["line 5", "E1 to stand", "from 0 to 3"]),
    "external axis that a later pose gives": (
        "LIN {X 1}\nLIN {X 2,E1 3}",
        ["line 5", "E1", "3 here first"],
    ),
    "clause on a variable": ("SLIN P2 WITH N=3", ["line 4", "system variables", "N=3"]),
    "word behind clauses": ("SLIN P2 WITH $VEL.CP=0.1 FAST", ["line 4", "'FAST'"]),
    "relative rotation": ("LIN_REL {A 5}", ["line 4", "got A"]),
    "option of a motion": ("LIN P2 FAST", ["line 4", "'FAST'"]),
    "clause of a motion": ("SLIN P2 WITH $SEN_PINT=3", ["line 4", "$SEN_PINT"]),
    "line to angles": ("LIN {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}", ["line 4", "axis angles"]),
    "partial point in another base": (
        "$BASE={X 1,Y 0,Z 0,A 0,B 0,C 0}\nLIN {Y 2}",
        ["line 5", "change"],
    ),
    "override": ("$OV_PRO=0", ["line 4", "$OV_PRO"]),
    "speed": ("$VEL.CP=0", ["line 4", "speed > 0"]),
    "speed that is not known": ("$VEL.CP=FEED\nLIN P2", ["line 5", "FEED"]),
    "zero divisor": ("P2.X=1/0\n", ["line 4", "divisor"]),
    "broken quotient": ("P2.X=7/2\n", ["line 4", "7.0"]),
    "comparisons without brackets": ("IF N>1 AND N<3 THEN\nENDIF", ["line 4", "brackets"]),
    "number too large": ("N=2000000000\n", ["line 4", "at most"]),
    "word that is no number": ("N=TRUE\n", ["line 4", "expected a number", "TRUE"]),
    "index that is not known": ("PT[$IN_NO]=P2\n", ["line 4", "index of PT"]),
    "end alone": ("ENDIF", ["line 4", "ENDIF"]),
    "block without end": ("IF N==2 THEN\nLIN P2", ["line 4", "ENDIF"]),
    "exit alone": ("EXIT", ["line 4", "EXIT"]),
    "recursion": ("way()", ["line 4", "calls in each other"]),
    "brackets": ("N=" + "(" * 999 + ")" * 999, ["line 4", "brackets in each other"]),
    "command of BAS": ("BAS(#EX_BASE,1)", ["line 4", "#EX_BASE"]),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_may_change_the_path_and_is_not_known_is_refused_by_name(name):
    body, words = REFUSED[name]
    with pytest.raises(ProgramError) as raised:
        program(f"{START}\n{body}", f"{POINTS}\nDECL FRAME CAMERA")
    message = str(raised.value)
    assert "\n" not in message
    assert len(message) < 320
    assert message.count("way.src") == 1
    for word in words:
        assert word in message

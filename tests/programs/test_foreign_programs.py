"""Programs that others wrote: what is read of them, and how everything else is refused."""

import numpy as np
import pytest
from damage import read_or_refused

from coupling.errors import ProgramError
from coupling.programs.languages import LANGUAGES, read_program
from coupling.programs.program import ProgramFile

KRL = """&ACCESS RVP
&REL 12
DEF CAM ( )
;FOLD INI;%{PE}
  BAS (#INITMOV,0 )
  PTP $AXIS_ACT
;ENDFOLD (INI)
$BASE = {X 1000.0,Y 0.0,Z 500.0,A 90.0,B 0.0,C 0.0}
$TOOL=TOOL_DATA[3]
$VEL.CP=0.2
PTP {A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0,E1 0}
LIN {X 10,Y 20,Z 30,A 0,B 0,C 0,S 2,T 35} C_DIS ; first
lin {Z 25.5}
$OUT[3]=TRUE
SPLINE WITH $ACC={CP 1.0}
  SPL XP1
  SLIN {X 12} WITH $VEL.CP = 0.05
ENDSPLINE
PTP HOME C_PTP
END
"""
KRL_POINTS = """DEFDAT CAM PUBLIC
DECL E6POS XP1={X 11.0,Y 20.0,Z 25.5,A 0.0,B 90.0,C 0.0,S 2,T 35,E1 0.0}
ENDDAT
"""
RAPID = """MODULE Cam
  ! made by hand
  PERS tooldata tMill:=[TRUE,[[0,0,200],[0.7071068,0,0.7071068,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS wobjdata wPart:=[FALSE,TRUE,"",[[1000,0,500],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  CONST robtarget p10:=[[10,20,30],[0,0,1,0],[0,-1,0,0],[9E+09,9E9,9E9,9E9,9E9,9E9]];
  CONST speeddata vCut:=[40,500,5000,1000];
  PROC main()
    MoveAbsJ [[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v1000,fine,tool0;
    MoveL p10,v200,z10,tMill\\WObj:=wPart; SetDO do1,1;
    MoveL [[11,20,30],[0,0,1,0],[0,-1,0,0],
      [9E9,9E9,9E9,9E9,9E9,9E9]],vCut\\T:=0.25,z1,tMill\\WObj:=wPart;
  ENDPROC
ENDMODULE
"""
FANUC = """/PROG  CAM
/ATTR
OWNER = MNEDITOR;
/MN
   1:  !made by hand ;
   2:  UFRAME_NUM=1 ;
   3:J P[1] 100% CNT50    ;
   4:L P[2:start] 250mm/sec CNT100 ACC50    ;
   5:L P[3] 1.5sec FINE    ;
/POS
P[1]{
   GP1:
\tUF : 1, UT : 2,
\tJ1=     0.000 deg,\tJ2=   -20.000 deg,\tJ3=     5.000 deg,
\tJ4=     0.000 deg,\tJ5=   -90.000 deg,\tJ6=     0.000 deg
};
P[2:"start"]{
   GP1:
\tUF : 1, UT : 2,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =   100.000  mm,\tY =   -20.500  mm,\tZ =     5.000  mm,
\tW =   180.000 deg,\tP =     0.000 deg,\tR =    90.000 deg
};
P[3]{
   GP1:
\tUF : 1, UT : 2,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =   110.000  mm,\tY =   -20.500  mm,\tZ =     5.000  mm,
\tW =   180.000 deg,\tP =     0.000 deg,\tR =    90.000 deg
};
/END
"""


def read(language: str, text: str, points: str = ""):
    files = [ProgramFile(f"cam{LANGUAGES[language].ending}", text)]
    if points:
        files.append(ProgramFile("cam.dat", points))
    return LANGUAGES[language].read(files)


def test_krl_of_a_cam_system_is_read():
    found = read("krl", KRL, KRL_POINTS)
    assert found.name == "CAM"
    np.testing.assert_allclose(found.base, [1.0, 0, 0.5, 0, 0, 0.5**0.5, 0.5**0.5], atol=1e-9)
    assert found.tool is None  # number 3 of the controller
    assert [move.motion for move in found.moves] == [
        "joint",
        "linear",
        "linear",
        "spline",
        "linear",
    ]
    np.testing.assert_allclose(np.rad2deg(found.moves[0].joints), [0, -90, 90, 0, 45, 0])
    positions = [move.pose[:3] for move in found.moves[1:]]
    expected = [[10, 20, 30], [10, 20, 25.5], [11, 20, 25.5], [12, 20, 25.5]]
    np.testing.assert_allclose(positions, 1e-3 * np.array(expected), atol=1e-9)
    assert [move.speed for move in found.moves[1:]] == pytest.approx([0.2, 0.2, 0.2, 0.05])
    np.testing.assert_allclose(found.moves[4].pose[3:], [0, 0.5**0.5, 0, 0.5**0.5], atol=1e-9)


def test_rapid_of_a_cam_system_is_read():
    found = read("rapid", RAPID)
    assert found.name == "main"
    np.testing.assert_allclose(found.base[:3], [1.0, 0.0, 0.5])
    np.testing.assert_allclose(found.tool, [0, 0, 0.2, 0, 0.5**0.5, 0, 0.5**0.5], atol=1e-7)
    assert [move.motion for move in found.moves] == ["joint", "linear", "linear"]
    assert found.moves[1].speed == pytest.approx(0.2)
    assert (found.moves[2].duration, found.moves[2].speed) == (0.25, None)
    np.testing.assert_allclose(found.moves[2].pose, [0.011, 0.02, 0.03, 0, 1, 0, 0], atol=1e-9)


def test_fanuc_of_a_cam_system_is_read():
    found = read("fanuc", FANUC)
    assert (found.name, found.base) == ("CAM", None)
    assert [move.motion for move in found.moves] == ["joint", "linear", "linear"]
    np.testing.assert_allclose(np.rad2deg(found.moves[0].joints), [0, -20, 5, 0, -90, 0], atol=1e-5)
    assert found.moves[1].speed == pytest.approx(0.25)
    assert found.moves[2].duration == 1.5
    np.testing.assert_allclose(found.moves[2].pose[:3], [0.11, -0.0205, 0.005], atol=1e-8)


def moved(language: str, line: str) -> tuple[str, str]:
    """Return a program with a line before its last motion."""
    text, mark = {
        "krl": (KRL, "SPLINE WITH"),
        "rapid": (RAPID, "    MoveL [[11"),
        "fanuc": (FANUC, "   5:L P[3]"),
    }[language]
    return language, text.replace(mark, f"{line}\n{mark}")


# What stands in a program, and what the message must say.
REFUSED = {
    "krl loop": (*moved("krl", "FOR I=1 TO 3"), ["line 15", "expected ENDFOR", "got FOR"]),
    "krl arc": (*moved("krl", "CIRC_REL {X 1},{X 2}"), ["line 15", "got 'CIRC_REL'"]),
    "krl unknown point": ("krl", KRL, ["expected a point that has a value", "'XP1'", ".dat"]),
    "krl home in between": (
        "krl",
        "LIN {X 1,Y 1,Z 1,A 0,B 0,C 0}\nPTP HOME\nLIN {X 2}",
        ["line 3", "PTP HOME, which has no value"],
    ),
    "krl word": (*moved("krl", "LIN {X ten}"), ["line 15", "expected a number", "'ten'"]),
    "krl huge": (*moved("krl", "LIN {X 1e300}"), ["line 15", "at most 1e+08"]),
    "krl infinite": (*moved("krl", "LIN {X inf}"), ["expected a number", "'inf'"]),
    "krl another base": (
        *moved("krl", "$BASE=BASE_DATA[2]\nLIN {X 1,Y 1,Z 1,A 0,B 0,C 0}"),
        ["line 16", "one base", "BASE_DATA[2]"],
    ),
    "krl half a point": ("krl", "DEF A()\nLIN {X 1}\nEND", ["X, Y, Z, A, B, C", "Y, Z"]),
    "krl no target": (*moved("krl", "LIN"), ["line 15", "expected a motion to a point"]),
    "krl no motion": ("krl", "DEF A()\nEND", ["expected motions, got none"]),
    "krl block without end": (
        "krl",
        "DEF A()\nTIME_BLOCK START\nSPL {X 1,Y 1,Z 1,A 0,B 0,C 0}",
        ["TIME_BLOCK END", "end of the file"],
    ),
    "krl block without parts": (
        "krl",
        "TIME_BLOCK START\nSPL {X 1,Y 1,Z 1,A 0,B 0,C 0}\nTIME_BLOCK END=1",
        ["line 3", "each with its PART"],
    ),
    "krl time zero": ("krl", "TIME_BLOCK START\nTIME_BLOCK PART=0", ["line 2", "time > 0"]),
    "krl end alone": ("krl", "TIME_BLOCK END=1", ["line 1", "expected START"]),
    "rapid loop": (*moved("rapid", "WHILE TRUE DO;"), ["line 10", "got WHILE"]),
    "rapid arc": (*moved("rapid", "MoveC p10,p10,v100,z1,tool0;"), ["line 10", "got tool0"]),
    "rapid brackets": (
        *moved("rapid", f"MoveL {'[' * 9000}{']' * 9000},v1,z1,tool0;"),
        ["line 10", "brackets"],
    ),
    "rapid unclosed": (*moved("rapid", "MoveL [[1,2,3,v1,z1,tool0;"), ["line 10", "4 numbers"][:1]),
    "rapid unknown": (*moved("rapid", "MoveL p99,v1,z1,tool0;"), ["line 10", "robtarget", "'p99'"]),
    "rapid offset": (
        *moved("rapid", "MoveL Offs(p10,1,2),v1,z1,tool0;"),
        ["line 10", "arguments of Offs"],
    ),
    "rapid quaternion": (
        "rapid",
        RAPID.replace("[11,20,30],[0,0,1,0]", "[11,20,30],[0,0,2,0]"),
        ["line 10", "length 1", "length 2"],
    ),
    "rapid time": (
        *moved("rapid", "MoveL p10,v1\\T:=-1,z1,tMill\\WObj:=wPart;"),
        ["line 10", "time \\T > 0"],
    ),
    "rapid two tools": (
        *moved("rapid", "MoveL p10,v1,z1,tool0;"),
        ["line 10", "one tool", "tool0 behind tMill"],
    ),
    "rapid no semicolon": ("rapid", "MoveL p10,v1,z1,tool0", ["line 1", "semicolon"]),
    "rapid nothing": ("rapid", "", ["expected motions, got none"]),
    "fanuc jump": (*moved("fanuc", "   5:  JMP LBL[1] ;"), ["line 9", "LBL[1]", "got none"]),
    "fanuc arc": (
        *moved("fanuc", "   5:S P[1] 10mm/sec FINE ;"),
        ["line 9", "J, L, C or A", "spline"],
    ),
    "fanuc position": (*moved("fanuc", "   5:L P[77] 10mm/sec FINE ;"), ["line 9", "P[77]"]),
    "fanuc register": (
        *moved("fanuc", "   5:L PR[1] 10mm/sec FINE ;"),
        ["line 9", "PR[1]", "value"],
    ),
    "fanuc speed": (*moved("fanuc", "   5:L P[2] fast FINE ;"), ["line 9", "fast", "50mm/sec"]),
    "fanuc zero": (*moved("fanuc", "   5:L P[2] 0msec FINE ;"), ["line 9", "> 0"]),
    "fanuc name": ("fanuc", "/MN\n", ["/PROG and a name"]),
    "fanuc empty position": ("fanuc", FANUC.replace("J1=", "K1="), ["P[1]", "J1, J2, .. in order"]),
    "fanuc endless": (*moved("fanuc", "   5:  CALL CAM ;"), ["at most 10 calls"]),
    "csv columns": ("csv", "t,a\n1,2\n", ["columns time, q1"]),
    "csv word": ("csv", "time,q1\n0,one\n1,2\n", ["not a table of numbers"]),
    "csv time": ("csv", "time,q1\n0,1\n0,2\n", ["row 2", "rising times"]),
    "csv nan": ("csv", "time,q1\n0,1\n1,nan\n", ["finite numbers"]),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_is_refused_in_one_sentence(name):
    language, text, words = REFUSED[name]
    with pytest.raises(ProgramError) as raised:
        read(language, text)
    message = str(raised.value)
    assert "\n" not in message
    assert len(message) < 300
    for word in words:
        assert word in message


@pytest.mark.parametrize("language", LANGUAGES)
def test_damaged_programs_of_others_are_read_or_refused(language):
    """Bytes left out, doubled or replaced anywhere: a program or a ProgramError, nothing else."""
    whole = {"krl": KRL.replace("XP1", "{X 1}"), "rapid": RAPID, "fanuc": FANUC}
    text = whole.get(language, "time,q1,q2\n0,1,2\n0.1,1,2\n")
    read(language, text)
    read_or_refused(lambda broken: read(language, broken), text, 400)


def test_a_file_is_read_with_what_belongs_to_it(tmp_path):
    (tmp_path / "cam.src").write_text(KRL)
    (tmp_path / "CAM.DAT").write_text(KRL_POINTS)
    assert len(read_program(tmp_path / "cam.src").moves) == 5
    (tmp_path / "latin.mod").write_bytes(RAPID.replace("by hand", "f\xfcr").encode("latin-1"))
    assert len(read_program(tmp_path / "latin.mod").moves) == 3
    with pytest.raises(ProgramError, match=r"ending: expected one of \.src, \.mod, \.ls, \.csv"):
        read_program(tmp_path / "cam.nc")
    with pytest.raises(ProgramError, match="cannot be read"):
        read_program(tmp_path / "none.src")

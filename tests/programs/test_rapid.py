"""RAPID as others write it: what is executed, what is left out and said, and what is refused by name."""

from pathlib import Path

import numpy as np
import pytest
from counted_calls import require_proportional
from damage import read_or_refused
from hypothesis import example, given
from hypothesis import strategies as st
from rapid_programs import HELD, REST, TRAPS, UPRIGHT, module, places, read, to, way
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError, ProgramError
from coupling.files.toml_file import validate
from coupling.path.frame import Frame
from coupling.programs.languages import read_program
from coupling.programs.program import HERE
from coupling.programs.rapid import reader as rapid_reader
from coupling.toolpaths.robot_program import ProgramPath

AT_30, IN_2_S = "v7000\\V:=30", "v10\\T:=2"
# What stands between p1 and p3, and where the robot goes between them [mm].
EXECUTED = {
    "component": ("p2.trans.y := 40;" + to("p2"), [[50, 40, 0]]),
    "position": ("p2.trans := [50,40,0];" + to("p2"), [[50, 40, 0]]),
    "whole": (f"p2 := [[50,40,0],{UPRIGHT};" + to("p2"), [[50, 40, 0]]),
    "copy": ("p2 := p3; p2.trans.y := p2.trans.y + 40;" + to("p2"), [[100, 40, 0]]),
    "offs": (to("Offs(p2,0,40,0)"), [[50, 40, 0]]),
    "numbers to other bases": (
        f"SetGO go1,0X14F; p2.trans := [0x1F,0b101,0o17];{to('p2')}",
        [[31, 5, 15]],
    ),
    "offs of offs": (to("Offs(Offs(p2,0,40,0),1,-2*3,pi-pi)"), [[51, 34, 0]]),
    # x of the tool is along -z of the work object.
    "reltool": (to("RelTool(p2,10,20,30)"), [[80, 20, -10]]),
    "trigger": ("TriggL p2,v50,trig1\\T2:=trig2,fine,tq\\WObj:=wq;", [[50, 0, 0]]),
    "output": ("MoveLDO p2,v50,fine,tq\\WObj:=wq,do1,1;", [[50, 0, 0]]),
    "displacement": (
        f"PDispSet [[0,40,0],[1,0,0,0]];{to('p2')}PDispOff;{to('p2')}",
        [[50, 40, 0], [50, 0, 0]],
    ),
    "turned displacement": (
        f"PDispSet [[0,0,0],OrientZYX(90,0,0)];{to('p2')}PDispOff;",
        [[0, 50, 0]],
    ),
    "for": (
        f"FOR i FROM 1 TO 3 DO {to('Offs(p1,10*i,i*i,0)')} ENDFOR",
        [[10, 1, 0], [20, 4, 0], [30, 9, 0]],
    ),
    "for down": (
        f"FOR i FROM 3 TO 1 STEP -2 DO {to('Offs(p1,i,0,0)')} ENDFOR",
        [[3, 0, 0], [1, 0, 0]],
    ),
    "while": (
        f"VAR num k := 0; WHILE k < 2 DO Incr k; {to('Offs(p1,k,0,0)')} ENDWHILE",
        [[1, 0, 0], [2, 0, 0]],
    ),
    "if": (
        f"IF 1 > 2 THEN {to('p3')} ELSEIF TRUE THEN {to('p2')} ELSE {to('p3')} ENDIF",
        [[50, 0, 0]],
    ),
    "compact if": (f"IF 3 DIV 2 = 1 AND NOT FALSE {to('p2')}", [[50, 0, 0]]),
    "test": (
        f"TEST 2 CASE 1: {to('p3')} CASE 2,3: {to('p2')} DEFAULT: Stop; ENDTEST",
        [[50, 0, 0]],
    ),
    "array": (
        f"VAR robtarget q{{2}}; q{{2}} := p2; q{{2}}.trans.z := Sqrt(16); {to('q{2}')}",
        [[50, 0, 4]],
    ),
    "vectors": (
        f"p2.trans := 2*(p1.trans+[1,2,3])-[0,0,1]; {to('p2')}",
        [[2, 4, 5]],
    ),
    "poses": (
        "VAR pose a := [[0,0,7],[1,0,0,0]]; p2.trans := [1,2,3];"
        "a := PoseMult(a,PoseInv([[0,0,3],[1,0,0,0]]));"
        "p2.trans := p2.trans + a.trans;" + to("p2"),
        [[1, 2, 7]],
    ),
    "powers and parts of numbers": (
        f"{to('Offs(p2,Pow(2,3)-Max(3,4),Trunc(-3.789 Dec:=2),Trunc(-3.9)+Min(7,2))')}".replace(
            " Dec", "\\Dec"
        ),
        [[54, -3.78, -1]],
    ),
    # (3, 4, 12) x (1, 2, 3) is (-12, 3, 2), their product 47, the first's length 13.
    "products of vectors": (
        "VAR pos a := [3,4,12]; VAR pos b := [1,2,3]; p2.trans := CrossProd(a,b);"
        + to("p2")
        + to("Offs(p1,VectMagn(a),DotProd(a,b),0)"),
        [[-12, 3, 2], [13, 47, 0]],
    ),
    # A quarter turn about z takes (1, 2, 3) to (-2, 1, 3).
    "a place in a pose": (
        "VAR pose f := [[5,7,11],NOrient([1,0,0,1])]; p2.trans := PoseVect(f,[1,2,3]);" + to("p2"),
        [[3, 8, 14]],
    ),
    "work object moved": (
        "wq.uframe.trans.x := 600;" + to("p2") + "wq.uframe.trans.x := 500;",
        [[150, 0, 0]],
    ),
    "object frame": (
        "wq.oframe.trans.y := 40;" + to("p2") + "wq.oframe.trans.y := 0;",
        [[50, 40, 0]],
    ),
    "world": (to("p2", "tq"), [[-450, 0, 0]]),
    # The other tool is 100 mm shorter: at its point the first tool's is 100 mm ahead, along x.
    "other tool": (to("p2", "tool0\\WObj:=wq"), [[150, 0, 0]]),
    "unreached stop": (f"IF FALSE Stop; {to('p2')}", [[50, 0, 0]]),
    "harmless": (
        'SetDO do1,1; WaitTime 0.5; TPWrite "a;b!"\\Num:=3; ! MoveL p3'
        + "\n AccSet 50,50;"
        + to("p2"),
        [[50, 0, 0]],
    ),
}


def test_the_robot_stands_where_the_program_waits_until_it_does():
    (_, passed, _), (_, waited, _) = (
        way(to("p2").replace("fine", "z1") + between).moves
        for between in ("SetDO do1,1;", "WaitRob\\InPos;")
    )
    assert (passed.is_stop, waited.is_stop) == (False, True)


@pytest.mark.parametrize("wait", ["WaitDI di1,1;", "WaitUntil di1=1;"])
def test_signals_behind_a_zone_are_taken_to_come_in_time(wait):
    said = "signals that it waits for behind zones come in time: the tool does not stand there"
    passed, stopped = (way(text + wait) for text in (to("p2").replace("fine", "z1"), to("p2")))
    assert said in passed.assumptions
    assert said not in stopped.assumptions
    assert [move.is_stop for move in passed.moves] == [True, False, True]


@pytest.mark.parametrize("name", EXECUTED)
def test_what_is_computable_is_computed(name):
    second, between = EXECUTED[name]
    assert places(way(second)) == [[0, 0, 0], *between, [100, 0, 0]]


def test_procedures_and_functions_of_the_program_are_executed_with_their_parameters():
    routines = """
      PROC Detour(robtarget p, num dy \\switch twice)
        MoveL Offs(p,0,dy,0),v50,fine,tq\\WObj:=wq;
        IF Present(twice) RETURN;
        MoveL Higher(p,5),v50,fine,tq\\WObj:=wq;
      ENDPROC
      FUNC robtarget Higher(robtarget p, num dz)
        p.trans.z := p.trans.z + dz;
        RETURN p;
      ENDFUNC
      PROC Shift(INOUT robtarget p, INOUT num count)
        p.trans.x := 7; count := count + 1;
      ENDPROC
      PROC Unused() MoveC p1,p2,v50,z1,tool0; ENDPROC
    """
    main = f"""
      VAR num n := 0;
      Detour p2, 40;
      Detour p2, 30\\twice;
      %"Detour"% p1, 20\\twice;
      Shift p2, n; p2.trans.y := n;
      {to("Offs(p2,0,0,n)")}
    """
    found = places(read(main, routines=routines))
    assert found == [[50, 40, 0], [50, 0, 5], [50, 30, 0], [0, 20, 0], [7, 1, 1]]


@example(0.0, 0.0, 0.0, (30.0, 90.0, 20.0))
@given(*[st.floats(-180.0, 180.0)] * 3, st.tuples(*[st.floats(-90.0, 90.0)] * 3))
def test_turns_of_targets_are_about_the_tools_new_axes(rx, ry, rz, angles):
    """RelTool: Rx, Ry, Rz about the axes as turned; OrientZYX: z, y', x''; EulerZYX back."""
    numbers = [f"{angle:.6f}" for angle in (rx, ry, rz, *angles)]
    target = f"[[1,2,3],OrientZYX({','.join(numbers[3:])}),{REST}"
    turns = ",".join(f"EulerZYX(\\{axis},OrientZYX({','.join(numbers[3:])}))" for axis in "ZYX")
    again = f"[[1,2,3],OrientZYX({turns}),{REST}"
    relative = f"RelTool({target},0,0,0\\Rx:={numbers[0]}\\Ry:={numbers[1]}\\Rz:={numbers[2]})"
    moves = read("\n".join(f"MoveJ {t},v50,fine,tq;" for t in (target, again, relative))).moves
    first, second, third = (Rotation.from_quat(move.pose[3:]) for move in moves)
    expected = Rotation.from_euler("ZYX", angles, degrees=True)
    assert (first * expected.inv()).magnitude() < 1e-6
    assert (second * expected.inv()).magnitude() < 1e-5
    turned = expected
    for axis, angle in zip("xyz", (rx, ry, rz), strict=True):
        turned = turned * Rotation.from_euler(axis, angle, degrees=True)
    assert (third * turned.inv()).magnitude() < 1e-6


def test_speeds_are_those_that_the_program_says():
    main = f"""
      {to("p1", speed="vmax")}
      {to("p2", speed="v150")}
      {to("p3", speed="fast")}
      {to("p2", speed=AT_30)}
      {to("p3", speed=IN_2_S)}
      VelSet 50,100;
      {to("p2", speed="v150")}
      {to("p3", speed="v500")}
      {to("p2", speed=IN_2_S)}
      {to("p3", speed="v35")}
    """
    program = read(main, "CONST speeddata fast := [80,500,5000,1000];")
    found = [(move.speed, move.duration) for move in program.moves]
    mm_s = [None, 150, 80, 30, None, 75, 100, None, 17.5]
    assert [speed for speed, _ in found] == [
        None if speed is None else pytest.approx(1e-3 * speed) for speed in mm_s
    ]
    assert [time for _, time in found] == [None] * 4 + [2.0, None, None, 4.0, None]
    assert "v35, which is not in the program, is 35 mm/s" in program.assumptions


def test_a_tool_that_turns_far_on_a_short_line_is_as_slow_as_its_turning():
    """90 deg at 45 deg/s take 2 s: 10 mm in that time are 5 mm/s."""
    turned = "RelTool(Offs(p1,10,0,0),0,0,0\\Rz:=90)"
    program = read(to("p1") + f"MoveL {turned},[50,45,5000,1000],fine,tq\\WObj:=wq;")
    assert program.moves[1].speed == pytest.approx(0.005, rel=1e-6)


def test_what_does_not_change_the_path_is_listed():
    second = """
      ConfL\\Off; SetDO do1,1; Reset do2; WaitTime 1; WaitTime 2; WaitUntil di1=1;
      IF di1 = 1 THEN SetDO do1,0; n := 3; ELSE Reset do1; ENDIF
      WHILE di2 = 0 DO WaitTime 0.1; ENDWHILE
      TPReadNum answer,"?";
      MoveL p2\\ID:=10,v50\\V:=20,z10\\Inpos:=inpos20,tq\\WObj:=wq\\TLoad:=load0;
      SingArea\\Wrist;
    """
    program = way(second, "VAR num n; VAR num answer;")
    assert dict(program.left_out) == {
        "ConfL": 1,
        "SetDO": 1,
        "Reset": 1,
        "WaitUntil": 1,
        "IF": 1,
        "WHILE": 1,
        "TPReadNum": 1,
        "\\Inpos": 1,
        "\\TLoad": 1,
    }
    assert program.assumptions == (
        "motions with \\ID do not wait for another robot",
        "the tool keeps its programmed rotation, from which SingArea\\Wrist may deviate",
        "zones, up to 10 mm, are not rounded: the path goes through every target",
    )


ASSUMED = {
    "mode": (f"IF OpMode() = OP_AUTO THEN {to('p2')} ELSE {to('p1')} ENDIF", "automatic operation"),
    "robot": (f"IF RobOS() {to('p2')}", "RobOS is TRUE"),
    "stop": (f"{to('p2')} Stop;", "ends at Stop in line 11"),
    "error": (f"{to('p2')} IF di1 = 1 EXIT;", "EXIT behind IF in line 11 is not reached"),
    "held work object": (
        to("p2", HELD),
        "work object wHeld, which the controller holds",
    ),
    "external axis": (f"p2.extax.eax_a := 5; {to('p2')}", "external axis eax_a stays at 5"),
    "handler": (f"{to('p2')} ERROR IF ERRNO = 1 RETRY; TRYNEXT;", "no error comes up"),
}


@pytest.mark.parametrize("name", ASSUMED)
def test_what_is_assumed_is_said(name):
    main, said = ASSUMED[name]
    program = read(main)
    assert len(program.moves) == 1
    assert said in " ".join(program.assumptions)


def test_data_and_procedures_that_the_file_lacks_are_those_of_its_folder(tmp_path: Path):
    lacking = module(f"{to('p1')} Detour; {to('p3')}").replace(
        "PERS tooldata tq", "PERS tooldata t"
    )
    (tmp_path / "way.prg").write_text(lacking)
    (tmp_path / "more.sys").write_text(
        "MODULE More(SYSMODULE)\n"
        "PERS tooldata tq := [TRUE,[[0,0,9],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n"
        f" PROC Detour() {to('Offs(p3,0,1,0)')} ENDPROC\nENDMODULE"
    )
    program = read_program(tmp_path / "way.prg")
    assert places(program) == [[0, 0, 0], [100, 1, 0], [100, 0, 0]]
    assert program.tool == (0.0, 0.0, pytest.approx(0.009), *HERE[3:])
    assert "more.sys, which lies in its folder, belongs to it: it has tq" in program.assumptions
    (tmp_path / "other.mod").write_text("MODULE Other PROC Detour() ENDPROC ENDMODULE")
    with pytest.raises(
        ProgramError,
        match=r"one Detour in the files of its folder, got one in more.sys and other.mod",
    ):
        read_program(tmp_path / "way.prg")
    (tmp_path / "more.sys").write_text("MODULE More(")
    (tmp_path / "other.mod").unlink()
    with pytest.raises(
        ProgramError, match=r"got Detour \(more.sys cannot be read: more.sys: line 1"
    ):
        read_program(tmp_path / "way.prg")


def test_what_is_local_in_another_module_is_not_there(tmp_path: Path):
    """A point of the same name is another one, which the program does not tell."""
    (tmp_path / "way.mod").write_text(module(f"{to('p1')} {to('p9')}"))
    other = f"MODULE Other\n{{}}CONST robtarget p9 := [[9,9,9],{UPRIGHT};\nENDMODULE"
    (tmp_path / "other.mod").write_text(other.format(""))
    assert places(read_program(tmp_path / "way.mod")) == [[0, 0, 0], [9, 9, 9]]
    (tmp_path / "other.mod").write_text(other.format("LOCAL "))
    with pytest.raises(ProgramError, match="expected a robtarget with a value, got 'p9'"):
        read_program(tmp_path / "way.mod")
    two = "MODULE {0}\nLOCAL PROC Aside() ENDPROC\nPROC {0}Way() Aside; ENDPROC\nENDMODULE"
    (tmp_path / "a.mod").write_text(two.format("A"))
    (tmp_path / "b.mod").write_text(two.format("B"))
    (tmp_path / "way.mod").write_text(module(f"{to('p1')} AWay; BWay; {to('p3')}"))
    assert places(read_program(tmp_path / "way.mod")) == [[0, 0, 0], [100, 0, 0]]
    (tmp_path / "way.mod").write_text(module(f"{to('p1')} Aside; {to('p3')}"))
    with pytest.raises(ProgramError, match="got Aside: put its module beside"):
        read_program(tmp_path / "way.mod")


def test_a_module_without_main_begins_with_its_procedure_of_motions():
    text = module(to("p1")).replace("main", "Path_10")
    assert rapid_reader.read(text).name == "Path_10"
    calling = text.replace(
        "ENDMODULE", "PROC Cycle() Path_10; ENDPROC PROC Init() Reset do1; ENDPROC ENDMODULE"
    )
    program = rapid_reader.read(calling)
    assert (program.name, len(program.moves)) == ("Cycle", 1)
    assert program.assumptions == ("it begins with Cycle, which no other procedure calls",)
    two = text.replace("ENDMODULE", f"PROC Path_20() {to('p2')} ENDPROC ENDMODULE")
    with pytest.raises(
        ProgramError, match="expected main, or one procedure with motions, got Path_10, Path_20"
    ):
        rapid_reader.read(two)


def test_what_was_left_out_and_assumed_stands_in_the_tasks_remarks(tmp_path: Path):
    main = "SetDO do1,1;".join(to(p) for p in ("p1", "p2", "p3")).replace("fine", "z50")
    (tmp_path / "way.mod").write_text(module(main))
    data = {"kind": "program", "file": str(tmp_path / "way.mod")}
    path = validate(data, ProgramPath, CaseError, "tool_path")
    remarks = path.task(Frame(np.zeros(3), Rotation.identity())).remarks
    assert "way.mod: read and left out: SetDO (2)" in remarks
    assert any("zones, up to 50 mm, are not rounded" in remark for remark in remarks)


def test_work_grows_in_proportion_to_length():
    def read_moves(count: int) -> None:
        lines = [
            f"MoveL [[{0.1 * k:.3f},0,{k % 7}.5],{UPRIGHT},v50,z1,tq\\WObj:=wq;"
            for k in range(count)
        ]
        rapid_reader.read(module("\n".join(lines)))

    require_proportional(read_moves)


@pytest.mark.parametrize("seed", range(3))
def test_damaged_programs_are_read_or_refused(seed):
    second = "\n".join(text for text, _ in EXECUTED.values())
    text = module(f"{to('p1')}\n{second}\n{to('p3')}", routines=TRAPS)
    rapid_reader.read(text)
    read_or_refused(rapid_reader.read, text, 60, seed)

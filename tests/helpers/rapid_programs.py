"""Programs of RAPID from some statements."""

from coupling.programs.program import RobotProgram
from coupling.programs.rapid import reader as rapid_reader

REST = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
UPRIGHT = f"[0.70710678,0,0.70710678,0],{REST}"
DATA = f"""
  PERS tooldata tq:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS wobjdata wq:=[FALSE,TRUE,"",[[500,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  CONST robtarget p1:=[[0,0,0],{UPRIGHT};
  VAR robtarget p2:=[[50,0,0],{UPRIGHT};
  CONST robtarget p3:=[[100,0,0],{UPRIGHT};
  CONST jointtarget home:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
"""


def module(main: str, data: str = "", routines: str = "") -> str:
    return f"MODULE M1\n{DATA}{data}\nPROC main()\n{main}\nENDPROC\n{routines}\nENDMODULE\n"


def read(main: str, data: str = "", routines: str = "", **others: str) -> RobotProgram:
    texts = {f"{name}.mod": text for name, text in others.items()}
    return rapid_reader.read(module(main, data, routines), "way.mod", texts)


def to(target: str, frames: str = "tq\\WObj:=wq", speed: str = "v50") -> str:
    return f"MoveL {target},{speed},fine,{frames};"


def places(program: RobotProgram) -> list[list[float]]:
    return [[round(1e3 * x, 6) + 0.0 for x in move.pose[:3]] for move in program.moves]


def way(second: str, data: str = "", routines: str = "", **others: str) -> RobotProgram:
    """Read p1, what is given, and p3."""
    return read(f"{to('p1')}\n{second}\n{to('p3')}", data, routines, **others)


HELD = "tq\\WObj:=wHeld"
TRAPS = f"""
TRAP tMove {to("p1")} ENDTRAP
TRAP tSet p2 := p3; RETURN; ENDTRAP
PROC Change(INOUT num x) x := 1; ENDPROC
"""

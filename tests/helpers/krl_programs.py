"""Programs of KRL from some statements."""

from coupling.programs.krl.reader import read
from coupling.programs.program import ProgramFile

ZERO = "{X 0,Y 0,Z 0,A 0,B 90,C 0}"
START = f"$VEL.CP=0.05\nLIN {ZERO}"


def program(body: str, data: str = "", **others: str):
    """Return the program of some statements, with a .dat and other files by their stems."""
    files = [ProgramFile("way.src", f"DEF way()\n{body}\nEND\n")]
    if data:
        files.append(ProgramFile("way.dat", f"DEFDAT way\n{data}\nENDDAT\n"))
    files += [ProgramFile(f"{name}.src", text) for name, text in others.items()]
    return read(files)


def places(found) -> list[list[float]]:
    """Return positions in millimetres."""
    return [[round(1e3 * x, 4) + 0.0 for x in move.pose[:3]] for move in found.moves if move.pose]


POINTS = """DECL FRAME PT[3]
PT[1]={X 0,Y 0,Z 0,A 0,B 90,C 0}
PT[2]={X 50,Y 0,Z 0,A 0,B 90,C 0}
DECL E6POS P2={X 50,Y 0,Z 0,A 0,B 90,C 0,S 2,T 35,E1 0.0}
DECL INT N=2
DECL FRAME SHIFT={X 0,Y 40,Z 0,A 0,B 0,C 0}"""

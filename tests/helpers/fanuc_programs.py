"""Programs of FANUC TP from some instructions."""

from coupling.programs.fanuc import reader as fanuc_reader
from coupling.programs.program import ProgramFile


def cartesian(number, x=0.0, y=0.0, z=0.0, w=0.0, p=0.0, r=0.0, more="", uf="1", ut="1"):
    """Return the data of a position as a controller writes them."""
    return (
        f"P[{number}]{{\n   GP1:\n\tUF : {uf}, UT : {ut},\t\tCONFIG : 'N U T, 0, 0, 0',\n"
        f"\tX = {x:10.3f}  mm,\tY = {y:10.3f}  mm,\tZ = {z:10.3f}  mm,\n"
        f"\tW = {w:10.3f} deg,\tP = {p:10.3f} deg,\tR = {r:10.3f} deg{more}\n}};\n"
    )


JOINTS = (
    "P[9]{\n   GP1:\n\tUF : 1, UT : 1,\n\tJ1= 1.0 deg,\tJ2= 2.0 deg,\tJ3= 3.0 deg,\n"
    "\tJ4= 4.0 deg,\tJ5= 5.0 deg,\tJ6= 6.0 deg\n};\n"
)


# Three positions on a line, and one of joint angles.
POINTS = "".join(cartesian(k, x=100.0 * (k - 1), w=180.0) for k in (1, 2, 3)) + JOINTS
CHOSEN = "UFRAME_NUM=1\nUTOOL_NUM=1\n"


def text_of(instructions: str, points: str = POINTS, name: str = "MAIN") -> str:
    lines = (f"{k:4d}:  {line} ;" for k, line in enumerate(instructions.splitlines(), start=1))
    return f"/PROG  {name}\n/ATTR\n/MN\n" + "\n".join(lines) + f"\n/POS\n{points}/END\n"


def read(instructions: str, points: str = POINTS, **called: str):
    files = [ProgramFile("main.ls", text_of(CHOSEN + instructions, points))]
    files += [ProgramFile(f"{n}.ls", text_of(t, points, n)) for n, t in called.items()]
    return fanuc_reader.read(files)


def places(program) -> list[list[float]]:
    """Return the positions of a program [mm], rounded."""
    return [[round(1e3 * x, 4) + 0.0 for x in move.pose[:3]] for move in program.moves]


FIRST, SECOND = "L P[1] 50mm/sec FINE", "L P[2] 50mm/sec CNT100"
ZEROES = "".join(f"PR[5,{k}]=0\n" for k in range(1, 7))

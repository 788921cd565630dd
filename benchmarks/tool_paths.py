"""Time and memory to read and plan long programs: python -m benchmarks.tool_paths.

    python -m benchmarks.tool_paths                        to 500 000 lines, about two minutes
    python -m benchmarks.tool_paths --before ../before     and the same in another tree, with ratios
    python -m benchmarks.tool_paths --lines 5000 --lines 10000

The other tree is one of the project, made by `git worktree add ../before <commit>`; it is asked no more
once it took three minutes or refused.  Each program is read and planned in a process of its own: its
CPU time without imports, and the most memory it held.  The exponent is that of time over lines.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

HERE = Path(__file__).parents[1]
LINES = (5_000, 10_000, 20_000, 100_000, 500_000)
PROGRAM_LINES = (250, 999, 4_000)
LONGEST = 180.0  # [s]

_RUN = """
import json, resource, sys, time
from pathlib import Path
import numpy as np
from scipy.spatial.transform import Rotation
from coupling.path.frame import Frame
from coupling.toolpaths import TOOL_PATHS
begin = time.process_time()
table = TOOL_PATHS[sys.argv[1]](kind=sys.argv[1], file=Path(sys.argv[2]))
table._program
read = time.process_time()
table.task(Frame(np.zeros(3), Rotation.identity()))
end = time.process_time()
memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
print(json.dumps([read - begin, end - read, memory]))
"""


@dataclass(frozen=True)
class Cost:
    """What a program took.

    Attributes:
        reading, planning: CPU times [s].
        memory: Most memory held [MB].
    """

    reading: float
    planning: float
    memory: float

    @property
    def time(self) -> float:
        """CPU time [s]."""
        return self.reading + self.planning

    @classmethod
    def of(cls, tree: Path, kind: str, file: Path) -> Cost | None:
        """Return what it takes in a tree; None where that refuses or takes three minutes."""
        paths = os.pathsep.join(str(tree / name) for name in (".", "fmu_src"))
        command = [sys.executable, "-c", _RUN, kind, str(file)]
        environment = os.environ | {"PYTHONPATH": paths}
        try:
            run = subprocess.run(
                command, env=environment, cwd=tree, capture_output=True, timeout=LONGEST, check=True
            )
        except (subprocess.TimeoutExpired, subprocess.CalledProcessError):
            return None
        return cls(*json.loads(run.stdout))


def gcode(lines: int) -> str:
    """Return lines of 1 mm along a spiral at one feed."""
    points = (_spiral(k) for k in range(lines))
    moves = (f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f}" for x, y, z in points)
    return "\n".join(["G21 G90 G17", "G0 X50 Y0 Z5", "G1 Z0 F3000", *moves, "M30"])


def gcode_feeds(lines: int) -> str:
    """Return the same with another feed in every line."""
    feeds = (3000.0 + 900.0 * math.sin(0.07 * k) for k in range(lines))
    points = (_spiral(k) for k in range(lines))
    moves = (
        f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} F{feed:.1f}"
        for (x, y, z), feed in zip(points, feeds, strict=True)
    )
    return "\n".join(["G21 G90 G17", "G0 X50 Y0 Z0", *moves, "M30"])


def fanuc(lines: int) -> str:
    """Return a FANUC program of linear moves of 60 mm there and back, at rest behind each."""
    moves = (f"{k}:L P[{k}] 50mm/sec FINE ;" for k in range(1, lines + 1))
    places = (
        f"P[{k}]{{ GP1: UF : 1, UT : 1, CONFIG : 'N U T, 0, 0, 0',"
        f" X = {60 * (k % 2):.3f} mm, Y = {0.05 * k:.3f} mm, Z = 0.000 mm,"
        f" W = 180.000 deg, P = {math.sin(0.01 * k):.3f} deg, R = 0.000 deg }};"
        for k in range(1, lines + 1)
    )
    head = ["/PROG SPIRAL", "/MN", "UFRAME_NUM=1 ;", "UTOOL_NUM=1 ;"]
    return "\n".join([*head, *moves, "/POS", *places, "/END"])


def _spiral(k: int) -> tuple[float, float, float]:
    angle, radius = 0.02 * k, 50.0 - 3e-5 * k
    return radius * math.cos(angle), radius * math.sin(angle), -5e-5 * k


# What is written, kind of the tool path, ending, lines.
PROGRAMS = {
    "G-code, one feed": (gcode, "gcode", ".ngc", LINES),
    "G-code, a feed in every line": (gcode_feeds, "gcode", ".ngc", LINES),
    "FANUC": (fanuc, "program", ".ls", PROGRAM_LINES),
}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="Reading and planning of long programs.")
    parser.add_argument("--before", type=Path, help="another tree of the project")
    parser.add_argument("--lines", type=int, action="append", help="lines of each program")
    options = parser.parse_args()
    console = Console()
    for name, (write, kind, ending, sizes) in PROGRAMS.items():
        costs: dict[int, Cost] = {}
        table = Table("lines", "read [s]", "plan [s]", "MB", "exponent", title=name)
        columns = ("before [s]", "MB", "ratio") if options.before else ()
        for column in columns:
            table.add_column(column)
        before: Cost | None = None
        known = options.before is not None
        for lines in options.lines or sizes:
            with tempfile.TemporaryDirectory() as folder, console.status(f"{name}: {lines}"):
                file = Path(folder, f"spiral{ending}")
                file.write_text(write(lines))
                cost = Cost.of(HERE, kind, file)
                before = Cost.of(options.before.resolve(), kind, file) if known else None
            if cost is None:
                break
            known = before is not None
            table.add_row(f"{lines}", *_row(cost, costs, lines), *_beside(before, cost, columns))
            costs[lines] = cost
        console.print(table)


def _row(cost: Cost, costs: dict[int, Cost], lines: int) -> tuple[str, ...]:
    exponent = "-"
    if costs:
        last = max(costs)
        exponent = f"{math.log(cost.time / costs[last].time) / math.log(lines / last):.2f}"
    return f"{cost.reading:.2f}", f"{cost.planning:.2f}", f"{cost.memory:.0f}", exponent


def _beside(before: Cost | None, cost: Cost, columns: tuple[str, ...]) -> tuple[str, ...]:
    if before is None:
        return ("-",) * len(columns)
    return f"{before.time:.2f}", f"{before.memory:.0f}", f"{before.time / cost.time:.1f}"


if __name__ == "__main__":
    main()

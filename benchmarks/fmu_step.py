"""Cost of one communication step: set six inputs, step, read seven outputs; and of its derivatives.

    python benchmarks/fmu_step.py

From a host in C (tests/native/host.c, native FMU only) and through FMPy, for both kinds of FMU.  The
best of many runs; the robot has backlash and is shaken by a pulsed force.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import fmpy
from rich.console import Console
from rich.table import Table

from benchmarks.task import ROBOT
from coupling.fmu_export.build import KINDS, BuildOptions, build_fmu
from coupling.native.compiler import SOURCES, host_platform

_HOST = Path(__file__).parent.parent / "tests" / "native" / "host.c"
# Communication steps [s], as host.c has them.
SIZES = (1e-3, 4e-3, 1e-2)
# What a step of 4 ms from a C host, and its six derivatives, are meant to take at most [us].
GOAL = 2.5
COLUMNS_GOAL = 10.0
_COLUMNS = "its six derivatives by the wrench"
_SPRING = "on a spring whose stiffness changes"
# In a process of its own.
_FMU = """
import json, sys, time
from pathlib import Path
import fmpy
from fmpy.fmi2 import FMU2Slave
folder = Path(sys.argv[1])
d = fmpy.read_model_description(str(folder))
names = {v.name: v.valueReference for v in d.modelVariables}
wrench = [names[f"{n}.{c}"] for n in ("force", "moment") for c in "xyz"]
tcp = [names[f"tcp.{c}"] for c in ("x", "y", "z", "qx", "qy", "qz", "qw")]
fmu = FMU2Slave(
    guid=d.guid, unzipDirectory=folder, modelIdentifier="ElasticRobot", instanceName="r"
)
def step(k, size):
    fmu.setReal(wrench, [0.0, 0.0, -500.0 * (k % 70 < 30), 0.0, 0.0, 0.0])
    fmu.doStep(k * size, size)
    fmu.getReal(tcp)
"""
_THROUGH_FMPY = f"""{_FMU}
drives = [names[f"q_cmd[{{i}}]"] for i in range(1, 7)]
best = []
for size in json.loads(sys.argv[2]):
    walls = []
    for trial in range(5):
        fmu.instantiate()
        fmu.setupExperiment()
        fmu.enterInitializationMode()
        fmu.setReal(drives, [0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
        fmu.exitInitializationMode()
        start = time.perf_counter()
        for k in range(300):
            step(k, size)
        walls.append((time.perf_counter() - start) / 300)
        fmu.fmi2FreeInstance(fmu.component)
    best.append(1e6 * min(walls))
print(json.dumps(best), flush=True)
"""


def from_c(folder: Path) -> dict[tuple[str, float], float]:
    """Return what host.c measures, by task and step size [s]: step, spring, columns, state [us]."""
    host, platform = folder / "host", host_platform()
    command = ["cc", "-std=c99", "-O2", f"-I{SOURCES / 'fmi'}", "-o", str(host), str(_HOST)]
    subprocess.run([*command, "-ldl", "-lm", "-lpthread"], check=True)
    guid = fmpy.read_model_description(str(folder / "native")).guid
    library = folder / "native" / "binaries" / platform.name / f"ElasticRobot{platform.suffix}"
    resources = (folder / "native" / "resources").as_uri()
    said = subprocess.run(
        [str(host), str(library), guid, resources, "time"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    lines = map(str.split, said.splitlines())
    return {(task, float(size)): float(cost) for task, size, cost in lines}


def through_fmpy(folder: Path) -> list[float]:
    """Return the cost of a step for SIZES [us], with FMPy's lists."""
    command = [sys.executable, "-c", _THROUGH_FMPY, str(folder), json.dumps(SIZES)]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    costs: list[float] = json.loads(said)
    return costs


def main() -> None:
    """Print the table and the goals."""
    console = Console()
    table = Table("", *[f"{1e3 * size:g} ms" for size in SIZES], title="one step [us]")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for kind in KINDS:
            file = build_fmu(ROBOT, folder / f"{kind}.fmu", BuildOptions(kind))
            fmpy.extract(str(file), unzipdir=str(folder / kind))
        costs = from_c(folder)
        tasks = {"step": "native FMU, host in C", "spring": _SPRING, "columns": _COLUMNS}
        for task, title in tasks.items():
            table.add_row(title, *[f"{costs[task, size]:.1f}" for size in SIZES])
        for kind in reversed(list(KINDS)):
            row = [f"{cost:.1f}" for cost in through_fmpy(folder / kind)]
            table.add_row(f"{kind} FMU, FMPy", *row)
    console.print(table)
    state, step = costs["state", 0.0], costs["step", 4e-3]
    console.print(f"state saved and restored: {state:.2f} us")
    verdict = "reached" if step <= GOAL else "not reached"
    console.print(f"4 ms from C: {step:.2f} us (at most {GOAL:g}; {verdict})")
    columns = costs["columns", 4e-3]
    verdict = "reached" if columns <= COLUMNS_GOAL else "not reached"
    console.print(f"{_COLUMNS}: {columns:.1f} us (at most {COLUMNS_GOAL:g}; {verdict})")


if __name__ == "__main__":
    main()

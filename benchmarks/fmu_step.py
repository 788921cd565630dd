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
from dataclasses import replace
from pathlib import Path

import fmpy
from rich.console import Console
from rich.table import Table

from benchmarks.task import ROBOT
from coupling.fmu_export.build import KINDS, BuildOptions, build_fmu
from coupling.fmu_export.compiler import SOURCES, host_platform
from elastic_robot.description import Robot

_HOST = Path(__file__).parent.parent / "tests" / "native" / "host.c"
# Communication steps [s], as host.c has them.
SIZES = (1e-3, 4e-3, 1e-2)
# What a step of 4 ms from a C host, and its six derivatives, are meant to take at most [us].
GOAL = 2.5
COLUMNS_GOAL = 10.0
# What the FMU in Python and FMPy are meant to add to a step of the model at most [us].
OVERHEAD_GOAL = 20.0
_COLUMNS = "its six derivatives by the wrench"
_SPRING = "on a spring whose stiffness changes"
# What both scripts begin with, each in a process of its own.
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
# Steps of the FMU and of its model, in turns of 30, 1e5 of each; the best turn of each.
# The model's own: from what it acts on to its pose, as the FMU asks for it.
_OVER_THE_MODEL = f"""{_FMU}
sys.path.insert(0, str(folder / "resources"))
import numpy as np
from elastic_robot.description import Robot
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand
TURN, TURNS, SIZE = 30, 3334, 1 / 256
fmu.instantiate()
fmu.setupExperiment()
fmu.enterInitializationMode()
fmu.exitInitializationMode()
robot = Robot.from_json((folder / "resources" / "robot.json").read_text())
model, rest, none = ElasticRobot(robot), np.zeros(len(robot.joints)), np.zeros(6)
model.reset(0.0, HeldCommand(0.0, rest, rest, rest), Load(none))
best = [np.inf, np.inf]
for turn in range(TURNS):
    start = time.perf_counter()
    for k in range(TURN * turn, TURN * (turn + 1)):
        step(k, SIZE)
    middle = time.perf_counter()
    for k in range(TURN * turn, TURN * (turn + 1)):
        model.step((k + 1) * SIZE, HeldCommand(k * SIZE, rest, rest, rest), Load(none))
        model.tcp()
    end = time.perf_counter()
    best = [min(best[0], middle - start), min(best[1], end - middle)]
print(*[1e6 * b / TURN for b in best])
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


def rigid(robot: Robot) -> Robot:
    """Return the robot's first joint without any elasticity: what remains is mostly interface."""
    first = replace(robot.joints[0], stiffness=None, damping=0.0, backlash=0.0, torque_table=None)
    return replace(robot, joints=(replace(first, tilt=()),))


def over_the_model(folder: Path) -> tuple[float, float]:
    """Return the cost of a step through FMPy and of the model's own [us]."""
    command = [sys.executable, "-c", _OVER_THE_MODEL, str(folder)]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    fmu, model = map(float, said.split())
    return fmu, model


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
        trivial = rigid(ROBOT)
        folder = Path(
            fmpy.extract(str(build_fmu(trivial, folder / "rigid.fmu", BuildOptions("python"))))
        )
        rigid_fmu, rigid_model = over_the_model(folder)
    console.print(table)
    state, step = costs["state", 0.0], costs["step", 4e-3]
    console.print(f"state saved and restored: {state:.2f} us")
    verdict = "reached" if step <= GOAL else "not reached"
    overhead = rigid_fmu - rigid_model
    verdict_overhead = "reached" if overhead <= OVERHEAD_GOAL else "not reached"
    console.print(
        f"python FMU of one rigid joint through FMPy: {rigid_fmu:.0f} us, its model"
        f" {rigid_model:.0f} us, over it {overhead:.0f} us (at most {OVERHEAD_GOAL:g};"
        f" {verdict_overhead})"
    )
    console.print(f"4 ms from C: {step:.2f} us (at most {GOAL:g}; {verdict})")
    columns = costs["columns", 4e-3]
    verdict = "reached" if columns <= COLUMNS_GOAL else "not reached"
    console.print(f"{_COLUMNS}: {columns:.1f} us (at most {COLUMNS_GOAL:g}; {verdict})")


if __name__ == "__main__":
    main()

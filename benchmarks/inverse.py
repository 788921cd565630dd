"""Time and memory of the inverse of the moving robot: its parts, half the path, other runs of the path.

    python -m benchmarks.inverse                       about 5 minutes
    python -m benchmarks.inverse --part 0.1            a quick look at the paths' beginnings
    python -m benchmarks.inverse --page performance    and write the table of docs/performance.md

One run on one core, in time of this process on it, which others on the machine do not lengthen as
they do wall time.  What is timed is from the path and the wrench to the command on a cycle of 4 ms,
without the polish on the simulated robot and without simulations.
"""

import os

for _library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_library] = "1"

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from benchmarks.goals import Goal
from benchmarks.inverse_tasks import InverseTask, cone_task, iso_task
from benchmarks.stopwatch import timed
from benchmarks.task import ROBOT
from coupling.fmu.driver import load
from coupling.fmu.job import SimulationJob
from coupling.fmu.worker import unpack
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.inverse.inversion import DesiredMotion, MovingRobot, joint_path
from coupling.inverse.joint_limits import JointLimits
from coupling.native.desk_library import loaded_library
from coupling.path.controller import Controller
from coupling.path.joint_path import JointPath
from coupling.robot.fmu_signals import POSE_OUTPUTS, WRENCH_INPUTS, save_trajectory
from docs.scripts.page import replace, table
from elastic_robot.fmi.interface import Mode

CURVES = ("linear", "backlash", "spline")
PARTS = ("plan", "links", "drives")
# Communication step of the peers [s].
_PERIOD = 4e-3
# Goals: time on one core [s] with backlash, ratio of whole to half, memory of a long path [GB].
LONGEST = {"ISO 9283, 0.25 m/s": 0.4, "cone": 2.5}
_WHOLE_OVER_HALF = 2.3
_MEMORY = 0.35
# Number of times that the cone is gone along for the long path: 602 s.
_LONG = 4


@dataclass(frozen=True)
class InverseRow:
    """A line of the table; times in [s] of the process on its core.

    Attributes:
        task: Name of the task.
        curve: Torque curve.
        duration: Length of the path [s].
        parts: Times of PARTS.
        half: Time of the inverse of half the path, without planning.
        peers: Times of other runs of the path, by name.
    """

    task: str
    curve: str
    duration: float
    parts: dict[str, float]
    half: float
    peers: dict[str, float]

    @property
    def inverse(self) -> float:
        """Time of the inverse: all but planning."""
        return sum(spent for part, spent in self.parts.items() if part != "plan")


def inverted(wanted: DesiredMotion, curve: str) -> tuple[dict[str, float], JointPath]:
    """Return the times that parts of the inverse took, and the command."""
    moving, parts = MovingRobot(ROBOT, curve), dict.fromkeys(PARTS[1:], 0.0)
    last = time.process_time()

    def progress(what: str, done: int, total: int) -> None:
        nonlocal last
        now = time.process_time()
        parts[what] += now - last
        last = now

    found = moving.invert(wanted, Controller(_PERIOD), JointLimits.of(ROBOT, None), progress)
    return parts, joint_path(found.command)


def measured(task: InverseTask, curve: str, peers: bool = True) -> InverseRow:
    """Return the line of a task and a curve."""
    plan, _ = timed(lambda: task.plan().q[0])
    wanted = task.wanted()
    parts, command = _best(wanted, curve)
    half, _ = _best(task.first(0.5).wanted(), curve)
    others = _peers(task, curve, command) if peers else {}
    return InverseRow(
        task.name, curve, task.duration, {"plan": plan, **parts}, sum(half.values()), others
    )


def _best(wanted: DesiredMotion, curve: str) -> tuple[dict[str, float], JointPath]:
    """Return the shorter of two runs."""
    runs = [inverted(wanted, curve) for _ in range(2)]
    return min(runs, key=lambda run: sum(run[0].values()))


def _peers(task: InverseTask, curve: str, command: JointPath) -> dict[str, float]:
    """Return the times of simulations of the command under the task's wrench."""
    start, end = command.time[0], task.path.time[-1]
    times = start + _PERIOD * np.arange(int((end - start) / _PERIOD + 1e-9) + 1)
    # Peers hold a force over a step: its mean.
    (loads,) = task.wrench.at(np.append(times[:1], 0.5 * (times[1:] + times[:-1])))

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        save_trajectory(folder / "command.npz", command)
        unpack(build_fmu(ROBOT, folder / "Robot.fmu", BuildOptions("native")), folder / "fmu")
        driver = load(folder / "fmu", loaded_library())
        inputs, outputs = WRENCH_INPUTS[:6], POSE_OUTPUTS

        def native(mode: Mode) -> float:
            settings = {
                "torque_curve": curve,
                "mode": mode,
                "trajectory": str(folder / "command.npz"),
            }
            job = SimulationJob(settings, times, inputs, loads, outputs, len(outputs))
            return timed(lambda: driver.run(job, lambda done, total: None))[0]

        return {
            "native FMU": native("dynamic"),
            "quasi-static pass": native("quasistatic"),
        }


def goals(rows: list[InverseRow], memory: tuple[float, float] | None) -> list[Goal]:
    """Return the goals; memory [GB] after the length of the path that took it [s]."""
    found = []
    for row in rows:
        if row.curve != "backlash":
            continue
        which, most = f"{row.task} ({row.duration:.0f} s), {row.curve}", LONGEST[row.task]
        text = f"{which}, time of the inverse [s]"
        found.append(Goal(text, f"at most {most:g}", row.inverse, row.inverse <= most))
        ratio = row.inverse / row.half
        text = f"{which}, time of the whole path over that of its half"
        found.append(Goal(text, f"at most {_WHOLE_OVER_HALF:g}", ratio, ratio <= _WHOLE_OVER_HALF))
    if memory is not None:
        text = f"a path of {memory[0]:.0f} s, largest memory [GB]"
        found.append(Goal(text, f"below {_MEMORY:g}", memory[1], memory[1] < _MEMORY))
    return found


def long_path() -> tuple[float, float, float]:
    """Return length [s] and time [s] of a long path, and the memory [GB] that a process took for it."""
    command = [sys.executable, "-m", "benchmarks.inverse", "--long"]
    answer = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    length, spent, memory = (float(number) for number in answer)
    return length, spent, memory


def _invert_long_path() -> None:
    task = cone_task().there_and_back(_LONG)
    spent = sum(inverted(task.wanted(), "backlash")[0].values())
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
    print(task.duration, spent, memory)  # what `long_path` reads


def lines(rows: list[InverseRow]) -> str:
    """Return the table."""
    names = list(rows[0].peers)
    head = ("path", "curve", *(f"{part} [s]" for part in PARTS), "inverse [s]", "whole / half")
    body = [
        (
            f"{row.task}, {row.duration:.0f} s",
            f"`{row.curve}`",
            *(f"{row.parts[part]:.2f}" for part in PARTS),
            f"{row.inverse:.2f}",
            f"{row.inverse / row.half:.2f}",
            *(f"{row.inverse / row.peers[name]:.2f}" for name in names),
        )
        for row in rows
    ]
    return table((*head, *(f"/ {name}" for name in names)), body)


def main() -> None:
    """Print the table and what it says of the goals."""
    parser = argparse.ArgumentParser(description="Time and memory of the inverse.")
    parser.add_argument("--part", type=float, default=1.0, help="of each path, from its start")
    parser.add_argument("--page", help="name of the page that takes the table")
    parser.add_argument("--long", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.long:
        _invert_long_path()
        return
    console, rows, memory = Console(), [], None
    for task in (iso_task(), cone_task()):
        for curve in CURVES:
            with console.status(f"{task.name}, {curve}"):
                rows.append(measured(task.first(options.part), curve))
    text = lines(rows)
    if options.part == 1.0:
        with console.status("a long path"):
            length, spent, gigabytes = long_path()
        memory = length, gigabytes
        text += f"\n\n{length:.0f} s of path, there and back along the cone with backlash:"
        text += f" {spent:.1f} s, {gigabytes:.2f} GB."
    print(f"{text}\n\nGoals of that run:\n")
    print("\n".join(f"- {goal}" for goal in goals(rows, memory)))
    if options.page:
        replace(options.page, "inverse", text)


if __name__ == "__main__":
    main()

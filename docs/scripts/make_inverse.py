"""Write the tables of docs/inverse.md: make inverse.

Deviations are those of a command as it stands in a run folder, replayed through the native FMU by
tests/helpers/replay.py, a program of its own; on other robots, those of the run.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.run.execute import run_compensation
from coupling.run.folder import write_run
from docs.scripts import inverse_servos
from docs.scripts.experiment import Page, results
from docs.scripts.page import table
from docs.scripts.runs import example, replays

REPLAY = Path(__file__).parents[2] / "tests" / "helpers" / "replay.py"
ONE_ROUND = {"max_rounds": 1}
CYCLES = (1, 2, 4, 8, 12, 20)  # [ms]
PAGE = Page("inverse")


@dataclass(frozen=True)
class Motion:
    """A path of the examples.

    Attributes:
        title: Its name in the tables.
        example: Case.
        keys: Keys of [tool_path] that are changed.
    """

    title: str
    example: str
    keys: Mapping[str, Any]


CONE = Motion("cone, 0.05 m/s", "cone", {})
ISO = Motion("ISO 9283, 0.1 m/s", "iso9283", {})
# Samples as close as the replay looks: what lies between them is no question.
_CLOSE = {"sample_s": 0.004}
SLOW = Motion("ISO 9283, 0.25 m/s", "iso9283", {"feed_m_s": 0.25, **_CLOSE})
FAST = Motion("ISO 9283, 1 m/s", "iso9283", {"feed_m_s": 1.0, **_CLOSE})


@dataclass(frozen=True)
class Replayed:
    """What a command does on the moving robot.

    Attributes:
        maximum, rms: Deviation of the tool every 4 ms [um].
        acceleration: Largest one of any drive, between the rows too [rad/s^2].
        evaluations: Of the process, to find it.
        converged: Whether its method is content with it.
    """

    maximum: float
    rms: float
    acceleration: float
    evaluations: int
    converged: bool

    @classmethod
    def of(cls, motion: Motion, **tables: Mapping[str, Any]) -> Replayed:
        """Correct the command of a path, with keys of the case's tables changed, and replay it."""
        case = example(motion.example, tool_path=motion.keys, **tables)
        run = run_compensation(case)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write_run(folder, case, run)
            robot = case.robots[0].description
            fmu = build_fmu(robot, folder / "robot.fmu", BuildOptions("native"))
            command = [sys.executable, str(REPLAY), str(folder), str(fmu)]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
        answer = json.loads(done.stdout)
        largest = max(answer["command"]["max_acceleration_rad_s2"])
        found = run.correction
        return cls(answer["max_um"], answer["rms_um"], largest, found.evaluations, found.converged)

    def __str__(self) -> str:
        return f"{_figure(self.maximum)} / {_figure(self.rms)}"

    def effort(self) -> str:
        """Return the evaluations of the process, in words."""
        return f"{self.evaluations}{'' if self.converged else ', not converged'}"


@PAGE.part
def methods() -> str:
    """Return what the commands of both methods leave on the moving robot."""
    mirror = {"robot": {"mode": "quasistatic"}, "compensation": {"method": "mirror"}}
    return results(
        ("path",),
        {motion.title: motion for motion in (CONE, ISO, SLOW, FAST)},
        lambda motion: (Replayed.of(motion), Replayed.of(motion, **mirror)),
        {
            "`inverse`, max / rms [um]": lambda both: str(both[0]),
            "evaluations": lambda both: both[0].effort(),
            "`mirror`, max / rms [um]": lambda both: str(both[1]),
            "evaluations ": lambda both: both[1].effort(),
        },
    )


@PAGE.part
def cycles() -> str:
    """Return deviation against the controller's cycle."""

    def both(cycle: float) -> list[Replayed]:
        return [
            Replayed.of(
                SLOW,
                controller={"cycle_s": 1e-3 * cycle, "interpolation": interpolation},
                compensation=ONE_ROUND,
            )
            for interpolation in ("quintic", "cubic")
        ]

    return results(
        ("cycle",),
        {f"{cycle} ms": cycle for cycle in CYCLES},
        both,
        {
            "quintic, max / rms [um]": lambda found: str(found[0]),
            "[rad/s²]": lambda found: f"{found[0].acceleration:.0f}",
            "cubic, max / rms [um]": lambda found: str(found[1]),
            "[rad/s²] ": lambda found: f"{found[1].acceleration:.0f}",
        },
    )


@PAGE.part
def robustness() -> str:
    """Return what a command leaves on robots that are not quite the model, as its run tells."""
    columns: dict[str, dict[str, float]] = {}
    for motion in (CONE, SLOW):
        run = run_compensation(example(motion.example, tool_path=motion.keys))
        columns[f"{motion.title}, max [um]"] = {
            "as in its file": run.correction.iterations[-1].deviation.maximum,
            **{name: deviation.maximum for name, deviation in replays(run).items()},
        }
    names = list(dict.fromkeys(name for column in columns.values() for name in column))
    rows = (
        [name, *(_figure(1e6 * c[name]) if name in c else "" for c in columns.values())]
        for name in names
    )
    return table(("robot", *columns), rows)


PAGE.part(inverse_servos.servos)


def _figure(value: float) -> str:
    return f"{value:.2g}" if value < 10.0 else f"{value:.0f}"


if __name__ == "__main__":
    PAGE.write()

"""Write the tables and the picture of docs/inverse.md: make inverse.

Deviations are those of a command as it stands in a run folder, replayed through the native FMU by
tests/helpers/replay.py, a program of its own; on other robots, those of the run.  With names, only those
parts:
python docs/scripts/make_inverse.py limits crossing.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from coupling.errors import PlanningError
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.run.execute import run_compensation
from coupling.run.folder import write_run
from docs.scripts import inverse_crossing, inverse_servos
from docs.scripts.page import finish, replace_parts, table
from docs.scripts.pictures import save
from docs.scripts.runs import example

JUDGE = Path(__file__).parents[2] / "tests" / "helpers" / "replay.py"
ONE_ROUND = {"max_rounds": 1}
CYCLES = (1, 2, 4, 8, 12, 20)  # [ms]


@dataclass(frozen=True)
class Motion:
    """A path of the examples.

    Attributes:
        title: Its name in the tables.
        example: Case.
        keys: Keys of [tool_path] that are changed.
        limits: Largest accelerations of the drives that are tried [rad/s^2].
    """

    title: str
    example: str
    keys: Mapping[str, Any]
    limits: tuple[float | None, ...]


CONE = Motion("cone, 0.05 m/s", "cone", {}, (None, 2, 1))
ISO = Motion("ISO 9283, 0.1 m/s", "iso9283", {}, ())
# Samples as close as the judge looks: what lies between them is no question.
SLOW = Motion(
    "ISO 9283, 0.25 m/s", "iso9283", {"feed_m_s": 0.25, "sample_s": 0.004}, (None, 12, 9, 5)
)
FAST = Motion(
    "ISO 9283, 1 m/s", "iso9283", {"feed_m_s": 1.0, "sample_s": 0.004}, (None, 18, 15, 12)
)


@dataclass(frozen=True)
class Judged:
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

    def __str__(self) -> str:
        return f"{_figure(self.maximum)} / {_figure(self.rms)}"


def judged(motion: Motion, **tables: Mapping[str, Any]) -> Judged:
    """Correct a command and replay it.

    Args:
        motion: Path.
        tables: Keys of the case's tables that are changed.

    Raises:
        PlanningError: If the path asks for more than the drives can do.
    """
    case = example(motion.example, tool_path=motion.keys, **tables)
    run = run_compensation(case)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_run(folder, case, run)
        fmu = build_fmu(case.robots[0].description, folder / "robot.fmu", BuildOptions("native"))
        done = subprocess.run(
            [sys.executable, JUDGE, folder, fmu], check=True, capture_output=True, text=True
        )
    answer = json.loads(done.stdout)
    found = Judged(
        answer["max_um"],
        answer["rms_um"],
        max(answer["command"]["max_acceleration_rad_s2"]),
        run.correction.evaluations,
        run.correction.converged,
    )
    print(motion.title, tables, found, f"{found.acceleration:.3g} rad/s^2", flush=True)
    return found


def methods() -> str:
    """Return what the commands of both methods leave on the moving robot."""
    rows = []
    for motion in (CONE, ISO, SLOW, FAST):
        inverse = judged(motion)
        mirror = judged(motion, robot={"mode": "quasistatic"}, compensation={"method": "mirror"})
        row = [motion.title]
        for found in (inverse, mirror):
            row += [
                str(found),
                f"{found.evaluations}{'' if found.converged else ', not converged'}",
            ]
        rows.append(row)
    head = ("path", "`inverse`, max / rms [um]", "evaluations", "`mirror`, max / rms [um]")
    return table((*head, "evaluations"), rows)


def cycles() -> str:
    """Return deviation against the controller's cycle."""
    rows = []
    for cycle in CYCLES:
        cells = [f"{cycle} ms"]
        for interpolation in ("quintic", "cubic"):
            found = judged(
                SLOW,
                controller={"cycle_s": 1e-3 * cycle, "interpolation": interpolation},
                compensation=ONE_ROUND,
            )
            cells += [str(found), f"{found.acceleration:.0f}"]
        rows.append(cells)
    head = ("cycle", "quintic, max / rms [um]", "[rad/s²]", "cubic, max / rms [um]", "[rad/s²]")
    return table(head, rows)


def limits() -> str:
    """Return deviation against the largest acceleration of the drives."""
    rows = []
    for motion in (CONE, SLOW, FAST):
        for limit in motion.limits:
            keys = {} if limit is None else {"max_acceleration_rad_s2": float(limit)}
            asked = "none" if limit is None else f"{limit:g}"
            try:
                found = judged(motion, controller=keys, compensation=ONE_ROUND)
                cells = [str(found), f"{found.acceleration:.3g}"]
            except PlanningError as refusal:
                print(motion.title, limit, refusal, flush=True)
                cells = ["refused", ""]
            rows.append([motion.title, asked, *cells])
    return table(("path", "limit [rad/s²]", "max / rms [um]", "used [rad/s²]"), rows)


def robustness() -> str:
    """Return what a command leaves on robots that are not quite the model, as its run tells."""
    found = {}
    for motion in (CONE, SLOW):
        run = run_compensation(example(motion.example, tool_path=motion.keys))
        found[motion.title] = {
            "as in its file": run.correction.iterations[-1].deviation.maximum,
            **{replay.name: replay.deviation.maximum for replay in run.robustness},
        }
    names = list(dict.fromkeys(name for column in found.values() for name in column))
    rows = (
        [
            name,
            *(_figure(1e6 * column[name]) if name in column else "" for column in found.values()),
        ]
        for name in names
    )
    return table(("robot", *(f"{title}, max [um]" for title in found)), rows)


def crossing() -> str:
    """Draw a backlash reversal, and return its caption."""
    found = inverse_crossing.crossing()
    save("inverse_crossing", inverse_crossing.drawn(found))
    return found.caption


def _figure(value: float) -> str:
    return f"{value:.2g}" if value < 10.0 else f"{value:.0f}"


PARTS: dict[str, Callable[[], str]] = {
    "crossing": crossing,
    "servos": inverse_servos.servos,
    "cycles": cycles,
    "limits": limits,
    "robustness": robustness,
    "methods": methods,
}


if __name__ == "__main__":
    sys.exit(finish(lambda: replace_parts("inverse", PARTS, sys.argv[1:])))

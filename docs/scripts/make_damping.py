"""Write the table of docs/robot_file.md on damping from real runs: make damping."""

from __future__ import annotations

import tempfile
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import tomlkit

from coupling.files.robot_file import shipped_robots
from coupling.path.deviation import Deviation
from coupling.run.plant import PLANT_REPLAY
from docs.scripts.experiment import Page, results, um
from docs.scripts.runs import compensated, example

ROBOT, RATIO = "icme2008", 0.04
CASES = {
    "cone": "cone",
    "ISO 9283 path": "iso9283",
    "slot at 20 000 1/min": "milling_20000",
    "slot at 40 000 1/min": "milling_40000",
}
PAGE = Page("robot_file")


@dataclass(frozen=True)
class Left:
    """Deviations of a case, not corrected and corrected, by dampers as they are and by a ratio."""

    before: Deviation
    before_by_ratio: Deviation
    after: Deviation
    on_other: Deviation


def _write_damped(folder: Path) -> Path:
    """Write the robot with a damping ratio; return the file."""
    data = tomllib.loads(shipped_robots()[ROBOT].read_text(encoding="utf-8"))
    for joint in data["joint"]:
        for part in (joint, *joint.get("tilt", [])):
            part.pop("damping", None)
    data["sources"] = {k: v for k, v in data["sources"].items() if not k.endswith("damping")}
    data["modal_damping"] = {"ratio": RATIO}
    file = folder / "damped.toml"
    file.write_text(tomlkit.dumps(data), encoding="utf-8")
    return file


@cache
def _left(name: str) -> Left:
    with tempfile.TemporaryDirectory() as folder:
        damped = str(_write_damped(Path(folder)))
        run = compensated(example(name, plant={"description": damped}))
        plant = run.of(PLANT_REPLAY)
        assert plant is not None
        other = compensated(example(name, robot={"description": damped}))
    return Left(
        run.deviation(run.before),
        other.deviation(other.before),
        run.deviation(run.correction.achieved),
        plant.deviation(),
    )


@PAGE.part
def damping() -> str:
    """Return the table of deviations by damping."""
    columns = {
        "not corrected, dampers of the file": lambda left: um(left.before.rms, 3),
        f"ratio {RATIO}": lambda left: um(left.before_by_ratio.rms, 3),
        "corrected, as modelled": lambda left: um(left.after.rms, 3),
        f"that command on the robot of ratio {RATIO}": lambda left: um(left.on_other.rms, 3),
    }
    return results(("rms [um]",), CASES, _left, columns)


if __name__ == "__main__":
    PAGE.write()

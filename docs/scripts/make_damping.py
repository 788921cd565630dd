"""Write the table of docs/robot_file.md on damping from real runs: make damping."""

from __future__ import annotations

import tempfile
import tomllib
from operator import itemgetter
from pathlib import Path

import tomlkit

from coupling.files.robot_file import shipped_robots
from docs.scripts.experiment import Page, results, um
from docs.scripts.runs import compensated, example, replays

ROBOT, RATIO = "icme2008", 0.04
CASES = {
    "cone": "cone",
    "ISO 9283 path": "iso9283",
    "slot at 20 000 1/min": "milling_20000",
    "slot at 40 000 1/min": "milling_40000",
}
PAGE = Page("robot_file")


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


def _left(name: str) -> list[str]:
    """Return the deviations of a case, not corrected by either dampers, and corrected on either."""
    with tempfile.TemporaryDirectory() as folder:
        damped = str(_write_damped(Path(folder)))
        run = compensated(example(name, plant={"description": damped}))
        other = compensated(example(name, robot={"description": damped}))
    deviations = (
        run.deviation(run.before),
        other.deviation(other.before),
        run.deviation(run.correction.achieved),
        replays(run)["plant"],
    )
    return [um(deviation.rms, 3) for deviation in deviations]


@PAGE.part
def damping() -> str:
    """Return the table of deviations by damping."""
    heads = (
        "not corrected, dampers of the file",
        f"ratio {RATIO}",
        "corrected, as modelled",
        f"that command on the robot of ratio {RATIO}",
    )
    columns = {head: itemgetter(k) for k, head in enumerate(heads)}
    return results(("rms [um]",), CASES, _left, columns)


if __name__ == "__main__":
    PAGE.write()

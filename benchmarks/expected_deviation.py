"""How often the deviation on a robot drawn from stated ranges lies in the interval that a run states.

    python -m benchmarks.expected_deviation [--plants 100] [--coupled] [--page] [CASE ...]

Plants are drawn here from what the robot's file says, without the code that draws those of the
interval.  The robot of the shipped cases states no `stiffness_range`: that of each of its gears is
taken for two thirds to one and a half of its stiffness.  The last row is a KUKA KR 210 with the ranges
of its file.  With `--coupled` the process answers to each plant's path.  `--page` writes the table into
docs/study.md.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.case.file import load_case
from coupling.errors import CouplingError
from coupling.events import unwatched
from coupling.files.robot_file import find_robot
from coupling.path.deviation import measure
from coupling.results.outlook import DrawnDeviation
from coupling.robot.cell import Cell
from coupling.robot.differences import RobotDifference
from coupling.robot.simulated_model import SimulatedModel
from coupling.run.execute import Run, run_compensation
from coupling.run.expected_robots import DRAWN_ROBOTS
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.run.plant import coupled_on
from docs.scripts.page import replace as replace_part
from docs.scripts.page import table

EXAMPLES = Path(__file__).parents[1] / "examples"
SHIPPED = ("measured_line", "gcode_groove", "iso9283", "cone", "milling_20000")
# Range of a gear of which the file states none, over its stiffness.
_SPREAD = 1.5
_SEED = 2026
_HEAD = (
    "case",
    "stated interval [um]",
    "plants, smallest to largest [um]",
    "held, uniform in the logarithm [%]",
    "held, uniform [%]",
)


@dataclass(frozen=True)
class Coverage:
    """Interval of a case's command, and the deviations of plants under it.

    Attributes:
        name: Name of the case.
        stated: The interval.
        largest: Deviation of plants whose stiffness is uniform in its logarithm, and of those whose
            stiffness is uniform [m], (plants,) each.
    """

    name: str
    stated: DrawnDeviation
    largest: tuple[np.ndarray, np.ndarray]

    @property
    def row(self) -> tuple[str, ...]:
        """Row of the table."""
        low, high = self.stated.low, self.stated.high
        both = np.concatenate(self.largest)
        held = (f"{100.0 * np.mean((low <= own) & (own <= high)):.0f}" for own in self.largest)
        span = f"{1e6 * both.min():.0f} to {1e6 * both.max():.0f}"
        return (self.name, f"{1e6 * low:.0f} to {1e6 * high:.0f}", span, *held)


def stated_ranges(placed: PlacedRobot, file: Path) -> list[tuple[float, float] | None]:
    """Return the lowest and highest stiffness of each joint over the model's, as a robot's file says."""
    tables = tomllib.loads(file.read_text(encoding="utf-8"))["joint"]
    ranges: list[tuple[float, float] | None] = []
    for joint, own in zip(placed.description.joints, tables, strict=True):
        if joint.stiffness is None:
            ranges.append(None)
            continue
        low, high = own.get(
            "stiffness_range", (joint.stiffness / _SPREAD, joint.stiffness * _SPREAD)
        )
        ranges.append((low / joint.stiffness, high / joint.stiffness))
    return ranges


def with_ranges(placed: PlacedRobot) -> PlacedRobot:
    """Return a robot of which every gear has a range."""
    ranges = {
        number: (joint.stiffness / _SPREAD, joint.stiffness * _SPREAD)
        for number, joint in enumerate(placed.description.joints, start=1)
        if joint.stiffness is not None
    }
    ranges |= placed.provenance.stiffness_ranges
    return replace(placed, provenance=replace(placed.provenance, stiffness_ranges=ranges))


def on_a_kuka(folder: Path) -> Path:
    """Write the case of the groove for a KUKA KR 210, and return its file."""
    text = (EXAMPLES / "cases" / "gcode_groove.toml").read_text(encoding="utf-8")
    for old, new in (
        ('"icme2008"', f'"{EXAMPLES / "robots" / "kuka_kr210.toml"}"'),
        ('"../toolpaths/', f'"{EXAMPLES / "toolpaths"}/'),
    ):
        assert old in text
        text = text.replace(old, new)
    file = folder / "gcode_groove_kuka_kr210.toml"
    file.write_text(text, encoding="utf-8")
    return file


def deviation_of(
    case: Case,
    run: Run,
    cell: Cell,
    models: Sequence[SimulatedModel],
    differences: Sequence[RobotDifference],
    force: float,
    coupled: bool,
) -> float:
    """Return what a command leaves on a plant [m]."""
    pairs = zip(models, differences, strict=True)
    plant = cell.with_robots([model.differing(own, "a plant") for model, own in pairs])
    found = run.correction
    loads = found.response.wrench.scaled(force)
    if coupled:
        answer = coupled_on(case, plant, force, found.joints, found.achieved, unwatched)
        loads = answer.response.wrench
    return measure(plant.simulate(found.joints, loads, "dynamic"), found.desired).maximum


def coverage(case: Case, plants: int, coupled: bool) -> Coverage:
    """Return how many plants of a case lie in its interval.

    Raises:
        CouplingError: If the case cannot be run, or a plant not be simulated.
    """
    run = run_compensation(case)
    stated = DrawnDeviation.among(run.finding_of(DRAWN_ROBOTS))
    assert stated is not None
    tables = ("robot", "support")[: len(case.robots)]
    files = [find_robot(case.resolved[name]["description"]) for name in tables]
    ranges = [stated_ranges(*pair) for pair in zip(case.robots, files, strict=True)]
    low, high = case.process_table.FORCE_FACTORS or (1.0, 1.0)
    chance = np.random.default_rng(_SEED)
    with FmuPool(case.fmu) as fmus:
        cell, models = cell_of(case.robots, fmus)
        largest: tuple[list[float], list[float]] = ([], [])
        for logarithmic, deviations in zip((True, False), largest, strict=True):
            for _ in range(plants):
                differences = [
                    RobotDifference(
                        {
                            "stiffness": tuple(
                                _drawn(limits, chance, logarithmic) for limits in robot
                            )
                        }
                    )
                    for robot in ranges
                ]
                force = float(chance.uniform(low, high))
                deviations.append(
                    deviation_of(case, run, cell, models, differences, force, coupled)
                )
    return Coverage(case.name, stated, (np.array(largest[0]), np.array(largest[1])))


def _drawn(
    limits: tuple[float, float] | None, chance: np.random.Generator, logarithmic: bool
) -> float:
    """Return a stiffness over the model's."""
    if limits is None:
        return 1.0
    if logarithmic:
        return math.exp(chance.uniform(math.log(limits[0]), math.log(limits[1])))
    return float(chance.uniform(*limits))


def main() -> None:
    """Print a row for each case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", type=Path)
    parser.add_argument("--plants", type=int, default=100)
    parser.add_argument("--coupled", action="store_true")
    parser.add_argument("--store", type=Path, help="store of evaluations of the cases' processes")
    parser.add_argument("--page", action="store_true")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        shipped = [EXAMPLES / "cases" / f"{name}.toml" for name in SHIPPED]
        for file in options.cases or [*shipped, on_a_kuka(Path(folder))]:
            begin = time.perf_counter()
            try:
                case = load_case(str(file))
                robots = tuple(map(with_ranges, case.robots))
                process = case.evaluated_process(options.store)
                found = coverage(
                    replace(case, robots=robots, process=process), options.plants, options.coupled
                )
            except CouplingError as error:
                print(f"{file.stem}: {error}", flush=True)
                continue
            rows.append(found.row)
            print(*found.row, f"({time.perf_counter() - begin:.0f} s)", sep="; ", flush=True)
    if options.page:
        replace_part("study", "plants", table(_HEAD, rows))


if __name__ == "__main__":
    main()

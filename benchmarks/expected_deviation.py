"""How often the deviation on a robot drawn from stated ranges lies in the interval that a run states.

    python -m benchmarks.expected_deviation [--plants 100] [--coupled] [CASE ...]

Where a robot file states no `stiffness_range`, that of each gear is taken for two thirds to one and a
half of its stiffness.  Plants are drawn at random, independent of the robots of the interval; with
`--coupled` the process answers to their own path.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.case.file import load_case
from coupling.errors import CouplingError
from coupling.events import unwatched
from coupling.path.deviation import measure
from coupling.results.outlook import DrawnDeviation
from coupling.robot.differences import RobotDifference
from coupling.run.execute import run_compensation
from coupling.run.models import Models, cell_of
from coupling.run.plant import coupled_on

CASES = Path(__file__).parents[1] / "examples" / "cases"
SHIPPED = ("cone", "gcode_groove", "measured_line", "bm3", "iso9283")
# Range of a gear of which the file states none, over its stiffness.
_SPREAD = 1.5


def with_ranges(placed: PlacedRobot) -> PlacedRobot:
    """Return a robot of which every gear has a range."""
    ranges = {
        number: (joint.stiffness / _SPREAD, joint.stiffness * _SPREAD)
        for number, joint in enumerate(placed.description.joints, start=1)
        if joint.stiffness is not None
    }
    ranges |= placed.provenance.stiffness_ranges
    return replace(placed, provenance=replace(placed.provenance, stiffness_ranges=ranges))


def deviations(case: Case, plants: int, coupled: bool) -> tuple[DrawnDeviation, np.ndarray]:
    """Return the interval of a case's command, and the deviation of each plant under it [m], (plants,).

    Raises:
        CouplingError: If the case cannot be run, or a plant not be simulated.
    """
    run = run_compensation(case)
    stated = DrawnDeviation.among(run.drawn, run.basis)
    assert stated is not None
    found, error = run.correction, case.process_table.FORCE_ERROR or 0.0
    chance = np.random.default_rng(2)
    largest = []
    with Models(case.fmu) as fmus:
        cell, models = cell_of(case.robots, fmus)
        for _ in range(plants):
            robots = []
            for placed, model in zip(case.robots, models, strict=True):
                factors = [1.0] * len(placed.description.joints)
                for number, (low, high) in placed.provenance.stiffness_ranges.items():
                    stiffness = placed.description.joints[number - 1].stiffness
                    assert stiffness is not None
                    factors[number - 1] = low * (high / low) ** chance.random() / stiffness
                difference = RobotDifference({"stiffness": tuple(factors)})
                robots.append(model.differing(difference, "a plant"))
            plant = cell.with_robots(robots)
            force, loads = 1.0 + error * chance.uniform(-1.0, 1.0), found.response.wrench
            loads = loads.scaled(force)
            if coupled:
                answer = coupled_on(case, plant, force, found.joints, found.achieved, unwatched)
                loads = answer.response.wrench
            path = plant.simulate(found.joints, loads, "dynamic")
            largest.append(measure(path, found.desired).maximum)
    return stated, np.array(largest)


def main() -> None:
    """Print a row for each case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "cases", nargs="*", default=[str(CASES / f"{name}.toml") for name in SHIPPED]
    )
    parser.add_argument("--plants", type=int, default=100)
    parser.add_argument("--coupled", action="store_true")
    options = parser.parse_args()
    for file in options.cases:
        begin = time.perf_counter()
        try:
            case = load_case(file)
            case = replace(case, robots=tuple(map(with_ranges, case.robots)))
            stated, largest = deviations(case, options.plants, options.coupled)
        except CouplingError as error:
            print(f"{Path(file).stem}: {error}")
            continue
        share = float(np.mean((stated.low <= largest) & (largest <= stated.high)))
        seconds = time.perf_counter() - begin
        print(
            f"{case.name}: stated {1e6 * stated.low:.0f} to {1e6 * stated.high:.0f} um, plants"
            f" {1e6 * largest.min():.0f} to {1e6 * largest.max():.0f} um, {100.0 * share:.0f} % within"
            f" ({seconds:.0f} s)",
            flush=True,
        )


if __name__ == "__main__":
    main()

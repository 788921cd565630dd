"""Loads along a path beside what the robots are rated for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from coupling.case.case import PlacedRobot
from coupling.files.ratings import Ratings
from coupling.path.histories import WrenchHistory
from coupling.results.gear_result import GearDiagnosis
from coupling.results.limit_warning import LimitWarning


def load_warnings(
    robots: Sequence[PlacedRobot],
    wrench: WrenchHistory,
    gears: Sequence[Sequence[GearDiagnosis]],
) -> tuple[LimitWarning, ...]:
    """Return one warning for each rated load and each gear's torque that is passed."""
    return tuple(
        warning
        for placed, load, gear_loads in zip(robots, wrench.tools, gears, strict=True)
        for warning in exceeded(
            placed.ratings, load, gear_loads, placed.name if len(robots) > 1 else ""
        )
    )


def exceeded(
    ratings: Ratings, wrench: WrenchHistory, gears: Sequence[GearDiagnosis], robot: str = ""
) -> Iterator[LimitWarning]:
    """Yield a warning for each rating of one robot that is passed."""
    force = np.linalg.norm(wrench.force[0], axis=1)
    worst = int(force.argmax())
    if ratings.payload is not None and force[worst] > ratings.payload:
        time = float(wrench.time[worst])
        yield LimitWarning.of("payload", float(force[worst]), ratings.payload, time, robot=robot)
    for gear in gears:
        at = gear.torque_time, gear.joint, robot
        effort = ratings.efforts.get(gear.joint)
        if effort is not None and gear.torque > effort:
            yield LimitWarning.of("effort", gear.torque, effort, *at)
        rated = ratings.gears.get(gear.joint)
        if rated is None:
            continue
        # The graver of both is the one that is said.
        limits = {"gear-torque-emergency": rated.emergency, "gear-torque-peak": rated.peak}
        for name, limit in limits.items():
            if limit is not None and gear.torque > limit:
                yield LimitWarning.of(name, gear.torque, limit, *at)
                break

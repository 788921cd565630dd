"""What was found of a case, in lines for people."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupling.check.checked import CheckedRobot
from coupling.check.joints import JointDemand
from coupling.run.console import gear_lines


def robot_lines(robot: CheckedRobot, loads: str) -> Iterator[str]:
    """Yield what there is to say of a robot.

    Args:
        robot: The robot.
        loads: What it carries, in words.
    """
    yield f"{robot.name}: {robot.way:.3f} m of path in {robot.path.time[-1]:.1f} s"
    for demand in robot.demands:
        yield f"  {joint_words(demand)}"
    yield f"  {room_words(robot)}"
    yield f"  distance from singular postures {robot.room.conditioning:.3f} (1/|J^-1|; place asks 0.03)"
    yield f"  under {loads}:"
    yield from (f"  {line}" for line in backlash_words(robot))
    yield from gear_lines(robot.gears)
    yield from (f"  Warning: {warning}" for warning in robot.warnings)


def backlash_words(robot: CheckedRobot) -> Iterator[str]:
    """Yield what a wrong backlash would leave, and whether any gear reverses."""
    if not any(gear.backlash for gear in robot.gears):
        yield "no gear has backlash: a wrong one would not show"
        return
    if robot.backlash:
        deviations = [own.deviation for own in robot.backlash]
        most = 1e6 * max(own.maximum for own in deviations)
        rest = 1e6 * max(own.maximum_less_constant for own in deviations)
        yield (
            f"{' or '.join(own.name for own in robot.backlash)} in all gears: simulated, a command that"
            f" is right leaves up to {most:.1f} um, {rest:.1f} um less a constant"
        )
    else:
        yield f"what a wrong backlash leaves is not known: {robot.unknown}"
    if not any(gear.at_risk for gear in robot.gears):
        yield "no gear reverses: a wrong backlash shows as little but a constant"


def joint_words(demand: JointDemand) -> str:
    """Return angles, rate and acceleration of a joint beside their limits."""
    low, high, margin = (
        float(np.rad2deg(value).round(1)) + 0.0
        for value in (demand.lowest, demand.highest, demand.margin)
    )
    within = f"{margin:.1f} deg from its limits" if np.isfinite(margin) else "no limits known"
    beyond = f": BEYOND ITS LIMIT in {', '.join(demand.beyond)}" if demand.beyond else ""
    rate, acceleration = (
        f"{np.rad2deg(value):.1f}{_of(limit)}"
        for value, limit in (
            (demand.rate, demand.rate_limit),
            (demand.acceleration, demand.acceleration_limit),
        )
    )
    return (
        f"joint {demand.joint}: {low:.1f} to {high:.1f} deg, {within}; at most {rate} deg/s,"
        f" {acceleration} deg/s^2{beyond}"
    )


def room_words(robot: CheckedRobot) -> str:
    """Return how far the path can be moved."""
    ways = ", ".join(f"{name} {1e3 * way:.0f}" for name, way in robot.room.free.items())
    return f"the whole path can be moved by [mm], axes of the base: {ways}"


def _of(limit: float) -> str:
    return f" of {np.rad2deg(limit):.0f}" if np.isfinite(limit) else ""

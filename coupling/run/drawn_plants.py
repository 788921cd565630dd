"""The command as written, replayed on robots and under forces drawn from what their sources state."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.stats.qmc import Sobol

from coupling.results.outlook import DrawnFrom, Replay
from coupling.robot.cell import Cell
from coupling.robot.differences import RobotDifference
from coupling.robot.robot_fmu import SimulatedModel
from coupling.run.robustness import StiffnessRanges
from coupling.solve.correction import Correction

# Robots that are drawn, by kind of FMU: the one in Python takes as long for one as the native one for
# a hundred.
DRAWS = {"native": 32, "python": 8}
# Of the design, so that the same case has the same figures.
_SEED = 1


def basis_of(
    models: Sequence[SimulatedModel],
    ranges: Sequence[StiffnessRanges],
    force_error: float | None,
) -> DrawnFrom:
    """Return what robots and forces can be drawn from, and what has no stated range.

    Args:
        models: Simulation of each robot.
        ranges: Stiffness of their gears that are not known better.
        force_error: Largest part by which the process's force is off, by its source; None: unknown.
    """
    drawn, missing = [], []
    joints = [
        (number in limits, joint)
        for model, limits in zip(models, ranges, strict=True)
        for number, joint in enumerate(model.robot.joints, start=1)
        if joint.stiffness is not None
    ]
    stated = sum(has_range for has_range, _ in joints)
    if stated:
        drawn.append(f"the stated stiffness of {stated} gears")
    if stated < len(joints):
        missing.append(f"the stiffness of {len(joints) - stated} gears")
    if force_error is None:
        missing.append("the force")
    else:
        drawn.append(f"a force of +-{100.0 * force_error:.3g} %")
    elastic = [joint for _, joint in joints]
    for name, is_there in (
        ("backlash", any(joint.backlash for joint in elastic)),
        ("hysteresis", any(joint.hysteresis for joint in elastic)),
        ("friction and servos", any(joint.drive for joint in elastic)),
    ):
        if not is_there:
            missing.append(f"{name}, which the file leaves out" if joints else name)
    is_whole = bool(joints) and stated == len(joints) and force_error is not None
    return DrawnFrom(tuple(drawn), tuple(missing), is_whole)


def drawn_differences(
    models: Sequence[SimulatedModel],
    ranges: Sequence[StiffnessRanges],
    force_error: float | None,
    count: int,
    seed: int,
) -> Iterator[tuple[list[RobotDifference], float]]:
    """Yield differences of all robots, and a factor of the force.

    The logarithm of a stiffness and the factor of the force are uniform in their ranges, each for
    itself, by a scrambled Sobol sequence.

    Args:
        count: Number of draws.
        seed: Seed of the scrambling.
    """
    robots = list(zip((model.robot for model in models), ranges, strict=True))
    size = sum(len(limits) for limits in ranges) + 1
    # A whole sequence is balanced; of one that is cut off the first are nearly so.
    shares = Sobol(size, seed=seed).random_base2(int(np.ceil(np.log2(max(count, 2)))))[:count]
    for share in shares:
        ahead = iter(share[:-1])
        differences = []
        for robot, limits in robots:
            factors = [1.0] * len(robot.joints)
            for number, (low, high) in sorted(limits.items()):
                stiffness = robot.joints[number - 1].stiffness
                along = float(next(ahead))
                if stiffness is not None:
                    factors[number - 1] = low * (high / low) ** along / stiffness
            differences.append(RobotDifference({"stiffness": tuple(factors)}))
        yield differences, 1.0 + (force_error or 0.0) * (2.0 * float(share[-1]) - 1.0)


def drawn_replays(
    cell: Cell,
    models: Sequence[SimulatedModel],
    ranges: Sequence[StiffnessRanges],
    force_error: float | None,
    found: Correction,
    count: int,
) -> tuple[Replay, ...]:
    """Replay a command, under the validation's wrench, on robots that are drawn.

    Args:
        cell: The robots of the case.
        found: The command.
        count: Number of robots.

    Returns:
        A replay for each; none where nothing has a stated range.

    Raises:
        SimulationError: If a robot cannot be simulated.
    """
    loaded = found.response.wrench
    pushes = force_error is not None and bool(np.any(loaded.wrench))
    if not (pushes or any(ranges)) or all(model.robot.is_rigid for model in models):
        return ()
    replays = []
    for differences, force in drawn_differences(models, ranges, force_error, count, _SEED):
        robots = [
            model.differing(difference, "a robot drawn from its ranges")
            for model, difference in zip(models, differences, strict=True)
        ]
        path = cell.with_robots(robots).simulate(found.joints, loaded.scaled(force), "dynamic")
        replays.append(Replay.of("drawn", path, found.desired))
    return tuple(replays)

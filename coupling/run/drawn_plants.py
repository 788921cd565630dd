"""The command as written, replayed on robots and under forces drawn from what their sources state."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait

import numpy as np

from coupling.case.case import PlacedRobot
from coupling.events import Progress, Watch, unwatched
from coupling.results.outlook import DrawnFrom, DrawnReplays, Replay
from coupling.robot.cell import Cell
from coupling.robot.differences import AS_THE_MODEL, RobotDifference
from coupling.robot.simulated_model import SimulatedModel
from coupling.run.check import Check, CheckedCommand, of_corrections
from coupling.run.fmu_pool import FmuPool
from coupling.run.robustness import StiffnessRanges
from coupling.run.usual_gears import Simulate, completed, left_out
from coupling.solve.correction import Correction

# Robots that are drawn, and those of them that have usual values of what their files leave out as well,
# by kind of FMU: the one in Python takes as long for one as the native one for a hundred.
DRAWS = {"native": (64, 16), "python": (8, 4)}
# Rows of a path that all draws simulate at most, but for the fewest draws.
_ROWS, _FEWEST = 1_000_000, 8
# A gear's stiffness without a range: what an identification of all gears of a robot left open, 17 to
# 37 % (fanuc_r2000ic).
_ASSUMED = 0.25
# Of the design, so that the same case has the same figures.
_SEED = 1
# Words for the robots that are simulated beside the others, and how often they are shown [s].
_WITH_VALUES, _SHOWN = "simulating robots with usual values of what their files leave out", 0.5


def basis_of(
    models: Sequence[SimulatedModel],
    ranges: Sequence[StiffnessRanges],
    force_factors: tuple[float, float] | None,
    has_force: bool = True,
    assumed: Sequence[StiffnessRanges] = (),
) -> DrawnFrom:
    """Return what robots and forces can be drawn from, and what has no stated range.

    Args:
        models: Simulation of each robot.
        ranges: Stiffness of their gears that are not known better.
        force_factors: Lowest and highest real force over the process's, by its source; None: unknown.
        has_force: Whether the process has a force at all.
        assumed: Ranges of gears for which none is stated, by robot.
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
    guessed = sum(len(limits) for limits in assumed)
    if guessed:
        drawn.append(f"an assumed {100.0 * _ASSUMED:.0f} % of the stiffness of {guessed} gears")
    if stated + guessed < len(joints):
        missing.append(f"the stiffness of {len(joints) - stated - guessed} gears")
    if has_force and force_factors is None:
        missing.append("the force")
    elif has_force and force_factors is not None:
        low, high = (100.0 * factor for factor in force_factors)
        drawn.append(f"{low:.3g} to {high:.3g} % of the force")
    elastic = [joint for _, joint in joints]
    if any(joint.backlash for joint in elastic):
        missing.append("errors of the file's backlash")
    if any(joint.hysteresis for joint in elastic):
        missing.append("errors of its hysteresis")
    if any(joint.drive for joint in elastic):
        missing.append("errors of its friction and servos")
    if not any(joint.kinematic_error for joint in elastic):
        missing.append("kinematic errors of the gears")
    is_whole = (
        bool(joints)
        and stated + guessed == len(joints)
        and not (has_force and force_factors is None)
    )
    return DrawnFrom(tuple(drawn), tuple(missing), is_whole)


def drawn_differences(
    models: Sequence[SimulatedModel],
    ranges: Sequence[StiffnessRanges],
    force_factors: tuple[float, float] | None,
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
    from scipy.stats.qmc import Sobol

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
        low, high = force_factors or (1.0, 1.0)
        yield differences, low + (high - low) * float(share[-1])


def drawn_replays(
    cell: Cell,
    models: Sequence[SimulatedModel],
    ranges: Sequence[StiffnessRanges],
    force_factors: tuple[float, float] | None,
    correction: Correction,
    simulate: Simulate,
    counts: tuple[int, int],
    assumed: Sequence[StiffnessRanges] = (),
    watch: Watch = unwatched,
) -> DrawnReplays:
    """Replay a command, under the validation's wrench, on robots that are drawn.

    Args:
        cell: The robots of the case.
        correction: The command.
        simulate: Function that gives the simulation of a robot that has what its file leaves out.
        counts: Numbers of robots, without and with what their files leave out.
        assumed: Ranges of gears for which none is stated, by robot.
        watch: Function called with the progress of the work.

    Returns:
        The replays; none where nothing has a stated range.

    Raises:
        SimulationError: If a robot cannot be simulated.
    """
    loaded = correction.response.wrench
    has_force = bool(np.any(loaded.wrench))
    basis = basis_of(models, ranges, force_factors, has_force, assumed)
    if assumed:
        ranges = [{**limits, **more} for limits, more in zip(ranges, assumed, strict=True)]
    pushes = has_force and force_factors is not None
    if not (pushes or any(ranges)) or all(model.robot.is_rigid for model in models):
        return DrawnReplays(basis)

    def replay(
        name: str,
        robots: Sequence[SimulatedModel],
        differences: Sequence[RobotDifference],
        force: float,
    ) -> Replay:
        """Return what the command leaves on robots that differ, under a factor of the force."""
        pairs = zip(robots, differences, strict=True)
        differing = [robot.differing(difference, name) for robot, difference in pairs]
        path = cell.with_robots(differing).simulate(
            correction.joints, loaded.scaled(force), "dynamic"
        )
        return Replay.of(name, path, correction.desired)

    count, completed_count = counts
    draws = list(drawn_differences(models, ranges, force_factors, count, _SEED))
    values = left_out(models)
    finished: list[Replay] = []

    def with_values() -> tuple[list[Replay], list[Replay]]:
        """Replay on robots with each of the values that files leave out, and on those with all."""
        same, both = [AS_THE_MODEL for _ in models], []
        for value in values:
            robots = completed(models, [value], simulate)
            finished.append(replay(value.name, robots, same, 1.0))
        whole = completed(models, values, simulate) if values else []
        for draw in draws[:completed_count] if values else []:
            both.append(replay("a drawn robot with usual values", whole, *draw))
            finished.append(both[-1])
        return finished[: len(values)], both

    # Side by side: these robots have FMUs of their own, each in its process.
    with ThreadPoolExecutor(1) as executor:
        of_values = executor.submit(with_values)
        stated = [replay("a robot drawn from its ranges", models, *draw) for draw in draws]
        total = len(values) + min(completed_count, len(draws)) * bool(values)
        while wait([of_values], _SHOWN).not_done:
            watch(Progress(_WITH_VALUES, len(finished), total))
        each, both = of_values.result()
    return DrawnReplays(basis, tuple(stated), tuple(each), tuple(both))


def _compute(command: CheckedCommand) -> DrawnReplays:
    case = command.case
    rows = len(command.correction.desired.time) * len(case.robots)
    # The FMU in Python takes too long for what is only assumed.
    assumed = [] if case.fmu == "python" else [assumed_ranges(placed) for placed in case.robots]
    with FmuPool(case.fmu) as others:
        return drawn_replays(
            command.cell,
            command.models,
            [placed.provenance.stiffness_ranges for placed in case.robots],
            case.process_table.FORCE_FACTORS,
            command.correction,
            others.of,
            draw_counts(case.fmu, rows),
            assumed,
            command.watch,
        )


def draw_counts(kind: str, rows: int) -> tuple[int, int]:
    """Return the numbers of robots that are drawn, without and with what their files leave out.

    Args:
        kind: Kind of the FMUs.
        rows: Rows of the paths of all tools.

    Example:
        >>> draw_counts("native", 2000), draw_counts("native", 70000)
        ((64, 16), (8, 8))
    """
    stated, completed_count = DRAWS[kind]
    if rows * stated > _ROWS:
        # A power of two is balanced.
        stated = max(2 ** int(np.log2(max(_ROWS / rows, 1.0))), min(_FEWEST, stated))
    return stated, min(completed_count, stated)


def assumed_ranges(placed: PlacedRobot) -> StiffnessRanges:
    """Return a range of the stiffness of each gear for which the robot's file states none."""
    return {
        number: ((1.0 - _ASSUMED) * joint.stiffness, joint.stiffness / (1.0 - _ASSUMED))
        for number, joint in enumerate(placed.description.joints, start=1)
        if joint.stiffness is not None and number not in placed.provenance.stiffness_ranges
    }


DRAWN_ROBOTS = Check("drawn", _compute, DrawnReplays(), of_corrections)

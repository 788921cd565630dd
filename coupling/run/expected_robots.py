"""The command as written, replayed on robots and under forces drawn from what their sources state.

This is the one place that says what is uncertain of a robot and a force of which nothing was measured.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.events import Progress, Watch, unwatched
from coupling.fmu.worker import WorkerProcesses
from coupling.path.deviation import Deviation
from coupling.results.outlook import DECIDING_RANKS, DrawnFrom, DrawnReplays
from coupling.results.replay import Replay, Worsening, keeping_the_worst
from coupling.robot.simulated_model import SimulatedModel
from coupling.run.check import Check, CheckedCommand, of_corrections
from coupling.run.fmu_pool import FmuPool
from coupling.run.replayed_command import ReplayedCommand, is_surely_better
from coupling.run.uncertain_parameters import (
    SampledRobots,
    StiffnessRanges,
    UncertainParameters,
    draw_samples,
)
from coupling.run.usual_gears import UsualValue, completed, left_out

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


@dataclass(frozen=True)
class ExpectedRobots:
    """Robots and a force as they are to be expected, before anything was measured.

    Attributes:
        robots: Robots as their files have them.
        parameters: Stiffness of gears and the force, which are known to ranges.
        values: Usual values of what the files leave out.
        basis: Ranges that are drawn from and parameters without one, in words.
    """

    robots: tuple[PlacedRobot, ...]
    parameters: UncertainParameters
    values: tuple[UsualValue, ...]
    basis: DrawnFrom

    @classmethod
    def of(cls, case: Case, has_force: bool) -> ExpectedRobots:
        """Return those of a case.

        Args:
            has_force: Whether its process has a force at all.
        """
        # The FMU in Python takes too long for what is only assumed.
        return cls.among(
            case.robots, case.process_table.FORCE_FACTORS, has_force, case.fmu != "python"
        )

    @classmethod
    def among(
        cls,
        robots: Sequence[PlacedRobot],
        force_factors: tuple[float, float] | None,
        has_force: bool = True,
        assumes: bool = True,
    ) -> ExpectedRobots:
        """Return those of robots.

        Args:
            force_factors: Lowest and highest real force over the process's, by its source; None: not
                known.
            has_force: Whether the process has a force at all.
            assumes: Whether gears for which no range is stated have an assumed one.
        """
        factors = force_factors if has_force else None
        ranges = [
            {**placed.provenance.stiffness_ranges, **(assumed_ranges(placed) if assumes else {})}
            for placed in robots
        ]
        return cls(
            tuple(robots),
            UncertainParameters.expected(robots, ranges, factors),
            left_out(robots),
            _basis(robots, ranges, factors, has_force),
        )

    @property
    def is_rigid(self) -> bool:
        """Whether no robot gives way."""
        return all(placed.description.is_rigid for placed in self.robots)

    @property
    def completed(self) -> tuple[PlacedRobot, ...]:
        """The robots with all usual values."""
        return completed(self.robots, self.values)

    def draws(self, count: int) -> Iterator[SampledRobots]:
        """Yield robots and forces, by the first points of a scrambled Sobol sequence."""
        for row in draw_samples("sobol", count, _SEED, self.parameters):
            yield self.parameters.sampled(row.tolist())


def _basis(
    robots: Sequence[PlacedRobot],
    ranges: Sequence[StiffnessRanges],
    force_factors: tuple[float, float] | None,
    has_force: bool,
) -> DrawnFrom:
    """Return what robots and forces are drawn from, and what has no range; arguments as they are."""
    drawn, missing = [], []
    elastic = [joint for placed in robots for joint in placed.description.joints if joint.stiffness]
    stated = sum(len(placed.provenance.stiffness_ranges) for placed in robots)
    guessed = sum(map(len, ranges)) - stated
    if stated:
        drawn.append(f"the stated stiffness of {stated} gears")
    if guessed:
        drawn.append(f"an assumed {100.0 * _ASSUMED:.0f} % of the stiffness of {guessed} gears")
    if stated + guessed < len(elastic):
        missing.append(f"the stiffness of {len(elastic) - stated - guessed} gears")
    if has_force and force_factors is None:
        missing.append("the force")
    elif force_factors is not None:
        low, high = (100.0 * factor for factor in force_factors)
        drawn.append(f"{low:.3g} to {high:.3g} % of the force")
    if any(joint.backlash for joint in elastic):
        missing.append("errors of the file's backlash")
    if any(joint.hysteresis for joint in elastic):
        missing.append("errors of its hysteresis")
    if any(joint.drive for joint in elastic):
        missing.append("errors of its friction and servos")
    if not any(joint.kinematic_error for joint in elastic):
        missing.append("kinematic errors of the gears")
    is_whole = (
        bool(elastic)
        and stated + guessed == len(elastic)
        and not (has_force and force_factors is None)
    )
    return DrawnFrom(tuple(drawn), tuple(missing), is_whole)


def drawn_replays(
    command: ReplayedCommand,
    expected: ExpectedRobots,
    fmus: FmuPool,
    counts: tuple[int, int],
    watch: Watch = unwatched,
) -> DrawnReplays:
    """Replay a command, under the model's wrench, on robots that are drawn.

    Args:
        expected: Robots and forces to expect.
        fmus: Simulations of robots that have what their files leave out; none of the command's.
        counts: Numbers of robots, without and with what their files leave out.
        watch: Function called with the progress of the work.

    Returns:
        The replays; none where nothing has a range.

    Raises:
        SimulationError: If a robot cannot be simulated.
    """
    if not expected.parameters.entries or expected.is_rigid:
        return DrawnReplays(expected.basis)
    count, completed_count = counts
    draws, values = list(expected.draws(count)), expected.values
    finished: list[Replay] = []

    def simulated(robots: Sequence[PlacedRobot]) -> list[SimulatedModel]:
        return [fmus.of(placed.description, placed.torque_curve, placed.drive) for placed in robots]

    def with_values() -> tuple[list[Replay], list[Replay]]:
        """Replay on robots with each of the values that files leave out, and on those with all."""
        for value in values:
            robots = simulated(completed(expected.robots, [value]))
            replay = command.on(value.name, robots, SampledRobots.as_the_model(len(robots)))
            finished.append(replay.without_path())
        each, name = list(finished), "a drawn robot with usual values"
        if not values:
            return each, []
        whole = simulated(expected.completed)
        return each, on_draws(name, whole, draws[:completed_count], finished.append)

    def on_draws(
        name: str,
        robots: Sequence[SimulatedModel],
        some: Sequence[SampledRobots],
        notify: Callable[[Replay], None] = lambda replay: None,
    ) -> list[Replay]:
        def each() -> Iterator[Replay]:
            for draw in some:
                replay = command.on(name, robots, draw)
                notify(replay.without_path())
                yield replay

        replays = keeping_the_worst(each())
        if command.correction is not None:
            confirm_ranks(
                replays, lambda number: command.uncorrected_on(name, robots, some[number])
            )
        return replays

    # Side by side: these robots have FMUs of their own, each in its process.
    with ThreadPoolExecutor(1) as executor:
        of_values = executor.submit(with_values)
        stated = on_draws("a robot drawn from its ranges", command.models, draws)
        total = len(values) + min(completed_count, len(draws)) * bool(values)
        while wait([of_values], _SHOWN).not_done:
            watch(Progress(_WITH_VALUES, len(finished), total))
        each, both = of_values.result()
    return DrawnReplays(expected.basis, tuple(stated), tuple(each), tuple(both))


def confirm_ranks(replays: list[Replay], simulate: Callable[[int], Deviation]) -> None:
    """Have the robots at the ranks that decide simulated uncorrected, where superposition does not do.

    A simulated deviation may change the order: that goes on until the robot at each rank is simulated,
    or surely better off with the command.

    Args:
        replays: Replays of a sample, beside what is uncorrected by superposition; changed.
        simulate: Function of a replay's number that returns what is uncorrected on its robots.
    """
    certain = {number for number, replay in enumerate(replays) if is_surely_better(replay)}
    for is_shifted, share in DECIDING_RANKS:
        while replays:
            # All know what is uncorrected on their robots, so that of the model counts for none.
            number = Worsening.deciding(replays, replays[0].deviation, is_shifted, share)
            if number in certain:
                break
            replays[number] = replays[number].beside(simulate(number))
            certain.add(number)


def _compute(command: CheckedCommand) -> DrawnReplays:
    case, correction = command.case, command.correction
    rows = len(correction.desired.time) * len(case.robots)
    wrench = correction.response.wrench
    expected = ExpectedRobots.of(case, bool(np.any(wrench.wrench)))
    with FmuPool(case.fmu, processes=WorkerProcesses()) as others:
        return drawn_replays(
            ReplayedCommand.of(command),
            expected,
            others,
            draw_counts(case.fmu, rows),
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


def _applies(command: CheckedCommand) -> bool:
    return of_corrections(command) and not command.is_measured


DRAWN_ROBOTS = Check("drawn", _compute, DrawnReplays(), _applies)

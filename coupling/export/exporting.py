"""Commands as programs, each judged by what its file does to the moving robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import PlanningError, SimulationError
from coupling.events import Progress, Watch, unwatched
from coupling.export.commands import RobotCommand
from coupling.export.curves import SampledCurve
from coupling.export.exported_program import ExportedProgram, ExportOptions
from coupling.export.job import ExportJob
from coupling.export.preconditions import require_joints, require_limits, require_step
from coupling.export.sampled import SampledCommand
from coupling.export.spline_points import spline_points
from coupling.inverse.inversion import DesiredMotion
from coupling.inverse.joint_limits import JointLimits
from coupling.path.joint_path import JointPath
from coupling.path.length_text import format_um
from coupling.run.fmu_pool import FmuPool, cell_of

# Programs that are tried, with closer points where the last one loses too much.
_MAX_PROGRAMS = 14
# How long before a loss its cause is looked for at first [s], a few periods of a robot's slowest
# oscillation, and how that grows: a gear may stay in its backlash for seconds before it shows.
_FIRST_LOOKBACK, _LOOKBACK_GROWTH = 0.3, 1.5
# What the inverse aims at, as parts of the tolerance, one after the other.
_INVERSE_TOLERANCES = (0.5, 0.1)
# Largest distance of targets that is tried where another one loses too much, in cycles; rounding of it.
_MOST_CYCLES, _CYCLE_ROUNDING = 3, 1e-6
# Fewest cycles of a command for which rows are solved for: with less nothing is left to be chosen.
_MIN_CYCLES = 8


def export_commands(
    commands: Sequence[RobotCommand], options: ExportOptions, watch: Watch = unwatched
) -> tuple[ExportedProgram, ...]:
    """Return the programs of robots that move at the same time: few points, or a row on every cycle.

    Args:
        commands: The command of each robot.
        watch: Function called with the progress of the work.

    Raises:
        CouplingError: If a robot cannot do what is asked, or the language not say it.
    """
    first = commands[0]
    cycle = options.cycle or first.controller.cycle
    program = every_cycle if options.language.dense else few_points
    require_step(options.language, cycle)
    robots = [command.placed for command in commands]
    limits = [
        JointLimits.of(command.placed.description, command.controller.max_acceleration)
        for command in commands
    ]
    for command, limit in zip(commands, limits, strict=True):
        require_joints(options.language, len(command.placed.description.joints))
        require_limits(command.joints, limit, command.who)
    exported = []
    with FmuPool(first.fmu, watch) as models:
        cell, _ = cell_of(robots, models)
        for command, member, limit in zip(commands, cell.members, limits, strict=True):
            name = _name(command, options, len(commands) > 1)
            job = ExportJob(command, member, limit, replace(options, name=name, cycle=cycle), watch)
            exported.append(program(job))
    return tuple(exported)


def _name(command: RobotCommand, options: ExportOptions, several: bool) -> str:
    """Return the name of a robot's program."""
    behind = f"_{command.placed.name}" if several else ""
    if options.name is not None:
        return options.name + behind
    word = "".join(c if c.isascii() and c.isalnum() else "_" for c in command.name)
    word = word if word[:1].isalpha() else f"P{word}"
    return word[: options.language.longest_name - len(behind)] + behind


def few_points(job: ExportJob) -> ExportedProgram:
    """Return the program of few points, with what it loses on joint lines and what would lose less.

    Where no least time between targets is asked for it is that of the language, or less if that is what
    the tolerance takes.
    """
    options, sampled = job.options, job.sampled(job.command.joints)
    if options.targets == "cartesian":
        job.require_regular_poses(sampled)
    usual = _cycles(options.spacing, job.cycle)
    last = 1 if options.shortest is None else usual
    tried = list[ExportedProgram]()
    for cycles in range(usual, last - 1, -1):
        if cycles > last and not _can_keep(job, sampled, cycles):
            continue
        tried.append(_fewest_points(job, sampled, cycles))
        if tried[-1].figures.loss_m <= options.tolerance:
            break
    exported = min(tried, key=lambda program: program.figures.loss_m)
    if options.language.between == "straight":
        exported = job.on_joint_lines(exported, sampled)
    if exported.figures.loss_m <= options.tolerance:
        return exported
    return replace(exported, advice=_advice(job, sampled, exported))


def _advice(job: ExportJob, sampled: SampledCommand, exported: ExportedProgram) -> str:
    """Return the option that keeps the tolerance, found by trying other distances of targets."""
    shortest = job.options.shortest
    for cycles in () if shortest is None else range(_MOST_CYCLES, 0, -1):
        if cycles == _cycles(job.options.spacing, job.cycle) or not _can_keep(job, sampled, cycles):
            continue
        tried = _fewest_points(job, sampled, cycles)
        if tried.figures.loss_m <= job.options.tolerance:
            option = f"--shortest-ms {1e3 * cycles * job.cycle:g}"
            return f"{option} keeps it, with {format_um(tried.figures.loss_m)} um"
    return f"--tolerance {np.ceil(1e6 * exported.figures.loss_m):g} accepts it"


def _cycles(spacing: float, cycle: float) -> int:
    """Return the fewest whole cycles that are no shorter than a time [s]."""
    return max(int(np.ceil(spacing / cycle - _CYCLE_ROUNDING)), 1)


def _space_points(points: np.ndarray, cycles: int) -> np.ndarray:
    """Return every so many-th point, the first and the last among them, none closer than that.

    Example:
        >>> _space_points(np.arange(8), 3)
        array([0, 3, 7])
    """
    chosen = points[: max(len(points) - cycles, 1) : cycles]
    return np.append(chosen, points[-1:])


def _can_keep(job: ExportJob, sampled: SampledCommand, cycles: int) -> bool:
    """Return whether a point every so many cycles, the most that there may be, keeps the tolerance."""
    losses = job.loss_through(sampled, _space_points(sampled.points, cycles))
    return float(losses.max()) <= job.options.tolerance


def _fewest_points(job: ExportJob, sampled: SampledCommand, cycles: int) -> ExportedProgram:
    """Return the first program that loses no more than is allowed, or the one that loses least.

    The points keep to the command within the tolerance.  Where the moving robot's tool then loses more,
    which a gear in its backlash or an oscillation does, it is halved there, until it does not, nor
    under the files, read back.
    """
    options, tried = job.options, list[_TriedRows]()
    candidates = _space_points(sampled.points, cycles)
    curve = sampled.curve(options.targets)
    choose = spline_points if options.language.between == "spline" else straight_points
    tolerance = np.full(len(sampled.time), options.tolerance)
    for number in range(_MAX_PROGRAMS):
        job.watch(Progress("choosing points, simulating them", number, _MAX_PROGRAMS))
        rows, smallest = choose(curve, sampled.time, candidates, tolerance), float(tolerance.min())
        losses = job.loss_through(sampled, rows)
        loss, lost = float(losses.max()), job.reference.time[losses > options.tolerance]
        if loss <= options.tolerance:
            checked = job.check_rows(sampled, rows, smallest)
            loss, lost = checked.exported.figures.loss_m, checked.lost
            if loss <= options.tolerance:
                return checked.exported
        tried.append(_TriedRows(loss, rows, smallest))
        if len(rows) == len(candidates):
            break
        tolerance = _halve_tolerance(
            tolerance, sampled.time, lost, _FIRST_LOOKBACK * _LOOKBACK_GROWTH**number
        )
    best = min(tried, key=lambda program: program.loss)
    return job.check_rows(sampled, best.rows, best.tolerance).exported


@dataclass(frozen=True)
class _TriedRows:
    """Rows through which a program loses too much.

    Attributes:
        loss: Largest distance of the moving robot's tool [m].
        rows: Their numbers, (k,).
        tolerance: Smallest tolerance that they keep [m].
    """

    loss: float
    rows: np.ndarray
    tolerance: float


def _halve_tolerance(
    tolerance: np.ndarray, time: np.ndarray, lost: np.ndarray, before: float
) -> np.ndarray:
    """Return tolerances at times, half of what they are up to so long before something was lost.

    Example:
        >>> _halve_tolerance(np.ones(4), np.array([0.0, 0.8, 1.0, 2.0]), np.array([1.0]), before=0.3)
        array([1. , 0.5, 0.5, 1. ])
    """
    first, last = np.searchsorted(lost, time), np.searchsorted(lost, time + before, side="right")
    return np.where(last > first, 0.5, 1.0) * tolerance


def straight_error(
    curve: SampledCurve, time: np.ndarray, tolerance: np.ndarray, start: int, end: int
) -> float:
    """Return how far the straight way from one sample to a later one is off, over the tolerance.

    Args:
        curve: The motion.
        time: Times of its samples [s], (n,).
        tolerance: Largest distance of the way at the tool, at every sample [m], (n,).
        start, end: Rows of the samples.
    """
    if end - start < 2:
        return 0.0
    rows = slice(start + 1, end)
    share = (time[rows] - time[start]) / (time[end] - time[start])
    first, last = (curve.values[k : k + 1] for k in (start, end))
    return float((curve.errors(curve.between(first, last, share), rows) / tolerance[rows]).max())


def straight_points(
    curve: SampledCurve, time: np.ndarray, candidates: np.ndarray, tolerance: np.ndarray
) -> np.ndarray:
    """Return rows of a motion through which straight ways stay within a tolerance.

    From each point the way goes as far as it stays within the tolerance: as far as was found by
    doubling and halving its length, for a longer way may be within it where a shorter one is not.

    Args:
        curve: The motion.
        time: Times of its samples [s], (n,).
        candidates: Numbers of rows that may be points, rising, the first and the last among them, (m,).
        tolerance: Largest distance of the way at the tool, at every sample [m], (n,).

    Returns:
        Chosen rows, rising.  From a candidate to the next one a way is taken whatever it leaves.
    """
    chosen, last, reach = [0], len(candidates) - 1, 1

    def fits(steps: int) -> bool:
        rows = candidates[chosen[-1]], candidates[chosen[-1] + steps]
        return straight_error(curve, time, tolerance, *rows) <= 1.0

    while chosen[-1] < last:
        remaining = last - chosen[-1]
        good, bad = 1, remaining + 1
        step = min(max(reach, 2), remaining)
        while good < step < bad:
            if fits(step):
                good, step = step, min(2 * step, remaining)
            else:
                bad = step
        while bad - good > 1:
            middle = (good + bad) // 2
            if fits(middle):
                good = middle
            else:
                bad = middle
        chosen.append(chosen[-1] + good)
        reach = good
    return candidates[chosen]


def every_cycle(job: ExportJob) -> ExportedProgram:
    """Return the first rows that lose no more than is allowed, or those that lose least.

    At first they are samples of the command.  What a drive does between two of them to turn a gear
    through its backlash is lost, and the link, free there, drifts on with the momentum that is
    missing.  Then the rows are those of the inverse of the moving robot, for the controller's own
    interpolation, of the path that its tool takes under the command.
    """
    tolerance = job.options.tolerance
    job.watch(Progress("sampling the command, reading it back", 0, 1))
    best = _check_rows(job, job.command.joints)
    for aim in _INVERSE_TOLERANCES:
        if best.figures.loss_m <= tolerance:
            break
        try:
            rows = _inverse(job, aim * tolerance)
        except (PlanningError, SimulationError) as cause:
            why = f"no better rows than samples of the command were found: {cause}"
            return replace(best, remark="; ".join(filter(None, (best.remark, why))))
        best = min(best, _check_rows(job, rows), key=lambda program: program.figures.loss_m)
    if best.figures.loss_m <= tolerance:
        return best
    micrometres = np.ceil(1e6 * best.figures.loss_m)
    accepted = f"--tolerance {micrometres:g} accepts it, a shorter --cycle-ms loses less"
    return replace(best, advice=accepted)


def _check_rows(job: ExportJob, command: JointPath) -> ExportedProgram:
    sampled = job.sampled(command)
    return job.check_rows(sampled, sampled.points, job.options.tolerance).exported


def _inverse(job: ExportJob, goal: float) -> JointPath:
    """Return rows of angles under which the moving robot's tool takes the path of the command."""
    member, path = job.member, job.reference
    cycles = float(np.ptp(path.time)) / job.cycle
    if cycles < _MIN_CYCLES:
        raise PlanningError(
            f"expected a command of {_MIN_CYCLES} cycles at least, got {cycles:.3g}"
        )
    assert member.inverter is not None
    desired_motion = DesiredMotion(path, member.planner.plan(path), job.loads.on(path))
    controller = replace(job.command.controller, cycle=job.cycle, interpolation="cubic")
    return member.inverter.invert(desired_motion, controller, goal, job.watch).joints

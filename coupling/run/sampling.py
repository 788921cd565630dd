"""The error of a process that is evaluated at samples, with its force interpolated linearly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from coupling.case.case import Case
from coupling.errors import CaseError, ProcessError, SimulationError
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import InterpolatedPath
from coupling.path.linear import interpolate_rows
from coupling.process import NoisySchema, Process, ProcessResponse
from coupling.results.limit_warning import LimitWarning
from coupling.results.replay import Replay
from coupling.robot.cell import Cell
from coupling.run.check import Check, CheckedCommand
from coupling.solve.correction import Correction
from coupling.solve.coupling import couple
from coupling.solve.fixed_point import Loop
from coupling.solve.schemes import SCHEMES
from coupling.toolpaths.task import Task

# An error of second order falls to a quarter at half the step: it is 4/3 of the difference.
_OF_HALF = 4.0 / 3.0
# A parabola is approximated by straight pieces a quarter of a step long, to 1/16 of its arch.
_PIECES = 4


@dataclass(frozen=True)
class SamplingCheck:
    """What the samples of a process leave out.

    Attributes:
        error: Largest distance between the path under the process's samples and the one that is
            estimated under all of its force [m].
        time: Instant of it [s].
    """

    error: float
    time: float
    replay: Replay


def sampling_of(case: Case, cell: Cell, correction: Correction) -> SamplingCheck | None:
    """Return what the samples of a process cost a command.

    None where nothing acts on the tools, where no robot gives way, or the path cannot be simulated.

    A formula is evaluated once more, at half the steps, on the path that the tools take.  Of records and
    of other processes the force is taken as parabolas between samples instead of lines: where a process
    does not tell when its force has corners, the steeper ones.  The robots answer to either against the
    process's stiffness, where it is known, as in a coupling.
    """
    rigid = all(placed.description.is_rigid for placed in case.robots)
    if rigid or not np.any(correction.response.wrench.wrench):
        return None
    samples = case.motion.samples.time
    try:
        process, time, factor = _finer(case, correction, samples)
        all_times = np.union1d(correction.achieved.time, time)
        rows = np.searchsorted(all_times, time)
        knows = correction.response.stiffness is not None
        scheme = SCHEMES["robin" if knows else "constant"]()
        loop = Loop(cell, process, case.mode, scheme, max_evaluations=1)
        start = _between(correction.achieved, all_times)
        coupled_path = couple(loop, correction.joints, start, rows).path
    except (SimulationError, ProcessError, CaseError):  # an estimate that spoils no result
        return None
    back = coupled_path.at_rows(np.searchsorted(all_times, correction.achieved.time))
    change = factor * back.deviation_from(correction.achieved)
    path = correction.achieved.displaced(change)
    replay = Replay.of("sampling", path, correction.desired)
    off = path.distance_to(correction.achieved)
    return SamplingCheck(float(off.max()), float(path.time[off.argmax()]), replay)


# Bends of the parabolas through a step and the row before or behind it -> bend of the step.
Choice = Callable[[np.ndarray, np.ndarray], np.ndarray]


def flatter(before: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """Return the smaller bend [Harten1987], shape of both: a corner at a row bends no step beside it."""
    return np.where(np.abs(before) <= np.abs(behind), before, behind)


def steeper(before: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """Return the larger bend, unit and shape of both: a corner may lie anywhere between two rows."""
    return np.where(np.abs(before) >= np.abs(behind), before, behind)


def parabolic(wrench: WrenchHistory, choice: Choice) -> WrenchHistory:
    """Return a history that follows parabolas between its rows instead of lines.

    No parabola reaches across a jump.

    Args:
        choice: `flatter` where corners are rows, `steeper` where they may be anywhere.

    Example:
        >>> time = np.array([0.0, 1.0, 2.0, 3.0])
        >>> wrench = np.zeros((4, 6)); wrench[:, 2] = [0.0, 1.0, 4.0, 9.0]
        >>> parabolic(WrenchHistory(time, wrench), flatter).at(np.array([0.5, 2.5]))[0, :, 2]
        array([0.25, 6.25])
    """
    time, values = wrench.time, wrench.wrench
    step = np.diff(time)
    slope = np.divide(
        np.diff(values, axis=1),
        step[:, None],
        out=np.zeros_like(values[:, 1:]),
        where=step[:, None] > 0,
    )
    bend = np.full((len(values), len(time), values.shape[2]), np.nan)
    inner = np.flatnonzero((step[1:] > 0.0) & (step[:-1] > 0.0))
    over = (step[inner] + step[inner + 1])[:, None]
    bend[:, inner + 1] = 2.0 * (slope[:, inner + 1] - slope[:, inner]) / over
    before, behind = bend[:, :-1], bend[:, 1:]
    chosen = choice(
        np.where(np.isnan(before), behind, before), np.where(np.isnan(behind), before, behind)
    )
    chosen = np.nan_to_num(chosen)
    parts = np.where(step > 0.0, _PIECES, 1)
    row = np.repeat(np.arange(len(step)), parts)
    within = np.concatenate([np.arange(count) / count for count in parts])
    since = (within * step[row])[:, None]
    bent = -0.5 * chosen[:, row] * since * (step[row][:, None] - since)
    refined = np.concatenate(
        [values[:, row] + slope[:, row] * since + bent, values[:, -1:]], axis=1
    )
    return WrenchHistory(np.append(time[row] + since[:, 0], time[-1]), refined)


def _finer(
    case: Case, correction: Correction, samples: np.ndarray
) -> tuple[Process, np.ndarray, float]:
    """Return a process that tells more, when it does, and the error over what that changes."""
    if case.process_table.FORMULA and not isinstance(case.process_table, NoisySchema):
        time = np.sort(np.concatenate([samples, 0.5 * (samples[1:] + samples[:-1])]))
        return case.process_table.process(_task_at(case, time)), time, _OF_HALF
    choice = flatter if len(case.corners) else steeper
    wrench = parabolic(correction.response.wrench.refined(samples), choice)
    time = wrench.instants
    stiffness = correction.response.stiffness
    if stiffness is not None:
        stiffness = interpolate_rows(time, samples, stiffness[None], axis=1)[0]
    return (
        _RecordedProcess(replace(correction.response, wrench=wrench, stiffness=stiffness)),
        time,
        1.0,
    )


@dataclass(frozen=True)
class _RecordedProcess:
    """What a process has answered already, as one that answers it to any path."""

    response: ProcessResponse
    identity: str = ""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        return self.response


def _task_at(case: Case, time: np.ndarray) -> Task:
    task, motion_path = case.task, _between(case.motion.path, time)
    support = task.support
    if support is not None:
        forming, desired = motion_path.tools
        support = replace(support.at(time), forming=forming, desired=desired)
    return replace(
        task, forming=motion_path.tools[0], support=support, sample_rows=np.arange(len(time))
    )


def _between(path: ToolPath, time: np.ndarray) -> ToolPath:
    return ToolPath.of_tools([InterpolatedPath(tool).at(time) for tool in path.tools])


def _compute(command: CheckedCommand) -> SamplingCheck | None:
    return sampling_of(command.case, command.cell, command.correction)


def _warnings(command: CheckedCommand) -> list[LimitWarning]:
    """Return a warning where the error exceeds the tolerance of the case.

    Of a coupling that did not converge it tells nothing: its forces are on the way to others.
    """
    sampling, tolerance = command.finding_of(SAMPLING), command.case.method.tolerance_m
    is_on_the_way = command.kind == "couple" and not command.correction.converged
    if sampling is None or sampling.error <= tolerance or is_on_the_way:
        return []
    return [LimitWarning.of("sampling", sampling.error, tolerance, sampling.time)]


SAMPLING = Check[SamplingCheck | None]("sampling", _compute, None, warnings=_warnings)

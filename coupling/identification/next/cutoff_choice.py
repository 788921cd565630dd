"""How far up a correction along the path goes: by what each is forecast to leave.

A gear that crosses its backlash elsewhere makes another deviation of the same correction, which no
linear response tells.  So the command is computed and forecast with the cutoff that contracts, and where
that gains little with lower ones as well; where none gains anything, the best command so far is given
again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from coupling.events import Progress, Watch, unwatched
from coupling.identification.next.command import CommandPlan
from coupling.identification.next.forecast import forecast
from coupling.identification.next.moves import next_repeating, worse
from coupling.identification.next.repeatability import Hypotheses
from coupling.identification.next.repeating import RepeatablePart, as_before
from coupling.inverse.inversion import MovingRobot
from coupling.path.joint_path import JointPath
from coupling.results.forecast import RunForecast
from coupling.robot.inverter import Inverter
from coupling.run.models import Models

# Cutoffs below the highest one that are tried [Hz].
_LOWER = (1.6, 0.8, 0.3)
# A forecast of less than this part of the best measured run needs no other beside it.
_GAINS = 0.7
# Deviation of the simulated tool that is good enough for a forecast [m].
_GOAL = 1e-6


def selected(found: CommandPlan, models: Models, watch: Watch = unwatched) -> CommandPlan:
    """Return a plan with the correction that is forecast to leave least.

    Args:
        found: The plan.
        models: Simulation models of the robots.
        watch: Function called with the progress.

    Raises:
        PlanningError: If the path asks for more than the drives can do.
        SimulationError: If the robot cannot be simulated.
    """
    best_run = found.history.runs[found.judgement.best]
    measured = found.left(best_run.size)
    commanded = _commands(found, models)
    best: tuple[RepeatablePart | None, RunForecast] | None = None
    for number, beyond in enumerate(_tried(found)):
        watch(Progress("comparing corrections along the path", number, len(_LOWER) + 1))
        wrench = found.history.runs[-1].source.stored.wrench
        expected = forecast(replace(found, repeating=beyond), commanded(beyond), wrench)
        safe = _safe(expected, best_run.size.doubt, measured)
        if safe and (best is None or expected.rms < best[1].rms):
            best = beyond, expected
        if best is not None and best[1].rms < _GAINS * measured:
            break
    return _again(found) if best is None else replace(found, repeating=best[0])


def _safe(expected: RunForecast, doubt: float, measured: float) -> bool:
    """Return whether a command is forecast to leave less, and in three of four cases not to be worse.

    Args:
        expected: The forecast.
        doubt: Standard deviation of the square of what is measured [m^2].
        measured: Rms that the best command left [m].
    """
    return expected.rms < measured and not worse(expected.upper_quartile, measured, doubt)


def _tried(found: CommandPlan) -> Iterator[RepeatablePart | None]:
    """Yield corrections along the path, the highest cutoff first."""
    yield found.repeating
    if found.repeating is None:
        return
    model, before = found.move.model, Hypotheses.before(found.options.repeatability)
    for cutoff in _LOWER:
        if cutoff < found.repeating.cutoff:
            lower = replace(model, contraction=replace(model.contraction, cutoff=cutoff))
            yield next_repeating(
                found.history, replace(found.move, model=lower), found.judgement, before
            )


def _again(found: CommandPlan) -> CommandPlan:
    """Return the plan that gives the best command so far once more."""
    history, number = found.history, found.judgement.best
    run, x = history.runs[number], history.factors_of(number)
    own = next(move for move in found.moves if np.allclose(move.model.x, x, rtol=0.0, atol=1e-9))
    before = run.source.discrepancy
    kind = "parameters" if before is None else own.kind
    return replace(
        found,
        move=replace(own, kind=kind),
        repeating=None if before is None else as_before(before),
        judgement=replace(found.judgement, again=True),
    )


def _commands(found: CommandPlan, models: Models) -> Callable[[RepeatablePart | None], JointPath]:
    """Return the function that gives the command with a correction, under the wrench that was last."""
    history, source = found.history, found.history.runs[-1].source
    robot = history.robot_at(found.move.model.x)
    fmu = models.of(robot, source.torque_curve, source.drive).fmu
    inverter = Inverter(MovingRobot(robot, source.torque_curve), fmu, drive=source.drive)
    wanted = source.wanted_whole

    def command(beyond: RepeatablePart | None) -> JointPath:
        path = wanted.path if beyond is None else beyond.discrepancy(history).model(wanted.path)
        corrected = replace(wanted, path=path)
        return inverter.invert(corrected, source.controller, _GOAL, unwatched).joints

    return command

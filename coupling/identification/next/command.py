"""The next command of a robot that was measured: what is learned of the runs, and by which move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import LearnError
from coupling.events import Progress, Watch, unwatched
from coupling.identification.next.causes import Cause, causes, largest, no_parameters
from coupling.identification.next.history import History
from coupling.identification.next.moves import NextStep, compared_runs, moves, next_repeating
from coupling.identification.next.options import NextOptions
from coupling.identification.next.possible_robot import earlier_models, file_model, learned_model
from coupling.identification.next.repeatability import Hypotheses
from coupling.identification.next.repeating import RepeatablePart, compared
from coupling.identification.runs.learning import Learned, LearnOptions, assessed, fitted
from coupling.identification.runs.problem import FramePrior
from coupling.identification.runs.source import MeasuredFile
from coupling.results.next_result import Contraction, DeviationSize, RunComparison
from coupling.run.models import Models

# Runs from which parameters are learned without a request; the second one where the first told
# nothing, or where its fit left so much more than the variance of noise: it may have ended beside.
_LEARNED_FROM, _BESIDE = 2, 3.0
# Turns of parameters and of what they do not explain; variance of what is left by that of noise, below
# which there is nothing else in it; a turn that does not lower it to this part is the last.
_TURNS, _NOISE, _LESS = 3, 1.5, 0.9
# What parameters are learned with where the frame is not known better.
_FRAME = FramePrior()


@dataclass(frozen=True)
class CommandPlan:
    """How the next command is to be computed.

    Attributes:
        history: The runs.
        moves: All moves, the best one first.
        move: The one that is taken.
        judgement: The last run beside the best one.
        repeating: Part that is corrected along the path; None: nothing.
        learned: Result of learning parameters from these runs; None where that was not done.
        options: Options that it was found with.
        hypotheses: Hypotheses on what is new in every run, and on how wrong the model is.
        causes: Likely causes of the deviation beyond the model, the largest first.
    """

    history: History
    moves: tuple[NextStep, ...]
    move: NextStep
    judgement: RunComparison
    repeating: RepeatablePart | None
    learned: Learned | None
    options: NextOptions
    hypotheses: Hypotheses
    causes: tuple[Cause, ...] = ()

    @property
    def contraction(self) -> Contraction:
        """Gain and filter of learning along the path."""
        return self.move.model.contraction

    @property
    def reference(self) -> int:
        """Number of the run from which the next one is predicted."""
        back = self.judgement.worse or self.judgement.again
        return self.judgement.best if back else self.judgement.last

    def left(self, size: DeviationSize) -> float:
        """Return the rms of a deviation [m]: less a constant where the frame is not known."""
        return size.rms if self.options.absolute else size.rms_less_constant


def plan(
    sources: Sequence[MeasuredFile], options: NextOptions, models: Models, watch: Watch = unwatched
) -> CommandPlan:
    """Return how the next command of a robot is to be computed.

    Args:
        sources: Runs and what was measured under their commands, in their order.
        options: Options of the search.
        models: Simulation models of the robots.
        watch: Function called with the progress.

    Raises:
        LearnError: If the runs and measurements do not belong together, or the move or cutoff that is
            asked for is not to be had.
    """
    watch(Progress("comparing what was measured", 0, 1))
    history = History.of(sources, options.known, models)
    known = [file_model(history, options), *earlier_models(history, options)]
    learned = None
    wanted = options.move in ("parameters", "both")
    if wanted or (options.move == "auto" and _worth_learning(history, len(known) == 1)):
        learned = _learned(history, options, models, watch)
        if not learned.refusal:
            known.append(learned_model(history, learned, options))
        elif wanted and len(known) == 1:
            raise LearnError(
                f"--move {options.move}: no parameters are identifiable: {learned.refusal}"
            )
    before, every = Hypotheses.before(options.repeatability), range(len(sources))
    ranked = moves(history, known, options.absolute, before)
    history = history.beside(ranked[0].model.x)
    hypotheses = compared(history, ranked[0].model, every, before).hypotheses
    judgement = compared_runs(history, options.absolute, hypotheses.rms)
    offered = [own for own in ranked if options.move in ("auto", own.kind)]
    if judgement.worse:
        # Back to the best command: its own robot, and what was learned along the path with that.
        x = history.factors_of(judgement.best)
        offered = [
            own
            for own in ranked
            if own.learns_path and np.allclose(own.model.x, x, rtol=0.0, atol=1e-9)
        ]
    if not offered:
        raise LearnError(f"--move {options.move}: expected a robot with identifiable parameters")
    move = offered[0]
    history = history.beside(move.model.x)
    found = next_repeating(history, move, judgement, before)
    if move.model is not ranked[0].model:
        hypotheses = compared(history, move.model, every, before).hypotheses
    number = judgement.best if judgement.worse else judgement.last
    follows = largest(causes(history, move.model.x, number))
    return CommandPlan(
        history, tuple(ranked), move, judgement, found, learned, options, hypotheses, follows
    )


def _worth_learning(history: History, first: bool) -> bool:
    """Return whether parameters are to be learned of runs without being asked for.

    Args:
        history: The runs.
        first: Whether none have been learned so far.
    """
    if len(history.runs) > _LEARNED_FROM:
        return False
    forecast = history.runs[-1].source.forecast
    return first or (forecast is not None and forecast.left_over > _BESIDE)


def _learned(history: History, options: NextOptions, models: Models, watch: Watch) -> Learned:
    """Return what the runs tell of the parameters, behind what no parameter explains.

    The two hide each other: a fit takes hysteresis or an error of a gear for parameters, and a wrong
    backlash looks like these.  So they are found by turns, parameters first, until noise alone is left
    or no less.
    """
    shift, turn = options.known.shift, options.known.turn
    frame = FramePrior(min(shift, _FRAME.shift), min(turn, _FRAME.turn))
    own = LearnOptions(np.isinf(turn), seed=options.seed, known=frame)
    sources = [
        replace(run.source, measured=replace(run.source.measured, position=run.tcp_positions))
        for run in history.runs
    ]
    best = fitted(sources, replace(own, start=history.start), models, watch)
    for _ in range(_TURNS):
        if best.fit.left_over.over < _NOISE:
            break
        x = best.fit.z[: len(history.start)]
        cleaned = _cleaned(history, x)
        if cleaned is None:
            break
        after = fitted(cleaned, replace(own, start=x), models, watch, best)
        if after.fit.left_over.over > _LESS * best.fit.left_over.over:
            break
        best = after
    return assessed(best, own, watch)


def _cleaned(history: History, x: np.ndarray) -> list[MeasuredFile] | None:
    """Return runs and what was measured less what no parameter explains; None where nothing is such."""
    cleaned, some = [], False
    for number, run in enumerate(history.runs):
        found = causes(history, x, number)
        moved = no_parameters(found, run.source.measured.time + run.clock)
        some = some or bool(np.any(moved))
        measured = replace(run.source.measured, position=run.tcp_positions - moved)
        cleaned.append(replace(run.source, measured=measured))
    return cleaned if some else None

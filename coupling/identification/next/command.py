"""The next command of a robot that was measured: its parameters once, then learning along the path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import LearnError
from coupling.events import Progress, Watch, unwatched
from coupling.identification.next.history import History
from coupling.identification.next.options import NextOptions
from coupling.identification.next.path_learning import (
    PathCorrection,
    compare_runs,
    correction_of,
    is_repeated,
    learn_path,
    weigh_runs,
)
from coupling.identification.next.possible_robot import (
    PossibleRobot,
    commanded_model,
    file_model,
    learned_model,
)
from coupling.identification.runs.learning import Learned, LearnOptions, learn
from coupling.identification.runs.problem import FramePrior
from coupling.identification.runs.source import MeasuredFile
from coupling.results.next_result import Contraction, RunComparison
from coupling.run.models import Models

# Parameters are learned from the first run, and anew from the first runs up to this number where the fit
# left so much more than the variance of noise: a gear may cross its backlash at another time.
_LEARNED_FROM, _UNEXPLAINED = 3, 3.0
# A correction that is expected to leave more than this part of the best run is not worth the risk.
_WORTH = 0.85
# What parameters are learned with where the frame is not known better.
_FRAME = FramePrior()


@dataclass(frozen=True)
class CommandPlan:
    """How the next command is to be computed.

    Attributes:
        history: The runs.
        model: The robot that the command is computed for.
        comparison: The last run beside the best one.
        correction: Part that is corrected along the path; None: nothing.
        learned: Result of learning parameters from these runs; None where that was not done.
        options: Options that it was found with.
        repeated: Whether what is left of the last run is more than by what the last two runs differ.
    """

    history: History
    model: PossibleRobot
    comparison: RunComparison
    correction: PathCorrection | None
    learned: Learned | None
    options: NextOptions
    repeated: bool

    @property
    def contraction(self) -> Contraction:
        """Gain and filter of learning along the path."""
        return self.model.contraction

    @property
    def move(self) -> str:
        """What is learned: "path", "parameters" or "both"."""
        if self.correction is None:
            return "parameters"
        return "both" if np.any(self.model.x) else "path"

    @property
    def reference(self) -> int:
        """Number of the run from which the next one is predicted."""
        back = self.comparison.worse or self.comparison.again
        return self.comparison.best if back else self.comparison.last


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
    model, learned = _robot(history, options, models, watch)
    history = history.beside(model.x)
    sizes = [run.size for run in history.runs]
    comparisons = [compare_runs(sizes[:count], options) for count in range(1, len(sizes) + 1)]
    comparison = comparisons[-1]
    if comparison.worse:
        # Back to the best command: its own robot, and what was learned along the path with that.
        model = commanded_model(history, comparison.best, options)
        history = history.beside(model.x)
    correction = None
    if options.move != "parameters":
        rms = [options.rms_of(size) for size in sizes]
        weights = weigh_runs(comparisons, rms, model.contraction.gain)
        correction = learn_path(history, model, weights)
        best = comparison.best
        if (
            best > 0
            and not learned
            and not comparison.worse
            and correction.left > _WORTH * rms[best]
        ):
            # Gears may cross their backlash elsewhere: not for so small a gain.
            comparison = replace(comparison, again=True)
            model = commanded_model(history, best, options)
            correction = correction_of(history.runs[best])
    repeated = is_repeated(history, model)
    return CommandPlan(history, model, comparison, correction, learned, options, repeated)


def _robot(
    history: History, options: NextOptions, models: Models, watch: Watch
) -> tuple[PossibleRobot, Learned | None]:
    """Return the robot that the next command is computed for, and what was learned of it now.

    Raises:
        LearnError: If parameters are asked for, and none are identifiable.
    """
    if options.move == "path":
        return file_model(history, options), None
    before = commanded_model(history, len(history.runs) - 1, options)
    asked_for = options.move in ("parameters", "both")
    unexplained = before.since == 0 or before.left_over > _UNEXPLAINED
    if not (asked_for or (len(history.runs) <= _LEARNED_FROM and unexplained)):
        return before, None
    learned = _learn(history, options, models, watch)
    if not learned.refusal:
        return learned_model(history, learned, options), learned
    if asked_for and before.since == 0:
        raise LearnError(
            f"--move {options.move}: no parameters are identifiable: {learned.refusal}"
        )
    return before, learned


def _learn(history: History, options: NextOptions, models: Models, watch: Watch) -> Learned:
    """Return what the runs tell of the parameters."""
    shift, turn = options.known.shift, options.known.turn
    frame = FramePrior(min(shift, _FRAME.shift), min(turn, _FRAME.turn))
    sources = [
        replace(run.source, measured=replace(run.source.measured, position=run.tcp_positions))
        for run in history.runs
    ]
    asked = LearnOptions(np.isinf(turn), seed=options.seed, known=frame)
    return learn(sources, asked, models, watch)

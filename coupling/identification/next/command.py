"""The next command of a measured robot: parameters from the first runs, then learning along the path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.events import Progress, Watch, unwatched
from coupling.identification.next.command_model import (
    CommandModel,
    learned_model,
    model_of_run,
)
from coupling.identification.next.history import History
from coupling.identification.next.measured_command import require_measured_under
from coupling.identification.next.options import NextOptions
from coupling.identification.next.path_learning import (
    PathCorrection,
    learn_path,
    learning_step,
)
from coupling.identification.runs.learning import learn
from coupling.identification.runs.problem import ANYWHERE, FramePrior
from coupling.identification.runs.results import Learned
from coupling.identification.runs.source import MeasuredFile
from coupling.results.next_result import LearningStep
from coupling.run.fmu_pool import FmuPool


@dataclass(frozen=True)
class CommandPlan:
    """How the next command is to be computed.

    Attributes:
        history: The runs.
        model: The robot that the command is computed for.
        step: Run from which the command goes on, and how far.
        correction: Part that is corrected along the path; None: nothing.
        tried_cutoff: Cutoff up to which a run has tried what learning does; at the first, its own [Hz].
        learned: Result of learning parameters from these runs; None where that was not done.
        options: Options of the search.
    """

    history: History
    model: CommandModel
    step: LearningStep
    correction: PathCorrection | None
    tried_cutoff: float
    learned: Learned | None
    options: NextOptions

    @property
    def is_refused(self) -> bool:
        """Whether parameters are asked for, and none are identifiable."""
        is_asked = self.options.move in ("parameters", "both")
        return is_asked and self.learned is not None and bool(self.learned.result.refusal)

    @property
    def move(self) -> str:
        """What is learned: "path", "parameters" or "both"."""
        if self.correction is None:
            return "parameters"
        return "both" if self.model.has_parameters else "path"


def plan(
    sources: Sequence[MeasuredFile], options: NextOptions, models: FmuPool, watch: Watch = unwatched
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
    history = History.of(sources, options.frame_accuracy, models)
    require_measured_under(history, options.random)
    learned = None
    if options.move in ("parameters", "both") or (options.move == "auto" and len(sources) == 1):
        learned = _learn(history, options, models, watch)
    if learned is not None and not learned.result.refusal:
        history = history.with_backlash_of(learned.robot)
        model = learned_model(history, learned.robot, options)
    else:
        number = 0 if options.move == "path" else len(sources) - 1
        model = model_of_run(history, number, options)
    history = history.aligned_with(model.x)
    sizes = [run.size for run in history.runs]
    step = learning_step(sizes, options)
    tried = learning_step(sizes[:-1] or sizes, options).cutoff
    if step.worse and learned is None:
        model = model_of_run(history, step.base, options)
        history = history.aligned_with(model.x)
    correction = None
    if options.move != "parameters":
        correction = learn_path(history, model, step.cutoff, options, step.worse)
    return CommandPlan(history, model, step, correction, tried, learned, options)


def _learn(history: History, options: NextOptions, models: FmuPool, watch: Watch) -> Learned:
    """Return the parameters that the runs identify."""
    shift, turn, usual = options.frame_accuracy.shift, options.frame_accuracy.turn, FramePrior()
    frame = FramePrior(min(shift, usual.shift), min(turn, usual.turn))
    sources = [
        replace(run.source, measured=replace(run.source.measured, position=run.tcp_positions))
        for run in history.runs
    ]
    return learn(sources, ANYWHERE if np.isinf(turn) else frame, models, watch)

"""The three moves to the next command: parameters, the path's deviation, both; and which is chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.identification.next.deviation_size import deviation_size
from coupling.identification.next.history import History
from coupling.identification.next.possible_robot import PossibleRobot
from coupling.identification.next.repeatability import VALUES, Hypotheses
from coupling.identification.next.repeating import RepeatablePart, repeating
from coupling.results.next_result import DeviationSize, RunComparison

# A move by a robot that was fitted to the run that judges it is to be better by this part.
_FITTED = 0.9
# A run is worse than another by this factor of the rms, and by so many standard deviations of noise.
_WORSE, _DOUBTS = 1.1, 2.0


@dataclass(frozen=True)
class NextStep:
    """A way to the next command.

    Attributes:
        kind: "path", "parameters" or "both".
        model: The robot that the command is computed for.
        size: Size of the deviation that it left, or would have left, of the last run.
        predicted: Whether the last run had no part in it.
    """

    kind: str
    model: PossibleRobot
    size: DeviationSize
    predicted: bool

    @property
    def learns_path(self) -> bool:
        """Whether the path's deviation is part of it."""
        return self.kind != "parameters"

    @property
    def words(self) -> str:
        """The move, in words."""
        if self.kind == "path":
            return "learning along the path alone, with the robot file's parameters"
        own = f"the parameters {self.model.name}"
        return own if self.kind == "parameters" else f"{own}, and learning along the path"


def moves(
    history: History, models: Sequence[PossibleRobot], absolute: bool, before: Hypotheses
) -> list[NextStep]:
    """Return every move with what it would have left of the last run, the best one first.

    From the second run on each move says from the runs before where the tool is in the last one,
    which is then compared.  A single run tells what the moves leave of itself: learning along the path
    what is faster than the cutoff.

    Args:
        history: The runs.
        models: Robots; the first is the file's.
        absolute: Whether the constant counts.
        before: Hypotheses on what is new in a run, before any is compared.
    """
    last = len(history.runs) - 1
    found = []
    for number, model in enumerate(models):
        beside = history.beside(model.x)
        path = _left_by_path(beside, model, before)
        predicted = model.since <= last
        found.append(
            NextStep("path" if not number else "both", model, path, predicted and last > 0)
        )
        if number:
            run = beside.runs[last]
            alone = deviation_size(
                run.measured.time, beside.beyond(last, model.x)[:, :3], run.noise
            )
            found.append(NextStep("parameters", model, alone, predicted))

    def judged(move: NextStep) -> float:
        left = move.size.rms if absolute else move.size.rms_less_constant
        return left / (_FITTED if move.model.since > last > 0 else 1.0)

    return sorted(found, key=judged)


def _left_by_path(history: History, model: PossibleRobot, before: Hypotheses) -> DeviationSize:
    """Return what learning along the path would have left of the last run."""
    last = len(history.runs) - 1
    run, beyond = history.runs[last], history.beyond(last, model.x)
    known = repeating(history, model, range(max(last, 1)), before)
    rest = beyond - known.at(run.measured.time)
    left = deviation_size(run.measured.time, rest[:, :3], run.noise)
    if last > 0:
        return left
    return replace(left, rms=known.left, rms_less_constant=known.left)


def compared_runs(history: History, absolute: bool, new: float = 0.0) -> RunComparison:
    """Return the last run of a history beside its best one.

    Args:
        history: The runs.
        absolute: Whether the constant counts: the frame is known.
        new: Rms of what is new in every run [m].
    """
    sizes = [run.size for run in history.runs]
    left = [own.rms if absolute else own.rms_less_constant for own in sizes]
    best, last = int(np.argmin(left)), len(left) - 1
    # A vector r with a new one n of few components in it has the square r^2 + n^2 + 2 r n.
    own = (2.0 * left[best] + new) * new / np.sqrt(VALUES)
    doubt = float(np.hypot(np.hypot(sizes[best].doubt, sizes[last].doubt), own))
    return RunComparison(best, last, worse(left[last], left[best], doubt))


def worse(rms: float, best: float, doubt: float) -> bool:
    """Return whether an rms is worse than another, beyond what is chance [m].

    Args:
        rms: Rms that is judged [m].
        best: The other one [m].
        doubt: Standard deviation of the difference of their squares [m^2].
    """
    return rms**2 > (_WORSE * best) ** 2 + _DOUBTS * doubt


def next_repeating(
    history: History, move: NextStep, judgement: RunComparison, before: Hypotheses
) -> RepeatablePart | None:
    """Return what is corrected along the path beyond the model; None where the move corrects nothing.

    Where the last run was worse than the best one it is that one's correction, and half of what that
    run tells beside it.
    """
    if not move.learns_path:
        return None
    if not judgement.worse:
        return repeating(history, move.model, range(len(history.runs)), before)
    gain = 0.5 * move.model.contraction.gain
    found = repeating(history, move.model, (judgement.best,), before, gain)
    corrected = history.runs[judgement.best].source.discrepancy
    if corrected is None:
        return found
    kept = (1.0 - found.weights[0]) * corrected.at(found.time)
    return replace(found, deviation=found.deviation + kept)

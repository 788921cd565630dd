"""First screens of identifications: whether a file was written, how well it predicts, what to do now."""

from __future__ import annotations

import math
from collections.abc import Sequence

from coupling.report.bars import bars
from coupling.report.lengths import NOT_KNOWN, in_words, words_if_known
from coupling.results.cutting_result import CuttingIdentified
from coupling.results.identified_result import IdentifiedResult
from coupling.results.motion_result import MotionResult
from coupling.results.parameter_result import ParameterResult
from coupling.results.response_result import ResponseFitResult
from coupling.results.section import UM, Answer, KeyFigure, NextStep

_NO_BETTER = (
    "The start file predicts these deflections as well as the new one does those it was not fitted to:"
    " keep it, unless it was fitted to these measurements itself."
)
# Log of an error that is told as a factor [1].
_LARGE = 0.7


def deflection_answer(result: IdentifiedResult, file: str) -> Answer:
    """Return the first screen of an identification from deflections, whose robot file is `file`."""
    sizes = result.rms_m
    plan = ["identify", "--plan", "-o", "plan.csv"]
    steps = [NextStep.by("Plan measurements that tell more:", *plan)]
    if not result.refusal:
        plan[2:2] = ["--robot", file]
        steps = [NextStep.by("Plan measurements for what is still open:", *plan)]
        steps = [*_use(file), *([] if _are_all_identified(result.parameters) else steps)]
    if sizes.left_out is None:
        error = words_if_known(sizes.fit)
        words = f"a deflection that was used is met to within {error}, typically"
    else:
        error = in_words(sizes.left_out)
        words = f"a deflection that was not used is predicted to within {error}, typically"
    is_doubtful = not result.refusal and sizes.is_no_better
    return Answer(
        sentence=_sentence(result.refusal, words, result.parameters),
        reason=_NO_BETTER if is_doubtful else "",
        good=None if is_doubtful else not result.refusal,
        figures=(
            KeyFigure(
                "Start file", words_if_known(sizes.start), "typical error of its deflections"
            ),
            KeyFigure("New file", words_if_known(sizes.left_out), "typical error of rows left out"),
            KeyFigure("Measured deflection", words_if_known(sizes.measured), "typical size"),
        ),
        steps=steps,
        picture=bars(
            [
                ("measured", sizes.measured),
                ("error, start file", sizes.start),
                ("error, new file", sizes.left_out),
            ]
        ),
    )


def response_answer(result: ResponseFitResult, file: str) -> Answer:
    """Return the first screen of an identification from responses, whose robot file is `file`."""
    predicted, reason = result.held_out, ""
    chosen, kind = (result.error, "fitted") if predicted is None else (predicted, "held out")
    words = f"half of the values of responses {kind} are met to within {_percent(chosen.written)}"
    good: bool | None = False
    steps = [NextStep("Compare both responses in the report; then run it again.")]
    if not result.refusal:
        good, steps = result.converged, _use(file)
        if predicted is None:
            good = None if good else False
            steps.append(NextStep("Check it in a posture that is not fitted: --hold-out FILE."))
            reason = "No posture was held out: nothing has checked posture, axes and tool."
        if not result.converged:
            reason = "The fit has not converged: its values may still change."
    return Answer(
        sentence=_sentence(result.refusal, words, result.parameters),
        reason=reason,
        good=good,
        figures=(
            KeyFigure("Start file", _percent(result.error.start), "error of half of the values"),
            KeyFigure("New file", _percent(result.error.written), "of responses that were fitted"),
            KeyFigure(
                "Held out",
                "none" if predicted is None else _percent(predicted.written),
                "of responses that were not fitted",
            ),
        ),
        steps=steps,
    )


def motion_answer(result: MotionResult, file: str) -> Answer:
    """Return the first screen of an identification from motion, whose robot file is `file`."""
    judge = result.recordings[-1]
    kind = "held out" if judge.held_out else "fitted"
    torques = [value for value in judge.torque_relative if value is not None]
    torque = f"{100.0 * max(torques):.2g} %" if torques else NOT_KNOWN
    steps = [NextStep("Look at what is named above in the report; then run it again.")]
    if not result.refusal:
        steps = _use(file)
    if not result.refusal and not judge.held_out:
        steps.append(NextStep("Check it by a recording that is not fitted: --hold-out FILE."))
    words = f"torques of a recording {kind} are met to within {torque} of their size"
    return Answer(
        sentence=_sentence(result.refusal, words, result.parameters),
        reason=""
        if result.converged
        else "The fit has not converged: its values may still change.",
        good=not result.refusal and result.converged,
        figures=(
            KeyFigure("Motor torque", torque, f"largest rms error of a joint, {kind}"),
            KeyFigure("Motor less link", _angle(judge.wind_up_rad), f"the same, {kind}"),
            KeyFigure("With lag alone", _angle(judge.wind_up_lag_alone_rad), "without the robot"),
        ),
        steps=steps,
    )


def cutting_answer(result: CuttingIdentified, file: str, is_case: bool) -> Answer:
    """Return the first screen of an identification from slots.

    Args:
        result: Its figures.
        file: File that is written, as commands name it.
        is_case: Whether it is a case; else keys of one.
    """
    steps = [NextStep("Compare the forces in the report; then run it again.")]
    if not result.refusal:
        steps = [NextStep("Correct the command:", f"elastic-robot compensate {file}")]
        if not is_case:
            steps = [
                NextStep(f"Have them written into your case: --case case.toml, or copy {file}.")
            ]
    words = f"a mean force at a feed that was not used is met to within {_force(result, 'mean')}"
    return Answer(
        sentence=_sentence(result.refusal, words, result.parameters),
        good=not result.refusal,
        figures=(
            KeyFigure("Mean forces", _force(result, "mean"), "largest error, feeds held out"),
            KeyFigure("Tooth passing", _force(result, "passing"), "the same, amplitude"),
            KeyFigure("Once a revolution", _force(result, "once"), "the same, amplitude"),
        ),
        steps=steps,
    )


def _sentence(refusal: str, words: str, parameters: Sequence[ParameterResult]) -> str:
    if refusal:
        return f"NOT IDENTIFIED, no file was written: {refusal}."
    identified = sum(parameter.identified for parameter in parameters)
    return f"IDENTIFIED: {words}; {identified} of {len(parameters)} parameters are identified."


def _are_all_identified(parameters: Sequence[ParameterResult]) -> bool:
    return all(parameter.identified for parameter in parameters)


def _use(file: str) -> list[NextStep]:
    return [
        NextStep(f"Name {file} as description in [robot] of your case."),
        NextStep("Correct the command:", "elastic-robot compensate case.toml"),
    ]


def _percent(log_error: float) -> str:
    """Return a median of |log(model / measurement)| as a relative error, a factor where it is large."""
    if log_error > _LARGE:
        return f"a factor of {math.exp(min(log_error, 99.0)):.2g}"
    return f"{100.0 * math.expm1(log_error):.2g} %"


def _angle(errors: Sequence[float | None]) -> str:
    stated_errors = [value for value in errors if value is not None]
    return f"{UM * max(stated_errors):.3g} urad" if stated_errors else "not measured"


def _force(result: CuttingIdentified, quantity: str) -> str:
    """Return the largest error of a force that was held out."""
    errors = [
        abs(row.held_out_N - row.measured_N)
        for row in result.predictions
        if row.quantity == quantity and row.held_out_N is not None
    ]
    return f"{max(errors):.3g} N" if errors else NOT_KNOWN

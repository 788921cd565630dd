"""First screens of identifications: whether a file was written, how well it predicts, what to do now."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from coupling.path.length_text import in_words
from coupling.report.bars import bars
from coupling.report.curves import SvgCurve, curves
from coupling.report.lengths import NOT_KNOWN, words_if_known
from coupling.results.identified_result import (
    CuttingIdentified,
    IdentifiedResult,
    ResponseFitResult,
)
from coupling.results.modes_result import ResponseResult
from coupling.results.motion_result import MotionResult, RecordingResult
from coupling.results.parameter_result import ParameterResult
from coupling.results.section import UM, Answer, KeyFigure, NextStep

_KEEP = NextStep("Keep the start file, unless it was fitted to these measurements itself.")
_UNFINISHED = "The fit has not converged: its values may still change."
_MILLING = "elastic-robot init cell --process milling-force"
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
    sentence = _sentence(result.refusal, words, result.parameters)
    if is_doubtful:
        sentence = _no_better(words_if_known(sizes.start), words_if_known(sizes.left_out))
        steps = [_KEEP, *steps[1:], *_use(file)]
    return Answer(
        sentence=sentence,
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
    error = result.error if result.held_out is None else result.held_out
    kind = "that were used" if result.held_out is None else "that were not used"
    words = f"half of the values of responses {kind} are met to within {_percent(error.written)}"
    good: bool | None = not result.refusal and result.converged
    steps = [NextStep("Compare both responses in the report; then run it again.")]
    reason, sentence = "", _sentence(result.refusal, words, result.parameters)
    if not result.refusal:
        steps = _use(file)
        if error.written >= error.start:
            good = False
            sentence = _no_better(_percent(error.start), _percent(error.written))
            steps = [_KEEP, *steps]
        elif result.held_out is None:
            good = None if good else False
            steps.append(NextStep("Check it in a posture that is not fitted: --hold-out FILE."))
            reason = "No posture was held out: nothing has checked posture, axes and tool."
        elif good and any(posture.unloaded_joints for posture in result.postures):
            good, reason = None, "Some gears were without load: what is said below comes first."
        if not result.converged:
            reason = _UNFINISHED
    return Answer(
        sentence=sentence,
        reason=reason,
        good=good,
        figures=(
            KeyFigure("Start file", _percent(error.start), f"error of responses {kind}"),
            KeyFigure("New file", _percent(error.written), "the same"),
            KeyFigure("Fit", f"{100.0 * result.residual:.2g} %", _noise(result)),
        ),
        steps=steps,
        picture=_response_picture(result),
    )


def _noise(result: ResponseFitResult) -> str:
    return f"of what was used remains; noise alone would be {100.0 * result.noise:.2g} %"


def _response_picture(result: ResponseFitResult) -> str:
    """Return the largest response of the posture that judges, measured and predicted."""
    posture = next((p for p in result.postures if p.held_out), result.postures[0])

    def sizes(response: ResponseResult) -> np.ndarray:
        return UM * np.hypot(response.real_m_N, response.imag_m_N)

    measured = max(posture.measured, key=lambda response: float(sizes(response).max()))
    content = [
        SvgCurve("measured", "quiet", np.array(measured.frequency_Hz), sizes(measured), True)
    ]
    for words, colour, responses in (
        ("start file", "bad", posture.start),
        ("new file", "link", posture.written),
    ):
        content += [
            SvgCurve(words, colour, np.array(response.frequency_Hz), sizes(response))
            for response in responses
            if response.name == measured.name
        ]
    words = f"motion along {measured.name[0]} by a force along {measured.name[1]} [um/N]"
    return curves(content, "frequency [Hz]", words, logarithmic=True)


def motion_answer(result: MotionResult, file: str) -> Answer:
    """Return the first screen of an identification from motion, whose robot file is `file`."""
    judge = result.recordings[-1]
    kind = "not used" if judge.held_out else "used"
    errors = {k: error for k, error in enumerate(judge.torque_relative) if error is not None}
    worst = max(errors, key=lambda k: errors[k], default=0)
    torque = f"{100.0 * errors[worst]:.2g} %" if errors else NOT_KNOWN
    steps = [NextStep("Look at what is named above in the report; then run it again.")]
    if not result.refusal:
        steps = _use(file)
    if not result.refusal and not judge.held_out:
        steps.append(NextStep("Check it by a recording that is not fitted: --hold-out FILE."))
    words = f"motor torques of a recording that was {kind} are met to within {torque} of their size"
    return Answer(
        sentence=_sentence(result.refusal, words, result.parameters),
        reason="" if result.converged else _UNFINISHED,
        good=not result.refusal and result.converged,
        figures=(
            KeyFigure("Motor torque", torque, f"typical error of joint {worst + 1}, the worst"),
            KeyFigure(
                "Link behind its gear",
                _at_arm(judge.wind_up_rad),
                "typical error 1 m from the joint, the worst",
            ),
            KeyFigure(
                "With rigid gears",
                _at_arm(judge.wind_up_lag_alone_rad),
                "the same, without this file",
            ),
        ),
        steps=steps,
        picture=_torque_picture(judge, worst),
    )


def _torque_picture(judge: RecordingResult, joint: int) -> str:
    """Return the torque of a motor over time, measured and predicted."""
    time, measured = np.array(judge.time), np.array(judge.measured_torque[joint])
    predicted = measured - np.array(judge.left_torque[joint])
    return curves(
        [
            SvgCurve("measured", "quiet", time, measured),
            SvgCurve("predicted", "link", time, predicted),
        ],
        "time [s]",
        f"torque of motor {joint + 1} [N m]",
    )


def cutting_answer(result: CuttingIdentified, file: str, is_case: bool) -> Answer:
    """Return the first screen of an identification from slots.

    Args:
        result: Its figures.
        file: File that is written, as commands name it.
        is_case: Whether it is a case; else keys of one.
    """
    steps = [NextStep("Compare the forces in the report; then run it again.")]
    if not result.refusal and is_case:
        steps = [NextStep("Correct the command:", f"elastic-robot compensate {file}")]
    elif not result.refusal:
        steps = [
            NextStep(
                f"Copy the lines of {file} into [process] of your case; or begin one:", _MILLING
            )
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
        picture=_force_picture(result),
    )


def _force_picture(result: CuttingIdentified) -> str:
    """Return the mean forces over the feed, measured and fitted."""
    content = []
    for axis, colour in (("across", "link"), ("along", "bad"), ("axial", "good")):
        rows = [row for row in result.predictions if (row.quantity, row.axis) == ("mean", axis)]
        rows = sorted(rows, key=lambda row: row.feed_m_s)
        feed = np.array([6e4 * row.feed_m_s for row in rows])
        content.append(
            SvgCurve(axis, colour, feed, np.array([row.measured_N for row in rows]), True)
        )
        content.append(SvgCurve("", colour, feed, np.array([row.fitted_N for row in rows])))
    return curves(content, "feed [mm/min]; dots: measured, lines: fitted", "mean force [N]")


def _sentence(refusal: str, words: str, parameters: Sequence[ParameterResult]) -> str:
    if refusal:
        return f"NOT IDENTIFIED, no file was written: {refusal}."
    identified = sum(parameter.identified for parameter in parameters)
    return f"IDENTIFIED: {words}; {identified} of {len(parameters)} parameters are identified."


def _no_better(start: str, new: str) -> str:
    """Return that a start file predicts as well as a new one, with the errors of both in words."""
    return (
        f"NO BETTER THAN THE START FILE: it predicts what was measured to within {start}, typically, the"
        f" new one what it was not fitted to only to within {new}."
    )


def _are_all_identified(parameters: Sequence[ParameterResult]) -> bool:
    return all(parameter.identified for parameter in parameters)


def _use(file: str) -> list[NextStep]:
    words = f"Name {file} as description in [robot] of your case, and correct its command; or begin one:"
    return [NextStep(words, f"elastic-robot init cell --robot {file}")]


def _percent(log_error: float) -> str:
    """Return a median of |log(model / measurement)| as a relative error, a factor where it is large."""
    if log_error > _LARGE:
        return f"a factor of {math.exp(min(log_error, 99.0)):.2g}"
    return f"{100.0 * math.expm1(log_error):.2g} %"


def _at_arm(errors: Sequence[float | None]) -> str:
    """Return the largest of angles, as what it moves a metre away."""
    stated_errors = [value for value in errors if value is not None]
    return in_words(max(stated_errors)) if stated_errors else "not measured"


def _force(result: CuttingIdentified, quantity: str) -> str:
    """Return the largest error of a force that was held out."""
    errors = [
        abs(row.held_out_N - row.measured_N)
        for row in result.predictions
        if row.quantity == quantity and row.held_out_N is not None
    ]
    return f"{max(errors):.3g} N" if errors else NOT_KNOWN

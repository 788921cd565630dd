"""Why a robot that was fitted to frequency responses should not be written.

Responses may be of another robot, posture, axis or sign than is told.  A fit leaves a median of
|log(model / measurement)|: on five robots in three postures noise of 3 to 10 % leaves 0.05 to 0.3, links
that bend, which the model has not, 0.1 to 0.4, in a posture up to 0.7; another posture, robot, axis or
sign 0.66 to 2.6, in the worst posture 1 and more, with springs that are further from the robot's than
those of the start.  In a posture that a fit of the others predicts that median over theirs, the noise
of both being alike, is 0.7 to 1.3 on robots of the model, up to 2.0 on those with links that bend, and
2.6 to 8 where another posture is told.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from coupling.identification.evidence import predict_left_out
from coupling.identification.response.experiment import PostureResponse, ResponseProblem
from coupling.identification.response.fit import ResponseFit, fit_robot
from coupling.identification.response.posture import MeasuredPosture, log_residual
from coupling.modes.measured_response import MeasuredResponse, other_readings
from coupling.results.identified_result import ResponseFitResult
from elastic_robot.description import Robot

# Median of |log(model / measurement)| that no robot leaves, of all responses and of those in a posture.
LARGEST_ERROR, LARGEST_IN_A_POSTURE = 0.6, 0.9
# What to look at if they cannot be.
_CHECKS = (
    "check --posture-deg (degrees, order of the files), robot file, tool and payload, axes (those of the"
    " robot's base), signs and units [m/N]"
)
# Another meaning of the responses is named that leaves less than this part of the error.
_LIKELIER = 0.6
# A robot is written that is better than the start by this factor at least.
_BETTER = 0.95
# One that predicts what is held out worse than the start by this factor is not.
_WORSE = 1.2
# Half of the springs are not further from the start's, but for a factor in common: the median is that of
# twice what is known of them (logs in standard deviations).
_FAR_SPRINGS = 2.0 * 0.6745
# Fewer postures have none that the others determine.
_FEWEST = 3
# Error of a prediction over that of the fit that no right posture has, and below which none is refused.
_LARGEST_RATIO, _SMALL = 2.4, 0.5


def refusal_of(
    result: ResponseFitResult,
    postures: Sequence[PostureResponse],
    problem: ResponseProblem,
    log_factors: np.ndarray,
) -> str:
    """Return why no robot should be written, in words; "" where one may be.

    Args:
        result: Figures of the fit.
        postures: The linearised robot in all its postures.
        problem: Stiffness and damping of the start, and what is known of them.
        log_factors: Logs of fitted over start stiffness [1], (m,).
    """
    error, predicted = result.error, result.held_out
    sizes = [posture.error.written for posture in result.postures]
    worst = int(np.argmax(sizes))
    if error.written > LARGEST_ERROR or sizes[worst] > LARGEST_IN_A_POSTURE:
        name = result.postures[worst].name
        others = [
            (each.name, posture)
            for k, (each, posture) in enumerate(zip(result.postures, postures, strict=True))
            if k != worst
        ]
        return _describe_mismatch(name, sizes[worst], postures[worst], others, problem)
    far = _FAR_SPRINGS * float(problem.prior[0])
    off = np.median(np.abs(log_factors - np.median(log_factors)))
    if off > far:
        return (
            f"half of the springs would have to change by a factor of {np.exp(off):.2g} or more against"
            f" the others (expected {np.exp(far):.2g} at most): {_CHECKS}, and measure more directions"
            " and postures, which wrong springs cannot all explain"
        )
    if not any(parameter.identified for parameter in result.parameters):
        return "the responses identify neither a stiffness nor a damping"
    if error.written > _BETTER * error.start:
        return (
            "the robot would be no better than the start file, log(model / measurement)"
            f" {error.written:.3g} after {error.start:.3g}: {_CHECKS}"
        )
    if predicted is not None and predicted.written > _WORSE * predicted.start:
        return (
            "the robot would predict the responses that are held out worse than the start file does,"
            f" log(model / measurement) {predicted.written:.3g} after {predicted.start:.3g}: measure in"
            " more postures, and check that all files are of one robot, tool and payload"
        )
    return ""


def posture_unlike_others(
    robot: Robot, torque_curve: str, measured: Sequence[MeasuredPosture]
) -> str:
    """Return in words which posture cannot be the one that is told; empty if all can, or there are two.

    Args:
        robot, torque_curve: As of `fit_robot`.
        measured: Postures; those held out are left aside.
    """
    measured = [each for each in measured if not each.is_held_out]
    if len(measured) < _FEWEST:
        return ""

    def prediction(fitted: list[int], row: int) -> tuple[float, float, ResponseFit]:
        """Return medians of a posture's error and of that of the others, and their fit."""
        held_out = [replace(each, is_held_out=k not in fitted) for k, each in enumerate(measured)]
        fit = fit_robot(robot, torque_curve, held_out)
        sizes = [np.abs(log_residual(posture, fit.values)) for posture in fit.postures]
        predicted = float(np.median(sizes.pop(row)))
        return predicted, float(np.median(np.concatenate(sizes))), fit

    errors = predict_left_out(len(measured), prediction)
    row = int(np.argmax([predicted / others for predicted, others, _ in errors]))
    predicted, of_others, fitted = errors[row]
    if predicted <= max(_SMALL, _LARGEST_RATIO * of_others):
        return ""
    postures = [
        (each.name, posture) for each, posture in zip(measured, fitted.postures, strict=True)
    ]
    name, posture = postures.pop(row)
    return (
        f"{name}: a robot fitted to the other postures is off by a factor of {np.exp(predicted):.2g} or"
        f" more in half of its values, in theirs of {np.exp(of_others):.2g}"
        f"{_likely_reading(posture, postures, fitted.problem)}: {_CHECKS}"
    )


def _describe_mismatch(
    name: str,
    error: float,
    posture: PostureResponse,
    others: Sequence[tuple[str, PostureResponse]],
    problem: ResponseProblem,
) -> str:
    """Return why responses cannot be of the posture that is told, and what to check.

    Args:
        name: Name of their file.
        error: Median of |log(model / measurement)| that the fit leaves [1].
        posture: The start robot in the posture, with what was measured.
        others: Names and postures of other files.
        problem: Stiffness and damping of the start.
    """
    most = LARGEST_ERROR if error <= LARGEST_IN_A_POSTURE else LARGEST_IN_A_POSTURE
    return (
        f"{name}: half of its values stay off by a factor of {np.exp(error):.2g} or more, and no robot"
        f" like the start file has them in the posture told (log(model / measurement) {error:.2g},"
        f" expected {most:g} at most){_likely_reading(posture, others, problem)}: {_CHECKS}"
    )


def _likely_reading(
    posture: PostureResponse,
    others: Sequence[tuple[str, PostureResponse]],
    problem: ResponseProblem,
) -> str:
    """Return behind a semicolon what else the start file has responses for; empty without.

    Args:
        posture, others, problem: As of `_describe_mismatch`.
    """

    def start_error(changed: PostureResponse) -> float:
        residual, _ = changed.log_residual(problem.stiffness, problem.damping)
        return float(np.median(np.abs(residual)))

    readings = [
        (
            f"they were measured in the posture of {other_name}",
            replace(other, measured=posture.measured),
        )
        for other_name, other in others
    ]
    readings += [
        (words, replace(posture, measured=responses))
        for words, responses in _readings(posture.measured)
    ]
    errors = [start_error(changed) for _, changed in readings]
    best, error_as_told = int(np.argmin(errors)), start_error(posture)
    if errors[best] >= _LIKELIER * error_as_told:
        return ""
    words, _ = readings[best]
    return f"; the start file comes to {errors[best]:.2g} for {error_as_told:.2g} if {words}"


def _readings(
    measured: Sequence[MeasuredResponse],
) -> Iterator[tuple[str, tuple[MeasuredResponse, ...]]]:
    """Yield in words what else the numbers may be, and the responses that they then stand for."""
    yield from other_readings(measured)
    for axes in permutations("xyz"):
        if axes != ("x", "y", "z"):
            names = dict(zip("xyz", axes, strict=True))
            yield (
                f"x, y, z of the file are {', '.join(axes)} of the base",
                tuple(replace(r, name=names[r.name[0]] + names[r.name[1]]) for r in measured),
            )

"""Why a robot that was fitted to frequency responses should not be written."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coupling.identification.response.experiment import PostureResponse, ResponseProblem
from coupling.identification.response.mismatch import (
    CHECKS,
    LARGEST_ERROR,
    LARGEST_IN_A_POSTURE,
    describe_mismatch,
)
from coupling.results.response_result import ResponseFitResult

# A robot is written that is better than the start by this factor at least.
_BETTER = 0.95
# One that predicts what is held out worse than the start by this factor is not.
_WORSE = 1.2
# Half of the springs are not further from the start's, but for a factor in common: the median is that of
# twice what is known of them (logs in standard deviations).
_FAR_SPRINGS = 2.0 * 0.6745


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
        return describe_mismatch(name, sizes[worst], postures[worst], others, problem)
    far = _FAR_SPRINGS * float(problem.prior[0])
    off = np.median(np.abs(log_factors - np.median(log_factors)))
    if off > far:
        return (
            f"half of the springs would have to change by a factor of {np.exp(off):.2g} or more against"
            f" the others (expected {np.exp(far):.2g} at most): {CHECKS}, and measure more directions"
            " and postures, which wrong springs cannot all explain"
        )
    if not any(parameter.identified for parameter in result.parameters):
        return "the responses identify neither a stiffness nor a damping"
    if error.written > _BETTER * error.start:
        return (
            "the robot would be no better than the start file, log(model / measurement)"
            f" {error.written:.3g} after {error.start:.3g}: {CHECKS}"
        )
    if predicted is not None and predicted.written > _WORSE * predicted.start:
        return (
            "the robot would predict the responses that are held out worse than the start file does,"
            f" log(model / measurement) {predicted.written:.3g} after {predicted.start:.3g}: measure in"
            " more postures, and check that all files are of one robot, tool and payload"
        )
    return ""

"""Whether responses can be of the robot and the posture that are told, and what they look like if not.

A fit leaves a median of |log(model / measurement)|.  On five robots in three postures, noise of 3 to
10 % leaves 0.05 to 0.3; links that bend, which the model has not, 0.1 to 0.4, in a posture up to 0.7;
another posture, robot, axis or sign 0.66 to 2.6, in the worst posture 1 and more, with springs that are
further from the robot's than those of the start.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from coupling.identification.response.experiment import PostureResponse, ResponseProblem
from coupling.modes.measured_response import MeasuredResponse, other_readings

# Median of |log(model / measurement)| that no robot leaves, of all responses and of those in a posture.
LARGEST_ERROR, LARGEST_IN_A_POSTURE = 0.6, 0.9
# What to look at if they cannot be.
CHECKS = (
    "check --posture-deg (degrees, order of the files), robot file, tool and payload, axes (those of the"
    " robot's base), signs and units [m/N]"
)
# Another meaning of the responses is named that leaves less than this part of the error.
_BETTER = 0.6


def describe_mismatch(
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
        f" expected {most:g} at most){likely_reading(posture, others, problem)}: {CHECKS}"
    )


def likely_reading(
    posture: PostureResponse,
    others: Sequence[tuple[str, PostureResponse]],
    problem: ResponseProblem,
) -> str:
    """Return behind a semicolon what else the start file has responses for; empty without.

    Args:
        posture, others, problem: As of `describe_mismatch`.
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
    if errors[best] >= _BETTER * error_as_told:
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

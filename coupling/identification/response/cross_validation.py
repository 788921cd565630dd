"""Whether a posture is like the others: a robot fitted to them must predict it about as well as them.

The median of |log(model / measurement)| in the posture over that of the others, the noise of both
being alike, is 0.7 to 1.3 on robots of the model, up to 2.0 on robots with links that bend, which the
model has not, and 2.6 to 8 where another posture is told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from coupling.identification.response.fit import fit_robot
from coupling.identification.response.mismatch import CHECKS, likely_reading
from coupling.identification.response.posture import MeasuredPosture, log_residual
from elastic_robot.description import Robot

# Fewer postures have none that the others determine.
_FEWEST = 3
# Error of a prediction over that of the fit that no right posture has, and below which none is refused.
_LARGEST_RATIO, _SMALL = 2.4, 0.5


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
    errors = []
    for row in range(len(measured)):
        held_out = [replace(each, is_held_out=k == row) for k, each in enumerate(measured)]
        fitted = fit_robot(robot, torque_curve, held_out)
        sizes = [np.abs(log_residual(posture, fitted.values)) for posture in fitted.postures]
        predicted = float(np.median(sizes.pop(row)))
        errors.append((predicted, float(np.median(np.concatenate(sizes))), fitted))
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
        f"{likely_reading(posture, postures, fitted.problem)}: {CHECKS}"
    )

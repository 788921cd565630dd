"""Whether data support a parameter, by F test and leave-one-out, and a model, by what is left out."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from scipy.special import fdtrc

from coupling.identification.intervals import left_out
from coupling.identification.least_squares import LinearProblem
from coupling.results.parameter_result import EvidenceResult

SIGNIFICANT = 0.05
# An F, and a change, below this are rounding.
_ROUNDING = 1e-9
# Numbers that a fit of the others predicts to no better than this part of them are none of the model:
# right deflections leave 0.03 to 0.19 on six robots whose links bend as well; exchanged postures, joints
# or axes 0.46 to 1.2 (medians).
_PREDICTED = 0.35
# Rows that are left out to see whether they alone make the case.
_TRIMMED = 3

Predicted = TypeVar("Predicted")


def support(
    with_it: LinearProblem, tested: np.ndarray, weight: np.ndarray, tests: int
) -> EvidenceResult:
    """Test some parameters of a problem together against the problem without them.

    Args:
        with_it: The problem, without weights of the loss.
        tested: Mask of these parameters, (P,).
        weight: Weights of the loss, (k,).
        tests: Number of parameters tested together, by which `SIGNIFICANT` is divided (Bonferroni).
    """
    without = with_it.only(~tested)
    more = with_it.rank - without.rank
    if not with_it.scale[tested].any():
        return _untested("no effect on any measurement")
    if more == 0:
        return _untested("not distinguishable from the others")
    freedom = with_it.target.size - with_it.rank
    if freedom <= 0:
        return _untested("cannot be tested: as many unknowns as measured values")
    squares = [
        float(np.sum(p.residual(p.solve()) ** 2))
        for p in (without.weighted(weight), with_it.weighted(weight))
    ]
    error = max(squares[1], np.finfo(float).eps ** 2 * float(np.sum(with_it.target**2))) / freedom
    statistic = max(squares[0] - squares[1], 0.0) / more / error if error > 0.0 else 0.0
    statistic *= statistic > _ROUNDING
    probability = float(fdtrc(more, freedom, statistic))
    errors = [np.sum(left_out(p, weight) ** 2, axis=1) for p in (without, with_it)]
    change, trimmed, words = _change(*errors), None, ""
    is_supported = probability < SIGNIFICANT / tests and bool(errors[1].sum() < errors[0].sum())
    if is_supported and len(weight) >= 4 * _TRIMMED:
        problems = [without, with_it]
        for row in np.sort(np.argsort(-errors[0], kind="stable")[:_TRIMMED])[::-1]:
            problems = [p.without(int(row)) for p in problems]
            weight = np.delete(weight, row)
        trimmed = _change(*(left_out(p, weight) ** 2 for p in problems))
        words = f" ({100.0 * trimmed:+.1f} % without the {_TRIMMED} worst rows)"
    return EvidenceResult(
        F=statistic,
        probability=probability,
        left_out_change=change,
        left_out_change_without_worst=trimmed,
        supported=is_supported,
        in_words=f"F {statistic:.3g}, p {probability:.2g}, leave-one-out {100.0 * change:+.1f} %"
        f"{words}: {'supported' if is_supported else 'not supported'}",
    )


def predict_left_out(count: int, predict: Callable[[list[int], int], Predicted]) -> list[Predicted]:
    """Return what a fit of all others says of each part of a measurement: leave-one-out.

    For rows of a linear problem `left_out` says it without another fit.

    Args:
        count: Number of parts.
        predict: Function of the numbers of the parts that are fitted, and of the one that is predicted.

    Example:
        >>> predict_left_out(3, lambda fitted, part: (fitted, part))
        [([1, 2], 0), ([0, 2], 1), ([0, 1], 2)]
    """
    numbers = range(count)
    return [predict([k for k in numbers if k != part], part) for part in numbers]


def poor_prediction(
    what: str, others: str, errors: np.ndarray, sizes: np.ndarray, unit: str
) -> str:
    """Return in words that half of what was left out is predicted poorly; "" where it is not.

    Args:
        what, others: Names of the measured numbers, and of those that are fitted.
        errors, sizes: Sizes of errors of prediction and of what was measured, in the unit, (k,).
        unit: Their unit.
    """
    error, size = float(np.median(errors)), float(np.median(sizes))
    if error <= _PREDICTED * size:
        return ""
    return (
        f"half of the {what} are predicted by a fit of the {others} to no better than {error:.3g}"
        f" {unit}, of {size:.3g} {unit} that were measured (expected {100.0 * _PREDICTED:.0f} % at most)"
    )


def _change(without: np.ndarray, within: np.ndarray) -> float:
    """Return the change of a root mean square, by squares without and with the parameter [1]."""
    before, after = float(without.sum()), float(within.sum())
    change = float(np.sqrt(after / before) - 1.0) if before > 0.0 else 0.0
    return change if abs(change) > _ROUNDING else 0.0


def _untested(reason: str) -> EvidenceResult:
    return EvidenceResult(
        F=0.0,
        probability=1.0,
        left_out_change=0.0,
        left_out_change_without_worst=None,
        supported=False,
        in_words=reason,
    )

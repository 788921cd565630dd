"""What postures and loads do not identify: parameters without effect, and those that look alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from coupling.identification.least_squares import LinearProblem
from coupling.results.base import finite
from coupling.results.identified_result import AlikeResult, DirectionResult

# Condition indices above this are strong dependencies (Belsley, Kuh and Welsch 1980).
STRONG = 30.0
# Cosine of two columns from which on a pair looks alike.
ALIKE = 0.98
# Smallest part of a direction that is named, over the largest, by what it does: of one that is not
# observable at all, and of one that is hardly.
_NAMED_UNOBSERVABLE, _NAMED = 1e-3, 0.05


@dataclass(frozen=True)
class Separability:
    """How well the parameters are distinguishable.

    Attributes:
        condition: Largest over smallest singular value of the scaled columns that are observable; nan
            where there are none.
        without_effect: Parameters that no measurement moves.
        unseen: Directions that the data do not see.
        weak: Directions of a condition index above `STRONG`.
        pairs: Parameters two and two whose columns are alike, and their cosine.
    """

    condition: float
    without_effect: tuple[str, ...]
    unseen: tuple[DirectionResult, ...]
    weak: tuple[DirectionResult, ...]
    pairs: tuple[AlikeResult, ...]


def separability(problem: LinearProblem, names: Sequence[str]) -> Separability:
    """Return what a problem's columns do not distinguish.

    Args:
        problem: The problem in the rigid posture.
        names: Names of its parameters.
    """
    without_effect = problem.scale == 0.0
    acting = problem.only(~without_effect)
    acting_names = [name for name, none in zip(names, without_effect, strict=True) if not none]
    values, directions = acting.decomposition
    observable = values[: acting.rank]
    index = observable[:1] / observable
    return Separability(
        float(index[-1]) if len(index) else np.nan,
        tuple(name for name, none in zip(names, without_effect, strict=True) if none),
        tuple(_name_direction(acting, acting_names, d, np.inf) for d in _reduced(acting.unseen)),
        tuple(
            _name_direction(acting, acting_names, direction, float(i))
            for i, direction in zip(index, directions, strict=False)
            if i > STRONG
        ),
        tuple(_pairs(acting, acting_names)),
    )


def _reduced(directions: np.ndarray) -> np.ndarray:
    """Return directions that span the same, each with a parameter of its own and few others."""
    _, order = qr(directions, mode="r", pivoting=True)
    return np.linalg.solve(directions[:, order[: len(directions)]], directions)


def _name_direction(
    problem: LinearProblem, names: Sequence[str], direction: np.ndarray, index: float
) -> DirectionResult:
    least = _NAMED if np.isfinite(index) else _NAMED_UNOBSERVABLE
    chosen = np.flatnonzero(np.abs(direction) > least * np.abs(direction).max())
    chosen = chosen[np.argsort(-np.abs(direction[chosen]), kind="stable")]
    parts = (
        direction
        if any(names[int(j)].endswith("backlash") for j in chosen)
        else (
            direction * problem.scale  # [rad] beside [rad/(N m)] only by their effect
        )
    )
    relative = parts[chosen] / parts[chosen[0]]
    of_names, words = tuple(names[int(j)] for j in chosen), ""
    for part, name in zip(relative.tolist(), of_names, strict=True):
        sign = " - " if part < 0.0 else " + "
        size = "" if abs(abs(part) - 1.0) < 5e-3 else f"{abs(part):.2g} "
        words += f"{sign}{size}{name.removesuffix('.stiffness')}"
    return DirectionResult(
        names=of_names,
        parts=tuple(relative.tolist()),
        index=finite(index),
        in_words=words.removeprefix(" + "),
    )


def _pairs(problem: LinearProblem, names: Sequence[str]) -> list[AlikeResult]:
    cosines = problem.scaled.T @ problem.scaled
    first, second = np.nonzero(np.triu(np.abs(cosines) > ALIKE, k=1))
    return [
        AlikeResult(names=(names[int(i)], names[int(j)]), cosine=float(cosines[i, j]))
        for i, j in zip(first, second, strict=True)
    ]

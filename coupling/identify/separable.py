"""What postures and loads cannot tell: parameters without effect, and those that look alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coupling.identify.least_squares import LinearProblem

# Condition indices above this are strong dependencies (Belsley, Kuh and Welsch 1980).
STRONG = 30.0
# Cosine of two columns from which on a pair looks alike.
ALIKE = 0.98
# Smallest part of a direction that is named, over the largest.
_NAMED = 0.05


@dataclass(frozen=True)
class Direction:
    """A change of parameters that moves hardly any measured number.

    Attributes:
        names: Parameters that take part.
        parts: How much each changes, over the one that changes most, (len(names),).
        index: Condition index: largest singular value over that of this direction; infinite for one
            that the data do not see.
    """

    names: tuple[str, ...]
    parts: tuple[float, ...]
    index: float

    def in_words(self) -> str:
        """Return for instance `joint[2] - 0.98 joint[3]`."""
        words = ""
        for part, name in zip(self.parts, self.names, strict=True):
            sign = " - " if part < 0.0 else " + "
            size = "" if abs(abs(part) - 1.0) < 5e-3 else f"{abs(part):.2g} "
            words += f"{sign}{size}{name.removesuffix('.stiffness')}"
        return words.removeprefix(" + ")


@dataclass(frozen=True)
class Separability:
    """How well the parameters can be told apart.

    Attributes:
        condition: Largest over smallest singular value of the scaled columns that are seen; nan
            where there are none.
        silent: Parameters that no measurement moves.
        unseen: Directions that the data do not see.
        weak: Directions of a condition index above `STRONG`.
        pairs: Parameters two and two whose columns are alike, and their cosine.
    """

    condition: float
    silent: tuple[str, ...]
    unseen: tuple[Direction, ...]
    weak: tuple[Direction, ...]
    pairs: tuple[tuple[str, str, float], ...]


def separability(problem: LinearProblem, names: Sequence[str]) -> Separability:
    """Tell what a problem's columns cannot tell apart.

    Args:
        problem: The problem in the rigid posture.
        names: Of its parameters.
    """
    silent = problem.scale == 0.0
    values, directions = problem.decomposition
    largest = values.max(initial=0.0)
    count = problem.rank
    seen = values[:count]
    found = []
    for value, direction in zip(values, directions, strict=True):
        index = largest / value if value > 0.0 else np.inf
        if index > STRONG and np.abs(direction[silent]).max(initial=0.0) < 0.5:
            found.append((index, direction))
    unseen = [
        _named(problem, names, d, np.inf)
        for d in problem.unseen
        if np.abs(d[silent]).max(initial=0.0) < 0.5
    ]
    weak = [
        _named(problem, names, d, index) for index, d in found[: max(0, len(found) - len(unseen))]
    ]
    return Separability(
        float(largest / seen[-1]) if count else np.nan,
        tuple(name for name, none in zip(names, silent, strict=True) if none),
        tuple(unseen),
        tuple(weak),
        tuple(_pairs(problem, names)),
    )


def _named(
    problem: LinearProblem, names: Sequence[str], direction: np.ndarray, index: float
) -> Direction:
    parts = direction * problem.scale
    if any(name.endswith("backlash") for name in names):
        parts = direction  # [rad] beside [rad/(N m)]: by their effect
    chosen = np.flatnonzero(np.abs(parts) > _NAMED * np.abs(parts).max())
    chosen = chosen[np.argsort(-np.abs(parts[chosen]), kind="stable")]
    relative = parts[chosen] / parts[chosen[0]]
    return Direction(tuple(names[int(j)] for j in chosen), tuple(relative.tolist()), index)


def _pairs(problem: LinearProblem, names: Sequence[str]) -> list[tuple[str, str, float]]:
    cosines = problem.scaled.T @ problem.scaled
    first, second = np.nonzero(np.triu(np.abs(cosines) > ALIKE, k=1))
    return [
        (names[int(i)], names[int(j)], float(cosines[i, j]))
        for i, j in zip(first, second, strict=True)
    ]

"""Whether data support a tilt, a backlash, a constant loss or a shifted point: F test, leave-one-out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import f as fisher
from scipy.stats import t as student

from coupling.identification.static.accuracy import left_out
from coupling.identification.static.fit import StaticFit
from coupling.identification.static.least_squares import LinearProblem
from coupling.identification.static.measurements import Measurements
from coupling.identification.static.prediction import point_columns
from coupling.identification.verdict import quantile

SIGNIFICANT = 0.05
# A loss common to all rows is significant where it is this improbable by chance.
_SUSPICIOUS = 0.01
# Size of such a loss that is worth a word [m].
_SMALL = 1e-6
# An F below this is rounding.
_ROUNDING = 1e-9
# Rows that are left out to see whether they alone make the case.
_TRIMMED = 3
# A shift of a point that is worth a word [m].
_SIZE = 1e-3
_NAMES = ("measured point", "load point")


@dataclass(frozen=True)
class Evidence:
    """A parameter, or some together, beside a model without.

    Attributes:
        statistic: F: how much the squares fall for each parameter, over the variance.
        probability: Of an F as large by chance.
        without, within: Leave-one-out sums of squares, without and with the parameter, whitened.
        tests: Number of parameters tested together, by which `SIGNIFICANT` is divided (Bonferroni).
        trimmed: Change of the leave-one-out root mean square with the parameter, where the three rows
            that are predicted worst without it are left out of everything [1]; nan for too few rows.
        reason: Why it could not be tested; "" where it was.
    """

    statistic: float
    probability: float
    without: float
    within: float
    tests: int
    trimmed: float = np.nan
    reason: str = ""

    @property
    def change(self) -> float:
        """Change of the leave-one-out root mean square with the parameter [1]."""
        return _change(self.without, self.within)

    @property
    def significant(self) -> bool:
        """Whether the F test supports it."""
        return self.probability < SIGNIFICANT / self.tests

    @property
    def predicts(self) -> bool:
        """Whether rows left out are predicted better with it."""
        return self.within < self.without

    @property
    def supported(self) -> bool:
        """Whether both do."""
        return not self.reason and self.significant and self.predicts

    def in_words(self) -> str:
        """Return the verdict."""
        if self.reason:
            return self.reason
        rest = (
            f" ({100.0 * self.trimmed:+.1f} % without the {_TRIMMED} worst rows)"
            if self.supported and np.isfinite(self.trimmed)
            else ""
        )
        return (
            f"F {self.statistic:.3g}, p {self.probability:.2g}, leave-one-out"
            f" {100.0 * self.change:+.1f} %{rest}: {'supported' if self.supported else 'not supported'}"
        )


def support(with_it: LinearProblem, tested: np.ndarray, weight: np.ndarray, tests: int) -> Evidence:
    """Test some parameters of a problem together against the problem without them.

    Args:
        with_it: The problem, without weights of the loss.
        tested: Which parameters, (P,) of bool.
        weight: Weights of the loss, (k,).
        tests: Number of parameters tested together.
    """
    without = with_it.only(~tested)
    more = with_it.rank - without.rank
    if not with_it.scale[tested].any():
        return _untested(tests, "no measurement moves it")
    if more == 0:
        return _untested(tests, "not distinguishable from the others")
    freedom = with_it.target.size - with_it.rank
    if freedom <= 0:
        return _untested(tests, "cannot be tested: as many unknowns as numbers measured")
    squares = [
        float(np.sum(p.residual(p.solve()) ** 2))
        for p in (without.weighted(weight), with_it.weighted(weight))
    ]
    error = max(squares[1], np.finfo(float).eps ** 2 * float(np.sum(with_it.target**2))) / freedom
    statistic = max(squares[0] - squares[1], 0.0) / more / error if error > 0.0 else 0.0
    statistic *= statistic > _ROUNDING
    errors = [np.sum(left_out(p, weight) ** 2, axis=1) for p in (without, with_it)]
    found = Evidence(
        statistic,
        float(fisher.sf(statistic, more, freedom)),
        float(errors[0].sum()),
        float(errors[1].sum()),
        tests,
    )
    if not found.supported or len(errors[1]) < 4 * _TRIMMED:
        return found
    problems = [without, with_it]
    for row in np.sort(np.argsort(-errors[0], kind="stable")[:_TRIMMED])[::-1]:
        problems = [p.without(int(row)) for p in problems]
        weight = np.delete(weight, row)
    left = [float(np.sum(left_out(p, weight) ** 2)) for p in problems]
    return replace(found, trimmed=_change(*left))


def _change(without: float, within: float) -> float:
    return float(np.sqrt(within / without) - 1.0) if without > 0.0 else 0.0


def _untested(tests: int, reason: str) -> Evidence:
    return Evidence(0.0, 1.0, np.nan, np.nan, tests, reason=reason)


@dataclass(frozen=True)
class CommonLoss:
    """A deflection that is missing in every row, whatever its load: what friction takes.

    Attributes:
        value: [m]; negative where rows deflect by more, as with backlash.
        half: Half width of its 95 % interval [m].
        probability: Of so large a value by chance.
    """

    value: float
    half: float
    probability: float

    def suspicion(self) -> str:
        """Return what is to be suspected, in words; "" for nothing."""
        if not self.probability < _SUSPICIOUS:
            return ""
        size = f"{1e3 * abs(self.value):.3f} +- {1e3 * self.half:.3f} mm"
        if self.value > 0.0:
            return (
                f"small loads deflect systematically less, by {size} at every load: friction or"
                " hysteresis suspected; measure loading and unloading"
            )
        return (
            f"small loads deflect systematically more, by {size} at every load: backlash suspected, or a"
            " zero reading that had not settled"
        )


def common_loss(
    problem: LinearProblem, weight: np.ndarray, white: np.ndarray, predicted: np.ndarray
) -> CommonLoss | None:
    """Return the loss that fits best, beside all parameters; None where it is not identifiable.

    Args:
        problem: The problem, without weights of the loss function.
        weight: Those weights, (k,).
        white: W_i, (k, r, r).
        predicted: Predicted deflections, (k, r).
    """
    way = predicted.copy()
    way[:, 3:] = 0.0
    length = np.linalg.norm(way, axis=1, keepdims=True)
    way = np.divide(-way, length, out=np.zeros_like(way), where=length > 0.0)
    column = np.einsum("kij,kj->ki", white, way)
    extended = problem.also(column, _SMALL, signed=True).weighted(weight)
    freedom = problem.target.size - extended.rank
    if extended.rank == problem.rank or freedom <= 0:
        return None
    found = extended.solve(-np.inf)
    variance = float(np.sum(extended.residual(found) ** 2)) / freedom
    deviation = float(extended.spread[-1] * extended.scale[-1] * np.sqrt(variance))
    if not deviation > 0.0:
        return None
    value = float(found[-1])
    probability = float(2.0 * student.sf(abs(value) / deviation, freedom))
    return CommonLoss(value, quantile(freedom) * deviation, probability)


@dataclass(frozen=True)
class MovedPoint:
    """A shift common to all rows, beside all parameters.

    Attributes:
        name: "measured point" or "load point".
        shift: In the TCP's frame [m], (3,), to first order.
        support: Whether the data support it: three numbers together.
    """

    name: str
    shift: tuple[float, ...]
    support: Evidence

    def suspicion(self) -> str:
        """Return what is to be suspected, in words; "" for nothing."""
        if not self.support.supported:
            return ""
        place = ", ".join(f"{value:.3f}" for value in self.shift)
        return (
            f"the {self.name} seems to be [{place}] m from where the table has it, in the TCP's frame"
            f" and to first order ({self.support.in_words()}): look where it was"
        )


def moved_points(fit: StaticFit, measured: Measurements) -> list[MovedPoint]:
    """Return the shifts of both points that fit best, one point at a time.

    Args:
        fit: The fit.
        measured: The measurements.
    """
    columns = point_columns(fit.elasticity, measured, fit.values)
    found = []
    for name, own in zip(_NAMES, columns, strict=True):
        problem = fit.problem
        for column in np.moveaxis(fit.white @ own, 2, 0):
            problem = problem.also(column, _SIZE, signed=True)
        tested = np.arange(len(problem.start)) >= len(fit.values)
        shift = problem.weighted(fit.weight).solve()[tested]
        own_support = support(problem, tested, fit.weight, len(_NAMES))
        found.append(MovedPoint(name, tuple(shift.tolist()), own_support))
    return found

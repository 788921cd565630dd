"""Whether data support a parameter, or some together: F test and leave-one-out, both."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc

from coupling.identification.intervals import left_out
from coupling.identification.least_squares import LinearProblem

SIGNIFICANT = 0.05
# An F below this is rounding.
_ROUNDING = 1e-9
# Rows that are left out to see whether they alone make the case.
_TRIMMED = 3


@dataclass(frozen=True)
class Evidence:
    """A parameter, or some together, beside a model without.

    Attributes:
        statistic: F: fall of the squares for each parameter, over the variance.
        probability: Probability of an F as large by chance.
        without, within: Leave-one-out sums of squares, without and with the parameter, whitened.
        tests: Number of parameters tested together, by which `SIGNIFICANT` is divided (Bonferroni).
        trimmed: Change of the leave-one-out root mean square with the parameter, where the three rows
            that are predicted worst without it are left out of everything [1]; nan for too few rows.
        reason: Reason for which it could not be tested; "" where it was.
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
    def is_supported(self) -> bool:
        """Whether both do."""
        return not self.reason and self.significant and self.predicts

    def in_words(self) -> str:
        """Return the verdict."""
        if self.reason:
            return self.reason
        without_worst = (
            f" ({100.0 * self.trimmed:+.1f} % without the {_TRIMMED} worst rows)"
            if self.is_supported and np.isfinite(self.trimmed)
            else ""
        )
        return (
            f"F {self.statistic:.3g}, p {self.probability:.2g}, leave-one-out"
            f" {100.0 * self.change:+.1f} %{without_worst}:"
            f" {'supported' if self.is_supported else 'not supported'}"
        )


def support(with_it: LinearProblem, tested: np.ndarray, weight: np.ndarray, tests: int) -> Evidence:
    """Test some parameters of a problem together against the problem without them.

    Args:
        with_it: The problem, without weights of the loss.
        tested: Mask of these parameters, (P,).
        weight: Weights of the loss, (k,).
        tests: Number of parameters tested together.
    """
    without = with_it.only(~tested)
    more = with_it.rank - without.rank
    if not with_it.scale[tested].any():
        return _untested(tests, "no effect on any measurement")
    if more == 0:
        return _untested(tests, "not distinguishable from the others")
    freedom = with_it.target.size - with_it.rank
    if freedom <= 0:
        return _untested(tests, "cannot be tested: as many unknowns as measured values")
    squares = [
        float(np.sum(p.residual(p.solve()) ** 2))
        for p in (without.weighted(weight), with_it.weighted(weight))
    ]
    error = max(squares[1], np.finfo(float).eps ** 2 * float(np.sum(with_it.target**2))) / freedom
    statistic = max(squares[0] - squares[1], 0.0) / more / error if error > 0.0 else 0.0
    statistic *= statistic > _ROUNDING
    errors = [np.sum(left_out(p, weight) ** 2, axis=1) for p in (without, with_it)]
    evidence = Evidence(
        statistic,
        float(fdtrc(more, freedom, statistic)),
        float(errors[0].sum()),
        float(errors[1].sum()),
        tests,
    )
    if not evidence.is_supported or len(errors[1]) < 4 * _TRIMMED:
        return evidence
    problems = [without, with_it]
    for row in np.sort(np.argsort(-errors[0], kind="stable")[:_TRIMMED])[::-1]:
        problems = [p.without(int(row)) for p in problems]
        weight = np.delete(weight, row)
    trimmed = [float(np.sum(left_out(p, weight) ** 2)) for p in problems]
    return replace(evidence, trimmed=_change(*trimmed))


def _change(without: float, within: float) -> float:
    return float(np.sqrt(within / without) - 1.0) if without > 0.0 else 0.0


def _untested(tests: int, reason: str) -> Evidence:
    return Evidence(0.0, 1.0, np.nan, np.nan, tests, reason=reason)

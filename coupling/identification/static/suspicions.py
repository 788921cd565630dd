"""Errors common to all rows of measured deflections: a constant loss, a shifted point."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtr

from coupling.identification.evidence import support
from coupling.identification.intervals import quantile
from coupling.identification.static.fit import StaticExperiment
from coupling.identification.static.prediction import point_columns
from coupling.results.identified_result import CommonLossResult

# A loss common to all rows is significant where it is this improbable by chance.
_SUSPICIOUS = 0.01
# Sizes of a loss and of a point's shift that are worth a word [m].
_SMALL, _SIZE = 1e-6, 1e-3
_NAMES = ("measured point", "load point")


def loss_suspicion(loss: CommonLossResult | None) -> str:
    """Return what is to be suspected of a loss, in words; "" for nothing."""
    if loss is None or not loss.probability < _SUSPICIOUS:
        return ""
    size = f"{1e3 * abs(loss.value_m):.3f} +- {1e3 * loss.half_m:.3f} mm"
    if loss.value_m > 0.0:
        return (
            f"deflections are systematically too small, by {size} at every load: possibly"
            " friction or hysteresis; measure loading and unloading"
        )
    return (
        f"deflections are systematically too large, by {size} at every load: possibly backlash, or a"
        " zero reading that had not settled"
    )


def common_loss(at: StaticExperiment) -> CommonLossResult | None:
    """Return the loss that fits best, beside all parameters; None where it is not identifiable."""
    problem, way = at.linear, at.prediction.deflection.copy()
    way[:, 3:] = 0.0
    length = np.linalg.norm(way, axis=1, keepdims=True)
    way = np.divide(-way, length, out=np.zeros_like(way), where=length > 0.0)
    column = np.einsum("kij,kj->ki", at.white, way)
    extended = problem.also(column, _SMALL, signed=True).weighted(at.weight)
    freedom = problem.target.size - extended.rank
    if extended.rank == problem.rank or freedom <= 0:
        return None
    solution = extended.solve(-np.inf)
    variance = float(np.sum(extended.residual(solution) ** 2)) / freedom
    deviation = float(extended.spread[-1] * extended.scale[-1] * np.sqrt(variance))
    if not deviation > 0.0:
        return None
    value = float(solution[-1])
    probability = float(2.0 * stdtr(freedom, -abs(value) / deviation))
    return CommonLossResult(
        value_m=value, half_m=quantile(freedom) * deviation, probability=probability
    )


def point_suspicions(at: StaticExperiment) -> list[str]:
    """Return what is to be suspected of both points, in words: a shift common to all rows of one."""
    suspicions = []
    columns = point_columns(at.problem.elasticity, at.problem.measured, at.x)
    for name, by_shift in zip(_NAMES, columns, strict=True):
        problem = at.linear
        for column in np.moveaxis(at.white @ by_shift, 2, 0):
            problem = problem.also(column, _SIZE, signed=True)
        tested = np.arange(len(problem.start)) >= len(at.x)
        evidence = support(problem, tested, at.weight, len(_NAMES))
        if evidence.supported:
            shift = problem.weighted(at.weight).solve()[tested]
            place = ", ".join(f"{value:.3f}" for value in shift)
            suspicions.append(
                f"the {name} seems to be [{place}] m from its place in the table, in the TCP's frame:"
                " check where it was; with it there, deflections that were not used are predicted"
                f" {-100.0 * (evidence.left_out_change or 0.0):.0f} % better"
            )
    return suspicions

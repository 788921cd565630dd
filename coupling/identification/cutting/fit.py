"""Coefficients from mean forces, then run-out from the course over a revolution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from coupling.errors import IdentifyError
from coupling.identification.cutting.course import slot_amplitudes
from coupling.identification.cutting.slots import MeasuredSlots, SlotCutter
from coupling.identification.verdict import quantile
from coupling.process.cutting_force import CuttingCoefficients

COEFFICIENTS = ("K_tc_Pa", "K_rc_Pa", "K_ac_Pa", "K_te_N_m", "K_re_N_m", "K_ae_N_m")
# Errors of amplitudes, by themselves, at the spindle's and the teeth's frequency; what a dynamometer
# shows of them is about all [1].
_ONCE, _PASSING, _RATIO = 0.08, 0.05, 0.4
# A smaller amplitude is none [N].
_LEAST = 1.0
# First run-outs [m].
_FIRST = (8e-6, 1.5e-5)


@dataclass(frozen=True)
class CuttingFit:
    """What slots say of a material, an edge and a spindle.

    Attributes:
        values: Coefficients in the order of COEFFICIENTS, in their units, (6,).
        half: Half 95 % intervals of them, in their units [Pa, N/m], (6,).
        run_out: Run-out [m].
        run_out_half: Half its 95 % interval [m].
        shown: Ratios of shown to real amplitudes: at the spindle's frequency across, along, axial, and
            at that of the teeth across and along [1], (5,).
    """

    values: np.ndarray
    half: np.ndarray
    run_out: float
    run_out_half: float
    shown: np.ndarray

    @property
    def coefficients(self) -> CuttingCoefficients:
        """The coefficients."""
        return CuttingCoefficients(*self.values.tolist())

    def predicted(self, cutter: SlotCutter, feed: np.ndarray) -> MeasuredSlots:
        """Return what the dynamometer would show at feeds [m/s], (n,)."""
        once, passing = slot_amplitudes(self.coefficients, self.run_out, cutter, feed)
        by_chip, by_edge = self.values[:3] * _PER_CHIP, self.values[3:] * _PER_EDGE
        edges = cutter.teeth * cutter.depth
        mean = edges * _SIGNS * (cutter.chip(feed)[:, None] * by_chip + by_edge)
        passing[:, :2] *= self.shown[3:]
        return MeasuredSlots(feed, mean, once * self.shown[:3], passing, ("", "", ""))


# Means in a slot by K_c c and by K_e, across, along and axial [Altintas2012, eq. (2.38)].
_PER_CHIP = np.array([0.25, 0.25, 1.0 / np.pi])
_PER_EDGE = np.array([1.0 / np.pi, 1.0 / np.pi, 0.5])
_SIGNS = np.array([1.0, -1.0, 1.0])


def fitted_slots(cutter: SlotCutter, slots: MeasuredSlots) -> CuttingFit:
    """Return what fits slots best.

    Raises:
        IdentifyError: If the mean across the feed does not rise with it.
    """
    values, half = _of_means(cutter, slots)
    coefficients = CuttingCoefficients(*values.tolist())
    measured_once = np.maximum(slots.once, _LEAST)
    # Axially the teeth of a slot nearly add up to a constant: what is left there says nothing.
    measured_passing = np.maximum(slots.passing[:, :2], _LEAST)

    def residual(unknown: np.ndarray) -> np.ndarray:
        once, passing = slot_amplitudes(coefficients, 1e-5 * unknown[0], cutter, slots.feed)
        return np.concatenate(
            [
                ((once * unknown[1:4] / measured_once - 1.0) / _ONCE).ravel(),
                ((passing[:, :2] * unknown[4:] / measured_passing - 1.0) / _PASSING).ravel(),
                (unknown[1:] - 1.0) / _RATIO,
            ]
        )

    solutions = [
        least_squares(residual, [1e5 * first, 1.0, 1.0, 1.0, 1.0, 1.0], bounds=(0.0, np.inf))
        for first in _FIRST
    ]
    best = min(solutions, key=lambda solution: float(solution.cost))
    freedom = len(best.fun) - len(best.x)
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * max(2.0 * best.cost / freedom, 1.0)
    return CuttingFit(
        values,
        half,
        1e-5 * float(best.x[0]),
        1e-5 * quantile(freedom) * float(np.sqrt(covariance[0, 0])),
        best.x[1:],
    )


def _of_means(cutter: SlotCutter, slots: MeasuredSlots) -> tuple[np.ndarray, np.ndarray]:
    """Return coefficients and half their 95 % intervals: means are linear in the feed."""
    chip, edges = cutter.chip(slots.feed), cutter.teeth * cutter.depth
    values, half = np.empty(6), np.empty(6)
    columns = np.column_stack([chip, np.ones(len(chip))])
    inverse = np.linalg.inv(columns.T @ columns)
    freedom = len(chip) - 2
    for axis in range(3):
        target = _SIGNS[axis] * slots.mean[:, axis]
        line = inverse @ columns.T @ target
        variance = float(np.sum((columns @ line - target) ** 2)) / freedom
        spread = quantile(freedom) * np.sqrt(variance * np.diag(inverse))
        factors = np.array([_PER_CHIP[axis], _PER_EDGE[axis]]) * edges
        values[[axis, 3 + axis]] = line / factors
        half[[axis, 3 + axis]] = spread / factors
    if not values[0] > 0.0:
        raise IdentifyError(
            "expected a mean force across the feed that rises with it, got one that falls: look at the"
            " columns of the axes"
        )
    # Rubbing alone cannot pull a tool on.
    return np.maximum(values, 0.0), half

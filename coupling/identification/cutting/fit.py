"""Coefficients and run-out from forces in slots: means and amplitudes, fitted together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.cutting.course import slot_forces
from coupling.identification.cutting.slots import MeasuredSlots, SlotCutter
from coupling.identification.differenced import DifferencedResidual
from coupling.identification.estimate import estimate
from coupling.identification.intervals import quantile
from coupling.process.cutting_force import CuttingCoefficients

COEFFICIENTS = ("K_tc_Pa", "K_rc_Pa", "K_ac_Pa", "K_te_N_m", "K_re_N_m", "K_ae_N_m")
# Errors: of means by the largest one, of amplitudes by themselves at the spindle's and the teeth's
# frequency; what a dynamometer shows of them is about all [1].
_MEAN, _ONCE, _PASSING, _RATIO = 0.025, 0.08, 0.05, 0.15
# A smaller amplitude is none [N].
_LEAST = 1.0
# Steps of a fit, and predicted gain of log likelihood below which it ends.
_MOST_STEPS, _SETTLED = 100, 1e-10
# First run-outs [m].
_FIRST = (8e-6, 1.5e-5)
# Sizes of a coefficient of a cut [Pa], of an edge [N/m], of a run-out [m].
_PER_CUT, _PER_LENGTH, _RUN_OUT = 1e9, 1e4, 1e-5
# Means in a slot without run-out by K_c c and by K_e, across, along, axial [Altintas2012, eq. (2.38)].
_PER_CHIP = np.array([0.25, 0.25, 1.0 / np.pi])
_PER_EDGE = np.array([1.0 / np.pi, 1.0 / np.pi, 0.5])
_SIGNS = np.array([1.0, -1.0, 1.0])


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
        mean, once, passing = slot_forces(self.coefficients, self.run_out, cutter, feed)
        passing[:, :2] *= self.shown[3:]
        return MeasuredSlots(feed, mean, once * self.shown[:3], passing, ("", "", ""))


def fitted_slots(cutter: SlotCutter, slots: MeasuredSlots) -> CuttingFit:
    """Return what fits slots best.

    Raises:
        IdentifyError: If the mean across the feed does not rise with it.
    """
    size = np.repeat([_PER_CUT, _PER_LENGTH], 3)
    first = _without_run_out(cutter, slots) / size
    mean_error = _MEAN * np.abs(slots.mean).max()
    measured_once = np.maximum(slots.once, _LEAST)
    # Axially the teeth of a slot nearly add up to a constant: what is left there says nothing.
    measured_passing = np.maximum(slots.passing[:, :2], _LEAST)

    def fit_of(unknown: np.ndarray) -> CuttingFit:
        values = unknown[:6] * size
        return CuttingFit(values, 0.0 * values, _RUN_OUT * float(unknown[6]), 0.0, unknown[7:])

    def residual(unknown: np.ndarray) -> np.ndarray:
        expected = fit_of(unknown).predicted(cutter, slots.feed)
        return np.concatenate(
            [
                ((expected.mean - slots.mean) / mean_error).ravel(),
                ((expected.once / measured_once - 1.0) / _ONCE).ravel(),
                ((expected.passing[:, :2] / measured_passing - 1.0) / _PASSING).ravel(),
                (unknown[7:] - 1.0) / _RATIO,
            ]
        )

    starts = [np.concatenate([first, [start / _RUN_OUT], np.ones(5)]) for start in _FIRST]
    bounds = np.zeros(len(starts[0])), np.full(len(starts[0]), np.inf)
    best = min(
        (
            estimate(
                DifferencedResidual(residual, start), bounds, _MOST_STEPS, _SETTLED
            ).linearisation
            for start in starts
        ),
        key=lambda point: point.cost,
    )
    jacobian, remaining = best.rows
    variance = 2.0 * best.cost / (len(remaining) - len(best.x))
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * max(variance, 1.0)
    # Forces of one feed err together: feeds are counted, not forces.
    half = quantile(len(slots.feed) - 2) * np.sqrt(np.diag(covariance))
    fit = fit_of(best.x)
    return CuttingFit(fit.values, half[:6] * size, fit.run_out, _RUN_OUT * half[6], fit.shown)


def _without_run_out(cutter: SlotCutter, slots: MeasuredSlots) -> np.ndarray:
    """Return coefficients [Pa, N/m], (6,), by means that are straight in the feed."""
    chip, edges = cutter.chip(slots.feed), cutter.teeth * cutter.depth
    rise, intercept = np.polyfit(chip, _SIGNS * slots.mean, 1)
    if not rise[0] > 0.0:
        raise IdentifyError(
            "expected a mean force across the feed that rises with it, got one that falls: look at the"
            " columns of the axes"
        )
    # Rubbing alone cannot pull a tool on.
    return np.maximum(np.concatenate([rise / _PER_CHIP, intercept / _PER_EDGE]) / edges, 1.0)

"""Coefficients and run-out from forces in slots: their course over a revolution, fitted together."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from coupling.errors import IdentifyError
from coupling.identification.cutting.slots import MeasuredSlots, SlotCutter
from coupling.identification.intervals import quantile
from coupling.process.cutting_force import CuttingCoefficients

# Angles in a revolution, and slices over the depth.
_ANGLES, _SLICES = 96, 6
# An edge, which is round, begins to act where its chip is about so thick [m].
USUAL_ROUNDNESS = 8e-6
COEFFICIENTS = ("K_tc_Pa", "K_rc_Pa", "K_ac_Pa", "K_te_N_m", "K_re_N_m", "K_ae_N_m")
# Errors: of means by the largest one, of amplitudes by themselves at the spindle's and the teeth's
# frequency; what a dynamometer shows of them is about all [1].
_MEAN, _ONCE, _PASSING, _RATIO = 0.025, 0.08, 0.05, 0.15
# Difference of the teeth's edges that is usual, and at most [1].
_WORN, _MOST_WORN = 0.2, 0.9
# Roundness of edges, by the usual one: usual and largest logarithm [1].
_ROUND, _MOST_ROUND = 0.5, 1.5
# A smaller amplitude is none [N].
_LEAST = 1.0
# Relative change of unknowns and squares that ends a fit.
_EXACT = 1e-12
# First run-outs [m].
_FIRST = (8e-6, 1.5e-5)
# Sizes of a coefficient of a cut [Pa], of an edge [N/m], of a run-out [m].
_PER_CUT, _PER_LENGTH, _RUN_OUT = 1e9, 1e4, 1e-5
# Means in a slot without run-out by K_c c and by K_e, across, along, axial [Altintas2012, eq. (2.38)].
_PER_CHIP = np.array([0.25, 0.25, 1.0 / np.pi])
_PER_EDGE = np.array([1.0 / np.pi, 1.0 / np.pi, 0.5])
_SIGNS = np.array([1.0, -1.0, 1.0])


def slot_forces(
    coefficients: CuttingCoefficients,
    run_out: float,
    cutter: SlotCutter,
    feed: np.ndarray,
    edge_difference: float = 0.0,
    roundness: float = USUAL_ROUNDNESS,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return means, and amplitudes at the frequencies of spindle and teeth, across, along, axial.

    A chip is what a tooth reaches beyond those before it, whose radii differ by the run-out of the axis:
    a tooth that reaches less leaves its chip to the next, and its edge does not act, so that means are
    not straight in the feed.

    Args:
        run_out: Distance of the cutter's axis from the spindle's, towards a tooth [m].
        cutter: Cutter and cut.
        feed: Feeds [m/s], (n,).
        edge_difference: Part by which the edge force of the tooth that reaches furthest exceeds the mean
            of all teeth [1], worn more than they; of others by the cosine of the angle between them.
        roundness: Chip at which three quarters of the edge force act, half of it where none is left, a
            quarter of it where the edge passes as much above the surface [m].

    Returns:
        Means and both amplitudes [N], (n, 3) each.
    """
    K = coefficients
    edges = ((K.K_tc, K.K_te), (K.K_rc, K.K_re), (K.K_ac, K.K_ae))
    chip = cutter.chip(feed)[:, None, None]
    angle = (np.arange(_ANGLES)[:, None] + 0.5) * 2.0 * np.pi / _ANGLES
    height = (np.arange(_SLICES) + 0.5) * cutter.depth / _SLICES
    lag = np.tan(cutter.helix) / (0.5 * cutter.diameter) * height
    teeth = np.arange(cutter.teeth)
    around = np.cos(2.0 * np.pi * teeth / cutter.teeth)
    radius, wear = run_out * around, 1.0 + edge_difference * around
    force = np.zeros((len(feed), _ANGLES, 3))
    for tooth in teeth:
        phi = (angle + 2.0 * np.pi * tooth / cutter.teeth - lag) % (2.0 * np.pi)
        sin, cos, is_in_slot = np.sin(phi), np.cos(phi), phi < np.pi
        reach = np.minimum.reduce(
            [
                passes * chip * sin + radius[tooth] - radius[(tooth - passes) % cutter.teeth]
                for passes in range(1, cutter.teeth + 1)
            ]
        )
        acts = is_in_slot / (1.0 + np.exp(-np.clip(reach / roundness, -50.0, 50.0)))
        thick = np.where(is_in_slot, np.maximum(reach, 0.0), 0.0)
        tangential, radial, axial = (
            by_chip * thick + wear[tooth] * edge * acts for by_chip, edge in edges
        )
        across, along = tangential * sin - radial * cos, -tangential * cos - radial * sin
        force += np.stack([across, along, axial], axis=-1).sum(axis=2) * cutter.depth / _SLICES
    spectrum = 2.0 * np.abs(np.fft.rfft(force, axis=1)) / _ANGLES
    return force.mean(axis=1), spectrum[:, 1], spectrum[:, cutter.teeth]


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
        edge_difference: Difference of the teeth's edge forces, as of `slot_forces` [1].
        roundness: Roundness of the edges, as of `slot_forces` [m].
    """

    values: np.ndarray
    half: np.ndarray
    run_out: float
    run_out_half: float
    shown: np.ndarray
    edge_difference: float = 0.0
    roundness: float = USUAL_ROUNDNESS

    @property
    def coefficients(self) -> CuttingCoefficients:
        """The coefficients."""
        return CuttingCoefficients(*self.values.tolist())

    def predicted(self, cutter: SlotCutter, feed: np.ndarray) -> MeasuredSlots:
        """Return what the dynamometer would show at feeds [m/s], (n,)."""
        mean, once, passing = slot_forces(
            self.coefficients,
            self.run_out,
            cutter,
            feed,
            self.edge_difference,
            self.roundness,
        )
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
        run_out, worn = _RUN_OUT * float(unknown[6]), float(unknown[12])
        roundness = USUAL_ROUNDNESS * float(np.exp(unknown[13]))
        return CuttingFit(values, 0.0 * values, run_out, 0.0, unknown[7:12], worn, roundness)

    def residual(unknown: np.ndarray) -> np.ndarray:
        expected = fit_of(unknown).predicted(cutter, slots.feed)
        return np.concatenate(
            [
                ((expected.mean - slots.mean) / mean_error).ravel(),
                ((expected.once / measured_once - 1.0) / _ONCE).ravel(),
                ((expected.passing[:, :2] / measured_passing - 1.0) / _PASSING).ravel(),
                (unknown[7:12] - 1.0) / _RATIO,
                unknown[12:] / [_WORN, _ROUND],
            ]
        )

    starts = [
        np.concatenate([first, [start / _RUN_OUT], np.ones(5), [0.0, 0.0]]) for start in _FIRST
    ]
    count = len(starts[0])
    bounds = (
        np.append(np.zeros(count - 2), [-_MOST_WORN, -_MOST_ROUND]),
        np.append(np.full(count - 2, np.inf), [_MOST_WORN, _MOST_ROUND]),
    )
    best = min(
        (
            least_squares(residual, start, "3-point", bounds, ftol=_EXACT, xtol=_EXACT, gtol=_EXACT)
            for start in starts
        ),
        key=lambda candidate: float(candidate.cost),
    )
    variance = 2.0 * best.cost / (len(best.fun) - count)
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * max(variance, 1.0)
    # Forces of one feed err together: feeds are counted, not forces.
    half = quantile(len(slots.feed) - 2) * np.sqrt(np.diag(covariance))
    fit = fit_of(best.x)
    return replace(fit, half=half[:6] * size, run_out_half=_RUN_OUT * float(half[6]))


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

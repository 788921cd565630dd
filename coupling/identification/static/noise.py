"""Standard deviations of measured deflections and loads, and the weights that follow."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.static.measurements import Measurements


@dataclass(frozen=True)
class MeasurementNoise:
    """Standard deviations of every number measured.

    Attributes:
        deflection: Deviations of deflections [m] and [rad], (k, r).
        wrench: Deviations of loads [N, N m], (k, 6).
        known: Whether those of the deflection were given; else they are estimated from residuals, one
            for positions and one for rotations.
    """

    deflection: np.ndarray
    wrench: np.ndarray
    known: bool

    def estimated(self, residual: np.ndarray) -> MeasurementNoise:
        """Return the noise with deviations that were not given taken from residuals, (k, r)."""
        if self.known:
            return self
        deflection = np.ones_like(residual)
        if residual.shape[1] == 6:
            # Only their ratio counts: no more rotations than positions, and neither without noise.
            position, rotation = (
                np.sqrt(np.mean(part**2)) for part in (residual[:, :3], residual[:, 3:])
            )
            if position > 0.0 and rotation > 0.0:
                deflection[:, 3:] = rotation / position
        return replace(self, deflection=deflection)


def noise_of(
    measured: Measurements,
    position: float | None = None,
    rotation: float | None = None,
    force: float | None = None,
    moment: float | None = None,
) -> MeasurementNoise:
    """Return the noise of measurements: their own columns, else one number for all rows.

    Args:
        measured: The measurements.
        position, rotation, force, moment: Standard deviations [m, rad, N, N m], or None.

    Raises:
        IdentifyError: If some are given and others that are needed beside them are not, or one of a
            deflection is zero.
    """
    common = np.repeat([_or_nan(position), _or_nan(rotation)], 3)[: measured.rows]
    own = measured.deflection_deviation
    deflection = np.where(np.isfinite(own), own, common)
    wrench = np.where(
        np.isfinite(measured.wrench_deviation),
        measured.wrench_deviation,
        np.repeat([_or_nan(force), _or_nan(moment)], 3),
    )
    wrench = np.where(np.isfinite(wrench), wrench, 0.0)
    given = np.isfinite(deflection)
    if not given.any():
        if wrench.any():
            raise IdentifyError(
                "standard deviations: expected those of the deflections (--sd-m, or columns sd.dx .."
                " sd.dz) beside those of the loads, got none"
            )
        return MeasurementNoise(np.ones_like(deflection), wrench, known=False)
    if not given.all():
        raise IdentifyError(
            "standard deviations: expected one of every number measured, got none of some: give"
            " --sd-m (and --sd-rad for rotations) for all that have no column"
        )
    if not np.all(deflection > 0.0):
        raise IdentifyError("standard deviations: expected numbers > 0 of deflections, got 0")
    return MeasurementNoise(deflection, wrench, known=True)


def whitening(noise: MeasurementNoise, by_wrench: np.ndarray) -> np.ndarray:
    """Return W_i with W_i S_i W_i^T = 1, S_i = diag(sd_d^2) + D_i diag(sd_w^2) D_i^T, (k, r, r).

    Args:
        noise: Standard deviations sd_d and sd_w.
        by_wrench: D, derivative of the deflections by the loads, (k, r, 6).
    """
    # In standard deviations of the deflection, so that metres and radians do not mix.
    scaled = by_wrench * noise.wrench[:, None, :] / noise.deflection[:, :, None]
    covariance = np.eye(scaled.shape[1]) + scaled @ scaled.swapaxes(1, 2)
    root = np.linalg.cholesky(covariance)
    return np.linalg.inv(root) / noise.deflection[:, None, :]


def _or_nan(value: float | None) -> float:
    return np.nan if value is None else value

"""Forces over a revolution in a slot, with run-out, and what a dynamometer shows of them."""

from __future__ import annotations

import numpy as np

from coupling.identification.cutting.slots import SlotCutter
from coupling.process.cutting_force import CuttingCoefficients

# Angles in a revolution, and slices over the depth.
_ANGLES, _SLICES = 96, 6
# An edge, which is round, begins to act where its chip is about so thick [m].
USUAL_ROUNDNESS = 8e-6


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

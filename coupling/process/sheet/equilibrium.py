"""Newton's method for the sheet's equilibrium; a state that did not converge is never kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpbtrf, dpbtrs

from coupling.process.sheet.assembly import Assembler, Box
from coupling.process.sheet.contact import Sphere


@dataclass(frozen=True)
class SheetState:
    """Shape and history of the sheet.

    Attributes:
        points: Control points of the midsurface in the part frame [m], (nx + 2, ny + 2, 3).
        plastic: Plastic strain 11, 22, 2*12 and equivalent plastic strain of every layer at every
            integration point, (nx, ny, points, layers, 4).
        stretch: Thickness over first thickness, (nx, ny, points).
    """

    points: np.ndarray
    plastic: np.ndarray
    stretch: np.ndarray


@dataclass(frozen=True)
class Equilibrium:
    """A converged state.

    Attributes:
        state: Of the sheet.
        forces: On the spheres [N], (spheres, 3).
        iterations: Of Newton's method.
    """

    state: SheetState
    forces: np.ndarray
    iterations: int


@dataclass(frozen=True)
class NewtonSettings:
    """When Newton's method ends.

    Attributes:
        tolerance: Largest unbalanced force at a control point that may move [N].
        largest_step: Displacements of an iteration are scaled down to this [m].
        max_iterations: Then the load step is cut.
    """

    tolerance: float
    largest_step: float
    max_iterations: int = 40


def find_equilibrium(
    assemble: Assembler,
    state: SheetState,
    spheres: tuple[Sphere, ...],
    box: Box,
    settings: NewtonSettings,
    start: np.ndarray | None = None,
) -> Equilibrium | None:
    """Return the equilibrium of the control points in a box, or None if none was found.

    Args:
        assemble: Residual and stiffness.
        state: Before; not changed.
        spheres: Tools at their new places.
        box: Control points that may move.
        settings: Of Newton's method.
        start: Control points of the first iteration; those of the state unless given.
    """
    points = (state.points if start is None else start).copy()
    plastic, stretch = state.plastic.copy(), state.stretch.copy()
    inside = (slice(box.first_x, box.last_x), slice(box.first_y, box.last_y))
    step = np.zeros_like(points[inside])
    last, halvings = np.inf, 0
    for iteration in range(settings.max_iterations):
        residual, band, forces = assemble(box, points, state.plastic, spheres, plastic, stretch)
        if not np.all(np.isfinite(residual)):
            return None
        if np.max(np.abs(residual)) <= settings.tolerance:
            return Equilibrium(SheetState(points, plastic, stretch), forces, iteration)
        size = float(np.linalg.norm(residual))
        if size > last and halvings < _MAX_HALVINGS:
            step *= 0.5
            points[inside] -= step
            halvings += 1
            continue
        last, halvings = size, 0
        solution, _ = dpbtrs(_factorise(band.T), -residual, lower=1)
        step = _limited(solution, settings.largest_step).reshape(step.shape)
        points[inside] += step
    return None


# An iteration that raises the unbalanced forces is taken back by halves at most so many times.
_MAX_HALVINGS = 3


def _limited(step: np.ndarray, largest: float) -> np.ndarray:
    """Scale a step down so that no displacement is larger."""
    scale = min(1.0, largest / max(float(np.max(np.abs(step))), 1e-300))
    return scale * step


# Shift of the diagonal, relative to its mean, tried first where the stiffness is not definite.
_FIRST_SHIFT = 1e-4


def _factorise(matrix: np.ndarray) -> np.ndarray:
    """Return the banded Cholesky factor; a stiffness that is not definite is shifted.

    Args:
        matrix: Lower band by rows [N/m], (1 + bandwidth, n).
    """
    factor, status = dpbtrf(matrix, lower=1)
    shift = _FIRST_SHIFT * float(np.mean(np.abs(matrix[0])))
    while status != 0:
        shifted = matrix.copy(order="F")
        shifted[0] += shift
        factor, status = dpbtrf(shifted, lower=1, overwrite_ab=1)
        shift *= 10.0
    return factor

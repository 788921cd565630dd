"""Newton's method for the sheet's equilibrium; a state that did not converge is never kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.sheet_fem.assembly import Assembler, Box
from coupling.sheet_fem.banded import GeneralBanded, SymmetricBanded
from coupling.sheet_fem.contact import Sphere
from coupling.sheet_fem.state import SheetState


@dataclass(frozen=True)
class Equilibrium:
    """A converged state.

    Attributes:
        state: Shape and history of the sheet.
        forces: Forces on the spheres [N], (spheres, 3).
        moments: Moments on them about their centres, by friction [N m], (spheres, 3).
        iterations: Number of Newton's iterations.
        before: State before the move.
        spheres: Tools where they have gone.
        box: Control points that could move.
        tangent: Derivative of the residual by them [N/m].
    """

    state: SheetState
    forces: np.ndarray
    moments: np.ndarray
    iterations: int
    before: SheetState
    spheres: tuple[Sphere, ...]
    box: Box
    tangent: SymmetricBanded | GeneralBanded


@dataclass(frozen=True)
class NewtonSettings:
    """When Newton's method ends.

    Attributes:
        tolerance: Largest unbalanced force at a control point that may move [N].
        largest_step: Displacement down to which those of an iteration are scaled [m].
        max_iterations: Number of iterations after which the load step is cut.
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
        state: State before, with the slip of the same spheres; not changed.
        spheres: Tools at their new places.
        box: Control points that may move.
        settings: Limits of Newton's method.
        start: Control points of the first iteration; those of the state unless given.
    """
    after = SheetState(
        (state.points if start is None else start).copy(),
        state.plastic.copy(),
        state.stretch.copy(),
        tuple(assemble.no_slip(sphere) for sphere in spheres),
    )
    points = after.points
    inside = (slice(box.first_x, box.last_x), slice(box.first_y, box.last_y))
    step = np.zeros_like(points[inside])
    last, halvings = np.inf, 0
    for iteration in range(settings.max_iterations):
        residual, stiffness, wrenches = assemble(box, state, spheres, after)
        if not np.all(np.isfinite(residual)):
            return None
        if np.max(np.abs(residual)) <= settings.tolerance:
            on_tools = (wrenches[:, :3], wrenches[:, 3:])
            return Equilibrium(after, *on_tools, iteration, state, spheres, box, stiffness)
        size = float(np.linalg.norm(residual))
        if size > last and halvings < _MAX_HALVINGS:
            step *= 0.5
            points[inside] -= step
            halvings += 1
            continue
        last, halvings = size, 0
        step = _limited(stiffness.solve(-residual), settings.largest_step).reshape(step.shape)
        points[inside] += step
    return None


# An iteration that raises the unbalanced forces is taken back by halves at most so many times.
_MAX_HALVINGS = 3


def _limited(step: np.ndarray, largest: float) -> np.ndarray:
    """Scale a step down so that no displacement is larger."""
    scale = min(1.0, largest / max(float(np.max(np.abs(step))), 1e-300))
    return scale * step

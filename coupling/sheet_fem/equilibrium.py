"""Newton's method for the sheet's equilibrium; a state that did not converge is never kept."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.sheet_fem.assembly import Assembler
from coupling.sheet_fem.border import Bordered
from coupling.sheet_fem.box import Box
from coupling.sheet_fem.contact import Sphere
from coupling.sheet_fem.interface import Interface
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
        tangent: Derivative of the residual by them and by the rim's unknowns [N/m].
    """

    state: SheetState
    forces: np.ndarray
    moments: np.ndarray
    iterations: int
    before: SheetState
    spheres: tuple[Sphere, ...]
    box: Box
    tangent: Bordered


@dataclass(frozen=True)
class NewtonSettings:
    """When Newton's method ends.

    Attributes:
        tolerance: Largest unbalanced force at a control point that may move [N].
        largest_step: Displacement down to which those of an iteration are scaled [m].
        kept: Bending of a coarse element up to which it is not evaluated anew near an equilibrium [m].
        linear: Bending of a coarse element up to which it may be linear in an equilibrium [m].
        max_iterations: Number of iterations after which the load step is cut.
    """

    tolerance: float
    largest_step: float
    kept: float
    linear: float
    max_iterations: int = 40


# Unbalanced force over the tolerance at which the sheet outside of the box is made linear: what still
# moves then is some ten microns, so that the state there hardly depends on the iterations.
_NEAR = 1000.0

# The first step is one against tools whose contact gives way so much more easily: a whole step of the
# tools at once presses so hard that the sheet would jump off them.
_SOFT = 1.0 / 3.0

# A guess leads away if an iteration raises the unbalanced forces to so many times what they were.
_LEADS_AWAY = 10.0


def find_equilibrium(
    assemble: Assembler,
    state: SheetState,
    spheres: tuple[Sphere, ...],
    box: Box,
    settings: NewtonSettings,
    guess: np.ndarray | None = None,
) -> Equilibrium | None:
    """Return the equilibrium of a sheet, or None if none was found.

    Control points of the box move freely, the others as coarse splines.  From a guess that leads away
    from it none is found.

    Args:
        assemble: Residual and stiffness.
        state: State before, with the slip of the same spheres; not changed.
        spheres: Tools at their new places.
        box: Control points about the tools.
        settings: Limits of Newton's method.
        guess: How the control points may be expected to move [m], (nx + 2, ny + 2, 3); without one the
            sheet is where it was.
    """
    after = SheetState(
        state.points.copy(),
        state.plastic.copy(),
        state.stretch.copy(),
        tuple(assemble.no_slip(sphere) for sphere in spheres),
        state.around,
        state.at_rim.copy(),
    )
    rim = assemble.rim(box)
    if rim is None:
        after = replace(after, around=None, at_rim=np.zeros(0))
    elif after.around is None or after.around.rim.box != box:
        after = _made_linear(assemble, rim, state, after, settings.linear)
    free = 3 * box.size
    step = np.zeros(0)
    last, halvings = np.inf, 0
    near = rim is None
    first = spheres
    if guess is None:
        first = tuple(tool._replace(stiffness=_SOFT * tool.stiffness) for tool in spheres)
    else:
        _move_as_expected(after, box, guess * assemble.free)
    inside = assemble.inside(box, state, first, after)
    for iteration in range(settings.max_iterations):
        residual, stiffness, wrenches = assemble.joined(inside, after)
        if not np.all(np.isfinite(residual)):
            return None
        unbalanced = float(np.max(np.abs(residual))) / settings.tolerance
        if iteration == 0 and guess is None:
            unbalanced = np.inf  # against the tools as they are it is not known yet
        if unbalanced <= 1.0 and near and (rim is None or _is_linear(after, settings.linear)):
            on_tools = (wrenches[:, :3], wrenches[:, 3:])
            _carried(after)
            return Equilibrium(after, *on_tools, iteration, state, spheres, box, stiffness)
        if rim is not None and unbalanced <= (1.0 if near else _NEAR):
            _carried(after)
            after = _made_linear(assemble, rim, state, after, settings.kept)
            # That moves no control point that the box's elements see.
            near, last = True, np.inf
            continue
        size = float(np.linalg.norm(residual))
        if guess is not None and size > _LEADS_AWAY * last:
            return None
        if size > last and halvings < _MAX_HALVINGS:
            step *= 0.5
            halvings += 1
            _move(after, box, -step[:free], -step[free:])
        else:
            last, halvings = size if np.isfinite(unbalanced) else np.inf, 0
            step = _limited(stiffness.solve(-residual), settings.largest_step)
            _move(after, box, step[:free], step[free:])
        inside = assemble.inside(box, state, spheres, after)
    return None


def _made_linear(
    assemble: Assembler, rim: Interface, before: SheetState, state: SheetState, limit: float
) -> SheetState:
    """Return a state with what is outside of the box made linear there."""
    around = assemble.linear(rim, before, state, limit)
    return replace(state, around=around, at_rim=np.zeros(rim.size))


def _is_linear(state: SheetState, limit: float) -> bool:
    """Return whether what is outside of the box is near where it was made linear."""
    assert state.around is not None
    return bool(np.max(state.around.bent_at(state.at_rim)) <= limit)


def _carried(state: SheetState) -> None:
    """Move all control points outside of the box, of which iterations move the edge."""
    if state.around is not None:
        state.around.carry(state.at_rim, state.points)


def _move_as_expected(state: SheetState, box: Box, guess: np.ndarray) -> None:
    """Move the control points of a box, and its rim, as is expected of them."""
    rim = None if state.around is None else state.around.rim
    at_rim = np.zeros(0) if rim is None else rim.fitted(guess[rim.edge])
    _move(state, box, guess[box.first_x : box.last_x, box.first_y : box.last_y], at_rim)


def _move(state: SheetState, box: Box, inside: np.ndarray, at_rim: np.ndarray) -> None:
    """Move the control points of a box, and with its rim's unknowns the others."""
    moved = state.points[box.first_x : box.last_x, box.first_y : box.last_y]
    moved += inside.reshape(moved.shape)
    if state.around is not None:
        state.at_rim[:] += at_rim
        state.around.carry_edge(state.at_rim, state.points)


# An iteration that raises the unbalanced forces is taken back by halves at most so many times.
_MAX_HALVINGS = 3


def _limited(step: np.ndarray, largest: float) -> np.ndarray:
    """Scale a step down so that no displacement is larger."""
    scale = min(1.0, largest / max(float(np.max(np.abs(step))), 1e-300))
    return scale * step

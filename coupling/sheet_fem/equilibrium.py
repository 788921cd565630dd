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
        tangent: Derivative of the residual by them and by the interface's unknowns [N/m].
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
    """Settings of Newton's method.

    Attributes:
        tolerance: Largest unbalanced force at a control point that may move [N].
        largest_step: Displacement down to which those of an iteration are scaled [m].
        unchanged: Bending of a coarse element up to which it is not evaluated anew near an equilibrium
            [m].
        linear: Bending of a coarse element up to which it may be linear in an equilibrium [m].
        max_iterations: Number of iterations after which the load step is cut.
    """

    tolerance: float
    largest_step: float
    unchanged: float
    linear: float
    max_iterations: int = 40


# Unbalanced force over the tolerance at which the sheet outside of the box is made linear: what still
# moves then is some ten microns, so that the state there hardly depends on the iterations.
_LINEARISED_IMBALANCE = 1000.0

# The first step is one against tools whose contact gives way so much more easily: a whole step of the
# tools at once presses so hard that the sheet would jump off them.
_FIRST_CONTACT_RATIO = 1.0 / 3.0

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
        guess: Expected moves of the control points [m], (nx + 2, ny + 2, 3); without one the
            sheet is where it was.
    """
    after = SheetState(
        state.points.copy(),
        state.plastic.copy(),
        state.stretch.copy(),
        tuple(assemble.no_slip(sphere) for sphere in spheres),
        state.far_field,
        state.at_interface.copy(),
    )
    interface = assemble.interface(box)
    if interface is None:
        after = replace(after, far_field=None, at_interface=np.zeros(0))
    elif after.far_field is None or after.far_field.interface.box != box:
        after = _made_linear(assemble, interface, state, after, settings.linear)
    free = 3 * box.size
    step = np.zeros(0)
    last, halvings = np.inf, 0
    near = interface is None
    first = spheres
    if guess is None:
        first = tuple(
            tool._replace(stiffness=_FIRST_CONTACT_RATIO * tool.stiffness) for tool in spheres
        )
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
        if unbalanced <= 1.0 and near and (interface is None or _is_linear(after, settings.linear)):
            on_tools = (wrenches[:, :3], wrenches[:, 3:])
            _carry_outside(after)
            return Equilibrium(after, *on_tools, iteration, state, spheres, box, stiffness)
        if interface is not None and unbalanced <= (1.0 if near else _LINEARISED_IMBALANCE):
            _carry_outside(after)
            after = _made_linear(assemble, interface, state, after, settings.unchanged)
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
            step = _limit_step(stiffness.solve(-residual), settings.largest_step)
            _move(after, box, step[:free], step[free:])
        inside = assemble.inside(box, state, spheres, after)
    return None


def _made_linear(
    assemble: Assembler, interface: Interface, before: SheetState, state: SheetState, limit: float
) -> SheetState:
    """Return a state with what is outside of the box made linear there."""
    far_field = assemble.linear(interface, before, state, limit)
    return replace(state, far_field=far_field, at_interface=np.zeros(interface.size))


def _is_linear(state: SheetState, limit: float) -> bool:
    """Return whether what is outside of the box is near where it was made linear."""
    assert state.far_field is not None
    return bool(np.max(state.far_field.bent_at(state.at_interface)) <= limit)


def _carry_outside(state: SheetState) -> None:
    """Move all control points outside of the box, of which iterations move the edge."""
    if state.far_field is not None:
        state.far_field.carry(state.at_interface, state.points)


def _move_as_expected(state: SheetState, box: Box, guess: np.ndarray) -> None:
    """Move the control points of a box, and its interface, as is expected of them."""
    interface = None if state.far_field is None else state.far_field.interface
    at_interface = np.zeros(0) if interface is None else interface.fitted(guess[interface.edge])
    _move(state, box, guess[box.first_x : box.last_x, box.first_y : box.last_y], at_interface)


def _move(state: SheetState, box: Box, inside: np.ndarray, at_interface: np.ndarray) -> None:
    """Move the control points of a box, and with its interface's unknowns the others."""
    points = state.points[box.first_x : box.last_x, box.first_y : box.last_y]
    points += inside.reshape(points.shape)
    if state.far_field is not None:
        state.at_interface[:] += at_interface
        state.far_field.carry_edge(state.at_interface, state.points)


# An iteration that raises the unbalanced forces is taken back by halves at most so many times.
_MAX_HALVINGS = 3


def _limit_step(step: np.ndarray, largest: float) -> np.ndarray:
    """Scale a step down so that no displacement is larger."""
    scale = min(1.0, largest / max(float(np.max(np.abs(step))), 1e-300))
    return scale * step

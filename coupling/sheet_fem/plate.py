"""The backing plate on which the sheet lies: a plane with a round hole, its edge rounded."""

from __future__ import annotations

import numpy as np

from coupling.sheet_fem.compiled import internal
from coupling.sheet_fem.contact import Surface, add_force, pressure
from coupling.sheet_fem.on_stack import on_stack


@internal
def add_plate(
    surface: Surface,
    i: int,
    j: int,
    points: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
) -> bool:
    """Add the backing plate, on which the flat sheet lies, to the element at (i, j).

    What lay on its plane when the sheet was flat stays on it, frictionless; the rest is held by the
    rounded edge, a quarter of a torus, where there is one.

    Args:
        surface: Contact points and plate.
        i: Place of the element in x.
        j: Number in y.
        points: Control points of the sheet [m], (nx + 2, ny + 2, 3).
        force: Added to: forces of the element [N], (27,).
        stiffness: Added to: their derivative [N/m], (27, 27).

    Returns:
        Whether the element touches the plate.
    """
    basis = surface.basis
    tube = surface.edge + 0.5 * surface.thickness
    margin = 2.0 * np.sqrt(np.sum(basis.area))
    near = False
    for A in range(9):
        x, y = points[i + A // 3, j + A % 3, 0], points[i + A // 3, j + A % 3, 1]
        if np.sqrt(x**2 + y**2) > surface.plane - tube - margin:
            near = True
    if not near:
        return False
    place, thrust, tangent = on_stack((3,)), on_stack((3,)), on_stack((3, 3))
    touches = False
    for g in range(basis.area.shape[0]):
        on_plane = surface.is_on_plate[i, j, g]
        if not on_plane and surface.edge == 0.0:
            continue
        N = basis.value[g]
        place[:] = 0.0
        for A in range(9):
            for k in range(3):
                place[k] += N[A] * points[i + A // 3, j + A % 3, k]
        if on_plane:
            size, slope = pressure(-place[2], surface.support, surface.smoothing)
            thrust[:], tangent[:] = 0.0, 0.0
            thrust[2], tangent[2, 2] = -size, slope
        else:
            slope = _edge(surface, tube, place, thrust, tangent)
        if slope == 0.0:
            continue
        touches = True
        for k in range(3):
            thrust[k] *= basis.area[g]
            for m in range(3):
                tangent[k, m] *= basis.area[g]
        add_force(N, thrust, tangent, force, stiffness)
    return touches


@internal
def _edge(
    surface: Surface, tube: float, place: np.ndarray, thrust: np.ndarray, tangent: np.ndarray
) -> float:
    """Set the traction of the plate's edge against a point of the midsurface, and its derivative.

    The midsurface is kept at the distance `tube` from the circle in the middle of the edge's roundness.
    Of the distance d the gradient is n, the second derivative t t / d + n_r / r c c: t along the
    meridian of the torus, c around its axis.  Returns the pressure's slope, zero without contact.
    """
    r = np.sqrt(place[0] ** 2 + place[1] ** 2)
    inward, above = r - surface.plane, place[2] + tube
    distance = np.sqrt(inward**2 + above**2)
    size, slope = pressure(tube - distance, surface.support, surface.smoothing)
    if slope == 0.0:
        return 0.0
    n_r, n_z = inward / distance, above / distance
    x, y = place[0] / r, place[1] / r
    normal = (n_r * x, n_r * y, n_z)
    along = (-n_z * x, -n_z * y, n_r)
    around = (-y, x, 0.0)
    for k in range(3):
        thrust[k] = -size * normal[k]
        for m in range(3):
            tangent[k, m] = slope * normal[k] * normal[m]
            tangent[k, m] -= size / distance * along[k] * along[m]
            tangent[k, m] -= size * n_r / r * around[k] * around[m]
    return slope

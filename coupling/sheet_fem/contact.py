"""Contact with spheres and a backing plate by a smoothed penalty."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import compiled
from coupling.sheet_fem.friction import elastic_slip
from coupling.sheet_fem.mesh import Basis


class Sphere(NamedTuple):
    """The tool's hemispherical end.

    Attributes:
        center: Centre in the sheet's frame [m], (3,).
        radius: Radius [m].
        stiffness: Pressure per penetration [Pa/m].
        smoothing: Penetration over which the stiffness rises linearly from zero [m].
        friction: Coefficient mu of Coulomb's law.
        slip_length: Elastic slip at which the sheet slides [m].
        moved: Move since the last equilibrium, without turning [m], (3,).
    """

    center: np.ndarray
    radius: float
    stiffness: float
    smoothing: float
    friction: float
    slip_length: float
    moved: np.ndarray


class Surface(NamedTuple):
    """Where contact is integrated.

    Attributes:
        basis: Splines at the contact points of an element.
        half_thickness: Distance of the touched face from the midsurface [m].
        supported: Mask of the contact points that lie on the backing plate's plane, (nx, ny, points).
        plane: Radius from which the backing plate is plane [m].
        edge: Radius of its rounded edge inside of that [m]; zero: the others touch nothing.
        support: Pressure per penetration of the backing plate [Pa/m].
        smoothing: Penetration over which that pressure sets in [m].
    """

    basis: Basis
    half_thickness: float
    supported: np.ndarray
    plane: float
    edge: float
    support: float
    smoothing: float


@compiled
def pressure(penetration: float, stiffness: float, smoothing: float) -> tuple[float, float]:
    """Return pressure [Pa] and its slope [Pa/m]; continuous with its slope, zero without contact.

    Example:
        >>> pressure(2e-6, 1e12, 1e-6)
        (1500000.0, 1000000000000.0)
    """
    if penetration <= 0.0:
        return 0.0, 0.0
    if penetration < smoothing:
        return 0.5 * stiffness * penetration**2 / smoothing, stiffness * penetration / smoothing
    return stiffness * (penetration - 0.5 * smoothing), stiffness


@compiled
def _spread(
    N: np.ndarray,
    thrust: np.ndarray,
    tangent: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
) -> None:
    """Add the force against a contact point, and its derivative by the point, to an element."""
    for k in range(3):
        for A in range(9):
            force[3 * A + k] += N[A] * thrust[k]
        for m in range(3):
            for A in range(9):
                for C in range(9):
                    stiffness[3 * A + k, 3 * C + m] += N[A] * N[C] * tangent[k, m]


@compiled
def press(
    surface: Surface,
    sphere: Sphere,
    places: np.ndarray,
    before: np.ndarray,
    points: np.ndarray,
    slip: np.ndarray,
    new_slip: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
    on_tool: np.ndarray,
) -> None:
    """Add the contact with a sphere to the elements at `places`.

    `on_tool` gets the force on the sphere and the moment about its centre, (6,).  Friction acts on
    the sphere's surface, but on the sheet's midsurface: its moment on the sheet is left out.
    """
    basis = surface.basis
    reach = sphere.radius + surface.half_thickness
    margin = 2.0 * np.sqrt(np.sum(basis.area))
    apart, thrust, drift, drag = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    tangent, turn = np.empty((3, 3)), np.empty((3, 3))
    for e in range(len(places)):
        i, j = places[e, 0], places[e, 1]
        if sphere.friction > 0.0:
            new_slip[i, j] = 0.0
        # The patch of control points encloses the element: farther ones cannot touch.
        near = False
        for A in range(9):
            distance = 0.0
            for k in range(3):
                distance += (points[i + A // 3, j + A % 3, k] - sphere.center[k]) ** 2
            if distance < (reach + margin) ** 2:
                near = True
        if not near:
            continue
        for g in range(basis.area.shape[0]):
            N = basis.value[g]
            apart[:] = sphere.center
            for A in range(9):
                for k in range(3):
                    apart[k] -= N[A] * points[i + A // 3, j + A % 3, k]
            distance = np.sqrt(apart[0] ** 2 + apart[1] ** 2 + apart[2] ** 2)
            size, slope = pressure(reach - distance, sphere.stiffness, sphere.smoothing)
            if slope == 0.0:
                continue
            size *= basis.area[g]
            slope *= basis.area[g]
            for k in range(3):
                apart[k] /= distance
            for k in range(3):
                thrust[k] = size * apart[k]
                for m in range(3):
                    tangent[k, m] = (slope + size / distance) * apart[k] * apart[m]
                tangent[k, k] -= size / distance
            if sphere.friction > 0.0:
                for k in range(3):
                    drift[k] = slip[i, j, g, k] - sphere.moved[k]
                    for A in range(9):
                        x, y = i + A // 3, j + A % 3
                        drift[k] += N[A] * (points[x, y, k] - before[x, y, k])
                elastic_slip(drift, apart, distance, sphere.slip_length, new_slip[i, j, g], turn)
                ratio = sphere.friction / sphere.slip_length
                for k in range(3):
                    drag[k] = ratio * size * new_slip[i, j, g, k]
                    for m in range(3):
                        tangent[k, m] += ratio * slope * new_slip[i, j, g, k] * apart[m]
                        tangent[k, m] += ratio * size * turn[k, m]
                for k in range(3):
                    a, b = (k + 1) % 3, (k + 2) % 3
                    thrust[k] += drag[k]
                    on_tool[3 + k] -= sphere.radius * (apart[a] * drag[b] - apart[b] * drag[a])
            for k in range(3):
                on_tool[k] += thrust[k]
            _spread(N, thrust, tangent, force[e], stiffness[e])


@compiled
def bear(
    surface: Surface,
    places: np.ndarray,
    points: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
) -> None:
    """Add the backing plate, on which the flat sheet lies, to the elements at `places`.

    What lay on its plane when the sheet was flat stays on it, frictionless; the rest is held by the
    rounded edge, a quarter of a torus, where there is one.
    """
    basis = surface.basis
    tube = surface.edge + surface.half_thickness
    margin = 2.0 * np.sqrt(np.sum(basis.area))
    place, thrust, tangent = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    for e in range(len(places)):
        i, j = places[e, 0], places[e, 1]
        near = False
        for A in range(9):
            x, y = points[i + A // 3, j + A % 3, 0], points[i + A // 3, j + A % 3, 1]
            if np.sqrt(x**2 + y**2) > surface.plane - tube - margin:
                near = True
        if not near:
            continue
        for g in range(basis.area.shape[0]):
            on_plane = surface.supported[i, j, g]
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
            for k in range(3):
                thrust[k] *= basis.area[g]
                for m in range(3):
                    tangent[k, m] *= basis.area[g]
            _spread(N, thrust, tangent, force[e], stiffness[e])


@compiled
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
    normal = np.array([n_r * place[0] / r, n_r * place[1] / r, n_z])
    along = np.array([-n_z * place[0] / r, -n_z * place[1] / r, n_r])
    around = np.array([-place[1] / r, place[0] / r, 0.0])
    for k in range(3):
        thrust[k] = -size * normal[k]
        for m in range(3):
            tangent[k, m] = slope * normal[k] * normal[m]
            tangent[k, m] -= size / distance * along[k] * along[m]
            tangent[k, m] -= size * n_r / r * around[k] * around[m]
    return slope

"""Contact with spheres and a backing plate: a smoothed penalty, Coulomb friction with elastic slip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import compile_function, internal
from coupling.sheet_fem.mesh import Basis
from coupling.sheet_fem.on_stack import on_stack


class Sphere(NamedTuple):
    """The tool's hemispherical end.

    Attributes:
        center: Centre in the sheet's frame [m], (3,).
        radius: Radius [m].
        stiffness: Pressure per penetration [Pa/m].
        smoothing: Penetration over which the stiffness rises linearly from zero [m].
        friction: Coefficient mu of Coulomb's law.
        slip_length: Elastic slip at which the sheet slides [m].
        displacement: Move since the last equilibrium, without turning [m], (3,).
    """

    center: np.ndarray
    radius: float
    stiffness: float
    smoothing: float
    friction: float
    slip_length: float
    displacement: np.ndarray


class Surface(NamedTuple):
    """Contact points of the sheet and its backing plate.

    Attributes:
        basis: Splines at the contact points of an element.
        thickness: First thickness of the sheet [m].
        is_on_plate: Mask of the contact points that lie on the backing plate's plane, (nx, ny, points).
        plane: Radius from which the backing plate is plane [m].
        edge: Radius of its rounded edge inside of that [m]; zero: the others touch nothing.
        support: Pressure per penetration of the backing plate [Pa/m].
        smoothing: Penetration over which that pressure sets in [m].
    """

    basis: Basis
    thickness: float
    is_on_plate: np.ndarray
    plane: float
    edge: float
    support: float
    smoothing: float


@compile_function
def elastic_slip(
    drift: np.ndarray,
    normal: np.ndarray,
    distance: float,
    length: float,
    slip: np.ndarray,
    tangent: np.ndarray,
) -> None:
    """Return mapping of the slip at a contact point [SimoLaursen1992].

    The traction on the tool is mu p s / length, s the elastic slip: what a point of the sheet has
    moved along the tool, cut to `length`.  So the traction never exceeds mu p, whatever the pressure
    does, and what is cut off does work against it only.

    Args:
        drift: Elastic slip before and what the sheet has moved relative to the tool since [m], (3,).
        normal: Unit vector from the point to the sphere's centre, (3,).
        distance: Distance between both [m].
        length: Largest elastic slip [m].
        slip: Written: elastic slip after [m], (3,).
        tangent: Written: its derivative by the place of the point [1], (3, 3).
    """
    along = drift[0] * normal[0] + drift[1] * normal[1] + drift[2] * normal[2]
    for k in range(3):
        slip[k] = drift[k] - along * normal[k]
    turn = 1.0 + along / distance
    for k in range(3):
        for m in range(3):
            # The normal turns as the point moves: P drift with P = 1 - n n.
            tangent[k, m] = normal[k] * (slip[m] / distance - turn * normal[m])
        tangent[k, k] += turn
    size = np.sqrt(slip[0] * slip[0] + slip[1] * slip[1] + slip[2] * slip[2])
    if size <= length:
        return
    scale = length / size
    for m in range(3):
        along = (slip[0] * tangent[0, m] + slip[1] * tangent[1, m] + slip[2] * tangent[2, m]) / size
        for k in range(3):
            tangent[k, m] = scale * (tangent[k, m] - slip[k] / size * along)
    for k in range(3):
        slip[k] *= scale


@compile_function
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


@internal
def add_force(
    N: np.ndarray,
    thrust: np.ndarray,
    tangent: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
) -> None:
    """Add thrust (3,) [N] and tangent (3, 3) [N/m] of a point to an element, by weights N, (9,)."""
    for k in range(3):
        for A in range(9):
            force[3 * A + k] += N[A] * thrust[k]
        for m in range(3):
            for A in range(9):
                for C in range(9):
                    stiffness[3 * A + k, 3 * C + m] += N[A] * N[C] * tangent[k, m]


@compile_function
def add_contact(
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

    The touched face is half the sheet's thickness from the midsurface, h = t/2 lambda with lambda = 1/J
    at constant volume, J the stretch of the midsurface's area.  So the pressure p that does work on the
    penetration d does some on the thinning, too, and the sheet's forces lessen by p h: it is the stress
    across the sheet, -p at the touched face and none at the other, in the mean over the thickness.

    `on_tool` gets each element's force on the sphere [N] and moment about the centre [N m], (e, 6).
    Friction acts on the sphere's surface, but on the sheet's midsurface: its moment on the sheet is left
    out.
    """
    basis = surface.basis
    reach = sphere.radius + surface.thickness
    margin = 2.0 * np.sqrt(np.sum(basis.area))
    apart, thrust, drift, drag = on_stack((3,)), on_stack((3,)), on_stack((3,)), on_stack((3,))
    along = on_stack((3,))
    tangent, turn = on_stack((3, 3)), on_stack((3, 3))
    spread, normal = on_stack((3, 9)), on_stack((3,))
    for e in range(len(places)):
        i, j = places[e, 0], places[e, 1]
        on_tool[e] = 0.0
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
            for k in range(3):
                apart[k] = sphere.center[k]
                for A in range(9):
                    apart[k] -= N[A] * points[i + A // 3, j + A % 3, k]
            distance = np.sqrt(apart[0] ** 2 + apart[1] ** 2 + apart[2] ** 2)
            if distance > sphere.radius + surface.thickness:
                continue
            half = 0.5 * surface.thickness * _stretch(basis, g, i, j, points, spread, normal)
            reached = sphere.radius + half - distance
            size, slope = pressure(reached, sphere.stiffness, sphere.smoothing)
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
                    drift[k] = slip[i, j, g, k] - sphere.displacement[k]
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
                    on_tool[e, 3 + k] -= sphere.radius * (apart[a] * drag[b] - apart[b] * drag[a])
            for k in range(3):
                on_tool[e, k] += thrust[k]
            add_force(N, thrust, tangent, force[e], stiffness[e])
            for k in range(3):
                along[k] = thrust[k] / size
            _squeeze(N, apart, along, half, size, slope, spread, normal, force[e], stiffness[e])


@internal
def _stretch(
    basis: Basis,
    g: int,
    i: int,
    j: int,
    points: np.ndarray,
    spread: np.ndarray,
    normal: np.ndarray,
) -> float:
    """Return the stretch of the thickness 1/J at a contact point.

    `spread` gets the derivative of ln J by the nine control points, N,a a^a, (3, 9).
    """
    first, second = on_stack((3,)), on_stack((3,))
    first[:], second[:] = 0.0, 0.0
    for A in range(9):
        for k in range(3):
            x = points[i + A // 3, j + A % 3, k]
            first[k] += basis.d1[g, A] * x
            second[k] += basis.d2[g, A] * x
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        normal[k] = first[a] * second[b] - first[b] * second[a]
    area = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    for k in range(3):
        normal[k] /= area
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        up1 = (second[a] * normal[b] - second[b] * normal[a]) / area
        up2 = (normal[a] * first[b] - normal[b] * first[a]) / area
        for A in range(9):
            spread[k, A] = basis.d1[g, A] * up1 + basis.d2[g, A] * up2
    return 1.0 / area


@internal
def _squeeze(
    N: np.ndarray,
    apart: np.ndarray,
    along: np.ndarray,
    half: float,
    size: float,
    slope: float,
    spread: np.ndarray,
    normal: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
) -> None:
    """Add what pressure does on the thinning of a contact point, and its derivative, to an element.

    With s the derivative of ln J, that of half the thickness is dh = -h s, and the second one, for
    control points A and C, h (s_A s_C + s_C s_A - n n (s_A . s_C)), the second with A, C exchanged.
    The force against the sheet is the pressure's `size` along `along`: with friction not the direction
    `apart` to the centre.
    """
    for A in range(9):
        for k in range(3):
            force[3 * A + k] -= size * half * spread[k, A]
        for C in range(9):
            dot = 0.0
            for k in range(3):
                dot += spread[k, A] * spread[k, C]
            for k in range(3):
                for m in range(3):
                    second = spread[k, A] * spread[m, C] + spread[m, A] * spread[k, C]
                    second -= normal[k] * normal[m] * dot
                    across = spread[k, A] * N[C] * apart[m] + N[A] * along[k] * spread[m, C]
                    squared = half * spread[k, A] * spread[m, C]
                    stiffness[3 * A + k, 3 * C + m] += half * (
                        size * second + slope * (squared - across)
                    )

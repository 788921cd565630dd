"""Elements one by one: control points -> nodal forces and stiffness."""

from __future__ import annotations

import numpy as np

from coupling.sheet_fem.compiled import compile_function
from coupling.sheet_fem.contact import Surface
from coupling.sheet_fem.on_stack import on_stack
from coupling.sheet_fem.plate import add_plate
from coupling.sheet_fem.shell import Point, Shell, add_response, integrate, sum_up


@compile_function
def fill_elements(
    shell: Shell,
    surface: Surface,
    places: np.ndarray,
    points: np.ndarray,
    plastic: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
    new_plastic: np.ndarray,
    new_stretch: np.ndarray,
) -> None:
    """Compute what some elements do, and the plate under them.

    Args:
        shell: Data that all elements share.
        surface: Contact points and plate.
        places: Numbers of the elements in x and y, (e, 2).
        points: Control points [m], (nx + 2, ny + 2, 3).
        plastic: Plastic strains before [1], (nx, ny, points, layers, 4).
        force: Written: nodal forces [N], (e, 27).
        stiffness: Written: their derivative [N/m], (e, 27, 27).
        new_plastic: Written, plastic strains after, shape of `plastic` [1].
        new_stretch: Written: stretch of the thickness [1], (nx, ny, points).
    """
    count, plate = shell.basis.area.shape[0], np.isfinite(surface.plane)
    functions, responses = np.empty((5 * count, 9)), np.empty((5 * count, 6, 9))
    nodes = on_stack((9, 3))
    point = Point(
        on_stack((2, 3)),
        on_stack((2, 3)),
        on_stack((3,)),
        on_stack((3,)),
        on_stack((5, 9)),
        on_stack((6,)),
        on_stack((6, 6)),
    )
    for e in range(len(places)):
        i, j = places[e, 0], places[e, 1]
        for A in range(9):
            for k in range(3):
                nodes[A, k] = points[i + A // 3, j + A % 3, k]
        force[e] = 0.0
        history = plastic[i, j], new_plastic[i, j], new_stretch[i, j]
        for g in range(count):
            integrate(shell, g, nodes, *history, point)
            for row in range(5):
                for A in range(9):
                    functions[5 * g + row, A] = point.functions[row, A]
            add_response(point, point.functions, force[e], responses[5 * g : 5 * g + 5])
        sum_up(functions, responses, stiffness[e])
        if plate:
            add_plate(surface, i, j, points, force[e], stiffness[e])

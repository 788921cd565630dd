"""Kirchhoff-Love shell at its points of integration: forces and stiffness [Kiendl2009]."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import compile_inlined
from coupling.sheet_fem.mesh import Basis
from coupling.sheet_fem.on_stack import on_stack
from coupling.sheet_fem.section import CrossSection, section


class Shell(NamedTuple):
    """Section, basis and mesh that all elements share.

    Attributes:
        cross: Metal, thickness and layers.
        basis: Splines at the integration points.
    """

    cross: CrossSection
    basis: Basis


class Point(NamedTuple):
    """Midsurface and section at a point of integration.

    Attributes:
        first: Tangents x,1 and x,2 [1], (2, 3).
        up: Their dual vectors a^1 and a^2 [1], (2, 3).
        normal: Unit normal, (3,).
        b: Second fundamental form b11, b22, b12 [1/m], (3,).
        functions: N,1 N,2 [1/m], h_11 h_22 2 h_12 [1/m2] of the control points (`add_response`), (5, 9).
        resultant: Membrane forces [N m] and moments [N m2], both times the point's area, (6,).
        tangent: Their derivative by membrane strains [1] and bending [1/m], (6, 6).
    """

    first: np.ndarray
    up: np.ndarray
    normal: np.ndarray
    b: np.ndarray
    functions: np.ndarray
    resultant: np.ndarray
    tangent: np.ndarray


@compile_inlined
def integrate(
    shell: Shell,
    g: int,
    points: np.ndarray,
    plastic: np.ndarray,
    new_plastic: np.ndarray,
    stretch: np.ndarray,
    point: Point,
) -> None:
    """Look at one point of integration of an element.

    Args:
        shell: Data that all elements share.
        g: Number of the point.
        points: Control points of the element [m], (9, 3).
        plastic: Plastic strains before [1], (points, layers, 4).
        new_plastic: Written: plastic strains after [1], (points, layers, 4).
        stretch: Written: stretch of the thickness [1], (points,).
        point: Written.
    """
    basis = shell.basis
    N1, N2 = basis.d1[g], basis.d2[g]
    N11, N22, N12 = basis.d11[g], basis.d22[g], basis.d12[g]
    first, up, n, b, functions = point.first, point.up, point.normal, point.b, point.functions
    second = on_stack((3, 3))  # x,11, x,22 and x,12
    a = on_stack((3,))
    first[:, :] = 0.0
    second[:, :] = 0.0
    for A in range(9):
        for k in range(3):
            x = points[A, k]
            first[0, k] += N1[A] * x
            first[1, k] += N2[A] * x
            second[0, k] += N11[A] * x
            second[1, k] += N22[A] * x
            second[2, k] += N12[A] * x
    n[0] = first[0, 1] * first[1, 2] - first[0, 2] * first[1, 1]
    n[1] = first[0, 2] * first[1, 0] - first[0, 0] * first[1, 2]
    n[2] = first[0, 0] * first[1, 1] - first[0, 1] * first[1, 0]
    det = n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
    root = np.sqrt(det)
    a[:] = 0.0
    b[:] = 0.0
    for k in range(3):
        n[k] /= root
        a[0] += first[0, k] * first[0, k]
        a[1] += first[1, k] * first[1, k]
        a[2] += first[0, k] * first[1, k]
        for i in range(3):
            b[i] += second[i, k] * n[k]
    strained = plastic[g], point.resultant, point.tangent, new_plastic[g]
    stretch[g] = section(shell.cross, a, b, *strained)
    area = basis.area[g]
    for i in range(6):
        point.resultant[i] *= area
        for j in range(6):
            point.tangent[i, j] *= area
    for k in range(3):
        up[0, k] = (a[1] * first[0, k] - a[2] * first[1, k]) / det
        up[1, k] = (a[0] * first[1, k] - a[2] * first[0, k]) / det
    for A in range(9):
        functions[0, A] = N1[A]
        functions[1, A] = N2[A]
        functions[2, A] = N11[A]
        functions[3, A] = N22[A]
        functions[4, A] = 2.0 * N12[A]
    for k in range(3):
        second[2, k] *= 2.0  # from here on as an engineering shear
    for i in range(3):
        along1 = along2 = 0.0
        for k in range(3):
            along1 += second[i, k] * up[0, k]
            along2 += second[i, k] * up[1, k]
        for A in range(9):
            functions[2 + i, A] -= along1 * N1[A] + along2 * N2[A]


@compile_inlined
def add_response(
    point: Point, functions: np.ndarray, force: np.ndarray, responses: np.ndarray
) -> None:
    """Add a point's forces, and write what displacements do to those of five functions.

    With u the displacement of control point A and N its spline, the first variations are
    da_ij = sum N,i a_j . u + N,j a_i . u and db_ij = h_ij n . u with h_ij = N,ij - Gamma^c_ij N,c; the
    second one of b, contracted with the moments m, is for control points A and C

        - t_A (g_C . u_A)(n . u_C) - t_C (n . u_A)(g_A . u_C) - m:b (g_A . g_C)(n . u_A)(n . u_C)

    with g = N,c a^c and t = m^ij h_ij.  So all of it is bilinear in five functions of each control
    point, N,1 N,2 h_11 h_22 2 h_12: the stiffness is their product with what a point of integration adds
    for each of them.  Splines that sum up those of the element have the same sums of its functions.

    Args:
        point: Midsurface and section there.
        functions: The five of nine splines [1/m, 1/m2], (5, 9).
        force: Nodal forces, added to [N], (27,).
        responses: Written, for each function and the pairs k <= m of directions: what displacements
            along m of the nine do along k, (5, 6, 9).
    """
    first, up, n, b = point.first, point.up, point.normal, point.b
    resultant, tangent = point.resultant, point.tangent
    N1, N2 = functions[0], functions[1]
    m1, m2, m12 = resultant[3], resultant[4], resultant[5]
    curved = m1 * b[0] + m2 * b[1] + 2.0 * m12 * b[2]
    turn, bent = on_stack((9,)), on_stack((9,))  # t, and what bends the point
    for A in range(9):
        turn[A] = m1 * functions[2, A] + m2 * functions[3, A] + m12 * functions[4, A]
    membrane = ((resultant[0], resultant[2]), (resultant[2], resultant[1]))
    for k in range(3):
        along1 = resultant[0] * first[0, k] + resultant[2] * first[1, k]
        along2 = resultant[2] * first[0, k] + resultant[1] * first[1, k]
        for A in range(9):
            force[3 * A + k] += N1[A] * along1 + N2[A] * along2 + n[k] * turn[A]
    # Derivatives of forces and moments by the tangents, each along k.
    by_slope = on_stack((2, 3, 6))
    for k in range(3):
        for i in range(6):
            by_slope[0, k, i] = first[0, k] * tangent[0, i] + first[1, k] * tangent[2, i]
            by_slope[1, k, i] = first[1, k] * tangent[1, i] + first[0, k] * tangent[2, i]
    for c in range(2):
        overlap1 = curved * (up[c, 0] * up[0, 0] + up[c, 1] * up[0, 1] + up[c, 2] * up[0, 2])
        overlap2 = curved * (up[c, 0] * up[1, 0] + up[c, 1] * up[1, 1] + up[c, 2] * up[1, 2])
        pair = 0
        for k in range(3):
            slopes = by_slope[c, k]
            for C in range(9):
                bent[C] = (
                    slopes[3] * functions[2, C]
                    + slopes[4] * functions[3, C]
                    + slopes[5] * functions[4, C]
                )
            for m in range(k, 3):
                on1 = slopes[0] * first[0, m] + slopes[2] * first[1, m] - overlap1 * n[k] * n[m]
                on2 = slopes[1] * first[1, m] + slopes[2] * first[0, m] - overlap2 * n[k] * n[m]
                if k == m:
                    on1 += membrane[c][0]
                    on2 += membrane[c][1]
                along = n[k] * up[c, m]
                for C in range(9):
                    responses[c, pair, C] = (
                        on1 * N1[C] + on2 * N2[C] + n[m] * bent[C] - along * turn[C]
                    )
                pair += 1
    for i in range(3):
        by_bend = tangent[3 + i]
        for C in range(9):
            bent[C] = (
                by_bend[3] * functions[2, C]
                + by_bend[4] * functions[3, C]
                + by_bend[5] * functions[4, C]
            )
        pair = 0
        for k in range(3):
            up1, up2 = resultant[3 + i] * up[0, k], resultant[3 + i] * up[1, k]
            for m in range(k, 3):
                on1 = n[k] * by_slope[0, m, 3 + i] - n[m] * up1
                on2 = n[k] * by_slope[1, m, 3 + i] - n[m] * up2
                both = n[k] * n[m]
                for C in range(9):
                    responses[2 + i, pair, C] = both * bent[C] + on1 * N1[C] + on2 * N2[C]
                pair += 1


@compile_inlined
def sum_up(functions: np.ndarray, responses: np.ndarray, stiffness: np.ndarray) -> None:
    """Write the stiffness [N/m], (27, 27), of points' functions, (5 p, 9), and answers, (5 p, 6, 9)."""
    product = np.dot(functions.T, responses.reshape(len(functions), 54)).reshape(9, 6, 9)
    for A in range(9):
        for C in range(9):
            pair = 0
            for k in range(3):
                for m in range(k, 3):
                    stiffness[3 * A + k, 3 * C + m] = product[A, pair, C]
                    stiffness[3 * C + m, 3 * A + k] = product[A, pair, C]
                    pair += 1

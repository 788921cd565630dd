"""Kirchhoff-Love shell element: control points -> nodal forces and stiffness [Kiendl2009]."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import compiled
from coupling.sheet_fem.mesh import Basis
from coupling.sheet_fem.section import CrossSection, section


class Shell(NamedTuple):
    """What the elements need besides the state.

    Attributes:
        cross: Metal, thickness and layers.
        basis: Splines at the integration points.
    """

    cross: CrossSection
    basis: Basis


@compiled
def element(
    shell: Shell,
    points: np.ndarray,
    plastic: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
    new_plastic: np.ndarray,
    stretch: np.ndarray,
) -> None:
    """Integrate one element.

    With u the displacement of control point A and N its spline, the first variations are
    da_ij = sum N,i a_j . u + N,j a_i . u and db_ij = (N,ij - Gamma^c_ij N,c) n . u; the second one
    of b, contracted with the moments m, is for control points A and C

        - t_A (g_C . u_A)(n . u_C) - t_C (n . u_A)(g_A . u_C) - m:b (g_A . g_C)(n . u_A)(n . u_C)

    with g = N,c a^c and t = m^ij (N,ij - Gamma^c_ij N,c).

    Args:
        shell: Data that all elements share.
        points: Control points [m], (9, 3).
        plastic: Plastic strains before, (points, layers, 4).
        force: Written: internal forces [N], (27,).
        stiffness: Written: their derivative [N/m], (27, 27).
        new_plastic: Written, (points, layers, 4).
        stretch: Written: stretch of the thickness, (points,).
    """
    basis = shell.basis
    count = basis.area.shape[0]
    # The stiffness is left^T right, twelve rows for each point: six strains, six of the second
    # variation of b; and the second variation of a, the same for all three directions.
    left = np.empty((12 * count, 27))
    right = np.empty((12 * count, 27))
    membrane = np.zeros((9, 9))
    resultant = np.empty(6)
    tangent = np.empty((6, 6))
    first = np.empty((2, 3))  # x,1 and x,2
    second = np.empty((3, 3))  # x,11, x,22 and x,12
    a = np.empty(3)
    b = np.empty(3)
    n = np.empty(3)
    h = np.empty((3, 9))
    gradient = np.empty((3, 9))  # g of each spline
    turn = np.empty(9)  # t
    force[:] = 0.0
    for g in range(count):
        B = right[12 * g : 12 * g + 6]
        DB = left[12 * g : 12 * g + 6]
        N1, N2 = basis.d1[g], basis.d2[g]
        N11, N22, N12 = basis.d11[g], basis.d22[g], basis.d12[g]
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
        a[:] = 0.0
        b[:] = 0.0
        for k in range(3):
            n[k] /= np.sqrt(det)
            a[0] += first[0, k] * first[0, k]
            a[1] += first[1, k] * first[1, k]
            a[2] += first[0, k] * first[1, k]
            for i in range(3):
                b[i] += second[i, k] * n[k]
        stretch[g] = section(shell.cross, a, b, plastic[g], resultant, tangent, new_plastic[g])
        area = basis.area[g]
        for i in range(6):
            resultant[i] *= area
            for j in range(6):
                tangent[i, j] *= area
        for i in range(3):
            for A in range(9):
                h[i, A] = N11[A] if i == 0 else (N22[A] if i == 1 else N12[A])
        for k in range(3):
            up1 = (a[1] * first[0, k] - a[2] * first[1, k]) / det
            up2 = (a[0] * first[1, k] - a[2] * first[0, k]) / det
            for A in range(9):
                gradient[k, A] = N1[A] * up1 + N2[A] * up2
            for i in range(3):
                for A in range(9):
                    h[i, A] -= second[i, k] * gradient[k, A]
        for A in range(9):
            turn[A] = resultant[3] * h[0, A] + resultant[4] * h[1, A] + 2.0 * resultant[5] * h[2, A]
            for k in range(3):
                r = 3 * A + k
                B[0, r] = N1[A] * first[0, k]
                B[1, r] = N2[A] * first[1, k]
                B[2, r] = N1[A] * first[1, k] + N2[A] * first[0, k]
                B[3, r] = n[k] * h[0, A]
                B[4, r] = n[k] * h[1, A]
                B[5, r] = 2.0 * n[k] * h[2, A]
        for i in range(6):
            for r in range(27):
                force[r] += B[i, r] * resultant[i]
                DB[i, r] = 0.0
            for j in range(6):
                for r in range(27):
                    DB[i, r] += tangent[i, j] * B[j, r]
        moment = resultant[3] * b[0] + resultant[4] * b[1] + 2.0 * resultant[5] * b[2]
        for A in range(9):
            for k in range(3):
                r = 3 * A + k
                for m in range(3):
                    own = turn[A] if k == m else 0.0
                    left[12 * g + 6 + m, r] = -own - moment * n[k] * gradient[m, A]
                    right[12 * g + 6 + m, r] = gradient[m, A] * n[k]
                    left[12 * g + 9 + m, r] = -gradient[m, A] * n[k]
                    right[12 * g + 9 + m, r] = own
            along1 = resultant[0] * N1[A] + resultant[2] * N2[A]
            along2 = resultant[2] * N1[A] + resultant[1] * N2[A]
            for C in range(9):
                membrane[A, C] += along1 * N1[C] + along2 * N2[C]
    np.dot(left.T, right, stiffness)
    for A in range(9):
        for C in range(9):
            for k in range(3):
                stiffness[3 * A + k, 3 * C + k] += membrane[A, C]

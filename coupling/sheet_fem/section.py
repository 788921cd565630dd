"""Cross section of the shell: metric and curvature of the midsurface -> forces and moments.

At height zeta above the midsurface the logarithmic strain is

    E(zeta) = e - zeta kappa,   e = f(a),   kappa = lambda 2 Df(a)[b],   f = ln/2,

the first-order expansion in zeta of ln(a - 2 zeta lambda b)/2: a and b are the first and second
fundamental forms of the midsurface in material coordinates (its reference is the unit square), and
lambda = exp(-tr e) is the stretch of the thickness at constant volume.  Plane-stress layers are
summed over the thickness (Gauss points), and all is pulled back to (a, b) with exact derivatives.

Vectors of six are (a11, a22, 2 a12)/2 - (1, 1, 0)/2 and (b11, b22, 2 b12); see [Miehe2002] for
plasticity in logarithmic strains.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import compile_function, compile_inlined
from coupling.sheet_fem.eigenbasis import eigenbasis, turn, turn_blocks
from coupling.sheet_fem.on_stack import on_stack
from coupling.sheet_fem.return_mapping import Metal, plane_stress

# Derivatives by (a11, a22, a12, b11, b22, b12), times these, are those by the vectors of six.  Those of
# the functions below, D, are by the former, and in the eigenbasis of a.
_BY_STRAIN = np.array([2.0, 2.0, 1.0, 1.0, 1.0, 0.5])


class CrossSection(NamedTuple):
    """Material and layers of the sheet.

    Attributes:
        material: Sheet metal.
        thickness: First thickness [m].
        layers: Points and weights over the thickness, -1 to 1, (2, layers).
    """

    material: Metal
    thickness: float
    layers: np.ndarray


@compile_inlined
def layer_resultants(
    cross: CrossSection,
    strain: np.ndarray,
    plastic: np.ndarray,
    resultant: np.ndarray,
    tangent: np.ndarray,
    new_plastic: np.ndarray,
) -> None:
    """Sum the layers' stresses.

    Args:
        cross: Metal, thickness and layers.
        strain: Membrane strain e [1] and bending kappa [1/m], (6,).
        plastic: Plastic strains of every layer before [1], (layers, 4).
        resultant: Written: conjugates of e and kappa [N/m, N], (6,).
        tangent: Written: its derivative [N/m, N, N m], (6, 6).
        new_plastic: Written: plastic strains after [1], (layers, 4).
    """
    at = on_stack((3,))
    stress = on_stack((3,))
    modulus = on_stack((3, 3))
    resultant[:] = 0.0
    tangent[:, :] = 0.0
    for layer in range(cross.layers.shape[1]):
        zeta = 0.5 * cross.thickness * cross.layers[0, layer]
        weight = 0.5 * cross.thickness * cross.layers[1, layer]
        for i in range(3):
            at[i] = strain[i] - zeta * strain[3 + i]
        plane_stress(cross.material, at, plastic[layer], stress, modulus, new_plastic[layer])
        for i in range(3):
            resultant[i] += weight * stress[i]
            resultant[3 + i] -= weight * zeta * stress[i]
            for j in range(3):
                part = weight * modulus[i, j]
                tangent[i, j] += part
                tangent[i, 3 + j] -= zeta * part
                tangent[3 + i, 3 + j] += zeta * zeta * part
    for i in range(3):
        for j in range(3):
            tangent[3 + j, i] = tangent[i, 3 + j]


@compile_inlined
def _curvature(F: np.ndarray, stretch: float, b: np.ndarray, dk: np.ndarray) -> None:
    """Fill `dk`, (7, 3), with D k for k = 2 Df(a)[b], which lacks the thickness stretch of kappa.

    Row 6 is kappa itself.
    """
    dk[:, :] = 0.0
    dk[0, 0] = 4.0 * F[3, 0] * b[0]
    dk[2, 0] = 4.0 * F[2, 1] * b[2]
    dk[1, 1] = 4.0 * F[0, 3] * b[1]
    dk[2, 1] = 4.0 * F[1, 2] * b[2]
    dk[0, 2] = 4.0 * F[2, 1] * b[2]
    dk[1, 2] = 4.0 * F[1, 2] * b[2]
    dk[2, 2] = 4.0 * (F[2, 1] * b[0] + F[1, 2] * b[1])
    dk[3, 0] = 2.0 * F[2, 0]
    dk[4, 1] = 2.0 * F[0, 2]
    dk[5, 2] = 4.0 * F[1, 1]
    for j in range(3):
        dk[6, j] = stretch * dk[3 + j, j] * b[j]


@compile_inlined
def _gradient(F: np.ndarray, stretch: float, dk: np.ndarray, G: np.ndarray) -> None:
    """Fill G, (6, 6), with D (e, kappa)."""
    G[:, :] = 0.0
    G[0, 0] = F[2, 0]
    G[1, 1] = F[0, 2]
    G[2, 2] = 2.0 * F[1, 1]
    for j in range(3):
        for i in range(6):
            G[3 + j, i] = stretch * dk[i, j]
        # The thickness stretch has the logarithm -tr f(a).
        G[3 + j, 0] -= dk[6, j] * F[2, 0]
        G[3 + j, 1] -= dk[6, j] * F[0, 2]


@compile_inlined
def _geometric(
    F: np.ndarray,
    stretch: float,
    dk: np.ndarray,
    b: np.ndarray,
    stress: np.ndarray,
    H: np.ndarray,
) -> None:
    """Fill H, (6, 6), with n : D2 e + m : D2 kappa for the resultants (n, m).

    The shear of dk is an engineering shear, that of m a stress: both belong together.
    """
    n, m = stress[:3], stress[3:]
    dt = (F[2, 0], F[0, 2])
    H[:, :] = 0.0
    m_k = 0.0
    # D2 of the thickness stretch, whose logarithm is -tr f(a), is drawn into n.
    for i in range(3):
        m_k += dk[6, i] * m[i]
    n0, n1, n2 = n[0] - m_k, n[1] - m_k, n[2]
    H[0, 0] = 2.0 * F[3, 0] * n0
    H[1, 1] = 2.0 * F[0, 3] * n1
    H[2, 2] = 2.0 * (F[2, 1] * n0 + F[1, 2] * n1)
    H[0, 2] = 2.0 * F[2, 1] * n2
    H[1, 2] = 2.0 * F[1, 2] * n2
    # 2 D2 f [da, db], the cross terms of a and b.
    two = 2.0 * stretch
    H[0, 3] = two * 2.0 * F[3, 0] * m[0]
    H[1, 4] = two * 2.0 * F[0, 3] * m[1]
    H[2, 5] = two * 2.0 * (F[2, 1] * m[0] + F[1, 2] * m[1])
    H[0, 5] = two * 2.0 * F[2, 1] * m[2]
    H[2, 3] = H[0, 5]
    H[1, 5] = two * 2.0 * F[1, 2] * m[2]
    H[2, 4] = H[1, 5]
    # 2 D3 f [b, da, da].
    shear = m[2] * b[2]
    mixed02 = m[0] * b[2] + m[2] * b[0]
    mixed12 = m[1] * b[2] + m[2] * b[1]
    H[0, 0] += two * (6.0 * F[4, 0] * m[0] * b[0] + 4.0 * F[3, 1] * shear)
    H[1, 1] += two * (6.0 * F[0, 4] * m[1] * b[1] + 4.0 * F[1, 3] * shear)
    H[0, 1] += two * 2.0 * F[2, 2] * shear
    H[0, 2] += two * (4.0 * F[3, 1] * mixed02 + 2.0 * F[2, 2] * mixed12)
    H[1, 2] += two * (4.0 * F[1, 3] * mixed12 + 2.0 * F[2, 2] * mixed02)
    H[2, 2] += two * (
        4.0 * F[3, 1] * m[0] * b[0]
        + 4.0 * F[1, 3] * m[1] * b[1]
        + 2.0 * F[2, 2] * (m[0] * b[1] + m[1] * b[0])
        + 12.0 * F[2, 2] * shear
    )
    for i in range(6):
        for j in range(i):
            H[i, j] = H[j, i]
    # First derivatives of k times those of the thickness stretch.
    for i in range(6):
        m_dk = m[0] * dk[i, 0] + m[1] * dk[i, 1] + m[2] * dk[i, 2]
        for j in range(2):
            H[i, j] -= m_dk * dt[j] * stretch
            H[j, i] -= m_dk * dt[j] * stretch
    for i in range(2):
        for j in range(2):
            H[i, j] += m_k * dt[i] * dt[j]


@compile_inlined
def _pull_back(
    G: np.ndarray, stress: np.ndarray, modulus: np.ndarray, first: np.ndarray, second: np.ndarray
) -> None:
    """Fill `first`, (6,), with G^T stress, and add G^T modulus G to `second`, (6, 6).

    G is [[e, 0], [X, k]] with e and k diagonal.
    """
    half = on_stack((3, 3))  # of G^T modulus: what a does on m
    for i in range(3):
        first[i] = G[i, i] * stress[i]
        first[3 + i] = G[3 + i, 3 + i] * stress[3 + i]
        for k in range(3):
            first[i] += G[3 + k, i] * stress[3 + k]
        for j in range(3):
            total = G[i, i] * modulus[i, 3 + j]
            for k in range(3):
                total += G[3 + k, i] * modulus[3 + k, 3 + j]
            half[i, j] = total
    for i in range(3):
        for j in range(3):
            both = half[i, j] * G[3 + j, 3 + j]
            second[i, 3 + j] += both
            second[3 + j, i] += both
            second[3 + i, 3 + j] += G[3 + i, 3 + i] * modulus[3 + i, 3 + j] * G[3 + j, 3 + j]
            total = G[i, i] * modulus[i, j]
            for k in range(3):
                total += G[3 + k, i] * modulus[3 + k, j]
            total *= G[j, j]
            for k in range(3):
                total += half[i, k] * G[3 + k, j]
            second[i, j] += total


@partial(compile_function, forceinline=True)
def section(
    cross: CrossSection,
    a: np.ndarray,
    b: np.ndarray,
    plastic: np.ndarray,
    resultant: np.ndarray,
    tangent: np.ndarray,
    new_plastic: np.ndarray,
) -> float:
    """Return the thickness stretch, and fill forces and moments per reference length.

    Args:
        cross: Metal, thickness and layers.
        a: First fundamental form a11, a22, a12 [1], (3,).
        b: Second fundamental form b11, b22, b12 [1/m], (3,).
        plastic: Plastic strains of every layer before [1], (layers, 4).
        resultant: Written: energy's derivative by (a/2, b) as vectors of six [N/m, N], (6,).
        tangent: Written: its derivative, a symmetric matrix, (6, 6).
        new_plastic: Written: plastic strains after [1], (layers, 4).
    """
    F, into, out = on_stack((5, 5)), on_stack((3, 3)), on_stack((3, 3))
    x1, x2 = eigenbasis(a, F, into, out)
    stretch = 1.0 / np.sqrt(x1 * x2)
    curvature, dk = on_stack((3,)), on_stack((7, 3))
    turn(into, b, curvature)
    _curvature(F, stretch, curvature, dk)

    # In material axes, in which the layers keep their plastic strains.
    strain, stress, modulus = on_stack((6,)), on_stack((6,)), on_stack((6, 6))
    spectral_strain = on_stack((6,))
    spectral_strain[0], spectral_strain[1], spectral_strain[2] = (
        0.5 * np.log(x1),
        0.5 * np.log(x2),
        0.0,
    )
    for i in range(3):
        spectral_strain[3 + i] = dk[6, i]
    turn(out, spectral_strain, strain)
    layer_resultants(cross, strain, plastic, stress, modulus, new_plastic)

    # In the eigenbasis.
    conjugate, conjugate_modulus = on_stack((6,)), on_stack((6, 6))
    turn(into, stress, conjugate)
    turn_blocks(into, modulus, conjugate_modulus)
    G, first, second = on_stack((6, 6)), on_stack((6,)), on_stack((6, 6))
    _gradient(F, stretch, dk, G)
    _geometric(F, stretch, dk, curvature, conjugate, second)
    _pull_back(G, conjugate, conjugate_modulus, first, second)

    turn(out, first, resultant)
    turn_blocks(out, second, tangent)
    for i in range(6):
        resultant[i] *= _BY_STRAIN[i]
        for j in range(6):
            tangent[i, j] *= _BY_STRAIN[i] * _BY_STRAIN[j]
    return stretch

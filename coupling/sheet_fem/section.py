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

import numpy as np

from coupling.sheet_fem.compiled import compiled
from coupling.sheet_fem.logarithm import divided_differences
from coupling.sheet_fem.material import Material, plane_stress


@compiled
def _rotation(c: float, s: float, strain: np.ndarray) -> None:
    """Fill the rotation of (11, 22, 2*12) strain vectors into axes turned by (cos, sin), (3, 3)."""
    strain[0, 0] = strain[1, 1] = c * c
    strain[0, 1] = strain[1, 0] = s * s
    strain[0, 2] = c * s
    strain[1, 2] = -c * s
    strain[2, 0] = -2.0 * c * s
    strain[2, 1] = 2.0 * c * s
    strain[2, 2] = c * c - s * s


@compiled
def layer_resultants(
    material: Material,
    thickness: float,
    layers: np.ndarray,
    strain: np.ndarray,
    plastic: np.ndarray,
    resultant: np.ndarray,
    tangent: np.ndarray,
    new_plastic: np.ndarray,
) -> None:
    """Sum the layers' stresses.

    Args:
        material: Of the sheet.
        thickness: At first [m].
        layers: Points and weights over the thickness, -1 to 1, (2, layers).
        strain: e and kappa, (6,).
        plastic: Of every layer before, (layers, 4).
        resultant: Written: conjugates of e and kappa [N/m, N], (6,).
        tangent: Written: its derivative, (6, 6).
        new_plastic: Written, (layers, 4).
    """
    at = np.empty(3)
    stress = np.empty(3)
    modulus = np.empty((3, 3))
    resultant[:] = 0.0
    tangent[:, :] = 0.0
    for layer in range(layers.shape[1]):
        zeta = 0.5 * thickness * layers[0, layer]
        weight = 0.5 * thickness * layers[1, layer]
        for i in range(3):
            at[i] = strain[i] - zeta * strain[3 + i]
        plane_stress(material, at, plastic[layer], stress, modulus, new_plastic[layer])
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


@compiled
def _geometric(
    n: np.ndarray,
    m: np.ndarray,
    b: np.ndarray,
    dk: np.ndarray,
    dt: np.ndarray,
    stretch: float,
    F: np.ndarray,
    H: np.ndarray,
) -> None:
    """Fill H with n : D2 e + m : D2 kappa over (da11, da22, da12, db11, db22, db12), eigenbasis."""
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


@compiled
def section(
    material: Material,
    thickness: float,
    layers: np.ndarray,
    a: np.ndarray,
    b: np.ndarray,
    plastic: np.ndarray,
    resultant: np.ndarray,
    tangent: np.ndarray,
    new_plastic: np.ndarray,
) -> float:
    """Return the thickness stretch, and fill forces and moments per reference length.

    Args:
        material: Of the sheet.
        thickness: At first [m].
        layers: Points and weights over the thickness, -1 to 1, (2, layers).
        a: First fundamental form a11, a22, a12, (3,).
        b: Second fundamental form b11, b22, b12 [1/m], (3,).
        plastic: Of every layer before, (layers, 4).
        resultant: Written: energy's derivative by (a/2, b) as vectors of six [N/m, N], (6,).
        tangent: Written: its derivative, symmetric, (6, 6).
        new_plastic: Written, (layers, 4).
    """
    mean, half = 0.5 * (a[0] + a[1]), 0.5 * (a[0] - a[1])
    radius = np.sqrt(half * half + a[2] * a[2])
    x1, x2 = mean + radius, mean - radius
    c, s = 1.0, 0.0
    if radius > 0.0:
        angle = 0.5 * np.arctan2(a[2], half)
        c, s = np.cos(angle), np.sin(angle)
    F = np.empty((5, 5))
    divided_differences(x1, x2, F)
    turn = np.empty((3, 3))
    _rotation(c, s, turn)
    stretch = 1.0 / np.sqrt(x1 * x2)

    # Second fundamental form in the eigenbasis of the first.
    be = np.empty(3)
    be[0] = c * c * b[0] + s * s * b[1] + 2.0 * c * s * b[2]
    be[1] = s * s * b[0] + c * c * b[1] - 2.0 * c * s * b[2]
    be[2] = c * s * (b[1] - b[0]) + (c * c - s * s) * b[2]

    # k = 2 Df(a)[b] (without the thickness stretch) and its derivatives; row 6 is kappa itself.
    dk = np.zeros((7, 3))
    dk[0, 0] = 4.0 * F[3, 0] * be[0]
    dk[2, 0] = 4.0 * F[2, 1] * be[2]
    dk[1, 1] = 4.0 * F[0, 3] * be[1]
    dk[2, 1] = 4.0 * F[1, 2] * be[2]
    dk[0, 2] = 4.0 * F[2, 1] * be[2]
    dk[1, 2] = 4.0 * F[1, 2] * be[2]
    dk[2, 2] = 4.0 * (F[2, 1] * be[0] + F[1, 2] * be[1])
    dk[3, 0] = 2.0 * F[2, 0]
    dk[4, 1] = 2.0 * F[0, 2]
    dk[5, 2] = 4.0 * F[1, 1]
    dk[6, 0] = stretch * 2.0 * F[2, 0] * be[0]
    dk[6, 1] = stretch * 2.0 * F[0, 2] * be[1]
    dk[6, 2] = stretch * 4.0 * F[1, 1] * be[2]
    dt = np.array([F[2, 0], F[0, 2]])

    # Strains in material axes; `turn` transposed carries stress vectors back, its rows strains.
    strain = np.empty(6)
    e1, e2 = 0.5 * np.log(x1), 0.5 * np.log(x2)
    strain[0] = c * c * e1 + s * s * e2
    strain[1] = s * s * e1 + c * c * e2
    strain[2] = 2.0 * c * s * (e1 - e2)
    strain[3] = c * c * dk[6, 0] + s * s * dk[6, 1] - c * s * dk[6, 2]
    strain[4] = s * s * dk[6, 0] + c * c * dk[6, 1] + c * s * dk[6, 2]
    strain[5] = 2.0 * c * s * (dk[6, 0] - dk[6, 1]) + (c * c - s * s) * dk[6, 2]

    inner = np.empty(6)
    modulus = np.empty((6, 6))
    layer_resultants(material, thickness, layers, strain, plastic, inner, modulus, new_plastic)

    # Derivatives of (e, kappa) by (da11, da22, da12, db11, db22, db12), eigenbasis.
    G = np.zeros((6, 6))
    G[0, 0] = F[2, 0]
    G[1, 1] = F[0, 2]
    G[2, 2] = 2.0 * F[1, 1]
    for i in range(6):
        for j in range(3):
            G[3 + j, i] = stretch * dk[i, j]
    for i in range(2):
        for j in range(3):
            G[3 + j, i] -= dk[6, j] * dt[i]

    # Resultants in the eigenbasis: strains there = turn * strains, so stresses = turn^-T * stresses.
    n = np.empty(3)
    m = np.empty(3)
    for part, target in ((0, n), (3, m)):
        target[0] = c * c * inner[part] + s * s * inner[part + 1] + 2.0 * c * s * inner[part + 2]
        target[1] = s * s * inner[part] + c * c * inner[part + 1] - 2.0 * c * s * inner[part + 2]
        target[2] = c * s * (inner[part + 1] - inner[part]) + (c * c - s * s) * inner[part + 2]
    H = np.empty((6, 6))
    # The shear of dk is an engineering shear, that of m a stress: both belong together.
    _geometric(n, m, be, dk, dt, stretch, F, H)

    # From (da, db) in the eigenbasis to the vectors of six in material axes: a matrix of two
    # blocks J; (e, kappa) in material axes are then back G J, again by blocks.
    J = np.empty((2, 3, 3))
    for i in range(3):
        for j in range(3):
            J[0, i, j] = turn[i, j] * (1.0 if i == 2 else 2.0)
            J[1, i, j] = turn[i, j] * (0.5 if i == 2 else 1.0)
    back = np.empty((3, 3))
    _rotation(c, -s, back)
    L = np.empty((6, 6))
    HJ = np.empty((6, 6))
    row = np.empty(6)
    for i in range(6):
        for block in range(2):
            for j in range(3):
                at = 3 * block + j
                row[at] = 0.0
                HJ[i, at] = 0.0
                for k in range(3):
                    row[at] += G[i, 3 * block + k] * J[block, k, j]
                    HJ[i, at] += H[i, 3 * block + k] * J[block, k, j]
        for j in range(6):
            G[i, j] = row[j]
    for i in range(3):
        for j in range(6):
            L[i, j] = back[i, 0] * G[0, j] + back[i, 1] * G[1, j] + back[i, 2] * G[2, j]
            L[3 + i, j] = back[i, 0] * G[3, j] + back[i, 1] * G[4, j] + back[i, 2] * G[5, j]
    for i in range(6):
        resultant[i] = 0.0
        for k in range(6):
            resultant[i] += L[k, i] * inner[k]
    for i in range(6):
        for j in range(6):
            row[j] = 0.0
            for k in range(6):
                row[j] += modulus[i, k] * L[k, j]
        for j in range(6):
            modulus[i, j] = row[j]
    for i in range(6):
        for j in range(6):
            total = 0.0
            for k in range(6):
                total += L[k, i] * modulus[k, j]
            for k in range(3):
                total += J[i // 3, k, i % 3] * HJ[3 * (i // 3) + k, j]
            tangent[i, j] = total
    return stretch

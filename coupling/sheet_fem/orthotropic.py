"""A sheet with a rolling direction, x: its coefficients, and the axes in which Yld91 is simple.

With c1 to c6 the coefficients (a, b, c, f, g, h in [Barlat1991]) the vector z = (p, d, t) of
`yield_function` is

    p = (c2 s_xx + c1 s_yy)/2,  d = ((2 c3 + c2) s_xx - (2 c3 + c1) s_yy)/6,  t = c6 s_xy.

c4 and c5 belong to the shears across the sheet, which plane stress has not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import internal
from coupling.sheet_fem.material import Material
from coupling.sheet_fem.on_stack import Symmetric, Triple
from coupling.sheet_fem.yield_function import effective_terms


class Yld91(NamedTuple):
    """Metal that yields by Yld91, with hardening of the effective stress as `Material` has it.

    Attributes:
        youngs_modulus: Young's modulus, E [Pa].
        poisson_ratio: Poisson's ratio, nu.
        strength: Effective yield stress at a total strain of 1, K [Pa].
        prestrain: Strain that the metal brings along, eps_0.
        exponent: Hardening exponent, n.
        anisotropy: Coefficients c1 to c6, > 0; all 1 for an isotropic metal.
        terms: Polynomial's numbers for the yield exponent, as `effective_terms`, (terms,).
    """

    youngs_modulus: float
    poisson_ratio: float
    strength: float
    prestrain: float
    exponent: float
    anisotropy: tuple[float, float, float, float, float, float]
    terms: np.ndarray

    @classmethod
    def of(cls, material: Material, anisotropy: Sequence[float], yield_exponent: int) -> Yld91:
        """Return a metal with elasticity and hardening of another.

        Args:
            material: Metal without anisotropy.
            anisotropy: Coefficients c1 to c6, > 0.
            yield_exponent: Exponent m, even.
        """
        c1, c2, c3, c4, c5, c6 = (float(c) for c in anisotropy)
        return cls(*material, (c1, c2, c3, c4, c5, c6), effective_terms(yield_exponent))


class OrthotropicAxes(NamedTuple):
    """The linear map of stresses to z, and its inverse; `shear` is c6."""

    px: float
    py: float
    dx: float
    dy: float
    xp: float
    xd: float
    yp: float
    yd: float
    shear: float


@internal
def axes_of(metal: Yld91) -> OrthotropicAxes:
    """Return the map of a metal."""
    c1, c2, c3, _, _, c6 = metal.anisotropy
    px, py = 0.5 * c2, 0.5 * c1
    dx, dy = (2.0 * c3 + c2) / 6.0, -(2.0 * c3 + c1) / 6.0
    over = 1.0 / (px * dy - py * dx)
    return OrthotropicAxes(px, py, dx, dy, over * dy, -over * py, -over * dx, over * px, c6)


@internal
def compliance(metal: Yld91, axes: OrthotropicAxes) -> Symmetric:
    """Return Hooke's law in z, strain over stress, times Young's modulus."""
    nu = metal.poisson_ratio
    xp, xd, yp, yd = axes.xp, axes.xd, axes.yp, axes.yd
    return Symmetric(
        xp * xp + yp * yp - 2.0 * nu * xp * yp,
        xp * xd + yp * yd - nu * (xp * yd + yp * xd),
        0.0,
        xd * xd + yd * yd - 2.0 * nu * xd * yd,
        0.0,
        2.0 * (1.0 + nu) / (axes.shear * axes.shear),
    )


@internal
def into_axes(axes: OrthotropicAxes, stress: np.ndarray) -> Triple:
    """Return z of a stress 11, 22, 12 [Pa], (3,)."""
    return Triple(
        axes.px * stress[0] + axes.py * stress[1],
        axes.dx * stress[0] + axes.dy * stress[1],
        axes.shear * stress[2],
    )


@internal
def fill_stress(axes: OrthotropicAxes, z: Triple, stress: np.ndarray) -> None:
    """Fill the stress 11, 22, 12 [Pa], (3,), whose z is given."""
    stress[0] = axes.xp * z.p + axes.xd * z.d
    stress[1] = axes.yp * z.p + axes.yd * z.d
    stress[2] = z.t / axes.shear


@internal
def add_strain(axes: OrthotropicAxes, factor: float, strain: Triple, total: np.ndarray) -> None:
    """Add a strain, conjugate to z, times a factor to the strain 11, 22, 2*12 [1], (3,)."""
    total[0] += factor * (axes.px * strain.p + axes.dx * strain.d)
    total[1] += factor * (axes.py * strain.p + axes.dy * strain.d)
    total[2] += factor * axes.shear * strain.t


@internal
def fill_modulus(axes: OrthotropicAxes, E: float, m: Symmetric, modulus: np.ndarray) -> None:
    """Fill the modulus of stress over strain [Pa], (3, 3), E m in z."""
    xp, xd, yp, yd = axes.xp, axes.xd, axes.yp, axes.yd
    shear = E / axes.shear
    modulus[0, 0] = E * (xp * xp * m.pp + 2.0 * xp * xd * m.pd + xd * xd * m.dd)
    modulus[1, 1] = E * (yp * yp * m.pp + 2.0 * yp * yd * m.pd + yd * yd * m.dd)
    modulus[0, 1] = E * (xp * yp * m.pp + (xp * yd + xd * yp) * m.pd + xd * yd * m.dd)
    modulus[0, 2] = shear * (xp * m.pt + xd * m.dt)
    modulus[1, 2] = shear * (yp * m.pt + yd * m.dt)
    modulus[2, 2] = shear / axes.shear * m.tt
    modulus[1, 0], modulus[2, 0], modulus[2, 1] = modulus[0, 1], modulus[0, 2], modulus[1, 2]

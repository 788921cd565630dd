"""Return mapping of an orthotropic sheet in plane stress: Yld91 with isotropic hardening.

It is the closest-point projection [DeSouzaNeto2008] in the axes of `orthotropic`: with the multiplier g
and Hooke's compliance B,

    B (z - z_trial) + g ds/dz = 0,   s(z) = sigma_y(eps + g).

The matrix of these equations is B + g d2s/dz2, positive definite since s is convex, bordered by ds/dz
and -sigma_y': nowhere singular.  So Newton's direction always lowers the sum of squares of the
residuals, and a line search leads to the one solution.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import compile_function, internal
from coupling.sheet_fem.material import yield_stress
from coupling.sheet_fem.on_stack import Symmetric, Triple, add_scaled, dot, inverse, product
from coupling.sheet_fem.orthotropic import (
    Yld91,
    add_strain,
    axes_of,
    compliance,
    fill_modulus,
    fill_stress,
    into_axes,
)
from coupling.sheet_fem.yield_function import Effective, effective

# Residual at which the return mapping ends, over the yield stress, and what rounding may leave of the
# trial stress, over that.
_CONVERGED = 1e-12
_ROUNDING = 1e-14
_MAX_ITERATIONS = 60
_MAX_HALVINGS = 20
# Share of the fall of the sum of squares, as its slope promises it, that a step must bring.
_FALL = 1e-4
# The multiplier along the ray of the trial stress, where Newton's method starts: iterations, and stress
# beyond the yield stress, relative to it, that is near enough.
_ALONG_RAY = 3
_CLOSE_EIGENVALUES = 1e-3


class _Trial(NamedTuple):
    """Trial state that a layer has to return from.

    Attributes:
        z: Trial stress [Pa].
        stress: Its effective stress [Pa].
        compliance: Hooke's law times Young's modulus.
        before: Equivalent plastic strain before.
    """

    z: Triple
    stress: float
    compliance: Symmetric
    before: float


class _Iterate(NamedTuple):
    """A place on the way back, and all that is known there.

    Attributes:
        z: Stress [Pa].
        multiplier: Multiplier times Young's modulus [Pa].
        s: Effective stress and its derivatives.
        normal: ds/dz.
        limit: Yield stress [Pa].
        slope: Its slope over Young's modulus.
        flow: Residual of the flow rule, times Young's modulus [Pa].
        size: Sum of squares of all residuals [Pa^2].
    """

    z: Triple
    multiplier: float
    s: Effective
    normal: Triple
    limit: float
    slope: float
    flow: Triple
    size: float


@internal
def _normal(z: Triple, s: Effective) -> Triple:
    return Triple(2.0 * z.p * s.x, 2.0 * z.d * s.y, 2.0 * z.t * s.y)


@internal
def _iterate(metal: Yld91, trial: _Trial, z: Triple, multiplier: float) -> _Iterate:
    s = effective(metal.terms, z.p, z.d, z.t)
    normal = _normal(z, s)
    E = metal.youngs_modulus
    limit, slope = yield_stress(metal, trial.before + multiplier / E)
    elastic = product(trial.compliance, add_scaled(z, -1.0, trial.z))
    flow = add_scaled(elastic, multiplier, normal)
    excess = s.stress - limit
    size = dot(flow, flow) + excess * excess
    return _Iterate(z, multiplier, s, normal, limit, slope / E, flow, size)


@internal
def _solver(trial: _Trial, at: _Iterate) -> Symmetric:
    """Return the inverse of B + g d2s/dz2, over Young's modulus."""
    B, s = trial.compliance, at.s
    p, d, t = at.z
    once, twice = 2.0 * at.multiplier, 4.0 * at.multiplier
    matrix = Symmetric(
        B.pp + once * s.x + twice * p * p * s.xx,
        B.pd + twice * p * d * s.xy,
        twice * p * t * s.xy,
        B.dd + once * s.y + twice * d * d * s.yy,
        twice * d * t * s.yy,
        B.tt + once * s.y + twice * t * t * s.yy,
    )
    return inverse(matrix)


@internal
def _along_ray(metal: Yld91, trial: _Trial, s: Effective) -> _Iterate:
    """Return the place on the ray of the trial stress where the surface is met.

    Along it the effective stress falls by a fixed rate with the multiplier.
    """
    E = metal.youngs_modulus
    normal = _normal(trial.z, s)
    fall = E * dot(normal, product(inverse(trial.compliance), normal))
    multiplier = 0.0
    limit, slope = yield_stress(metal, trial.before)
    excess = trial.stress - limit
    for _ in range(_ALONG_RAY):
        # The yield stress is concave: from below this never overshoots.
        multiplier += excess / (fall + slope)
        limit, slope = yield_stress(metal, trial.before + multiplier)
        excess = trial.stress - fall * multiplier - limit
        if excess <= _CLOSE_EIGENVALUES * limit:
            break
    scale = limit / trial.stress
    z = Triple(scale * trial.z.p, scale * trial.z.d, scale * trial.z.t)
    return _iterate(metal, trial, z, E * multiplier)


@internal
def _converged(trial: _Trial, at: _Iterate) -> bool:
    return bool(at.size <= (_CONVERGED * at.limit + _ROUNDING * trial.stress) ** 2)


@internal
def _return_to_surface(metal: Yld91, trial: _Trial, start: _Iterate) -> _Iterate:
    """Return the last iterate of Newton's method with a line search."""
    at = start
    for _ in range(_MAX_ITERATIONS):
        if _converged(trial, at):
            break
        solver = _solver(trial, at)
        u, v = product(solver, at.flow), product(solver, at.normal)
        excess = at.s.stress - at.limit
        more = (excess - dot(at.normal, u)) / (dot(at.normal, v) + at.slope)
        step = add_scaled(u, more, v)
        # The multiplier stays positive.
        share = 1.0 if at.multiplier + more > 0.0 else -0.9 * at.multiplier / more
        last = at
        for _ in range(_MAX_HALVINGS):
            z = add_scaled(last.z, -share, step)
            at = _iterate(metal, trial, z, last.multiplier + share * more)
            if at.size <= (1.0 - _FALL * share) * last.size or _converged(trial, at):
                break
            share *= 0.5
    return at


@compile_function
def yld91(
    material: Yld91,
    strain: np.ndarray,
    plastic: np.ndarray,
    stress: np.ndarray,
    tangent: np.ndarray,
    new_plastic: np.ndarray,
) -> None:
    """Return mapping of one layer; arguments as of `return_mapping.plane_stress`, strain (3,) [1].

    Where it does not converge the stress is not a number, and the load step is cut.
    """
    E, nu, before = material.youngs_modulus, material.poisson_ratio, plastic[3]
    direct, G = E / (1.0 - nu * nu), 0.5 * E / (1.0 + nu)
    e0, e1 = strain[0] - plastic[0], strain[1] - plastic[1]
    stress[0], stress[1] = direct * (e0 + nu * e1), direct * (e1 + nu * e0)
    stress[2] = G * (strain[2] - plastic[2])
    for k in range(4):
        new_plastic[k] = plastic[k]
    axes = axes_of(material)
    z = into_axes(axes, stress)
    s = effective(material.terms, z.p, z.d, z.t)
    if not s.stress > yield_stress(material, before)[0]:  # also without any stress
        tangent[:, :] = 0.0
        tangent[0, 0] = tangent[1, 1] = direct
        tangent[0, 1] = tangent[1, 0] = nu * direct
        tangent[2, 2] = G
        return
    trial = _Trial(z, s.stress, compliance(material, axes), before)
    at = _return_to_surface(material, trial, _along_ray(material, trial, s))
    if not _converged(trial, at):
        stress[:] = np.nan
        return
    fill_stress(axes, at.z, stress)
    add_strain(axes, at.multiplier / E, at.normal, new_plastic)
    new_plastic[3] += at.multiplier / E
    m = _solver(trial, at)
    v = product(m, at.normal)
    over = 1.0 / (dot(at.normal, v) + at.slope)
    curbed = Symmetric(
        m.pp - over * v.p * v.p,
        m.pd - over * v.p * v.d,
        m.pt - over * v.p * v.t,
        m.dd - over * v.d * v.d,
        m.dt - over * v.d * v.t,
        m.tt - over * v.t * v.t,
    )
    fill_modulus(axes, E, curbed, tangent)

"""Symmetric matrices of 3 x 3 as plain numbers, for code that allocates nothing."""

from __future__ import annotations

from typing import NamedTuple

from coupling.sheet_fem.compiled import internal


class Triple(NamedTuple):
    """A vector of (p, d, t)."""

    p: float
    d: float
    t: float


class Symmetric(NamedTuple):
    """A symmetric matrix over (p, d, t)."""

    pp: float
    pd: float
    pt: float
    dd: float
    dt: float
    tt: float


@internal
def inverse(m: Symmetric) -> Symmetric:
    """Return the inverse, of the cofactors."""
    pp, pd, pt = m.dd * m.tt - m.dt * m.dt, m.pt * m.dt - m.pd * m.tt, m.pd * m.dt - m.pt * m.dd
    over = 1.0 / (m.pp * pp + m.pd * pd + m.pt * pt)
    return Symmetric(
        over * pp,
        over * pd,
        over * pt,
        over * (m.pp * m.tt - m.pt * m.pt),
        over * (m.pd * m.pt - m.pp * m.dt),
        over * (m.pp * m.dd - m.pd * m.pd),
    )


@internal
def product(m: Symmetric, v: Triple) -> Triple:
    """Return the matrix times a vector."""
    return Triple(
        m.pp * v.p + m.pd * v.d + m.pt * v.t,
        m.pd * v.p + m.dd * v.d + m.dt * v.t,
        m.pt * v.p + m.dt * v.d + m.tt * v.t,
    )


@internal
def dot(a: Triple, b: Triple) -> float:
    """Return the scalar product."""
    return a.p * b.p + a.d * b.d + a.t * b.t


@internal
def add_scaled(a: Triple, factor: float, b: Triple) -> Triple:
    """Return a + factor b."""
    return Triple(a.p + factor * b.p, a.d + factor * b.d, a.t + factor * b.t)

"""Steps of d e' + S(e) = T(t) where S bends: exponential collocation.

The source g of `gear_steps` is interpolated at five Lobatto points (Hochbruck and Ostermann,
"Exponential integrators", Acta Numerica 19, 2010), exact where S is a line, whatever the time constant.
Steps are halved until an embedded rule of four points agrees.  The equations of all steps are solved
together by Newton's method, each iteration one bidiagonal system.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dtbtrs

from coupling.inverse.gear_pieces import Piece
from coupling.inverse.gear_steps import Steps, decaying_moments

_NODES = np.array([0.0, 0.5 - np.sqrt(21.0) / 14.0, 0.5, 0.5 + np.sqrt(21.0) / 14.0, 1.0])
_POWERS = np.arange(5)
_MONOMIALS = np.linalg.inv(_NODES[:, None] ** _POWERS).T  # values at the nodes @ this: coefficients
# The polynomial that vanishes at all nodes but the middle one.
_WITHOUT_MIDDLE = np.poly(np.delete(_NODES, 2))[::-1]
# Values at the nodes of both halves of a step, from those at the nodes of the whole.
_HALVES = [_MONOMIALS @ (((part + _NODES) / 2.0)[:, None] ** _POWERS).T for part in (0.0, 1.0)]
# Newton's iterations over the steps of one call; what has not converged then is halved.
_ITERATIONS = 25
_CONVERGED = 1e-14  # [rad]
# Largest estimate of the error of the angle [rad]; the error is far smaller.
_TOLERANCE = 1e-10
_HALVINGS = 40
# Part of a step that a path along a bend goes on behind its piece.
_BEYOND = 0.02


def follow_bend(
    piece: Piece, damping: float, start: float, steps: Steps
) -> tuple[Steps, np.ndarray]:
    """Return steps, halved as needed, and the angles at their ends [rad], (k,), along a bent piece.

    Where the piece is left the steps end, a little behind it: the law bends anew there.
    """
    steps, values = _converged(piece, damping, steps, np.full((len(steps.length), 5), start))
    for _ in range(_HALVINGS):
        steps, values = _cut(piece, damping, steps, values)
        count = _inside(piece, values[:, -1])
        own, decay = _errors(piece, damping, steps, values)
        band = np.stack([np.ones(count), -np.append(decay[1:count], 0.0)])
        total, _ = dtbtrs(band, own[:count], uplo="L", diag="U")
        if total.max() <= _TOLERANCE:
            break
        excess = own / (0.1 * _TOLERANCE * np.maximum(1.0 - decay, 0.01))
        excess[count:] = 0.0
        # Halving a step makes its estimate 2^5 times smaller.
        times = np.clip(np.ceil(np.log2(np.maximum(excess, 1e-3)) / 5.0), 0, 4).astype(int)
        if not times.any():
            times[:count] = 1
        while times.any():
            chosen = times > 0
            steps, values = steps.halved(chosen), _halves(values, chosen)
            times = np.repeat(np.maximum(times - 1, 0), np.where(chosen, 2, 1))
        steps, values = _converged(piece, damping, steps, values)
    return steps, values[:, -1]


def _errors(
    piece: Piece, damping: float, steps: Steps, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return each step's contribution to the error [rad], and the share of an error that it passes on.

    The difference to the rule without the middle node: more than the error of the rule itself.
    """
    x, h = values, steps.length
    slope = piece.slope(x[:, 2])
    source = _torque_at_nodes(steps) - piece.torque(x) + slope[:, None] * (x - x[:, :1])
    quartic = source @ _MONOMIALS[:, -1] / damping
    z = slope * h / damping
    return h * np.abs(quartic * (decaying_moments(z, 5) @ _WITHOUT_MIDDLE)), np.exp(-z)


def _cut(
    piece: Piece, damping: float, steps: Steps, values: np.ndarray
) -> tuple[Steps, np.ndarray]:
    """End the steps a little behind the first place at which the angle leaves the piece."""
    count = _inside(piece, values[:, -1])
    x = values[count - 1]
    edge = piece.high if x[-1] > piece.high else piece.low
    if piece.low <= x[-1] <= piece.high:
        return steps, values
    polynomial = _MONOMIALS.T @ x
    polynomial[0] -= edge
    roots = np.roots(polynomial[::-1])
    real = np.sort(roots.real[(np.abs(roots.imag) < 1e-6) & (np.abs(roots.real - 0.5) <= 0.5)])
    part = float(real[0]) + _BEYOND if len(real) else 1.0
    values = values[:count]
    length, last = steps.length[:count].copy(), steps.last[:count].copy()
    if part < 0.9:
        length[-1] *= part
        last[-1] = False
    steps = Steps(steps.row[:count], steps.offset[:count], length, steps.torque[:count], last)
    return (steps, values) if last[-1] else _converged(piece, damping, steps, values)


def _inside(piece: Piece, ends: np.ndarray) -> int:
    """Number of steps up to the first that ends outside the piece, with that one."""
    outside = (ends < piece.low) | (ends > piece.high)
    return int(np.argmax(outside)) + 1 if outside.any() else len(ends)


def _halves(values: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Values at the nodes of steps (k, 5) of which some are halved."""
    pick = np.repeat(np.arange(len(chosen)), np.where(chosen, 2, 1))
    second = np.append(False, pick[1:] == pick[:-1])
    first = chosen[pick] & ~second
    out = values[pick]
    out[first] = out[first] @ _HALVES[0]
    out[second] = out[second] @ _HALVES[1]
    return out


def _converged(
    piece: Piece, damping: float, steps: Steps, values: np.ndarray
) -> tuple[Steps, np.ndarray]:
    """Solve the collocation of all steps from a guess; halve steps on which Newton fails."""
    for _ in range(_HALVINGS):
        values, failed = collocate(piece, damping, steps, values)
        if not failed.any():
            break
        values = _halves(values, failed)
        steps = steps.halved(failed)
    return steps, values


def _torque_at_nodes(steps: Steps) -> np.ndarray:
    at, c = steps.length[:, None] * _NODES, steps.torque
    return c[:, :1] + at * (c[:, 1:2] + at * (c[:, 2:3] + at * c[:, 3:]))


def collocate(
    piece: Piece, damping: float, steps: Steps, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return angles at the nodes of each step (k, 5), and the steps where Newton still moves them.

    Args:
        piece: Piece of the curve.
        damping: d [N m s/rad].
        steps: Steps.
        values: A guess [rad], (k, 5); its first entry is the initial angle.
    """
    h = steps.length[:, None]
    at, torque = h * _NODES, _torque_at_nodes(steps)
    width = piece.high - piece.low
    below, above = piece.low - width, piece.high + width
    x = values
    band = np.ones((2, len(x) + 1))
    failed = np.zeros(len(x), dtype=bool)
    for _ in range(_ITERATIONS):
        slope = piece.slope(x[:, 2:3])
        z = slope * at[:, 1:] / damping
        source = (torque - piece.torque(x) + slope * (x - x[:, :1])) / damping
        moments = decaying_moments(z, 5) * _NODES[1:, None] ** (_POWERS + 1)
        y = h * np.einsum("kjm,km->kj", moments, source @ _MONOMIALS)
        decay = np.exp(-z)
        new = np.empty_like(x)
        new[:, 1:] = x[:, :1] + y
        # Newton's steps d_{n+1} = r_n + decay_n d_n of the angles between the steps.
        rest = np.append(0.0, new[:, -1])
        rest[1:-1] -= x[1:, 0]
        rest[-1] -= x[-1, -1]
        band[1, :-1] = -decay[:, -1]
        moved, _ = dtbtrs(band, rest, uplo="L", diag="U")
        new[:, 0] = x[:, 0] + moved[:-1]
        new[:, 1:] += decay * moved[:-1, None]
        np.clip(new, below, above, out=new)
        change = np.abs(new - x).max(axis=1)
        x = new
        count = _inside(piece, x[:, -1])
        failed[:] = False
        failed[:count] = change[:count] > _CONVERGED + 4e-16 * np.abs(x[:count]).max()
        if not failed.any():
            break
    return x, failed & (change > 10.0 * _CONVERGED)

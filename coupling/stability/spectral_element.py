"""Polynomials through the Gauss points of an element, and what decaying waves make of them.

The answer of a mode with eigenvalue c to a polynomial p is int_0^x exp(c (x - xi)) p(xi) dxi, by a
quadrature that is graded towards the end where the mode decays fast.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

# Decay within an element from which on its integrals are graded towards their end, and how.
_SLOW_DECAY, _GRADES = 15.0, 5.0 ** np.arange(-6, 1)


@dataclass(frozen=True)
class ElementRule:
    """Points of an element, within 0 and 1, and its integrals.

    Attributes:
        points: Gauss points x [1], (p,).
        weights: Their weights [1], (p,).
    """

    points: np.ndarray
    weights: np.ndarray

    def lagrange(self, x: np.ndarray) -> np.ndarray:
        """Return the polynomials that are 1 at one point and 0 at the others [1], (.., p)."""
        return _legendre(2.0 * x - 1.0, len(self.points)) @ self._coefficients

    @cached_property
    def _coefficients(self) -> np.ndarray:
        count = len(self.points)
        values = _legendre(2.0 * self.points - 1.0, count)
        # Discrete orthogonality at Gauss points: the inverse of `values`.
        return (2.0 * np.arange(count)[:, None] + 1.0) * values.T * self.weights

    def within(self, c: np.ndarray) -> np.ndarray:
        """Return the integrals of exp(c (x - xi)) times each polynomial from 0 to each point x [1].

        Args:
            c: Exponents over the element [1], complex, (k,).

        Returns:
            Complex, (p, p, k).
        """
        return self._integrals(c, self.points, _base)

    def whole(self, c: np.ndarray) -> np.ndarray:
        """Return the integrals of exp(c (1 - xi)) times each polynomial [1], complex, (p, k)."""
        return self._integrals(c, np.ones(1), _whole_base)[0]

    def partial(self, c: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return the integrals of exp(c (x - xi)) times each polynomial from 0 to x [1], (n, p, k).

        Args:
            c: Exponents over the element [1], complex, (k,).
            x: Ends [1], within 0 and 1, (n,).
        """

        def base_of(points: int, count: int, graded: bool) -> np.ndarray:
            return _weighted_polynomials(points, count, graded, x)

        return self._integrals(c, x, base_of)

    def _integrals(
        self,
        c: np.ndarray,
        x: np.ndarray,
        base_of: Callable[[int, int, bool], np.ndarray],
    ) -> np.ndarray:
        graded = bool(np.abs(c.real).max(initial=0.0) > _SLOW_DECAY)
        count = len(self.points) // 2 + 6 + (0 if graded else int(np.abs(c).max(initial=0.0) / 3.0))
        behind, _ = _quadrature(count, graded)
        wave = np.exp((x[:, None] * behind)[..., None] * c)
        # (n, p, q) @ (n, q, k)
        return base_of(len(self.points), count, graded) @ wave


def _legendre(x: np.ndarray, count: int) -> np.ndarray:
    """Return Legendre's polynomials of degrees 0 to count - 1, (.., count)."""
    return np.polynomial.legendre.legvander(x, count - 1)


@cache
def element_rule(count: int) -> ElementRule:
    """Return the rule of an element with so many points."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return ElementRule(0.5 * (1.0 + nodes), 0.5 * weights)


def _weighted_polynomials(points: int, count: int, graded: bool, x: np.ndarray) -> np.ndarray:
    """Return the polynomials times the weights of a quadrature from 0 to x, (n, p, q)."""
    behind, weight = _quadrature(count, graded)
    way = x[:, None] * behind
    base = element_rule(points).lagrange(x[:, None] - way) * (x[:, None] * weight)[..., None]
    return np.ascontiguousarray(base.transpose(0, 2, 1))


@cache
def _base(points: int, count: int, graded: bool) -> np.ndarray:
    return _weighted_polynomials(points, count, graded, element_rule(points).points)


@cache
def _whole_base(points: int, count: int, graded: bool) -> np.ndarray:
    return _weighted_polynomials(points, count, graded, np.ones(1))


@cache
def _quadrature(count: int, graded: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return points and weights between 0 and 1, where graded in panels that shrink towards 0."""
    rule, edges = element_rule(count), np.append(0.0, _GRADES if graded else [1.0])
    width = np.diff(edges)[:, None]
    return (edges[:-1, None] + width * rule.points).ravel(), (width * rule.weights).ravel()

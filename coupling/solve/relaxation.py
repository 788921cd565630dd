"""Relaxation schemes for the fixed point x = G(x): all answer `update(x, g)` with the next x."""

from __future__ import annotations

from collections import deque

import numpy as np

from coupling.solve.scheme import Scheme, SchemeBuilder


class ConstantRelaxation(Scheme):
    """x + factor (g - x); plain iteration for factor 1.

    Converges where |1 - factor (1 + loop gain)| < 1, the loop gain being process stiffness times
    robot compliance.

    Args:
        first: The factor.
    """

    def __init__(self, first: float = 1.0) -> None:
        self._factor = first

    def update(self, x: np.ndarray, g: np.ndarray) -> np.ndarray:
        """Return the relaxed iterate."""
        return x + self._factor * (g - x)

    def reset(self) -> None:
        """Do nothing: there is no memory."""


class Aitken(Scheme):
    """Relaxation whose factor follows the secant of the last two residuals.

    Irons and Tuck 1969; in the form of Kuettler and Wall 2008, eq. (46) (docs/references.md).

    Args:
        first: Factor of the first update.

    Example:
        >>> scheme, x = Aitken(first=0.1), np.array([1e-3])
        >>> for _ in range(2):  # loop gain 5: x = 1e-3 - 5 x
        ...     x = scheme.update(x, g=1e-3 - 5.0 * x)
        >>> bool(np.isclose(x[0], 1e-3 / 6.0, rtol=1e-12))
        True
    """

    def __init__(self, first: float = 1.0) -> None:
        self._first = self._factor = first
        self._residual: np.ndarray | None = None

    def update(self, x: np.ndarray, g: np.ndarray) -> np.ndarray:
        """Return the relaxed iterate."""
        residual = g - x
        if self._residual is not None:
            change = residual - self._residual
            length = float(np.vdot(change, change))
            if length > 0.0:
                self._factor *= -float(np.vdot(self._residual, change)) / length
        self._residual = residual
        return x + self._factor * residual

    def reset(self) -> None:
        """Return to the first factor."""
        self._factor, self._residual = self._first, None


class Anderson(Scheme):
    """Quasi-Newton step from a least-squares fit over earlier residuals (IQN-ILS).

    Degroote, Bathe and Vierendeels 2009; equal to Anderson's mixing (docs/references.md).

    Args:
        first: Factor of the first update.
    """

    # Differences that add less than this fraction to the fit are noise of the robot's solution.
    DEPENDENT = 1e-8
    # Earlier differences that are kept.
    MEMORY = 10

    def __init__(self, first: float = 1.0) -> None:
        self._first = first
        self._last: tuple[np.ndarray, np.ndarray] | None = None
        self._residual_steps: deque[np.ndarray] = deque(maxlen=self.MEMORY)
        self._g_steps: deque[np.ndarray] = deque(maxlen=self.MEMORY)

    def update(self, x: np.ndarray, g: np.ndarray) -> np.ndarray:
        """Return the next iterate."""
        residual = g - x
        if self._last is not None:
            last_residual, last_g = self._last
            self._residual_steps.append((residual - last_residual).ravel())
            self._g_steps.append((g - last_g).ravel())
        self._last = residual, g
        if not self._residual_steps:
            return x + self._first * residual
        steps = np.column_stack(self._residual_steps)
        weights = np.linalg.lstsq(steps, residual.ravel(), rcond=self.DEPENDENT)[0]
        return g - (np.column_stack(self._g_steps) @ weights).reshape(g.shape)

    def reset(self) -> None:
        """Forget all differences."""
        self._last = None
        self._residual_steps.clear()
        self._g_steps.clear()


class Restarting(Scheme):
    """A scheme that starts again, more carefully, from its best iterate when it gets lost.

    A tool that a too large update lifts off its wall feels no force there, and what a scheme learns
    from such iterates misleads it.  After some updates that did not reduce the residual the wrapped
    scheme forgets everything and continues from the best iterate with a smaller first factor.

    Args:
        build: Maker of the wrapped scheme.
        first: Its first factor.
    """

    PATIENCE = 3  # updates without a smaller residual
    SHRINK = 0.25  # of the first factor, at each restart

    def __init__(self, build: SchemeBuilder, first: float = 1.0) -> None:
        self._build = build
        self._first = self._factor = first
        self._scheme = build(first)
        self._best: tuple[np.ndarray, np.ndarray] | None = None
        self._best_size = np.inf
        self._idle = 0

    def update(self, x: np.ndarray, g: np.ndarray) -> np.ndarray:
        """Return the next iterate."""
        size = float(np.linalg.norm(g - x))
        if self._best is None or size < self._best_size:
            self._best, self._best_size, self._idle = (x, g), size, 0
        else:
            self._idle += 1
        if self._idle >= self.PATIENCE:
            self._idle = 0
            self._factor *= self.SHRINK
            self._scheme = self._build(self._factor)
            x, g = self._best
        return self._scheme.update(x, g)

    def reset(self) -> None:
        """Forget earlier iterates and restarts."""
        self._best, self._best_size, self._idle = None, np.inf, 0
        self._factor = self._first
        self._scheme = self._build(self._factor)

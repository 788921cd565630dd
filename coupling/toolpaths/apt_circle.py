"""Circles of APT cutter location data, which stand beside the points along them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Points on a circle may be so far apart that their chords leave it by this [m].
_SAGITTA = 1e-4
# A point is on a circle within this [m].
_CIRCLE_TOLERANCE = 1e-4


@dataclass(frozen=True)
class AptCircle:
    """A circle in the file's unit.

    Attributes:
        line: Line of its statement.
        centre: Its centre [the file's unit], (3,).
        normal: Unit vector along its axis [1], (3,).
        radius: Its radius [the file's unit].
        first: Number of the first point behind its statement.
    """

    line: int
    centre: np.ndarray
    normal: np.ndarray
    radius: float
    first: int

    def require_points(self, points: np.ndarray, scale: float) -> None:
        """Refuse a circle that points do not follow: two or more, close to its arc.

        Args:
            points: Points of the file [its unit], (n, 3).
            scale: The unit [m].

        Raises:
            ValueError: If they do not.
        """
        along = points[self.first - 1 : self.first + 2] - self.centre
        across = along - np.outer(along @ self.normal, self.normal)
        off = np.abs(np.linalg.norm(across, axis=1) - self.radius)
        half = 0.5 * np.linalg.norm(np.diff(across, axis=0), axis=1)
        sagitta = self.radius - np.sqrt(np.maximum(self.radius**2 - half**2, 0.0))
        if (
            len(along) < 3
            or scale * off.max() > _CIRCLE_TOLERANCE
            or scale * sagitta.max() > _SAGITTA
        ):
            raise ValueError(
                f"line {self.line}: CIRCLE: expected points along it behind it, at most"
                f" {1e3 * _SAGITTA:g} mm from chord to arc, got others: output arcs as points"
            )

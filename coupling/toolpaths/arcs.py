"""Arcs and helices between two points, by their centre or their radius."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.toolpaths.segments import Curve

# A centre may be so much farther from one end than from the other, for a printed program is rounded:
# 10 um, or as RS274/NGC has it a thousandth of the radius and at most half a millimetre [m].
_MIN_RADIUS_TOLERANCE, _RELATIVE_RADIUS_TOLERANCE, _MAX_RADIUS_TOLERANCE = 1e-5, 1e-3, 5e-4
# Ends this close are one [m]: no program writes so many digits.
_SAME_POINT_DISTANCE = 1e-9


@dataclass(frozen=True)
class Plane:
    """A plane of arcs.

    Attributes:
        first, second: Numbers of its axes, in which arcs turn counter-clockwise from the first.
        normal: Number of the axis that they are seen from.
    """

    first: int
    second: int
    normal: int

    def vectors(
        self, first: np.ndarray, second: np.ndarray, normal: np.ndarray | float
    ) -> np.ndarray:
        """Return vectors, any unit, (..., 3), of components (...) in its axes."""
        vectors = np.empty((*np.shape(first), 3))
        vectors[..., self.first], vectors[..., self.second], vectors[..., self.normal] = (
            first,
            second,
            normal,
        )
        return vectors


PLANES = {17.0: Plane(0, 1, 2), 18.0: Plane(2, 0, 1), 19.0: Plane(1, 2, 0)}


@dataclass(frozen=True)
class Arc:
    """An arc, or a helix about the normal of its plane.

    Attributes:
        plane: The plane.
        centre: Centre in the plane [m], (2,).
        start, end: First and last point [m], (3,).
        angle: Angle from the first axis to the start [rad].
        sweep: Angle that it turns by, positive counter-clockwise [rad].
    """

    plane: Plane
    centre: np.ndarray
    start: np.ndarray
    end: np.ndarray
    angle: float
    sweep: float

    @classmethod
    def about(
        cls, plane: Plane, start: np.ndarray, end: np.ndarray, centre: np.ndarray, clockwise: bool
    ) -> Arc:
        """Return the arc about a centre [m], (2,); a full circle where its ends are one in the plane.

        Raises:
            ValueError: If the ends are not equally far from the centre.
        """
        axes = [plane.first, plane.second]
        a, b = start[axes] - centre, end[axes] - centre
        radii = np.hypot(*a), np.hypot(*b)
        allowed = max(
            _MIN_RADIUS_TOLERANCE,
            min(_RELATIVE_RADIUS_TOLERANCE * max(radii), _MAX_RADIUS_TOLERANCE),
        )
        if abs(radii[0] - radii[1]) > allowed or min(radii) == 0.0:
            raise ValueError(
                "expected a centre equally far from both ends, got"
                f" {1e3 * radii[0]:.6g} and {1e3 * radii[1]:.6g} mm: write more digits, or"
                " G90.1 before where I, J, K are places"
            )
        angle = float(np.arctan2(a[1], a[0]))
        turn = float(np.arctan2(b[1], b[0])) - angle
        if np.linalg.norm(end[axes] - start[axes]) < _SAME_POINT_DISTANCE:
            turn = 0.0
        # Between 0, left out, and a full turn, which is what equal ends mean.
        sweep = (-turn if clockwise else turn) % (2.0 * np.pi) or 2.0 * np.pi
        return cls(plane, centre, start, end, angle, -sweep if clockwise else sweep)

    @classmethod
    def of_radius(
        cls, plane: Plane, start: np.ndarray, end: np.ndarray, radius: float, clockwise: bool
    ) -> Arc:
        """Return the shorter arc between points (3,) of a radius [m], with a negative one the longer.

        Raises:
            ValueError: If the ends are farther apart than the circle is wide, or one.
        """
        axes = [plane.first, plane.second]
        chord = end[axes] - start[axes]
        length = float(np.hypot(*chord))
        if length < _SAME_POINT_DISTANCE:
            raise ValueError(
                "expected an arc with R to end elsewhere, got a full circle: give I, J, K"
            )
        if length > 2.0 * abs(radius) + _MIN_RADIUS_TOLERANCE:
            raise ValueError(
                f"expected ends at most {2e3 * abs(radius):.6g} mm apart, got {1e3 * length:.6g} mm"
            )
        height = np.sqrt(max(radius**2 - 0.25 * length**2, 0.0))
        leftward = np.array([-chord[1], chord[0]]) / length
        side = -1.0 if clockwise != (radius < 0.0) else 1.0
        return cls.about(
            plane, start, end, start[axes] + 0.5 * chord + side * height * leftward, clockwise
        )

    @property
    def radius(self) -> float:
        """Radius at the start [m]."""
        return float(np.hypot(*(self.start[[self.plane.first, self.plane.second]] - self.centre)))

    @property
    def length(self) -> float:
        """Length [m]."""
        return float(np.hypot(self.radius * self.sweep, self._rise))

    @property
    def _rise(self) -> float:
        return float(self.end[self.plane.normal] - self.start[self.plane.normal])

    def segment(self) -> Curve:
        """Return it as a curve by arc length; it ends where its program says, to the last digit."""
        axes = [self.plane.first, self.plane.second]
        last = float(np.hypot(*(self.end[axes] - self.centre)))

        def point(s: np.ndarray) -> np.ndarray:
            part = s / self.length
            angle = self.angle + part * self.sweep
            radius = self.radius + part * (last - self.radius)
            first, second = self.centre[:, None] + radius * np.stack([np.cos(angle), np.sin(angle)])
            return self.plane.vectors(
                first, second, self.start[self.plane.normal] + part * self._rise
            )

        return Curve(self.length, point)

    def curvatures(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the curvature vectors at both ends [1/m], towards the axis, (3,) each."""
        ends = np.array([self.angle, self.angle + self.sweep])
        inwards = self.plane.vectors(-np.cos(ends), -np.sin(ends), 0.0)
        begin, end = inwards * self.radius * (self.sweep / self.length) ** 2
        return begin, end

    def directions(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the unit tangents at both ends, (3,) each."""
        ends, size = np.array([self.angle, self.angle + self.sweep]), self.radius * self.sweep
        along = self.plane.vectors(-size * np.sin(ends), size * np.cos(ends), self._rise)
        begin, end = along / self.length
        return begin, end

"""A rigid joint: its link is where the drive is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.inverse.gear_drive import wanted_bend
from coupling.inverse.rows import CommandRows, Layout
from coupling.inverse.spline import UniformSpline, stencil


@dataclass(frozen=True)
class RigidDrive:
    """The link of a rigid joint, which misses its motion by  delta = q - phi  at the nodes.

    Attributes:
        layout: Order of the unknowns.
        cycle: Distance of the rows [s].
        first: Whether the path begins here.
        link: phi at the nodes [rad], (nodes,).
        bend: phi'' where the coefficients of the command's acceleration stand [rad/s^2], (n,).
    """

    layout: Layout
    cycle: float
    first: bool
    link: np.ndarray
    bend: np.ndarray

    @classmethod
    def of(cls, link: UniformSpline, rows: CommandRows) -> RigidDrive:
        """Return the drive of a rigid joint along all rows."""
        layout = Layout.of(rows)
        nodes = rows.start + rows.cycle / layout.parts * np.arange(layout.nodes)
        return cls(layout, rows.cycle, True, link.at(nodes)[:, 0], wanted_bend(link, rows))

    def part(self, begin: int, end: int) -> RigidDrive:
        """Return the drive along the intervals begin to end of the rows."""
        parts, degree = self.layout.parts, self.layout.degree
        return replace(
            self,
            layout=replace(self.layout, count=end - begin),
            first=self.first and begin == 0,
            link=self.link[begin * parts : end * parts + 1],
            bend=self.bend[begin : end + degree - 2],
        )

    @property
    def _value(self) -> np.ndarray:
        """Weights of an interval's coefficients at the ends of its steps, (parts, degree + 1)."""
        parts = self.layout.parts
        return stencil(np.arange(1, parts + 1) / parts, self.layout.degree, 0)

    def defects(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return delta - q + phi at the ends of the steps [rad], (n, parts)."""
        local = np.lib.stride_tricks.sliding_window_view(coefficients, self.layout.degree + 1)
        wanted = (misses + self.link)[1:].reshape(-1, self.layout.parts)
        defects: np.ndarray = wanted - local @ self._value.T
        return defects

    def gradient(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return the derivatives of `defects` by the unknowns of their blocks, (n, parts, width)."""
        layout = self.layout
        rows = np.zeros((layout.count, layout.parts, layout.width))
        rows[:, :, layout.block_coefficient[1:]] = -self._value
        steps = np.arange(layout.parts)
        rows[:, steps, layout.block_miss[steps + 2]] = 1.0
        return rows

"""Model discrepancy: the measured deviation of a robot's tool beyond its model along one path.

It is a function of time, along the path and at the feed that it was measured at, and it is added to
what the model does: a part of hysteresis, gear errors and heat that comes again with every run.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import BSpline, CubicSpline, make_interp_spline

from coupling.errors import CaseError
from coupling.files.csv_table import CORRECTION_COLUMNS, read_table, write_table
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.time_axis import require_history

_POSITION = ("x", "y", "z")
# A path is the one that was measured if its points are as near as this [m]: a part that is touched off
# anew moves by its robot's sag, and the discrepancy changes over centimetres.
_SAME_PATH_DISTANCE = 2e-3
# Ends that are as near as this are the same [s].
_SAME_END = 1e-3


@dataclass(frozen=True)
class Discrepancy:
    """Deviation of the real tool from the model's, over time along one path.

    Attributes:
        time: Rising, from the path's start to its end [s], (k,).
        position: Desired positions at these times, in the frame of the run folder's files [m], (k, 3).
        deviation: Displacement [m] and rotation vector [rad] of the real tool from the model's, same
            axes, (k, 6).

    Raises:
        ValueError: If sizes do not agree, time does not rise or a value is not finite.

    Example:
        >>> time = np.linspace(0.0, 1.0, 5)
        >>> shift = Discrepancy(time, np.zeros((5, 3)), np.tile([1e-4, 0, 0, 0, 0, 0], (5, 1)))
        >>> pose = np.zeros((2, 7)); pose[:, 6] = 1.0
        >>> shift.real(ToolPath(np.array([0.0, 1.0]), pose)).position[0, :, 0]
        array([1.e-04, 1.e-04])
    """

    time: np.ndarray
    position: np.ndarray
    deviation: np.ndarray

    def __post_init__(self) -> None:
        shapes = self.position.shape, self.deviation.shape
        count = len(self.time)
        if shapes != ((count, 3), (count, 6)) or count < 2:
            raise ValueError(
                f"expected positions ({count}, 3) and deviations ({count}, 6), got {shapes}"
            )
        require_history(self.time, np.hstack([self.position, self.deviation]), "discrepancy")

    @classmethod
    def read(cls, file: Path) -> Discrepancy:
        """Read a file of such a table.

        Raises:
            CaseError: If it is no such file.
        """
        rows = read_table(file, ("time", *_POSITION, *CORRECTION_COLUMNS), CaseError)
        try:
            return cls(rows[:, 0], rows[:, 1:4], rows[:, 4:])
        except ValueError as cause:
            raise CaseError(f"{file}: {cause}") from cause

    def text(self) -> str:
        """Return it as a table: time, x, y, z, dx, dy, dz, drx, dry, drz."""
        table = io.StringIO()
        columns = ("time", *_POSITION, *CORRECTION_COLUMNS)
        write_table(table, columns, np.column_stack([self.time, self.position, self.deviation]))
        return table.getvalue()

    def transformed(self, frame: Frame) -> Discrepancy:
        """Return the same in another frame, in which `frame` is the present one."""
        return Discrepancy(self.time, frame.points(self.position), frame.rotate(self.deviation))

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return it at times (n,) [m, rad], (n, 6); beyond its ends it holds its last value."""
        values: np.ndarray = self._between(np.clip(time, self.time[0], self.time[-1]))
        return values

    def real(self, path: ToolPath) -> ToolPath:
        """Return the real tool's path for the model's path, of one tool."""
        return path.displaced(self.at(path.time))

    def model(self, path: ToolPath) -> ToolPath:
        """Return the model's path for which the real tool is on `path`, of one tool."""
        rotation = self.at(path.time)
        return path.displaced(-rotation)

    def require_along(self, path: ToolPath) -> None:
        """Refuse another path than the one that it was measured along.

        Raises:
            CaseError: If ends or points differ.
        """
        ends = float(path.time[0]), float(path.time[-1])
        span = float(self.time[0]), float(self.time[-1])
        if max(abs(a - b) for a, b in zip(ends, span, strict=True)) > _SAME_END:
            raise CaseError(
                f"expected a path from {span[0]:.6g} to {span[1]:.6g} s, as it was measured, got one"
                f" {ends[0]:.6g} to {ends[1]:.6g} s: measure this path"
            )
        there = CubicSpline(path.time, path.position[0])(np.clip(self.time, *ends))
        off = np.linalg.norm(there - self.position, axis=1)
        if off.max() > _SAME_PATH_DISTANCE:
            row = int(off.argmax())
            raise CaseError(
                f"expected the path that was measured, got one that is {1e3 * off[row]:.3g} mm beside it"
                f" at t = {self.time[row]:.6g} s: measure this path"
            )

    @cached_property
    def _between(self) -> BSpline:
        # At rest at both ends, as the paths are that it is added to, up to its acceleration.
        rest_states = [(order, np.zeros(6)) for order in (1, 2)]
        return make_interp_spline(self.time, self.deviation, 5, bc_type=(rest_states, rest_states))

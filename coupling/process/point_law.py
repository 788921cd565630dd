"""Processes without memory: the force follows from the time and the TCP's position alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from coupling.path.histories import ToolPath, WrenchHistory


@dataclass(frozen=True)
class PointLaw:
    """A force law, its constants, and the desired path where it asks for one.

    Attributes:
        force: Of `coupling.process.force_laws`: positions (n, 3) and constants to forces (n, 3).
        constants: Numbers and arrays, by the name of the force's argument.
        desired: Given to the force as `desired`, at the times of the positions; None: the force
            does not depend on time.
    """

    force: Callable[..., np.ndarray]
    constants: Mapping[str, float | np.ndarray]
    desired: ToolPath | None = None

    def wrench(self, path: ToolPath) -> WrenchHistory:
        """Return the wrench on the tool along an actual path, base axes.

        Between its samples the desired path is straight.
        """
        arguments = dict(self.constants)
        if self.desired is not None:
            arguments["desired"] = np.column_stack(
                [np.interp(path.time, self.desired.time, axis) for axis in self.desired.position.T]
            )
        force = self.force(path.position, **arguments)
        return WrenchHistory(path.time, np.hstack([force, np.zeros_like(force)]))

"""Milling spindles for robot files whose TCP is the flange."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import tomlkit
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Spindle:
    """A spindle with holder and tool, straight before the flange; a block of even mass.

    Attributes:
        reach: Distance of the tool's tip from the flange [m].
        across, length: Size of the block across and along the tool [m].
    """

    mass: float
    reach: float
    across: float
    length: float

    def on_flange(self, text: str) -> str:
        r"""Return the text of a robot file with the spindle on its flange, x of the TCP along the tool.

        Example:
            >>> text = HEAVY_SPINDLE.on_flange("[tcp]\nposition = [0.0, 0.0, 0.0]\n")
            >>> text.splitlines()[1]
            'position = [0.35, 0.0, 0.0] # an assumption: the tip of a milling tool'
        """
        file: Any = tomlkit.parse(text)
        flange_from_tool = Rotation.from_euler("xyz", file["tcp"].get("rpy", [0.0, 0.0, 0.0]))
        along, turn = flange_from_tool.apply([1.0, 0.0, 0.0]), flange_from_tool.as_matrix()
        squares = self.across**2 + self.length**2
        moments = self.mass / 12.0 * np.array([2.0 * self.across**2, squares, squares])
        inertia = (turn @ np.diag(moments) @ turn.T)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        file["tcp"]["position"] = _rounded(self.reach * along)
        if "payload" not in file:
            file["payload"] = tomlkit.table()
        file["payload"]["mass"] = self.mass
        file["payload"]["com"] = _rounded(0.5 * self.length * along)
        file["payload"]["inertia"] = _rounded(
            inertia if np.any(np.abs(inertia[3:]) > 1e-9) else inertia[:3]
        )
        file["payload"]["mass"].comment("an assumption: a milling spindle with holder and tool")
        file["tcp"]["position"].comment("an assumption: the tip of a milling tool")
        sources = file.get("sources", {})
        for key in [key for key in sources if key.split(".")[0] in ("tcp", "payload")]:
            del sources[key]
        for key in ("tcp", "payload") if sources else ():
            sources[key] = "an assumption of elastic-robot init: a milling spindle"
        return tomlkit.dumps(file)


# Of robots for heavy loads, and of those for 20 to 100, 5 to 20 and fewer kilograms.
HEAVY_SPINDLE = Spindle(30.0, 0.35, 0.12, 0.3)
MEDIUM_SPINDLE = Spindle(12.0, 0.3, 0.1, 0.25)
SMALL_SPINDLE = Spindle(4.0, 0.2, 0.08, 0.16)
LIGHT_SPINDLE = Spindle(2.0, 0.15, 0.06, 0.12)


def _rounded(values: np.ndarray) -> list[float]:
    """Return numbers to a millionth of their unit, without negative zeros."""
    return [round(value, 6) + 0.0 for value in values.tolist()]

"""Stiffness of gears by class of robot, where nobody has measured it, and a spindle for bare flanges.

The ranges hold the published values that docs/references.md lists; where there are none, they say so.
"""

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


@dataclass(frozen=True)
class GearClass:
    """Robots with gears of a kind.

    Attributes:
        arm, wrist: Lowest, typical and highest stiffness of the gears of the arm and of the last three
            joints [N m/rad].
        longest: Length of links from the first joint to the flange up to which a robot is taken for one
            of the class, if none is stated [m].
        moving_mass: Mass of the links that such a robot moves [kg], for an estimate.
        spindle: Spindle that such a robot mills with.
    """

    about: str
    arm: tuple[float, float, float]
    wrist: tuple[float, float, float]
    source: str
    longest: float
    moving_mass: float
    spindle: Spindle


CLASSES = {
    "light": GearClass(
        "light arms with strain wave gears, up to 15 kg",
        (5e3, 1.5e4, 5e4),
        (2e3, 6e3, 2e4),
        "the order of 1e4 N m/rad of light arms with strain wave gears [AlbuSchaeffer2007]; how far"
        " gears of other sizes are from it is an assumption",
        1.35,
        20.0,
        LIGHT_SPINDLE,
    ),
    "small": GearClass(
        "industrial robots of 5 to 20 kg",
        (1.5e5, 3.5e5, 7e5),
        (1e4, 4e4, 1e5),
        "2.1e5 to 4.7e5 N m/rad of the arm of a robot of 15 kg [Tuerk1990]; the wrist is an"
        " assumption, a ninth of the arm as in heavy robots",
        2.0,
        120.0,
        SMALL_SPINDLE,
    ),
    "medium": GearClass(
        "industrial robots of 20 to 100 kg",
        (4e5, 1.2e6, 4e6),
        (4e4, 1.5e5, 4e5),
        "an assumption: between the classes small and heavy; no published values were found",
        2.5,
        350.0,
        MEDIUM_SPINDLE,
    ),
    "heavy": GearClass(
        "industrial robots of 100 to 500 kg",
        (1.3e6, 3.3e6, 7.6e6),
        (2e5, 4.5e5, 8e5),
        "arm 2.4e6 and 3.3e6 of 270 kg [Klimchik2013], 3.7e6 to 4.8e6 of 500 kg [Bharti2024], 1.4e6 to"
        " 2.8e6 of 165 kg [Liu2026], 4.1e6 to 7.5e6 of 300 kg (the file kuka_kr300);"
        " wrist 3.0e5 to 4.2e5, 4.7e5 to 7.6e5, 4.3e5 to 5.0e5 N m/rad of the first three;"
        " 1.5e6 to 3.4e6 of modal fits of wrists [GBTMilling] are left out",
        5.0,
        1000.0,
        HEAVY_SPINDLE,
    ),
}


def class_of(length: float) -> str:
    """Return the class of a robot whose links have a length [m].

    Example:
        >>> class_of(0.8), class_of(2.9)
        ('light', 'heavy')
    """
    fitting = [name for name, gear_class in CLASSES.items() if length <= gear_class.longest]
    return fitting[0] if fitting else "heavy"

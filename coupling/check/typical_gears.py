"""Stiffness of gears by class of robot, for robots of which nobody has measured it.

The ranges hold the published values that docs/references.md lists; where there are none, they say so.
"""

from __future__ import annotations

from dataclasses import dataclass

from coupling.check.spindle import (
    HEAVY_SPINDLE,
    LIGHT_SPINDLE,
    MEDIUM_SPINDLE,
    SMALL_SPINDLE,
    Spindle,
)


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

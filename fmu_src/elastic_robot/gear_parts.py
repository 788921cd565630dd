"""Parts of a joint's gear as data: hysteresis and kinematic error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic_robot.requirements import require_number


@dataclass(frozen=True)
class StopElement:
    """Element of a gear's hysteresis: a spring in series with dry friction.

    Its torque follows the gear's wind-up e as h = f clip(s / a, +-1): the elongation s takes every
    change of e until it reaches the slip angle a, where the element slips (Prandtl's stop operator,
    Maxwell-slip element; Brokate and Sprekels 1996, docs/references.md).

    Attributes:
        slip_torque: Torque f at which it slips [N m], > 0.
        slip_angle: Elongation a at which it slips [rad], > 0.

    Raises:
        ValueError: If a value is out of its range.

    Example:
        >>> StopElement(slip_torque=50.0, slip_angle=1e-4).stiffness
        500000.0
    """

    slip_torque: float
    slip_angle: float

    def __post_init__(self) -> None:
        require_number("slip_torque", self.slip_torque, minimum=0.0, open_end=True, unit="N m")
        require_number("slip_angle", self.slip_angle, minimum=0.0, open_end=True, unit="rad")

    @property
    def stiffness(self) -> float:
        """Stiffness while it does not slip [N m/rad]."""
        return self.slip_torque / self.slip_angle


@dataclass(frozen=True)
class KinematicError:
    """One sine of a gear's kinematic error: its output is at q + amplitude sin(order q + phase).

    q is the motor's angle over the gear ratio; a gear whose parts are not round, or not in the middle,
    has the orders of their turns.

    Attributes:
        amplitude: Its amplitude [rad], > 0.
        order: Periods in a turn of the gear's output, > 0.
        phase: Its phase at q = 0 [rad].

    Raises:
        ValueError: If a value is out of its range.
    """

    amplitude: float
    order: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        require_number("amplitude", self.amplitude, minimum=0.0, open_end=True, unit="rad")
        require_number("order", self.order, minimum=0.0, open_end=True, unit="1")
        require_number("phase", self.phase, minimum=-np.inf, open_end=True, unit="rad")

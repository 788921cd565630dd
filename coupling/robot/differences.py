"""Differences of the robot that really moves from the model that a command is computed for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from coupling.robot.parameter_table import PARAMETER_KINDS, VARIED
from coupling.robot.parameters import acting_parts, apply_values, place_of
from elastic_robot.body import Body
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import IDEAL
from elastic_robot.requirements import Vector

_ZERO = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class RobotDifference:
    """Differences of one robot from its description.

    Attributes:
        amounts: Factors of parameters, and shifts [rad], by the names of `VARIED`: one for all joints,
            or one for each, (joints,); those of gears are those of the tilts at their joints as well.
        payload: Mass that the last body carries in addition, as a point [kg], >= 0.
        payload_position: Place of that mass in the last body's frame [m], (3,); None: at the TCP.

    Raises:
        ValueError: If a factor is negative, that of what no robot is without zero, or the mass negative.

    Example:
        >>> from coupling.files.robot_file import find_robot, load_robot
        >>> robot = load_robot(find_robot("icme2008"))
        >>> softer = RobotDifference({"stiffness": (0.5,)}).values(robot, "backlash")
        >>> softer["joint[1].tilt[1].stiffness"]
        15000000.0
        >>> RobotDifference().applied(robot, "backlash") is robot
        True
    """

    amounts: Mapping[str, Vector] = field(default_factory=dict)
    payload: float = 0.0
    payload_position: Vector | None = None

    def __post_init__(self) -> None:
        for name, amounts in self.amounts.items():
            _, variation = VARIED[name]
            is_finite, least = np.all(np.isfinite(amounts)), min(amounts, default=1.0)
            if variation.is_shift:
                if not is_finite:
                    raise ValueError(f"{name}: expected finite angles [rad], got {list(amounts)}")
                continue
            if not is_finite or least < 0.0 or (variation.above_zero and least == 0.0):
                bound = "> 0" if variation.above_zero else ">= 0"
                raise ValueError(f"{name}: expected finite factors {bound}, got {list(amounts)}")
        if not (np.isfinite(self.payload) and self.payload >= 0.0):
            raise ValueError(f"payload: expected a finite mass >= 0 [kg], got {self.payload}")

    def values(self, robot: Robot, torque_curve: str, drive: str = "") -> dict[str, float]:
        """Return the parameters of a robot that change, by name.

        What does not show is left out: the backlash of a linear gear, stiffness and backlash of a gear
        with a torque table of its own, motors that follow their command exactly, and whatever is zero.

        Args:
            drive: "ideal" where its motors follow their command exactly.

        Raises:
            ValueError: If there are neither one nor as many factors as joints.
        """
        values = {}
        for name in self.amounts:
            key, variation = VARIED[name]
            by_joint = self._by_joint(name, robot)
            for varied in (key, *variation.also):
                kind = PARAMETER_KINDS[varied]
                for place, part in acting_parts(robot, torque_curve, drive, kind):
                    parameter, value = f"{place}.{varied}", kind.read(part)
                    amount = by_joint[place_of(parameter)[0] - 1]
                    other = variation.changed(value, amount)
                    if other != value:
                        values[parameter] = other
        return values

    def applied(self, robot: Robot, torque_curve: str, drive: str = "") -> Robot:
        """Return the robot that differs; arguments as of `values`."""
        values = self.values(robot, torque_curve, drive)
        differing = apply_values(robot, values) if values else robot
        if self.payload == 0.0:
            return differing
        place = robot.tcp_position if self.payload_position is None else self.payload_position
        mass = Body(self.payload, place, _ZERO)
        whole = mass if robot.payload is None else _merge_bodies((robot.payload, mass))
        return replace(differing, payload=whole)

    def in_words(self) -> Iterator[str]:
        """Yield a phrase for each difference."""
        for name, amounts in self.amounts.items():
            _, variation = VARIED[name]
            if set(amounts) != {variation.neutral}:
                numbers = ", ".join(f"{amount / variation.unit:g}" for amount in amounts)
                sign, unit = ("+", " deg") if variation.is_shift else ("x", "")
                yield f"{variation.in_words} {sign} {numbers}{unit}"
        if self.payload:
            yield f"payload + {self.payload:g} kg"

    def _by_joint(self, name: str, robot: Robot) -> list[float]:
        amounts, count = self.amounts[name], len(robot.joints)
        if len(amounts) not in (1, count):
            raise ValueError(
                f"{name}: expected one number, or {count}, one for each joint, got {len(amounts)}"
            )
        return [float(amount) for amount in np.broadcast_to(amounts, count)]


AS_THE_MODEL = RobotDifference()


def _merge_bodies(bodies: Sequence[Body]) -> Body:
    """Return the bodies of one frame as a single one, by the parallel axis theorem."""
    mass = sum(body.mass for body in bodies)
    com = sum((body.mass * np.array(body.com) for body in bodies), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        arm = np.array(body.com) - com
        inertia += body.inertia_matrix + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Body.from_matrix(mass, com, inertia)


@dataclass(frozen=True)
class PlantRobot:
    """The robot that really moves in place of a model."""

    description: Robot
    torque_curve: str
    difference: RobotDifference = AS_THE_MODEL
    drive: str = IDEAL

    @cached_property
    def robot(self) -> Robot:
        """The robot, with its differences."""
        return self.difference.applied(self.description, self.torque_curve, self.drive)


@dataclass(frozen=True)
class Plant:
    """Robots and load that a command really meets.

    Attributes:
        couple: Whether the process is evaluated on the path that the plant takes; if not, the wrench is
            that on the model.
    """

    robots: tuple[PlantRobot, ...]
    force: float = 1.0
    couple: bool = False

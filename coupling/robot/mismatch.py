"""Differences of the robot that really moves from the model that a command is computed for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.fit.parameters import robot_parameters
from elastic_robot.description import Body, Robot, Vector
from elastic_robot.fmi.interface import IDEAL

_NOTHING = (0.0, 0.0, 0.0)
# Parameters that may differ by a factor, in the order in which they are told.
FACTORS = ("stiffness", "damping", "backlash", "hysteresis")


@dataclass(frozen=True)
class ModelMismatch:
    """Differences of one robot from its description.

    Attributes:
        stiffness, damping, backlash, hysteresis: Factors of the parameters of the gears and of the tilts
            at their joints; one for all joints, or one for each, (joints,).
        payload: Mass that the last body carries in addition, as a point [kg], >= 0.
        payload_position: Place of that mass in the last body's frame [m], (3,); None: at the TCP.

    Raises:
        ValueError: If a factor is negative, that of the stiffness zero, or the mass negative.

    Example:
        >>> ModelMismatch(stiffness=(0.98,), payload=5.0).backlash
        (1.0,)
    """

    stiffness: Vector = (1.0,)
    damping: Vector = (1.0,)
    backlash: Vector = (1.0,)
    hysteresis: Vector = (1.0,)
    payload: float = 0.0
    payload_position: Vector | None = None

    def __post_init__(self) -> None:
        for name in FACTORS:
            factors = np.array(getattr(self, name))
            least = factors.min(initial=1.0)
            if not np.all(np.isfinite(factors)) or least < 0.0 or (name, least) == ("stiffness", 0):
                bound = "> 0" if name == "stiffness" else ">= 0"
                raise ValueError(
                    f"{name}: expected finite factors {bound}, got {list(factors.tolist())}"
                )
        if not (np.isfinite(self.payload) and self.payload >= 0.0):
            raise ValueError(f"payload: expected a finite mass >= 0 [kg], got {self.payload}")

    def description(self, robot: Robot) -> Robot:
        """Return a robot with the payload; the factors are in `parameters`.

        Example:
            >>> from coupling.files.robot_file import find_robot, load_robot
            >>> robot = load_robot(find_robot("icme2008"))
            >>> ModelMismatch().description(robot) is robot
            True
        """
        if self.payload == 0.0:
            return robot
        place = robot.tcp_position if self.payload_position is None else self.payload_position
        mass = Body(self.payload, place, _NOTHING)
        carried = mass if robot.payload is None else _joined((robot.payload, mass))
        return replace(robot, payload=carried)

    def parameters(self, robot: Robot, torque_curve: str) -> dict[str, float]:
        """Return the parameters of a robot's FMU that change, by name.

        What does not show is left out: the backlash of a linear gear, stiffness and backlash of a gear
        with a torque table of its own, and whatever is zero.

        Raises:
            ValueError: If there are neither one nor as many factors as joints.
        """
        factors = {kind: self._by_coordinate(kind, robot) for kind in FACTORS}
        return {
            own.name: value
            for own in robot_parameters(robot, torque_curve, FACTORS)
            if (value := float(factors[own.kind][own.coordinate] * own.value)) != own.value
        }

    def _by_coordinate(self, key: str, robot: Robot) -> np.ndarray:
        """Return the factors of every elastic coordinate, (m,)."""
        factors, joints = getattr(self, key), robot.joints
        if len(factors) not in (1, len(joints)):
            raise ValueError(
                f"{key}: expected one factor, or {len(joints)}, one for each joint, got"
                f" {len(factors)}"
            )
        coordinates = [(joint.stiffness is not None) + len(joint.tilt) for joint in joints]
        return np.repeat(np.broadcast_to(factors, len(joints)), coordinates)


AS_THE_MODEL = ModelMismatch()


def _joined(bodies: Sequence[Body]) -> Body:
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
    """The robot that really moves in place of a model.

    Attributes:
        description: Its description, with its payload.
        torque_curve: "linear", "backlash" or "spline".
        difference: Factors of its parameters.
        drive: "ideal", or "servo": its motors follow the command as their servos do.
    """

    description: Robot
    torque_curve: str
    difference: ModelMismatch = AS_THE_MODEL
    drive: str = IDEAL


@dataclass(frozen=True)
class Plant:
    """Robots and load that a command really meets.

    Attributes:
        robots: One for each robot of the case.
        force: Factor of the process's whole wrench.
        couple: Whether the process is evaluated on the path that the plant takes; if not, the wrench is
            that on the model.
    """

    robots: tuple[PlantRobot, ...]
    force: float = 1.0
    couple: bool = False

"""Differences of the robot that really moves from the model that a command is computed for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.robot.parameters import robot_parameters
from elastic_robot.description import Body, Robot, Vector
from elastic_robot.fmi.interface import IDEAL
from elastic_robot.gear_parts import Drive

_NOTHING = (0.0, 0.0, 0.0)
# Parameters that may differ by a factor, in the order of reports; those of gears and tilts
# are parameters of FMUs.
_ELASTIC = ("stiffness", "damping", "backlash", "hysteresis")
FACTORS = (*_ELASTIC, "friction", "servo_gain", "kinematic_error")
_ABOVE_ZERO = ("stiffness", "servo_gain")


@dataclass(frozen=True)
class ModelMismatch:
    """Differences of one robot from its description.

    Attributes:
        stiffness, damping, backlash, hysteresis: Factors of the parameters of the gears and of the tilts
            at their joints; one for all joints, or one for each, (joints,).
        friction: Factors of the friction of motors, at rest and viscous; likewise.
        servo_gain: Factors of the gains Kv, Kp and Ki of their servos, > 0; likewise.
        kinematic_error: Factors of the amplitudes of the gears' kinematic errors; likewise.
        kinematic_error_phase: Shifts of the phases of their sines [rad]; likewise.
        payload: Mass that the last body carries in addition, as a point [kg], >= 0.
        payload_position: Place of that mass in the last body's frame [m], (3,); None: at the TCP.

    Raises:
        ValueError: If a factor is negative, that of stiffness or gains zero, or the mass negative.

    Example:
        >>> ModelMismatch(stiffness=(0.98,), payload=5.0).backlash
        (1.0,)
    """

    stiffness: Vector = (1.0,)
    damping: Vector = (1.0,)
    backlash: Vector = (1.0,)
    hysteresis: Vector = (1.0,)
    friction: Vector = (1.0,)
    servo_gain: Vector = (1.0,)
    kinematic_error: Vector = (1.0,)
    kinematic_error_phase: Vector = (0.0,)
    payload: float = 0.0
    payload_position: Vector | None = None

    def __post_init__(self) -> None:
        for name in FACTORS:
            factors = np.array(getattr(self, name))
            least = factors.min(initial=1.0)
            above = name in _ABOVE_ZERO
            if not np.all(np.isfinite(factors)) or least < 0.0 or (above and least == 0.0):
                bound = "> 0" if above else ">= 0"
                raise ValueError(
                    f"{name}: expected finite factors {bound}, got {list(factors.tolist())}"
                )
        if not np.all(np.isfinite(self.kinematic_error_phase)):
            raise ValueError(
                "kinematic_error_phase: expected finite angles [rad], got"
                f" {list(self.kinematic_error_phase)}"
            )
        if not (np.isfinite(self.payload) and self.payload >= 0.0):
            raise ValueError(f"payload: expected a finite mass >= 0 [kg], got {self.payload}")

    def description(self, robot: Robot) -> Robot:
        """Return a robot with the payload, other motors and errors; other factors are in `parameters`.

        Raises:
            ValueError: If there are neither one nor as many factors as joints, or kinematic errors
                become larger than those of any gear.

        Example:
            >>> from coupling.files.robot_file import find_robot, load_robot
            >>> robot = load_robot(find_robot("icme2008"))
            >>> ModelMismatch().description(robot) is robot
            True
        """
        robot = self._with_errors(self._with_motors(robot))
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
        factors = {kind: self._by_coordinate(kind, robot) for kind in _ELASTIC}
        return {
            own.name: value
            for own in robot_parameters(robot, torque_curve, _ELASTIC)
            if (value := float(factors[own.kind][own.coordinate] * own.value)) != own.value
        }

    def has_effect(self, robot: Robot, torque_curve: str, drive: str) -> bool:
        """Return whether a robot whose drives are "ideal" or have a "servo" moves otherwise for it."""
        own = self.under(drive)
        return bool(own.parameters(robot, torque_curve)) or own.description(robot) != robot

    def under(self, drive: str) -> ModelMismatch:
        """Return what of it shows under drives that are "ideal", which have no motors, or a "servo"."""
        return self if drive != IDEAL else replace(self, friction=(1.0,), servo_gain=(1.0,))

    def _with_errors(self, robot: Robot) -> Robot:
        """Return a robot with other amplitudes and phases of its gears' kinematic errors."""
        if set(self.kinematic_error) == {1.0} and set(self.kinematic_error_phase) == {0.0}:
            return robot
        factors = self._by_joint("kinematic_error", robot)
        shifts = self._by_joint("kinematic_error_phase", robot)
        joints = [
            replace(
                joint,
                kinematic_error=tuple(
                    replace(sine, amplitude=factor * sine.amplitude, phase=sine.phase + shift)
                    for sine in joint.kinematic_error
                    if factor > 0.0
                ),
            )
            for joint, factor, shift in zip(robot.joints, factors, shifts, strict=True)
        ]
        return replace(robot, joints=tuple(joints))

    def _with_motors(self, robot: Robot) -> Robot:
        """Return a robot with other friction and gains."""
        if set(self.friction) | set(self.servo_gain) == {1.0}:
            return robot
        factors = zip(
            self._by_joint("friction", robot), self._by_joint("servo_gain", robot), strict=True
        )
        joints = [
            joint if joint.drive is None else replace(joint, drive=_other(joint.drive, *own))
            for joint, own in zip(robot.joints, factors, strict=True)
        ]
        return replace(robot, joints=tuple(joints))

    def _by_coordinate(self, key: str, robot: Robot) -> np.ndarray:
        """Return the factors of every elastic coordinate, (m,)."""
        coordinates = [(joint.stiffness is not None) + len(joint.tilt) for joint in robot.joints]
        return np.repeat(self._by_joint(key, robot), coordinates)

    def _by_joint(self, key: str, robot: Robot) -> list[float]:
        """Return the factors of every joint."""
        factors, count = getattr(self, key), len(robot.joints)
        if len(factors) not in (1, count):
            raise ValueError(
                f"{key}: expected one number, or {count}, one for each joint, got {len(factors)}"
            )
        return [float(factor) for factor in np.broadcast_to(factors, count)]


AS_THE_MODEL = ModelMismatch()


def _other(drive: Drive, friction: float, gain: float) -> Drive:
    """Return a drive with all of its friction and all gains of its servo times factors."""
    return replace(
        drive,
        friction=friction * drive.friction,
        viscous=friction * drive.viscous,
        position_gain=gain * drive.position_gain,
        rate_gain=gain * drive.rate_gain,
        integral_gain=gain * drive.integral_gain,
    )


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

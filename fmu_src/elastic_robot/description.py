"""The robot as data: frozen dataclasses that cannot hold a robot that is not physical.

Nothing but NumPy is imported here, because this module also runs inside the FMU, where the robot
arrives as JSON; robot.toml is read before.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic_robot.body import Body
from elastic_robot.drive import Drive
from elastic_robot.gear_parts import KinematicError, StopElement
from elastic_robot.requirements import (
    Vector,
    require_number,
    require_pairs,
    require_vector,
    unit_vector,
)

Table = tuple[tuple[float, float], ...]

# Largest kinematic error of a gear [rad], and its largest slope: real ones stay below 0.001 and 0.1.
_LARGEST_ERROR, _STEEPEST_ERROR = 0.1, 0.5


@dataclass(frozen=True)
class Tilt:
    """Elastic rotation of a joint about an axis other than its own.

    Attributes:
        axis: Unit vector in the body's axes, (3,).
        stiffness: Stiffness [N m/rad], > 0.
        damping: Damping [N m s/rad], >= 0.

    Raises:
        ValueError: If a value is out of its range.
    """

    axis: Vector
    stiffness: float
    damping: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", unit_vector("axis", self.axis))
        require_number("stiffness", self.stiffness, minimum=0.0, open_end=True, unit="N m/rad")
        require_number("damping", self.damping, minimum=0.0, open_end=False, unit="N m s/rad")


@dataclass(frozen=True)
class Joint:
    """Revolute joint with the body it carries.

    Attributes:
        origin: Joint centre in the frame of the previous body [m], (3,).
        axis: Unit vector of rotation, (3,).
        body: The link behind the joint.
        stiffness: Stiffness of the torsion about the axis [N m/rad], > 0; None for a rigid joint.
        damping: Damping of the torsion [N m s/rad], >= 0; 0 for a rigid joint.
        backlash: Half width of the gear's backlash [rad], >= 0; 0 for a rigid joint.
        tilt: At most two tilts, in the order of rotation.
        limits: Lowest and highest drive angle [rad], or None.
        max_rate: Highest drive rate [rad/s], or None.
        max_acceleration: Highest drive acceleration [rad/s^2], or None for no limit.
        torque_table: Points (angle [rad], torque [N m]) of the characteristic curve for the torque
            curve "spline", both strictly rising, through zero; None: from stiffness and backlash.
        hysteresis: Elements of the gear's hysteresis, beside its torque curve; none for a rigid joint.
        kinematic_error: Sines of the gear's kinematic error.
        balancer: Points (angle of the joint [rad], torque on its link about its axis [N m]) of a
            counterbalance, angles strictly rising, or None: a natural cubic spline goes through them,
            straight beyond the last ones; none for a rigid joint.
        drive: Motor and servo, or None for a drive that follows its command exactly.
        name: Name for messages.

    Raises:
        ValueError: If a value is out of its range or a rigid joint has elastic properties.
    """

    origin: Vector
    axis: Vector
    body: Body
    stiffness: float | None = None
    damping: float = 0.0
    backlash: float = 0.0
    tilt: tuple[Tilt, ...] = ()
    limits: tuple[float, float] | None = None
    max_rate: float | None = None
    max_acceleration: float | None = None
    torque_table: Table | None = None
    hysteresis: tuple[StopElement, ...] = ()
    kinematic_error: tuple[KinematicError, ...] = ()
    balancer: Table | None = None
    drive: Drive | None = None
    name: str = ""

    def __post_init__(self) -> None:
        require_vector("origin", self.origin, 3, "m")
        object.__setattr__(self, "axis", unit_vector("axis", self.axis))
        require_number("damping", self.damping, minimum=0.0, open_end=False, unit="N m s/rad")
        require_number("backlash", self.backlash, minimum=0.0, open_end=False, unit="rad")
        if self.stiffness is not None:
            require_number("stiffness", self.stiffness, minimum=0.0, open_end=True, unit="N m/rad")
        else:
            self._require_rigid()
        largest = sum(error.amplitude for error in self.kinematic_error)
        if largest > _LARGEST_ERROR:
            raise ValueError(
                "kinematic_error: expected a sum of amplitudes of at most"
                f" {_LARGEST_ERROR:g} rad, more than any gear is off, got {largest:.4g} rad"
            )
        steepest = sum(error.amplitude * error.order for error in self.kinematic_error)
        if steepest > _STEEPEST_ERROR:
            raise ValueError(
                "kinematic_error: expected a sum of amplitude times order of at most"
                f" {_STEEPEST_ERROR:g}, as no gear stops or turns back, got {steepest:.4g}"
            )
        if len(self.tilt) > 2:
            raise ValueError(f"tilt: expected at most 2 entries, got {len(self.tilt)}")
        if self.limits is not None:
            require_vector("limits", self.limits, 2, "rad")
            if self.limits[0] >= self.limits[1]:
                raise ValueError(
                    f"limits: expected [low, high], low < high [rad], got {list(self.limits)}"
                )
        if self.balancer is not None and self.stiffness is not None:
            self._require_balancer(np.array(self.balancer), self.stiffness)
        if self.torque_table is not None:
            self._require_table(np.array(self.torque_table))
        for key, unit in (("max_rate", "rad/s"), ("max_acceleration", "rad/s^2")):
            if getattr(self, key) is not None:
                require_number(key, getattr(self, key), minimum=0.0, open_end=True, unit=unit)

    def _require_rigid(self) -> None:
        """Refuse what a joint without stiffness cannot have."""
        damps = f"damping = {self.damping!r}", "a rigid joint has no damping"
        plays = f"backlash = {self.backlash!r}", "a rigid joint has no backlash"
        for has, (other, reason) in (
            (self.damping > 0.0, damps),
            (self.backlash > 0.0, plays),
            (self.hysteresis, ("hysteresis", "a rigid joint has no hysteresis")),
            (self.balancer, ("balancer", "one that turns a rigid joint moves nothing")),
            (self.drive, ("drive", "a motor turns a gear that gives way")),
            (self.torque_table, ("torque_table", "a rigid joint has no torque")),
        ):
            if has:
                raise ValueError(
                    f"stiffness: expected a number > 0 [N m/rad] beside {other}, got none: {reason}"
                )

    def _require_balancer(self, table: np.ndarray, stiffness: float) -> None:
        require_pairs("balancer", table, 3)
        flat = np.flatnonzero(np.diff(table[:, 0]) <= 0.0)
        if len(flat):
            raise ValueError(
                "balancer: expected strictly rising angles, got no rise behind"
                f" {table[flat[0], 0]:.6g} rad"
            )
        slope = np.diff(table[:, 1]) / np.diff(table[:, 0])
        if slope.max() >= stiffness:
            raise ValueError(
                f"balancer: expected torques that rise by less than the gear's {stiffness:.6g}"
                f" N m/rad, as its link is driven away else, got {slope.max():.6g} N m/rad behind"
                f" {table[slope.argmax(), 0]:.6g} rad"
            )

    def _require_table(self, table: np.ndarray) -> None:
        require_pairs("torque_table", table, 5)
        flat = np.flatnonzero(np.any(np.diff(table, axis=0) <= 0.0, axis=1))
        if len(flat):
            angle = table[flat[0] : flat[0] + 2, 0]
            raise ValueError(
                "torque_table: expected strictly rising angles and torques, got no rise between"
                f" {angle[0]:.6g} and {angle[1]:.6g} rad"
            )
        if not table[0, 1] < 0.0 < table[-1, 1]:
            raise ValueError(
                "torque_table: expected torques on both sides of zero, got"
                f" {table[0, 1]:.6g} to {table[-1, 1]:.6g} N m"
            )


@dataclass(frozen=True)
class Robot:
    """Serial elastic robot.

    Attributes:
        name: The robot's name.
        gravity: Gravity [m/s^2] in base axes, (3,).
        tcp_position: TCP in the last body's frame [m], (3,).
        tcp_rpy: Roll, pitch, yaw of the tool's axes in the last body [rad],
            R = Rz(yaw) Ry(pitch) Rx(roll).
        joints: Base to tool, at least one.
        payload: Body carried by the last one, in its frame, or None.

    Raises:
        ValueError: If a value is not finite or there is no joint.

    Example:
        >>> link = Body(mass=10.0, com=(0.5, 0.0, 0.0), inertia=(0.1, 1.0, 1.0))
        >>> joint = Joint(origin=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), body=link, stiffness=1e5)
        >>> robot = Robot("pendulum", joints=(joint,), tcp_position=(1.0, 0.0, 0.0))
        >>> Robot.from_json(robot.to_json()) == robot
        True
    """

    name: str
    joints: tuple[Joint, ...]
    gravity: Vector = (0.0, 0.0, -9.81)
    tcp_position: Vector = (0.0, 0.0, 0.0)
    tcp_rpy: Vector = (0.0, 0.0, 0.0)
    payload: Body | None = None

    def __post_init__(self) -> None:
        if not self.joints:
            raise ValueError("joints: expected at least one, got none")
        require_vector("gravity", self.gravity, 3, "m/s^2")
        require_vector("tcp position", self.tcp_position, 3, "m")
        require_vector("tcp rpy", self.tcp_rpy, 3, "rad")

    @property
    def is_rigid(self) -> bool:
        """Whether no joint gives way, neither about its axis nor by a tilt."""
        return all(joint.stiffness is None and not joint.tilt for joint in self.joints)

    def to_json(self) -> str:
        """Return the robot as JSON; `from_json` restores it exactly."""
        return json.dumps(dataclasses.asdict(self), indent=1)

    @classmethod
    def from_json(cls, text: str) -> Robot:
        """Build the robot from `to_json`'s text."""
        data = _tuples(json.loads(text))
        parts = {"tilt": Tilt, "hysteresis": StopElement, "kinematic_error": KinematicError}

        def joint(values: dict[str, Any]) -> Joint:
            lists = {
                key: tuple(kind(**part) for part in values[key]) for key, kind in parts.items()
            }
            drive = values["drive"] and Drive(**values["drive"])
            return Joint(**{**values, **lists, "body": Body(**values["body"]), "drive": drive})

        payload = data["payload"] and Body(**data["payload"])
        return cls(**{**data, "joints": tuple(map(joint, data["joints"])), "payload": payload})


def _tuples(value: Any) -> Any:
    """Return what JSON tells, with tuples in place of lists."""
    if isinstance(value, dict):
        return {key: _tuples(entry) for key, entry in value.items()}
    return tuple(map(_tuples, value)) if isinstance(value, list) else value

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

from elastic_robot.gear_parts import Drive, KinematicError, StopElement, require_number

Vector = tuple[float, ...]
Table = tuple[tuple[float, float], ...]

# A direction must be given to this accuracy in length; it is normalised afterwards.
_UNIT_LENGTH_TOLERANCE = 1e-9
# Negative moments of rounding, and how far identified ones may be from the triangle inequality: makers
# publish 0.7 % for arms of their own, which changes no motion.  Both in parts of the largest moment.
_INERTIA_TOLERANCE, TRIANGLE_TOLERANCE = 1e-6, 0.02
# Largest kinematic error of a gear [rad], and its largest slope: real ones stay below 0.001 and 0.1.
_LARGEST_ERROR, _STEEPEST_ERROR = 0.1, 0.5


def _require_vector(key: str, value: Vector, length: int, unit: str) -> None:
    if len(value) != length or not np.all(np.isfinite(value)):
        raise ValueError(f"{key}: expected {length} finite numbers [{unit}], got {list(value)}")


def _unit_vector(key: str, value: Vector) -> Vector:
    _require_vector(key, value, 3, "unit vector")
    length = float(np.linalg.norm(value))
    if abs(length - 1.0) > _UNIT_LENGTH_TOLERANCE:
        advice = "a direction" if length == 0.0 else f"{[float(c) / length for c in value]}"
        raise ValueError(
            f"{key}: expected a unit vector, got {list(value)}, of length {length:.9g}: give {advice}"
        )
    if abs(length - 1.0) < 1e-15:  # already rounded to the last bit: a copy stays identical
        return value
    return tuple(float(c) / length for c in value)


@dataclass(frozen=True)
class Body:
    """Rigid body.

    Attributes:
        mass: Mass [kg], >= 0.
        com: Centre of mass in the body's frame [m], (3,).
        inertia: Inertia about the centre of mass, in the body's axes [kg m^2]: xx, yy, zz or
            xx, yy, zz, xy, xz, yz.

    Raises:
        ValueError: If a value is missing, not finite, or no mass distribution has this inertia.
    """

    mass: float
    com: Vector
    inertia: Vector

    def __post_init__(self) -> None:
        require_number("mass", self.mass, minimum=0.0, open_end=False, unit="kg")
        _require_vector("com", self.com, 3, "m")
        if len(self.inertia) not in (3, 6) or not np.all(np.isfinite(self.inertia)):
            raise ValueError(
                "inertia: expected xx, yy, zz or xx, yy, zz, xy, xz, yz [kg m^2], got"
                f" {list(self.inertia)}"
            )
        small, middle, large = np.linalg.eigvalsh(self.inertia_matrix)
        slack, excess = (
            part * max(large, 0.0) for part in (_INERTIA_TOLERANCE, TRIANGLE_TOLERANCE)
        )
        if small < -slack or large > small + middle + excess:
            raise ValueError(
                "inertia: expected principal moments >= 0 of which none exceeds the sum of the others"
                f" by more than {100.0 * TRIANGLE_TOLERANCE:g} %,"
                f" got {small:.6g}, {middle:.6g}, {large:.6g} kg m^2 of {list(self.inertia)}"
            )
        if self.mass == 0.0 and large > 0.0:
            raise ValueError(f"mass: expected > 0 [kg] with inertia {list(self.inertia)}, got 0")

    @classmethod
    def from_matrix(cls, mass: float, com: np.ndarray, matrix: np.ndarray) -> Body:
        """Return the body of a centre of mass [m], (3,), and inertia about it [kg m^2], (3, 3)."""
        six = matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        return cls(float(mass), tuple(com.tolist()), tuple(six.tolist()))

    @property
    def inertia_matrix(self) -> np.ndarray:
        """Inertia tensor about the centre of mass [kg m^2], (3, 3)."""
        xx, yy, zz, xy, xz, yz = (*self.inertia, 0.0, 0.0, 0.0)[:6]
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def scaled(self, factor: float) -> Body:
        """Return the body with its density multiplied by a factor."""
        return Body(self.mass * factor, self.com, tuple(i * factor for i in self.inertia))

    def placed(self, rotation: np.ndarray, position: np.ndarray) -> Body:
        """Return the body in another frame, of which this body's frame has the given placement.

        Args:
            rotation: Rotation from this body's axes to the other frame's, (3, 3).
            position: This body's origin in the other frame [m], (3,).

        Example:
            >>> quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
            >>> rod = Body(mass=1.0, com=(0.5, 0.0, 0.0), inertia=(0.0, 2.0, 2.0))
            >>> rod.placed(quarter, np.array([0.0, 0.0, 1.0])).com
            (0.0, 0.5, 1.0)
        """
        com = rotation @ self.com + position
        return Body.from_matrix(self.mass, com, rotation @ self.inertia_matrix @ rotation.T)


def triangle_excess(body: Body) -> float:
    """Return by what part of itself a body's largest principal moment exceeds the sum of the others.

    Example:
        >>> round(triangle_excess(Body(1.0, (0.0, 0.0, 0.0), (1.0, 1.0, 2.02))), 4)
        0.0099
    """
    small, middle, large = np.linalg.eigvalsh(body.inertia_matrix)
    return max(float((large - small - middle) / large), 0.0) if large > 0.0 else 0.0


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
        object.__setattr__(self, "axis", _unit_vector("axis", self.axis))
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
        _require_vector("origin", self.origin, 3, "m")
        object.__setattr__(self, "axis", _unit_vector("axis", self.axis))
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
            _require_vector("limits", self.limits, 2, "rad")
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
        _require_pairs("balancer", table, 3)
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
        _require_pairs("torque_table", table, 5)
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


def _require_pairs(name: str, table: np.ndarray, least: int) -> None:
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < least or not np.isfinite(table).all():
        raise ValueError(
            f"{name}: expected at least {least} pairs of finite numbers [rad, N m], got"
            f" {len(table)} points"
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
        _require_vector("gravity", self.gravity, 3, "m/s^2")
        _require_vector("tcp position", self.tcp_position, 3, "m")
        _require_vector("tcp rpy", self.tcp_rpy, 3, "rad")

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

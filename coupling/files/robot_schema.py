"""The keys of a robot file."""

from __future__ import annotations

from math import inf
from typing import Annotated

from pydantic import Field, model_validator

from coupling.errors import locate_errors
from coupling.files.balancer_table import BalancerTable
from coupling.files.drive_table import DriveTable
from coupling.files.gear_table import GearTable
from coupling.files.toml_file import Positive, Schema, Vector3
from elastic_robot.body import Body
from elastic_robot.drive import Drive
from elastic_robot.gear_parts import KinematicError, StopElement

Pair = Annotated[list[float], Field(min_length=2, max_length=2)]


Moments = Annotated[list[float], Field(min_length=3, max_length=6)]


class BodyTable(Schema):
    """Mass properties of a body."""

    mass: float
    com: Vector3
    inertia: Moments

    def body(self) -> Body:
        """Return the body."""
        return Body(self.mass, tuple(self.com), tuple(self.inertia))


class TiltTable(Schema):
    """An entry of a joint's `tilt`."""

    axis: Vector3
    stiffness: float
    damping: float = 0.0


class GearTorque(Schema):
    """Torque that a gear may pass on [N m]: again and again in motion, and in an emergency stop."""

    peak: Positive | None = None
    emergency: Positive | None = None

    @model_validator(mode="after")
    def _emergency_is_more(self) -> GearTorque:
        if self.peak is None and self.emergency is None:
            raise ValueError("expected peak, emergency or both [N m], got neither")
        if self.peak and self.emergency and self.emergency < self.peak:
            raise ValueError(
                f"emergency: expected at least peak, {self.peak:.6g} N m, got {self.emergency:.6g} N m"
            )
        return self


class JointElasticity(Schema):
    """Elasticity of a joint, and the limits of its drive and its gear."""

    stiffness: float | None = None
    stiffness_range: Pair | None = None
    damping: float = 0.0
    backlash: float = 0.0
    tilt: list[TiltTable] = []
    torque_table: list[Pair] | None = None
    limits: Pair | None = None
    max_rate: float | None = None
    max_acceleration: float | None = None
    gear_torque_Nm: GearTorque | None = None
    gear: GearTable = GearTable()
    drive: DriveTable | None = None
    balancer: BalancerTable | None = None

    @model_validator(mode="after")
    def _range_holds_stiffness(self) -> JointElasticity:
        if self.stiffness_range is not None:
            low, high = self.stiffness_range
            if self.stiffness is None or not 0.0 < low <= self.stiffness <= high < inf:
                raise ValueError(
                    "stiffness_range: expected [low, high], 0 < low <= stiffness <= high [N m/rad], got"
                    f" {self.stiffness_range} beside stiffness = {self.stiffness}"
                )
        return self

    @model_validator(mode="after")
    def _gear_is_elastic(self) -> JointElasticity:
        if self.gear_torque_Nm is not None and self.stiffness is None:
            raise ValueError(
                "gear_torque_Nm: expected a stiffness beside it, as the torque is that of an elastic"
                " gear, got none: give one, or leave gear_torque_Nm out"
            )
        if self.gear.model_fields_set - {"kinematic_error"} and self.stiffness is None:
            raise ValueError("gear: expected a stiffness beside it, got none: the joint is rigid")
        for key in ("drive", "balancer"):
            if getattr(self, key) is not None and self.stiffness is None:
                raise ValueError(
                    f"{key}: expected a stiffness beside it, got none: the joint is rigid"
                )
        if self.gear.efficiency is not None and self.drive is None:
            raise ValueError(
                "gear: efficiency: expected a drive beside it, whose friction grows with the load, got"
                " none"
            )
        if self.gear.from_sheet and self.torque_table is not None:
            raise ValueError(
                "gear: hysteresis_width_arcmin: expected no torque_table beside it, as the width is that"
                " of a gear with one stiffness, got one: give the elements of hysteresis"
            )
        if self.gear.lost_motion_arcmin is not None and "backlash" in self.model_fields_set:
            raise ValueError(
                "gear: lost_motion_arcmin: expected no backlash beside it, as it determines the"
                f" backlash, got backlash = {self.backlash!r}"
            )
        return self

    def hysteresis(self) -> tuple[float, tuple[StopElement, ...]]:
        """Return the half width of the gear's backlash [rad] and the elements of its hysteresis."""
        if self.stiffness is None:
            return self.backlash, ()
        with locate_errors("gear", ValueError):
            return self.gear.hysteresis_of(self.stiffness, self.backlash)

    def kinematic_errors(self) -> tuple[KinematicError, ...]:
        """Return the sines of the gear's kinematic error."""
        with locate_errors("gear", ValueError):
            return self.gear.kinematic_errors(None if self.drive is None else self.drive.gear_ratio)

    def motor(self) -> Drive | None:
        """Return motor, servo and friction of the joint, if the file has them.

        Raises:
            ValueError: If their numbers are beyond what can be computed with.
        """
        with locate_errors("drive", ValueError):
            return None if self.drive is None else self.drive.drive(self.gear.load_friction)


class JointTable(BodyTable, JointElasticity):
    """[[joint]] of a file that describes the whole robot."""

    name: str = ""
    origin: Vector3
    axis: Vector3


class Tcp(Schema):
    """[tcp], in the last body's frame."""

    position: Vector3
    rpy: Vector3 = [0.0, 0.0, 0.0]


class ControllerAxesTable(Schema):
    """[controller]: how the maker's controller counts the joints and lays its frames."""

    joint_matrix: list[list[float]] | None = None
    joint_offset_deg: list[float] | None = None
    base_position: Vector3 = [0.0, 0.0, 0.0]
    flange_position: Vector3 = [0.0, 0.0, 0.0]
    flange_rpy_deg: Vector3 = [0.0, 0.0, 0.0]


class ModalDamping(Schema):
    """[modal_damping]: the damping ratio of all modes, in place of each joint's damping."""

    ratio: Annotated[float, Field(gt=0.0, le=0.5)]


class _RobotKeys(Schema):
    """What every robot file has."""

    name: str
    gravity: Vector3 = [0.0, 0.0, -9.81]
    payload_N: Positive | None = None
    payload: BodyTable | None = None
    modal_damping: ModalDamping | None = None
    controller: ControllerAxesTable | None = None
    servos_confirmed: bool = True
    sources: dict[str, str] = {}


class RobotFile(_RobotKeys):
    """A robot file that describes the whole robot."""

    tcp: Tcp
    joint: Annotated[list[JointTable], Field(min_length=1)]


class Urdf(Schema):
    """[urdf]: the rigid robot."""

    file: str
    base: str | None = None
    mass_scale: Positive = 1.0


class UrdfJoint(JointElasticity):
    """[[joint]] beside a URDF, by its name there; mass, com and inertia replace the URDF's."""

    name: str
    mass: float | None = None
    com: Vector3 | None = None
    inertia: Moments | None = None

    @property
    def has_part_of_body(self) -> bool:
        """Whether it replaces anything of the URDF's body."""
        return not (self.mass is None and self.com is None and self.inertia is None)


class UrdfTcp(Schema):
    """[tcp] beside a URDF, in the frame of a link of it."""

    link: str
    position: Vector3 = [0.0, 0.0, 0.0]
    rpy: Vector3 = [0.0, 0.0, 0.0]


class UrdfRobotFile(_RobotKeys):
    """A robot file that adds elasticities to a URDF."""

    urdf: Urdf
    tcp: UrdfTcp
    joint: list[UrdfJoint] = []


def damping_ratio(file: RobotFile | UrdfRobotFile) -> float | None:
    """Return the damping ratio of all modes [1]; None where the file states each damping.

    Raises:
        ValueError: If it states both.
    """
    if file.modal_damping is None:
        return None
    for number, joint in enumerate(file.joint, start=1):
        if any("damping" in part.model_fields_set for part in (joint, *joint.tilt)):
            raise ValueError(
                f"joint {number}: damping: expected none beside [modal_damping], which determines all of"
                " them, got one: leave either out"
            )
    return file.modal_damping.ratio

"""The keys of a robot file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from coupling.files.toml_file import Positive, Schema, Vector3
from elastic_robot.description import Body

Pair = Annotated[list[float], Field(min_length=2, max_length=2)]


class BodyTable(Schema):
    """Mass properties of a body."""

    mass: float
    com: Vector3
    inertia: Annotated[list[float], Field(min_length=3, max_length=6)]

    def body(self) -> Body:
        """Return the body."""
        return Body(self.mass, tuple(self.com), tuple(self.inertia))


class TiltTable(Schema):
    """An entry of a joint's `tilt`."""

    axis: Vector3
    stiffness: float
    damping: float = 0.0


class Elasticity(Schema):
    """What gives way in a joint, and what its drive can do."""

    stiffness: float | None = None
    damping: float = 0.0
    backlash: float = 0.0
    tilt: list[TiltTable] = []
    torque_table: list[Pair] | None = None
    limits: Pair | None = None
    max_rate: float | None = None
    max_acceleration: float | None = None


class JointTable(BodyTable, Elasticity):
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


class RobotFile(Schema):
    """A robot file that describes the whole robot."""

    name: str
    gravity: Vector3 = [0.0, 0.0, -9.81]
    tcp: Tcp
    joint: Annotated[list[JointTable], Field(min_length=1)]
    payload: BodyTable | None = None
    controller: ControllerAxesTable | None = None
    sources: dict[str, str] = {}


class Urdf(Schema):
    """[urdf]: the rigid robot."""

    file: str
    base: str | None = None
    mass_scale: Positive = 1.0


class UrdfJoint(Elasticity):
    """[[joint]] beside a URDF, by its name there."""

    name: str


class UrdfTcp(Schema):
    """[tcp] beside a URDF, in the frame of a link of it."""

    link: str
    position: Vector3 = [0.0, 0.0, 0.0]
    rpy: Vector3 = [0.0, 0.0, 0.0]


class UrdfRobotFile(Schema):
    """A robot file that adds elasticities to a URDF."""

    name: str
    gravity: Vector3 = [0.0, 0.0, -9.81]
    urdf: Urdf
    tcp: UrdfTcp
    joint: list[UrdfJoint] = []
    payload: BodyTable | None = None
    controller: ControllerAxesTable | None = None
    sources: dict[str, str] = {}

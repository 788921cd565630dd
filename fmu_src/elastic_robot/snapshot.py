"""Everything that an ElasticRobot needs to go on as it would have; as an object and as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from elastic_robot.motion import State
from elastic_robot.motors import MotorState
from elastic_robot.parameters import Parameters
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.tool_load import ToolLoad
from elastic_robot.trajectory import Drives


@dataclass(frozen=True)
class HeldInputs:
    """Drives and loads of the robot at the present time.

    Attributes:
        q, qd, qdd: Commanded motion of the drives, before their gears [rad, rad/s, rad/s^2], (n,).
        acting: Loads on the tool.
        torque: Torques of motors without servo [N m], (d,) or of all (1,).
    """

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    acting: ToolLoad
    torque: np.ndarray

    @classmethod
    def at(
        cls, time: float, drives: Drives, acting: ToolLoad, torque: np.ndarray | None = None
    ) -> HeldInputs:
        """Return the drives' motion at a time, with what acts on tool and motors then."""
        q, qd, qdd = drives.at(np.array([time]))[:, 0]
        return cls(q, qd, qdd, acting, np.zeros(1) if torque is None else torque)

    @property
    def commands(self) -> np.ndarray:
        """q, q', q'' [rad, rad/s, rad/s^2], (3, n)."""
        return np.stack([self.q, self.qd, self.qdd])


@dataclass(frozen=True)
class Snapshot:
    """State of an ElasticRobot; frozen, so that a copy costs nothing.

    Attributes:
        state: Elastic coordinates, elongations and time.
        held: Drives and load at that time.
        parameters: Parameters that the state was computed with.
        opposite: Whether qw of the elastic and of the rigid tool was below 0 at the start.
    """

    state: State
    held: HeldInputs
    parameters: Parameters
    opposite: tuple[bool, bool]

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return the snapshot as named arrays, any unit and shape, from which `from_arrays` restores it.

        The tables of the torque curve belong to the robot.
        """
        acting = self.held.acting
        return {
            "opposite": np.array(self.opposite),
            **_arrays("state", self.state, "motors"),
            **_arrays("motors", self.state.motors),
            **_arrays("held", self.held, "acting"),
            **_arrays("acting", acting, "contact"),
            **_arrays("contact", acting.contact),
            **_arrays("parameters", self.parameters, "tables"),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray], parameters: Parameters) -> Snapshot:
        """Return the snapshot of `to_arrays`.

        Args:
            arrays: The arrays of `to_arrays`, of any unit and shape.
            parameters: Parameters of the same robot; their tables are used.
        """

        def part(kind: type[Any], prefix: str, **known: Any) -> Any:
            keys = [field.name for field in fields(kind) if field.name not in known]
            values = {key: arrays[f"{prefix}_{key}"] for key in keys}
            return kind(**known, **{k: v if v.ndim else v.item() for k, v in values.items()})

        acting = part(ToolLoad, "acting", contact=part(PlaneContact, "contact"))
        elastic, rigid = arrays["opposite"].tolist()
        return cls(
            part(State, "state", motors=part(MotorState, "motors")),
            part(HeldInputs, "held", acting=acting),
            part(Parameters, "parameters", tables=parameters.tables),
            (elastic, rigid),
        )


def _arrays(prefix: str, part: Any, *without: str) -> dict[str, np.ndarray]:
    """Return the fields of a dataclass as arrays by their names, but for some."""
    keys = [field.name for field in fields(part) if field.name not in without]
    return {f"{prefix}_{key}": np.array(getattr(part, key)) for key in keys}

"""Everything that an ElasticRobot needs to go on as it would have; as an object and as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from elastic_robot.motion import Drives, State
from elastic_robot.parameters import Parameters
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.tool_load import ToolLoad


@dataclass(frozen=True)
class HeldInputs:
    """Drives and loads of the robot at the present time.

    Attributes:
        q, qd, qdd: Motion of the drives, before their gears [rad, rad/s, rad/s^2], (n,).
        acting: Loads on the tool.
    """

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    acting: ToolLoad

    @classmethod
    def at(cls, time: float, drives: Drives, acting: ToolLoad) -> HeldInputs:
        """Return the drives' motion at a time, with what acts on the tool then."""
        q, qd, qdd = drives.at(np.array([time]))[:, 0]
        return cls(q, qd, qdd, acting)


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
        state, contact = self.state, self.held.acting.contact
        return {
            "clock": np.array(state.time),
            "x": state.x,
            "v": state.v,
            "elongation": state.elongation,
            "opposite": np.array(self.opposite),
            **{f"held_{key}": getattr(self.held, key) for key in _HELD},
            **{f"acting_{key}": getattr(self.held.acting, key) for key in _ACTING},
            **{f"contact_{key}": np.array(getattr(contact, key)) for key in _CONTACT},
            **{f"parameters_{key}": getattr(self.parameters, key) for key in _PARAMETERS},
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray], parameters: Parameters) -> Snapshot:
        """Return the snapshot of `to_arrays`.

        Args:
            arrays: The arrays of `to_arrays`, of any unit and shape.
            parameters: Parameters of the same robot; their tables are used.
        """
        state = State(float(arrays["clock"]), *(arrays[key] for key in ("x", "v", "elongation")))
        numbers = {key: float(arrays[f"contact_{key}"]) for key in _CONTACT if key != "normal"}
        contact = PlaneContact(**numbers, normal=arrays["contact_normal"])
        wrench, anchor, stiffness, velocity = (arrays[f"acting_{key}"] for key in _ACTING)
        acting = ToolLoad(wrench, anchor, stiffness, contact, velocity)
        held = HeldInputs(**{key: arrays[f"held_{key}"] for key in _HELD}, acting=acting)
        numbers_of = {key: arrays[f"parameters_{key}"] for key in _PARAMETERS}
        computed = Parameters(**numbers_of, tables=parameters.tables)
        elastic, rigid = arrays["opposite"].tolist()
        return cls(state, held, computed, (elastic, rigid))


_HELD = ("q", "qd", "qdd")
_ACTING = ("wrench", "anchor", "stiffness", "velocity")
_CONTACT = ("stiffness", "dissipation", "radius", "friction", "slip_speed", "normal")
_PARAMETERS = ("gravity", "stiffness", "damping", "backlash", "hysteresis", "friction")

"""Everything that an ElasticRobot needs to go on as it would have; as an object and as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from elastic_robot.motion import Drives, State
from elastic_robot.motors import MotorState
from elastic_robot.parameters import Parameters
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.tool_load import ToolLoad


@dataclass(frozen=True)
class HeldInputs:
    """Drives and loads of the robot at the present time.

    Attributes:
        q, qd, qdd: Commanded motion of the drives, before their gears [rad, rad/s, rad/s^2], (n,).
        acting: Loads on the tool.
        torque: Torques of motors without servo [N m], (d,); empty: none.
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
        return cls(q, qd, qdd, acting, np.zeros(0) if torque is None else torque)

    @property
    def commands(self) -> np.ndarray:
        """q, q', q'', (3, n)."""
        return np.stack([self.q, self.qd, self.qdd])

    def moved(self, drives: np.ndarray) -> HeldInputs:
        """Return them with angles and rates of drives [rad, rad/s], (3, n)."""
        return replace(self, q=drives[0], qd=drives[1])


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
            **{f"motors_{key}": value for key, value in vars(state.motors).items()},
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
        motors = MotorState(**{key: arrays[f"motors_{key}"] for key in _MOTORS})
        x, v, elongation = (arrays[key] for key in ("x", "v", "elongation"))
        state = State(float(arrays["clock"]), x, v, elongation, motors)
        numbers = {key: float(arrays[f"contact_{key}"]) for key in _CONTACT if key != "normal"}
        contact = PlaneContact(**numbers, normal=arrays["contact_normal"])
        wrench, anchor, stiffness, velocity = (arrays[f"acting_{key}"] for key in _ACTING)
        acting = ToolLoad(wrench, anchor, stiffness, contact, velocity)
        held = HeldInputs(**{key: arrays[f"held_{key}"] for key in _HELD}, acting=acting)
        numbers_of = {key: arrays[f"parameters_{key}"] for key in _PARAMETERS}
        computed = Parameters(**numbers_of, tables=parameters.tables)
        elastic, rigid = arrays["opposite"].tolist()
        return cls(state, held, computed, (elastic, rigid))


_HELD = ("q", "qd", "qdd", "torque")
_MOTORS = ("angle", "rate", "integral", "presliding")
_ACTING = ("wrench", "anchor", "stiffness", "velocity")
_CONTACT = ("stiffness", "dissipation", "radius", "friction", "slip_speed", "normal")
_PARAMETERS = ("gravity", "stiffness", "damping", "backlash", "hysteresis", "friction")

"""Everything that an ElasticRobot needs to go on as it would have; as an object and as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from elastic_robot.collocation import NewtonMatrix, State
from elastic_robot.motion import Drives
from elastic_robot.parameters import Parameters
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.tool_load import Acting


@dataclass(frozen=True)
class Held:
    """What acts on the robot at the present time.

    Attributes:
        q, qd, qdd: Motion of the drives [rad, rad/s, rad/s^2], (n,).
        acting: What acts on the tool.
    """

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    acting: Acting

    @classmethod
    def at(cls, time: float, drives: Drives, acting: Acting) -> Held:
        """Return the drives' motion at a time, with what acts on the tool then."""
        q, qd, qdd = drives.at(np.array([time]))[:, 0]
        return cls(q, qd, qdd, acting)


@dataclass(frozen=True)
class Snapshot:
    """State of an ElasticRobot; frozen, so that a copy costs nothing.

    Attributes:
        state: State of the stepper.
        held: Drives and load at that time.
        parameters: Parameters that the state was computed with.
        opposite: Whether qw of the elastic and of the rigid tool was below 0 at the start.
    """

    state: State
    held: Held
    parameters: Parameters
    opposite: tuple[bool, bool]

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return the snapshot as named arrays, from which `from_arrays` restores it exactly.

        The Newton matrices are represented by what they are built from; the tables of the torque
        curve belong to the robot.
        """
        state, newton, contact = self.state, self.state.newton, self.held.acting.contact
        arrays = {
            "clock": np.array([state.time, state.step, state.predictor_step]),
            "x": state.x,
            "v": state.v,
            "region": state.region,
            "touching": np.array(state.touching),
            "opposite": np.array(self.opposite),
            **{f"held_{key}": getattr(self.held, key) for key in _HELD},
            **{f"acting_{key}": getattr(self.held.acting, key) for key in _ACTING},
            **{f"contact_{key}": np.array(getattr(contact, key)) for key in _CONTACT},
            **{f"parameters_{key}": getattr(self.parameters, key) for key in _PARAMETERS},
        }
        if state.predictor is not None:
            arrays["predictor"] = state.predictor
        if newton is not None:
            arrays["newton_step"] = np.array(newton.step)
            arrays |= {f"newton_{key}": getattr(newton, key) for key in _NEWTON}
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray], parameters: Parameters) -> Snapshot:
        """Return the snapshot of `to_arrays`.

        Args:
            arrays: The arrays of `to_arrays`.
            parameters: Parameters of the same robot; their tables are used.
        """
        time, step, predictor_step = arrays["clock"].tolist()
        newton = None
        if "newton_step" in arrays:
            newton = NewtonMatrix.build(
                float(arrays["newton_step"]), *(arrays[f"newton_{key}"] for key in _NEWTON)
            )
        state = State(
            time,
            arrays["x"],
            arrays["v"],
            arrays["region"],
            step,
            arrays.get("predictor"),
            predictor_step,
            newton,
            int(arrays["touching"]),
        )
        numbers = {key: float(arrays[f"contact_{key}"]) for key in _CONTACT if key != "normal"}
        contact = PlaneContact(**numbers, normal=arrays["contact_normal"])
        wrench, anchor, stiffness, velocity = (arrays[f"acting_{key}"] for key in _ACTING)
        acting = Acting(wrench, anchor, stiffness, contact, velocity)
        held = Held(**{key: arrays[f"held_{key}"] for key in _HELD}, acting=acting)
        gravity, stiffness, damping, backlash = (arrays[f"parameters_{key}"] for key in _PARAMETERS)
        computed = Parameters(gravity, stiffness, damping, backlash, parameters.tables)
        elastic, rigid = arrays["opposite"].tolist()
        return cls(state, held, computed, (elastic, rigid))


_HELD = ("q", "qd", "qdd")
_ACTING = ("wrench", "anchor", "stiffness", "velocity")
_CONTACT = ("stiffness", "dissipation", "radius", "friction", "slip_speed", "normal")
_PARAMETERS = ("gravity", "stiffness", "damping", "backlash")
_NEWTON = ("mass", "damping", "stiffness")

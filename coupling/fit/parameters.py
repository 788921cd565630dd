"""The elastic parameters of a robot: stiffness and damping of gears and tilts, the gears' backlash."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

# What is fitted.
KINDS = ("backlash", "stiffness", "damping")


@dataclass(frozen=True)
class RobotParameter:
    """One elastic parameter of a robot.

    Attributes:
        name: Name in the FMU, `joint[1].stiffness`.
        kind: One of `KINDS`, or "hysteresis", the torque at which all elements of a gear slip.
        coordinate: Number of its elastic coordinate.
        gear: Number of its gear; None for a tilt.
        value: Value in the robot file [N m/rad, N m s/rad, rad, N m].
    """

    name: str
    kind: str
    coordinate: int
    gear: int | None
    value: float

    @property
    def vibrates(self) -> bool:
        """Whether it is a tilt's damping, which acts in vibrations alone."""
        return self.gear is None and self.kind == "damping"


def robot_parameters(
    robot: Robot, torque_curve: str, kinds: Sequence[str] = KINDS
) -> tuple[RobotParameter, ...]:
    """Return the parameters of a robot that are not zero, kind by kind.

    Args:
        robot: The robot.
        torque_curve: A name of `TORQUE_CURVES`; a linear one has no backlash, and a gear with a table of
            its own under "spline" neither backlash nor stiffness.
        kinds: Those that count, in their order.
    """
    chain, nominal = build_chain(robot), Parameters.of(robot)
    found = []
    for kind in kinds:
        for row, name in enumerate(chain.elastic_names):
            tilt = bool(chain.elastic_tilt[row])
            tabled = torque_curve == "spline" and nominal.tables[row] is not None
            if kind == "backlash" and (tilt or torque_curve == "linear"):
                continue
            value = float(getattr(nominal, kind)[row])
            gear = None if tilt else int(np.flatnonzero(chain.torsions == row)[0])
            if value > 0.0 and (kind in ("damping", "hysteresis") or not tabled):
                found.append(RobotParameter(f"{name}.{kind}", kind, row, gear, value))
    return tuple(found)


def with_values(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return the robot with other values of its parameters, by name."""

    def changed(place: str, own: Any) -> Any:
        return replace(
            own, **{k: values[f"{place}.{k}"] for k in KINDS if f"{place}.{k}" in values}
        )

    joints = []
    for number, joint in enumerate(robot.joints, start=1):
        name = f"joint[{number}]"
        tilts = tuple(
            changed(f"{name}.tilt[{k}]", tilt) for k, tilt in enumerate(joint.tilt, start=1)
        )
        joints.append(replace(changed(name, joint), tilt=tilts))
    return replace(robot, joints=tuple(joints))

"""What is learned of a robot: factors of its backlash, stiffness and damping."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

# Standard deviations of the logarithm of a factor before anything is measured: what a gear's backlash
# and damping, and a stiffness from a data sheet or a static identification, are known to.
PRIOR = {"backlash": 0.3, "stiffness": 0.1, "damping": 0.3}


@dataclass(frozen=True)
class Learnable:
    """One parameter whose factor is learned.

    Attributes:
        name: Its name in the FMU.
        kind: "backlash", "stiffness" or "damping".
        coordinate: Number of its elastic coordinate.
        gear: Number of its gear; None for a tilt.
        value: Value in the robot file.
    """

    name: str
    kind: str
    coordinate: int
    gear: int | None
    value: float

    @property
    def vibrates(self) -> bool:
        """Whether it is a tilt's damping: it acts in vibrations, which simulation alone shows."""
        return self.gear is None and self.kind == "damping"


def learnables(robot: Robot, torque_curve: str) -> tuple[Learnable, ...]:
    """Return what can be learned of a robot.

    Stiffness and damping of gears and tilts, backlash of gears; of a gear with a torque table of its own
    the damping alone, and nothing that is zero.
    """
    chain, nominal = build_chain(robot), Parameters.of(robot)
    found = []
    for kind in PRIOR:
        for row, name in enumerate(chain.elastic_names):
            tilt = bool(chain.elastic_tilt[row])
            tabled = torque_curve == "spline" and nominal.tables[row] is not None
            if (tilt and kind == "backlash") or (tabled and kind != "damping"):
                continue
            if kind == "backlash" and torque_curve == "linear":
                continue
            value = float(getattr(nominal, kind)[row])
            gear = None if tilt else int(np.flatnonzero(chain.torsions == row)[0])
            if value > 0.0:
                found.append(Learnable(f"{name}.{kind}", kind, row, gear, value))
    return tuple(found)


def prior_of(parameters: tuple[Learnable, ...]) -> np.ndarray:
    """Return the standard deviations of log factors before anything is measured, (P,)."""
    return np.array([PRIOR[parameter.kind] for parameter in parameters])


def changed(parameters: tuple[Learnable, ...], x: np.ndarray) -> dict[str, float]:
    """Return the FMU's parameters of log factors x (P,), by name."""
    values = [p.value * float(np.exp(own)) for p, own in zip(parameters, x, strict=True)]
    return {p.name: value for p, value in zip(parameters, values, strict=True)}


def robot_with(robot: Robot, parameters: tuple[Learnable, ...], x: np.ndarray) -> Robot:
    """Return the robot with log factors x, (P,)."""
    values = changed(parameters, x)
    joints = []
    for number, joint in enumerate(robot.joints, start=1):
        name = f"joint[{number}]"
        tilts = tuple(
            replace(
                tilt,
                stiffness=values.get(f"{name}.tilt[{k}].stiffness", tilt.stiffness),
                damping=values.get(f"{name}.tilt[{k}].damping", tilt.damping),
            )
            for k, tilt in enumerate(joint.tilt, start=1)
        )
        if joint.stiffness is not None:
            own = {k: values.get(f"{name}.{k}", getattr(joint, k)) for k in PRIOR}
            joint = replace(
                joint,
                stiffness=own["stiffness"],
                damping=own["damping"],
                backlash=own["backlash"],
            )
        joints.append(replace(joint, tilt=tilts))
    return replace(robot, joints=tuple(joints))


def factors_between(parameters: tuple[Learnable, ...], robot: Robot) -> np.ndarray:
    """Return the log factors that another robot of the same build has, (P,).

    Raises:
        ValueError: If it lacks an elasticity.
    """
    chain, nominal = build_chain(robot), Parameters.of(robot)
    x = np.zeros(len(parameters))
    for k, own in enumerate(parameters):
        name, kind = own.name.rsplit(".", 1)
        if name not in chain.elastic_names:
            raise ValueError(f"expected a robot with {own.name}, got none")
        value = float(getattr(nominal, kind)[chain.elastic_names.index(name)])
        x[k] = np.log(max(value, 1e-3 * own.value) / own.value)
    return x

"""What is identified of a robot: compliances of its torsions and tilts, backlash of its gears."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Robot, Tilt
from elastic_robot.parameters import Parameters
from elastic_robot.spline_curve import SplineCurve
from elastic_robot.torque_curves import TORQUE_CURVES, LinearCurve

# What a coordinate is taken for that gives way by nothing measurable [rad/(N m), rad].
LEAST_COMPLIANCE, LEAST_BACKLASH = 1e-14, 1e-10


@dataclass(frozen=True)
class ElasticParameters:
    """The parameters p of a robot: compliance of every elastic coordinate, then backlash of gears.

    Attributes:
        robot: The robot they belong to.
        names: As the FMU names them, joint[1].stiffness or joint[1].backlash, (P,).
        elastic: Index of the elastic coordinate of each, (P,).
        is_backlash: Which are half widths of backlash [rad]; the others are compliances 1/k
            [rad/(N m)], (P,).
        start: Values of the robot's description, (P,).
    """

    robot: Robot
    names: tuple[str, ...]
    elastic: np.ndarray
    is_backlash: np.ndarray
    start: np.ndarray

    @classmethod
    def of(cls, robot: Robot, torque_curve: str) -> ElasticParameters:
        """Return the parameters of a robot: backlash where it has any and the curve knows it.

        A gear whose torque the curve takes from its own table has none.
        """
        chain, given = build_chain(robot), Parameters.of(robot)
        curve = TORQUE_CURVES[torque_curve]
        tabled = [table is not None and curve is SplineCurve for table in given.tables]
        coordinates = np.flatnonzero(~np.array(tabled, dtype=bool))
        loose = np.flatnonzero((given.backlash > 0.0) & ~np.array(tabled, dtype=bool))
        loose = loose[:0] if curve is LinearCurve else loose
        names = (
            *(f"{chain.elastic_names[k]}.stiffness" for k in coordinates),
            *(f"{chain.elastic_names[k]}.backlash" for k in loose),
        )
        return cls(
            robot,
            names,
            np.concatenate([coordinates, loose]),
            np.repeat([False, True], [len(coordinates), len(loose)]),
            np.concatenate([1.0 / given.stiffness[coordinates], given.backlash[loose]]),
        )

    @property
    def is_torsion(self) -> np.ndarray:
        """Which are compliances of a joint about its own axis, (P,)."""
        return ~np.array([".tilt[" in name or backlash for name, backlash in self._pairs()])

    @property
    def least(self) -> np.ndarray:
        """Smallest values that the model is computed with, (P,)."""
        return np.where(self.is_backlash, LEAST_BACKLASH, LEAST_COMPLIANCE)

    def parameters(self, values: np.ndarray) -> Parameters:
        """Return the model's parameters at values of p, (P,)."""
        given = Parameters.of(self.robot)
        values = np.maximum(values, self.least)
        stiffness, backlash = given.stiffness.copy(), given.backlash.copy()
        stiffness[self.elastic[~self.is_backlash]] = 1.0 / values[~self.is_backlash]
        backlash[self.elastic[self.is_backlash]] = values[self.is_backlash]
        return replace(given, stiffness=stiffness, backlash=backlash)

    def described(self, values: np.ndarray) -> Robot:
        """Return the robot with values of p, (P,)."""
        changed = self.parameters(values)
        joints, k = [], 0
        for joint in self.robot.joints:
            if joint.stiffness is not None:
                stiffness, backlash = float(changed.stiffness[k]), float(changed.backlash[k])
                joint = replace(joint, stiffness=stiffness, backlash=backlash)
                k += 1
            tilts = []
            for tilt in joint.tilt:
                tilts.append(replace(tilt, stiffness=float(changed.stiffness[k])))
                k += 1
            joints.append(replace(joint, tilt=tuple(tilts)))
        return replace(self.robot, joints=tuple(joints))

    def in_units(self, values: np.ndarray) -> np.ndarray:
        """Return stiffnesses [N m/rad] in the place of compliances; infinite for none."""
        with np.errstate(divide="ignore"):
            return np.where(self.is_backlash, values, 1.0 / np.maximum(values, 0.0))

    def _pairs(self) -> list[tuple[str, bool]]:
        return list(zip(self.names, self.is_backlash.tolist(), strict=True))


@dataclass(frozen=True)
class Candidate:
    """A parameter that a robot does not have.

    Attributes:
        name: joint[3].tilt about [0, 0, 1], or joint[3].backlash.
        joint: Number of the joint, from 0.
        axis: Axis of the tilt in the body's axes, (3,); None for a backlash.
    """

    name: str
    joint: int
    axis: tuple[float, ...] | None

    def added_to(self, robot: Robot, value: float) -> Robot:
        """Return the robot with this parameter.

        Args:
            robot: The robot.
            value: Compliance [rad/(N m)] or half width [rad].
        """
        joint = robot.joints[self.joint]
        if self.axis is None:
            changed = replace(joint, backlash=max(value, LEAST_BACKLASH))
        else:
            stiffness = 1.0 / max(value, LEAST_COMPLIANCE)
            ratio = joint.damping / joint.stiffness if joint.stiffness else 0.0
            tilt = Tilt(self.axis, stiffness, ratio * stiffness)
            changed = replace(joint, tilt=(*joint.tilt, tilt))
        joints = (*robot.joints[: self.joint], changed, *robot.joints[self.joint + 1 :])
        return replace(robot, joints=joints)


def candidates(robot: Robot, torque_curve: str) -> list[Candidate]:
    """Return the tilts, and the backlashes, that joints may have beside what they have."""
    found = []
    for i, joint in enumerate(robot.joints):
        if joint.stiffness is None and not joint.tilt:
            continue  # a joint that the file takes for rigid
        for axis in _lateral(joint)[: 2 - len(joint.tilt)]:
            words = ", ".join(f"{component:.4g}" for component in axis)
            found.append(Candidate(f"joint[{i + 1}].tilt about [{words}]", i, axis))
    if TORQUE_CURVES[torque_curve] is not LinearCurve:
        for i, joint in enumerate(robot.joints):
            if joint.stiffness is not None and joint.backlash == 0.0 and not joint.torque_table:
                found.append(Candidate(f"joint[{i + 1}].backlash", i, None))
    return found


def _lateral(joint: Joint) -> list[tuple[float, ...]]:
    """Return the directions across a joint's axis, and its tilts': body axes where these lie so."""
    taken = [np.array(joint.axis), *(np.array(tilt.axis) for tilt in joint.tilt)]
    found: list[tuple[float, ...]] = []
    order = np.argsort(np.abs(joint.axis), kind="stable")
    for axis in np.eye(3)[order]:
        for other in taken:
            axis = axis - (axis @ other) / (other @ other) * other
        length = np.linalg.norm(axis)
        if length > 0.1:
            unit = axis / length + 0.0
            found.append(tuple(unit.tolist()))
            taken.append(unit)
    return found

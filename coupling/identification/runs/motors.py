"""What was recorded of motors while a tool was measured: columns, and by how much they count.

A servo's motor that has more friction than its model takes more torque, and follows its command
otherwise; neither depends on where the measuring frame lies.  Both are compared less their means, as
gravity and payload leave a torque that is nearly constant, and a controller's zeros an angle.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import LearnError
from coupling.files.measured_table import MeasuredTable
from coupling.identification.motor_torques import torque_per_current
from coupling.path.joint_path import MotorHistory
from elastic_robot.description import Robot

# Columns, as in a robot's recording in motion.
_NAMED = re.compile(r"(motor|motor_torque|motor_current)\[(\d+)\]")
# Smallest deviations that are believed [rad], [N m].
_LEAST = {"motor": 1e-7, "motor_torque": 1e-3}


@dataclass(frozen=True)
class MeasuredMotors:
    """Angles and torques of motors, at the times of a measurement, in c columns.

    Attributes:
        columns: Kind of each, "motor", "motor_torque" or, as read, "motor_current", and its joint from
            0, (c,).
        values: Angles over the gear ratio [rad], torques times it [N m], currents [A], (n, c).
        deviation: Standard deviations by which they count, of a row [rad], [N m], (c,).
        remarks: Sentences on joints whose torques the robot's file hardly explains.
    """

    columns: tuple[tuple[str, int], ...]
    values: np.ndarray
    deviation: np.ndarray
    remarks: tuple[str, ...] = ()

    @classmethod
    def read(cls, table: MeasuredTable) -> MeasuredMotors | None:
        """Return its columns of a table; None where it has none.

        These are `motor[i]`, `motor_torque[i]` and, where there is no torque, `motor_current[i]`.
        """
        matches = [
            match
            for name in table.header
            if (match := _NAMED.fullmatch(name))
            and not (match[1] == "motor_current" and f"motor_torque[{match[2]}]" in table.header)
        ]
        if not matches:
            return None
        columns = tuple((match[1], int(match[2]) - 1) for match in matches)
        return cls(columns, table.of([match[0] for match in matches]), np.ones(len(columns)))

    @property
    def least(self) -> np.ndarray:
        """Smallest deviations that are believed [rad], [N m], (c,)."""
        return np.array([_LEAST[kind] for kind, _ in self.columns])

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints of the columns, from 0, each once."""
        return tuple(sorted({joint for _, joint in self.columns}))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(f"{kind}[{joint + 1}]" for kind, joint in self.columns)

    def at_rows(self, rows: np.ndarray) -> MeasuredMotors:
        """Return its rows of given numbers, (k,)."""
        return replace(self, values=self.values[rows])

    def of(self, robot: Robot, name: str) -> MeasuredMotors | None:
        """Return the columns of joints that have a motor in a robot's file; None where none has.

        Currents become torques.

        Raises:
            LearnError: If there are columns of joints that the robot has not, or currents of motors
                without a torque constant in its file.
        """
        joints = robot.joints
        unknown = [
            name
            for name, (_, i) in zip(self.names, self.columns, strict=True)
            if i not in range(len(joints))
        ]
        if unknown:
            raise LearnError(
                f"{name}: expected motors of a robot with {len(joints)} joints, got {unknown[0]}"
            )
        known_columns = [k for k, (_, i) in enumerate(self.columns) if joints[i].drive is not None]
        columns, values = (
            [self.columns[k] for k in known_columns],
            self.values[:, known_columns].copy(),
        )
        for k, (kind, joint) in enumerate(columns):
            if kind == "motor_current":
                values[:, k] *= torque_per_current(robot, joint, name, LearnError)
                columns[k] = ("motor_torque", joint)
        return (
            MeasuredMotors(tuple(columns), values, self.deviation[known_columns])
            if columns
            else None
        )

    def of_history(self, motion: MotorHistory) -> np.ndarray:
        """Return angles [rad] and torques [N m] of simulated motors, in its columns, (k, c)."""
        by_kind = {"motor": motion.angle, "motor_torque": motion.torque}
        return np.column_stack(
            [by_kind[kind][:, motion.joints.index(joint)] for kind, joint in self.columns]
        )

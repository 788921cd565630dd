"""The FMU's inputs."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace

from elastic_robot.description import Joint
from elastic_robot.fmi.sizes import FORCE, MOMENT, RADIUS, SLIP_SPEED, SPRING, TORQUE
from elastic_robot.fmi.variables import AXES, SYMMETRIC, Array, Block, Variable

LARGEST = sys.float_info.max


def limits_of(variable: Variable) -> tuple[float, float]:
    """Return the range of an input; that of all finite numbers where it has none."""
    low, high = variable.minimum, variable.maximum
    return -LARGEST if low is None else low, LARGEST if high is None else high


def inputs(joints: Sequence[Joint]) -> dict[str, Block]:
    """Return the inputs by block: load, drives, contact spring, contact, motors' torques."""

    def block(variables: list[Variable], *arrays: Array) -> Block:
        return Block("input", "continuous", tuple(variables), arrays=arrays)

    def drives(name: str, unit: str, text: str, all_text: str) -> Block:
        variables = [
            Variable(f"{name}[{i}]", unit, f"{text} of drive {i}", 0.0)
            for i in range(1, len(joints) + 1)
        ]
        return block(variables, Array(name, all_text, len(joints)))

    def limited(angles: Block) -> Block:
        # Inputs start at 0, which is in their range whatever the drive's.
        limits = [
            variable
            if joint.limits is None
            else replace(
                variable, minimum=min(joint.limits[0], 0.0), maximum=max(joint.limits[1], 0.0)
            )
            for variable, joint in zip(angles.variables, joints, strict=True)
        ]
        return replace(angles, variables=tuple(limits))

    def along(
        array: str,
        prefix: str,
        unit: str,
        text: str,
        behind: str,
        start: Sequence[float] = (0.0,) * 3,
    ) -> Block:
        """Return a vector: `text`, an axis, and what is behind it in the descriptions."""
        variables = [
            Variable(f"{prefix}{c}", unit, f"{text} {c} {behind}", initial)
            for c, initial in zip(AXES, start, strict=True)
        ]
        return block(variables, Array(array, f"{text} {behind}: x, y, z", 3))

    on_tool = "on the tool at the TCP"
    of_anchor = "of the spring's anchor, base axes,"
    of_contact = "of the contact's plane, out of it to the robot's side, base axes"
    stiffness = "Stiffness of the spring from TCP to anchor, base axes"
    return {
        "wrench": block(
            [
                Variable(
                    f"{name}.{c}", unit, f"{text}, {c}, {on_tool}, base axes", 0.0, nominal=nominal
                )
                for name, unit, text, nominal in (
                    ("force", "N", "Force", FORCE),
                    ("moment", "N.m", "Moment", MOMENT),
                )
                for c in AXES
            ],
            Array("force", f"Force {on_tool}: x, y, z in base axes", 3),
            Array("moment", f"Moment {on_tool}: x, y, z in base axes", 3),
        ),
        "q_cmd": limited(
            drives(
                "q_cmd",
                "rad",
                "Angle at the step's start",
                "Angles of the drives at the step's start",
            )
        ),
        "qd_cmd": drives(
            "qd_cmd", "rad/s", "Rate at the step's start", "Rates of the drives at the step's start"
        ),
        "qdd_cmd": drives(
            "qdd_cmd",
            "rad/s2",
            "Acceleration at the step's start",
            "Accelerations of the drives at the step's start",
        ),
        "anchor": along(
            "anchor.position", "anchor.", "m", "Position", f"{of_anchor} at the step's start"
        ),
        "anchor_velocity": along(
            "anchor.velocity", "anchor.v", "m/s", "Velocity", f"{of_anchor} over the step"
        ),
        "anchor_stiffness": block(
            [
                Variable(
                    f"anchor.k{c}",
                    "N/m",
                    f"{stiffness}: force {c[0]} by its length {c[1]}",
                    0.0,
                    nominal=SPRING,
                )
                for c in SYMMETRIC
            ],
            Array("anchor.stiffness", f"{stiffness}: {', '.join(SYMMETRIC)}", 6),
        ),
        "wrench_rate": block(
            [
                Variable(
                    f"{name}_rate.{c}",
                    unit,
                    f"Rate of {name}.{c} over the step",
                    0.0,
                    nominal=nominal,
                )
                for name, unit, nominal in (
                    ("force", "N/s", FORCE),
                    ("moment", "N.m/s", MOMENT),
                )
                for c in AXES
            ],
            Array("force_rate", "Rate of force over the step: x, y, z in base axes", 3),
            Array("moment_rate", "Rate of moment over the step: x, y, z in base axes", 3),
        ),
        "contact": block(
            [
                Variable(f"contact.{name}", unit, text, start, minimum=0.0, nominal=nominal)
                for name, unit, text, start, nominal in (
                    (
                        "stiffness",
                        "N/m",
                        "Stiffness of the contact of the TCP with the plane through the anchor, 0: none",
                        0.0,
                        SPRING,
                    ),
                    ("dissipation", "s/m", "Damping of the contact by its force", 0.0, None),
                    ("radius", "m", "Radius of the sphere at the TCP that touches", 0.0, RADIUS),
                    ("friction", "1", "Coefficient of friction of the contact", 0.0, None),
                    (
                        "slip_speed",
                        "m/s",
                        "Speed, above zero, below which friction falls with it",
                        SLIP_SPEED,
                        SLIP_SPEED,
                    ),
                )
            ]
        ),
        "contact_normal": along(
            "contact.normal", "contact.n", "1", "Normal", of_contact, (0.0, 0.0, 1.0)
        ),
        "torque_cmd": block(
            [
                Variable(
                    f"torque_cmd[{i}]",
                    "N.m",
                    f"Torque of the motor of drive {i} over the step, at the gear's output",
                    0.0,
                    nominal=TORQUE,
                )
                for i, joint in enumerate(joints, start=1)
                if joint.drive is not None
            ]
        ),
    }

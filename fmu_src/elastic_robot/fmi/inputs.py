"""The FMU's inputs."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace

from elastic_robot.description import Joint
from elastic_robot.fmi.sizes import FORCE, MOMENT, RADIUS, SLIP_SPEED, SPRING, TORQUE
from elastic_robot.fmi.variables import SYMMETRIC, Block, Group, Variable, along, group, numbered

LARGEST = sys.float_info.max


def limits_of(variable: Variable) -> tuple[float, float]:
    """Return the range of an input; that of all finite numbers where it has none."""
    low, high = variable.minimum, variable.maximum
    return -LARGEST if low is None else low, LARGEST if high is None else high


def inputs(joints: Sequence[Joint]) -> dict[str, Block]:
    """Return the inputs by block: load, drives, contact spring, contact, motors' torques."""
    on_tool, of_anchor = "on the tool at the TCP, base axes", "of the spring's anchor, base axes"
    rate, over_step = "Rate over the step", "over the step"
    stiffness = "Stiffness of the spring from TCP to anchor, base axes, force by length"
    normal = "Normal of the contact's plane, out of it to the robot's side, base axes"
    motor = "Torque of the motor over the step, at the gear's output"
    motors = {
        f"torque_cmd[{i}]": f"drive {i}"
        for i, joint in enumerate(joints, start=1)
        if joint.drive is not None
    }

    def block(*groups: Group) -> Block:
        return Block.of("input", "continuous", *groups)

    def drives(name: str, unit: str, text: str) -> Block:
        parts = numbered(name, (f"drive {i + 1}" for i in range(len(joints))))
        return block(group(name, unit, f"{text} at the step's start", parts, 0.0))

    return {
        "wrench": block(
            group("force", "N", f"Force {on_tool}", along("force."), 0.0, FORCE),
            group("moment", "N.m", f"Moment {on_tool}", along("moment."), 0.0, MOMENT),
        ),
        "q_cmd": _limited(drives("q_cmd", "rad", "Angle"), joints),
        "qd_cmd": drives("qd_cmd", "rad/s", "Rate"),
        "qdd_cmd": drives("qdd_cmd", "rad/s2", "Acceleration"),
        "anchor": block(
            group("anchor.position", "m", f"Position {of_anchor}", along("anchor."), 0.0)
        ),
        "anchor_velocity": block(
            group(
                "anchor.velocity",
                "m/s",
                f"Velocity {of_anchor}, {over_step}",
                along("anchor.v"),
                0.0,
            )
        ),
        "anchor_stiffness": block(
            group("anchor.stiffness", "N/m", stiffness, along("anchor.k", SYMMETRIC), 0.0, SPRING)
        ),
        "wrench_rate": block(
            group("force_rate", "N/s", f"{rate} of the force", along("force_rate."), 0.0, FORCE),
            group(
                "moment_rate", "N.m/s", f"{rate} of the moment", along("moment_rate."), 0.0, MOMENT
            ),
        ),
        "contact": block(
            *(
                group("", unit, "Contact", {f"contact.{name}": text}, start, nominal, minimum=0.0)
                for name, unit, start, nominal, text in (
                    ("stiffness", "N/m", 0.0, SPRING, "stiffness of TCP against plane, 0: none"),
                    ("dissipation", "s/m", 0.0, None, "damping by its force"),
                    ("radius", "m", 0.0, RADIUS, "radius of the sphere at the TCP that touches"),
                    ("friction", "1", 0.0, None, "coefficient of friction"),
                    (
                        "slip_speed",
                        "m/s",
                        SLIP_SPEED,
                        SLIP_SPEED,
                        "speed below which friction falls",
                    ),
                )
            )
        ),
        "contact_normal": block(
            group("contact.normal", "1", normal, along("contact.n"), (0.0, 0.0, 1.0))
        ),
        "torque_cmd": block(group("", "N.m", motor, motors, 0.0, TORQUE)),
    }


def _limited(angles: Block, joints: Sequence[Joint]) -> Block:
    """Return the angles of drives with their limits, and 0, at which inputs start, within them."""
    limits = [
        variable
        if joint.limits is None
        else replace(variable, minimum=min(joint.limits[0], 0.0), maximum=max(joint.limits[1], 0.0))
        for variable, joint in zip(angles.variables, joints, strict=True)
    ]
    return replace(angles, variables=tuple(limits))

"""The FMI contract as data: every variable of the FMU, in the order of its value reference.

The variables come in blocks.  The reals are one array in the slave, and a block is a slice of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

AXES = ("x", "y", "z")
POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
TORQUE_CURVE_DEFAULT = "backlash"
MODES = ("dynamic", "quasistatic")
INITIAL_STATES = ("equilibrium", "undeflected")


@dataclass(frozen=True)
class Variable:
    """One FMI variable.

    Attributes:
        name: Structured name.
        unit: Of a real; empty for strings.
        text: Description.
        start: Start value of an input or parameter; None for outputs.
    """

    name: str
    unit: str
    text: str
    start: float | str | None = None


@dataclass(frozen=True)
class Block:
    """Consecutive variables of one kind.

    Attributes:
        causality: "input", "output" or "parameter".
        variability: "continuous", "tunable" or "fixed".
        variables: In the order of their value references.
    """

    causality: str
    variability: str
    variables: tuple[Variable, ...]


def blocks(robot: Robot) -> dict[str, Block]:
    """Return the FMU's variables by block; the last block holds the strings."""
    n = len(robot.joints)
    chain = build_chain(robot)
    parameters = Parameters.of(robot)
    names = chain.elastic_names

    def inputs(*variables: Variable) -> Block:
        return Block("input", "continuous", variables)

    def outputs(*variables: Variable) -> Block:
        return Block("output", "continuous", variables)

    def tunable(*variables: Variable) -> Block:
        return Block("parameter", "tunable", variables)

    def pose(group: str, text: str) -> list[Variable]:
        return [Variable(f"{group}.{c}", "m" if c in AXES else "1", text) for c in POSE]

    def drives(name: str, unit: str, text: str) -> list[Variable]:
        return [
            Variable(f"{name}[{i}]", unit, f"{text} of drive {i}", 0.0) for i in range(1, n + 1)
        ]

    def elastic(
        key: str, unit: str, text: str, values: np.ndarray, rows: np.ndarray
    ) -> list[Variable]:
        return [Variable(f"{names[k]}.{key}", unit, text, float(values[k])) for k in rows]

    every, twists = np.arange(len(names)), chain.twists
    on_tool = "on the tool at the TCP, base axes"
    return {
        "wrench": inputs(
            *[Variable(f"force.{c}", "N", f"Force {on_tool}", 0.0) for c in AXES],
            *[Variable(f"moment.{c}", "N.m", f"Moment {on_tool}", 0.0) for c in AXES],
        ),
        "q_cmd": inputs(*drives("q_cmd", "rad", "Angle at the step's start")),
        "qd_cmd": inputs(*drives("qd_cmd", "rad/s", "Rate at the step's start")),
        "qdd_cmd": inputs(*drives("qdd_cmd", "rad/s2", "Acceleration, held over the step,")),
        "tcp": outputs(*pose("tcp", "Pose of the elastic robot's TCP in the base frame")),
        "velocity": outputs(
            *[Variable(f"tcp.v{c}", "m/s", "Velocity of the TCP, base axes") for c in AXES]
        ),
        "rigid": outputs(*pose("rigid", "Pose of the TCP with undeflected joints")),
        "deviation": outputs(
            *[Variable(f"deviation.{c}", "m", "TCP minus rigid TCP, base axes") for c in AXES],
            *[
                Variable(
                    f"deviation.r{c}", "rad", "Rotation vector from rigid to elastic, base axes"
                )
                for c in AXES
            ],
        ),
        "compliance": outputs(
            *[
                Variable(f"compliance.{c}", "m/N", "Static translational compliance of the TCP")
                for c in ("xx", "xy", "xz", "yy", "yz", "zz")
            ]
        ),
        "deflection": outputs(
            *[
                Variable(f"deflection[{k + 1}]", "rad", f"Elastic angle of {name}")
                for k, name in enumerate(names)
            ]
        ),
        "gravity": tunable(
            *[
                Variable(f"gravity.{c}", "m/s2", "Gravity in base axes", float(value))
                for c, value in zip(AXES, robot.gravity, strict=True)
            ]
        ),
        "stiffness": tunable(
            *elastic("stiffness", "N.m/rad", "Spring", parameters.stiffness, every)
        ),
        "damping": tunable(*elastic("damping", "N.m.s/rad", "Damper", parameters.damping, every)),
        "backlash": tunable(
            *elastic("backlash", "rad", "Half width of the dead band", parameters.backlash, twists)
        ),
        "strings": Block(
            "parameter",
            "fixed",
            (
                Variable(
                    "trajectory", "", "CSV or NPZ file of the joint motion; empty: inputs", ""
                ),
                Variable("torque_curve", "", "linear, backlash or spline", TORQUE_CURVE_DEFAULT),
                Variable("mode", "", " or ".join(MODES), MODES[0]),
                Variable("initial_state", "", " or ".join(INITIAL_STATES), INITIAL_STATES[0]),
            ),
        ),
    }

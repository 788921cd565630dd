"""The FMI contract as data: every variable of the FMU, in the order of its value reference.

The variables come in blocks.  The reals are one array in the slave, and a block is a slice of it.  The
native FMU reads this table from its robot.txt; what a block or a choice means there is an enum of
fmi/interface.h.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from elastic_robot.chain import Chain, build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters
from elastic_robot.torque_curves import TORQUE_CURVES

MODEL_NAME = "ElasticRobot"
# To begin with: communication step [s], and error allowed at the TCP over a path [m].
STEP_SIZE = 0.01
TOLERANCE = 1e-6
AXES = ("x", "y", "z")
POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
# Entries of a symmetric 3x3 matrix, in their order.
SYMMETRIC = ("xx", "xy", "xz", "yy", "yz", "zz")
TORQUE_CURVE_DEFAULT = "backlash"
Mode = Literal["dynamic", "quasistatic"]
MODES: tuple[Mode, ...] = get_args(Mode)
INITIAL_STATES = ("equilibrium", "undeflected")
LONGEST_TEXT = 1024  # bytes of a string variable, its end included; ER_MAX_PATH in C

Names = tuple[str, ...]


@dataclass(frozen=True)
class Variable:
    """One FMI variable.

    Attributes:
        name: Structured name.
        unit: Of a real; empty for strings.
        text: Description.
        start: Start value of an input or parameter; None for outputs.
        minimum, maximum: Range, where there is one.
        nominal: Usual size, where it is not about 1.
        choices: Values that a string may have; empty for any.
    """

    name: str
    unit: str
    text: str
    start: float | str | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    choices: Names = ()


@dataclass(frozen=True)
class Array:
    """Variables of a block, one after another, that are one array in an FMU of FMI 3.0 with arrays.

    Attributes:
        name: Structured name.
        text: Description.
        size: Number of elements.
    """

    name: str
    text: str
    size: int


@dataclass(frozen=True)
class Block:
    """Consecutive variables of one kind.

    Attributes:
        causality: "input", "output", "parameter" or "local".
        variability: "continuous", "tunable" or "fixed".
        variables: In the order of their value references.
        follows: Of outputs: the blocks of inputs that their value at a step's end depends on, in
            one of the modes at least.
        starts_from: Of outputs and derivatives: the blocks that their initial value depends on.
        arrays: What they are in FMI 3.0 with arrays; empty where each stands alone there too.
        exchanged: Of outputs, derivatives and event indicators: the blocks that their value depends on
            in model exchange; TIME for what the drives of a trajectory move.
        own: Those of them of which it is the element at the same place only.
        derivative_of: The block of states whose derivatives by time these are.
        is_event_indicator: Whether a change of their sign is an event of model exchange.
    """

    causality: str
    variability: str
    variables: tuple[Variable, ...]
    follows: Names = ()
    starts_from: Names = ()
    arrays: tuple[Array, ...] = ()
    exchanged: Names = ()
    own: Names = ()
    derivative_of: str = ""
    is_event_indicator: bool = False


# Blocks of inputs that are the first derivatives of others.
DERIVATIVES = {"wrench": "wrench_rate", "anchor": "anchor_velocity"}
# python_host adds this to the value references of inputs whose derivatives it sets.
OF_DERIVATIVES = 1 << 30

# Sizes that occur, for solvers and plots that scale by them.
_FORCE, _MOMENT, _DEVIATION, _ANGLE, _COMPLIANCE, _SPRING = 1e3, 1e2, 1e-3, 1e-3, 1e-6, 1e6
_RATE, _ACCELERATION = 5e-2, 5.0
# The states of model exchange, and how large they are: x [rad] and x' [rad/s].
STATES: dict[str, float] = {"deflection": _ANGLE, "deflection_rate": _RATE}
# In `exchanged`: the independent variable.
TIME = "time"
# What the state at a step's end follows, what loads and posture follow, and the initial equilibrium.
_STEP = (
    "wrench",
    "q_cmd",
    "qd_cmd",
    "qdd_cmd",
    "anchor",
    "anchor_velocity",
    "anchor_stiffness",
    "wrench_rate",
)
_HELD = ("wrench", "q_cmd", "anchor", "anchor_stiffness")
_REST = (
    "wrench",
    "q_cmd",
    "anchor",
    "anchor_stiffness",
    "gravity",
    "stiffness",
    "backlash",
    "strings",
)


def blocks(robot: Robot) -> dict[str, Block]:
    """Return the FMU's variables by block; the last block holds the strings."""
    chain = build_chain(robot)
    parameters = _parameters(chain, robot)
    strings = parameters.pop("strings")
    return {
        **_inputs(len(robot.joints)),
        **_outputs(chain),
        **parameters,
        **_locals(chain),
        "strings": strings,
    }


def _inputs(joints: int) -> dict[str, Block]:
    def block(variables: list[Variable], *arrays: Array) -> Block:
        return Block("input", "continuous", tuple(variables), arrays=arrays)

    def drives(name: str, unit: str, text: str, all_text: str) -> Block:
        variables = [
            Variable(f"{name}[{i}]", unit, f"{text} of drive {i}", 0.0)
            for i in range(1, joints + 1)
        ]
        return block(variables, Array(name, all_text, joints))

    on_tool = "on the tool at the TCP"
    of_anchor = "of the spring's anchor, base axes,"
    stiffness = "Stiffness of the spring from TCP to anchor, base axes"
    return {
        "wrench": block(
            [
                Variable(
                    f"{name}.{c}", unit, f"{text}, {c}, {on_tool}, base axes", 0.0, nominal=nominal
                )
                for name, unit, text, nominal in (
                    ("force", "N", "Force", _FORCE),
                    ("moment", "N.m", "Moment", _MOMENT),
                )
                for c in AXES
            ],
            Array("force", f"Force {on_tool}: x, y, z in base axes", 3),
            Array("moment", f"Moment {on_tool}: x, y, z in base axes", 3),
        ),
        "q_cmd": drives(
            "q_cmd", "rad", "Angle at the step's start", "Angles of the drives at the step's start"
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
        "anchor": block(
            [
                Variable(f"anchor.{c}", "m", f"Position {c} {of_anchor} at the step's start", 0.0)
                for c in AXES
            ],
            Array("anchor.position", f"Position {of_anchor} at the step's start: x, y, z", 3),
        ),
        "anchor_velocity": block(
            [
                Variable(f"anchor.v{c}", "m/s", f"Velocity {c} {of_anchor} over the step", 0.0)
                for c in AXES
            ],
            Array("anchor.velocity", f"Velocity {of_anchor} over the step: x, y, z", 3),
        ),
        "anchor_stiffness": block(
            [
                Variable(
                    f"anchor.k{c}",
                    "N/m",
                    f"{stiffness}: force {c[0]} by its length {c[1]}",
                    0.0,
                    nominal=_SPRING,
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
                    ("force", "N/s", _FORCE),
                    ("moment", "N.m/s", _MOMENT),
                )
                for c in AXES
            ],
            Array("force_rate", "Rate of force over the step: x, y, z in base axes", 3),
            Array("moment_rate", "Rate of moment over the step: x, y, z in base axes", 3),
        ),
    }


def _outputs(chain: Chain) -> dict[str, Block]:
    def block(
        variables: list[Variable],
        *arrays: Array,
        follows: Names = _STEP,
        starts_from: Names = _REST,
        exchanged: Names = (*_HELD, TIME, "deflection"),
        own: Names = (),
    ) -> Block:
        return Block(
            "output",
            "continuous",
            tuple(variables),
            follows,
            starts_from,
            arrays,
            exchanged,
            own,
        )

    def pose(
        group: str,
        text: str,
        follows: Names = _STEP,
        starts_from: Names = _REST,
        exchanged: Names = ("q_cmd", TIME, "deflection"),
    ) -> Block:
        position = [
            Variable(f"{group}.{c}", "m", f"Position {c} of {text}, base axes") for c in AXES
        ]
        orientation = [
            Variable(
                f"{group}.{c}",
                "1",
                f"Unit quaternion of {text}, component {c[1]}: tool axes to base axes",
                minimum=0.0 if c == "qw" else -1.0,
                maximum=1.0,
            )
            for c in POSE[3:]
        ]
        return block(
            position + orientation,
            Array(f"{group}.position", f"Position of {text}: x, y, z in base axes", 3),
            Array(
                f"{group}.orientation",
                f"Unit quaternion of {text}: x, y, z, w; tool axes to base axes",
                4,
            ),
            follows=follows,
            starts_from=starts_from,
            exchanged=exchanged,
        )

    apart = "TCP minus rigid TCP"
    turned = "Rotation vector from the rigid to the elastic tool"
    compliance = "Static compliance of the TCP on the anchor's spring"
    names = chain.elastic_names
    return {
        "tcp": pose("tcp", "the elastic robot's TCP"),
        "velocity": block(
            [Variable(f"tcp.v{c}", "m/s", f"Velocity {c} of the TCP, base axes") for c in AXES],
            Array("tcp.velocity", "Velocity of the TCP: x, y, z in base axes", 3),
            starts_from=(*_REST, "qd_cmd"),
            exchanged=("q_cmd", "qd_cmd", TIME, *STATES),
        ),
        "rigid": pose(
            "rigid",
            "the TCP with undeflected joints",
            follows=("q_cmd", "qd_cmd", "qdd_cmd"),
            starts_from=("q_cmd", "strings"),
            exchanged=("q_cmd", TIME),
        ),
        "deviation": block(
            [
                Variable(f"deviation.{prefix}{c}", unit, f"{text}, {c}, base axes", nominal=nominal)
                for prefix, unit, text, nominal in (
                    ("", "m", apart, _DEVIATION),
                    ("r", "rad", turned, _ANGLE),
                )
                for c in AXES
            ],
            Array("deviation.position", f"{apart}: x, y, z in base axes", 3),
            Array("deviation.rotation", f"{turned}: x, y, z in base axes", 3),
            exchanged=("q_cmd", TIME, "deflection"),
        ),
        "compliance": block(
            [
                Variable(
                    f"compliance.{c}",
                    "m/N",
                    f"{compliance}: displacement {c[0]} by force {c[1]}, base axes",
                    nominal=_COMPLIANCE,
                )
                for c in SYMMETRIC
            ],
            Array(
                "compliance",
                f"{compliance} in base axes, displacement by force: {', '.join(SYMMETRIC)}",
                6,
            ),
        ),
        "deflection": block(
            [
                Variable(f"deflection[{k}]", "rad", f"Elastic angle of {name}", nominal=_ANGLE)
                for k, name in enumerate(names, start=1)
            ],
            Array(
                "deflection", "Elastic angles, in the order of the stiffness parameters", len(names)
            ),
            exchanged=("deflection",),
            own=("deflection",),
        ),
        "deflection_rate": block(
            [
                Variable(
                    f"deflection_rate[{k}]",
                    "rad/s",
                    f"Rate of elastic angle of {name}",
                    nominal=_RATE,
                )
                for k, name in enumerate(names, start=1)
            ],
            Array("deflection_rate", "Rates of the elastic angles", len(names)),
            starts_from=(),
            exchanged=("deflection_rate",),
            own=("deflection_rate",),
        ),
    }


def _locals(chain: Chain) -> dict[str, Block]:
    """What model exchange asks for beside the outputs: derivatives of the states, event indicators."""
    names = chain.elastic_names
    moving = (*_HELD, "qd_cmd", "qdd_cmd", TIME, *STATES)
    bend = "of the torque curve of"

    def derivatives(
        state: str, unit: str, nominal: float, starts_from: Names, exchanged: Names, own: Names = ()
    ) -> Block:
        text = {"deflection": "Rate", "deflection_rate": "Acceleration"}[state]
        return Block(
            "local",
            "continuous",
            tuple(
                Variable(
                    f"der({state}[{k}])",
                    unit,
                    f"{text} of {name} as the equation of motion has it",
                    nominal=nominal,
                )
                for k, name in enumerate(names, start=1)
            ),
            starts_from=starts_from,
            arrays=(Array(f"der({state})", f"Derivatives of {state} by time", len(names)),),
            exchanged=exchanged,
            own=own,
            derivative_of=state,
        )

    return {
        "deflection_derivative": derivatives(
            "deflection", "rad/s", _RATE, (), ("deflection_rate",), ("deflection_rate",)
        ),
        "rate_derivative": derivatives(
            "deflection_rate",
            "rad/s2",
            _ACCELERATION,
            (*_REST, "qd_cmd", "qdd_cmd"),
            moving,
        ),
        "bend": Block(
            "local",
            "continuous",
            tuple(
                Variable(
                    f"{names[k]}.bend.{side}",
                    "rad",
                    f"Way to the next bend {bend} {names[k]} {side}; 1 where there is none",
                    nominal=_ANGLE,
                )
                for k in chain.torsions
                for side in ("below", "above")
            ),
            exchanged=("deflection",),
            is_event_indicator=True,
        ),
    }


def _parameters(chain: Chain, robot: Robot) -> dict[str, Block]:
    parameters, names = Parameters.of(robot), chain.elastic_names
    curves = tuple(TORQUE_CURVES)

    def tunable(variables: list[Variable], *arrays: Array) -> Block:
        return Block("parameter", "tunable", tuple(variables), arrays=arrays)

    def choice(name: str, choices: Names, text: str, start: str) -> Variable:
        return Variable(name, "", text, start, choices=choices)

    def elastic(key: str, unit: str, text: str, values: np.ndarray) -> list[Variable]:
        return [
            Variable(
                f"{name}.{key}",
                unit,
                f"{text} of {name}",
                float(value),
                minimum=0.0,
                nominal=float(value) or None,
            )
            for name, value in zip(names, values, strict=True)
        ]

    backlash = elastic("backlash", "rad", "Half width of the dead band", parameters.backlash)
    return {
        "gravity": tunable(
            [
                Variable(
                    f"gravity.{c}", "m/s2", f"Gravity {c}, base axes", float(value), nominal=10.0
                )
                for c, value in zip(AXES, robot.gravity, strict=True)
            ],
            Array("gravity", "Gravity: x, y, z in base axes", 3),
        ),
        "stiffness": tunable(
            elastic("stiffness", "N.m/rad", "Stiffness, above zero,", parameters.stiffness)
        ),
        "damping": tunable(elastic("damping", "N.m.s/rad", "Damping", parameters.damping)),
        "backlash": tunable([backlash[k] for k in chain.torsions]),
        "strings": Block(
            "parameter",
            "fixed",
            (
                Variable(
                    "trajectory",
                    "",
                    "CSV or NPZ file of the joint motion (time, q1.., qd1.., qdd1..); empty: q_cmd",
                    "",
                ),
                choice(
                    "torque_curve",
                    curves,
                    f"{', '.join(curves[:-1])} or {curves[-1]}",
                    TORQUE_CURVE_DEFAULT,
                ),
                choice("mode", MODES, " or ".join(MODES), MODES[0]),
                choice(
                    "initial_state", INITIAL_STATES, " or ".join(INITIAL_STATES), INITIAL_STATES[0]
                ),
            ),
        ),
    }

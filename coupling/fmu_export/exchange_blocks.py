"""All variables of the native FMU: those of co-simulation, and those of model exchange beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from elastic_robot.chain import Chain, build_chain
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import blocks, joints_with_motor, with_joint_names
from elastic_robot.fmi.outputs import HELD, REST, ROTORS, STATES, TUNABLE
from elastic_robot.fmi.sizes import (
    ACCELERATION,
    ANGLE,
    DEVIATION,
    ELONGATION,
    GROWTH,
    PRESLIDING,
    RATE,
    TORQUE,
)
from elastic_robot.fmi.variables import TIME, Array, Block, Names, group
from elastic_robot.hysteresis import REVERSAL_TIME

# What a servo follows of its command.
_SERVO = ("q_cmd", "qd_cmd", TIME)


def all_blocks(robot: Robot, strings: Mapping[str, str] = MappingProxyType({})) -> dict[str, Block]:
    """Return the variables by block, in the order of their value references; the last has the strings.

    Args:
        strings: Start values of strings by name, where they are not the usual ones.

    Raises:
        ParameterError: As `elastic_robot.fmi.interface.blocks`.
    """
    table = blocks(robot, strings)
    texts = table.pop("strings")
    indicators = _indicators(build_chain(robot), joints_with_motor(robot))
    with_names = {key: with_joint_names(block, robot) for key, block in indicators.items()}
    return {**table, **_derivatives(table), **with_names, "strings": texts}


def _derivatives(table: Mapping[str, Block]) -> dict[str, Block]:
    """Return the derivatives of the states by time, as the equation of motion has them, by block."""
    moving = (*HELD, "anchor_velocity", "qd_cmd", "qdd_cmd", "torque_cmd", TIME, *STATES)
    of_motor = ("deflection", "deflection_rate", "elongation", *ROTORS)
    accelerated = ("qd_cmd", "qdd_cmd", "torque_cmd")

    def derivative(
        state: str,
        unit: str,
        nominal: float,
        exchanged: Names,
        starts_from: Names = (),
        elementwise: Names = (),
        tuned: Names = (),
    ) -> Block:
        variables = tuple(
            replace(
                variable,
                name=f"der({variable.name})",
                unit=unit,
                text=f"Derivative by time: {variable.text}",
                nominal=nominal,
            )
            for variable in table[state].variables
        )
        return Block(
            "local",
            "continuous",
            variables,
            starts_from=starts_from,
            arrays=(Array(f"der({state})", f"Derivatives of {state} by time", len(variables)),),
            exchanged=exchanged,
            elementwise=elementwise,
            derivative_of=state,
            tuned=tuned,
        )

    by_rotor: tuple[Names, Names, Names] = (
        ("rotor_rate",),
        ("qd_cmd", "strings", TIME),
        ("rotor_rate",),
    )
    rate = ("deflection_rate",)
    derivatives = [
        derivative("deflection", "rad/s", RATE, rate, elementwise=rate),
        derivative(
            "deflection_rate",
            "rad/s2",
            ACCELERATION,
            moving,
            (*REST, "anchor_velocity", *accelerated),
            tuned=TUNABLE,
        ),
        derivative("elongation", "rad/s", RATE, rate),
        derivative("rotor_angle", "rad/s", RATE, *by_rotor),
        derivative(
            "rotor_rate",
            "rad/s2",
            ACCELERATION,
            (*_SERVO, "torque_cmd", *of_motor),
            (*REST, *accelerated, "friction"),
            tuned=TUNABLE,
        ),
        derivative(
            "servo_integral",
            "N.m/s",
            GROWTH,
            (*_SERVO, "rotor_angle", "rotor_rate", "servo_integral"),
            ("q_cmd", "qd_cmd", "strings", TIME),
        ),
        derivative("presliding", "rad/s", RATE, *by_rotor),
    ]
    return {STATES[block.derivative_of].derivative: block for block in derivatives}


def _indicators(chain: Chain, motors: Sequence[int]) -> dict[str, Block]:
    """Return the event indicators by block.

    Args:
        motors: Joints with a motor, counted from 1.
    """
    names, slips = chain.elastic_names, f"its rate times {REVERSAL_TIME:g} s while it slips"

    def block(
        unit: str,
        nominal: float,
        text: str,
        parts: Mapping[str, str],
        exchanged: Names,
        tuned: Names = (),
    ) -> Block:
        indicators = group("", unit, text, parts, nominal=nominal)
        return replace(
            Block.of("local", "continuous", indicators),
            exchanged=exchanged,
            is_event_indicator=True,
            tuned=tuned,
        )

    return {
        "bend": block(
            "rad",
            ANGLE,
            "Way to the next bend of the torque curve, 1 without one",
            {
                f"{names[k]}.bend.{side}": f"{names[k]} {side}"
                for k in chain.torsions
                for side in ("below", "above")
            },
            ("deflection",),
            ("backlash",),
        ),
        "slip": block(
            "rad",
            ELONGATION,
            f"Way of an element of hysteresis to its slip angle, {slips}",
            {
                f"{names[gear]}.slip[{number}]": f"element {number} of {names[gear]}"
                for gear, number in chain.elements.places
            },
            ("deflection_rate", "elongation"),
        ),
        "motor_slip": block(
            "rad",
            PRESLIDING,
            f"Way of a motor's friction to its slip angle, {slips}",
            {f"joint[{i}].motor.slip": f"joint[{i}]" for i in motors},
            ("rotor_rate", "presliding"),
        ),
        "torque_room": block(
            "N.m",
            TORQUE,
            "Way of a servo to its motor's torque limit, 1 without one",
            {f"joint[{i}].motor.torque_room": f"joint[{i}]" for i in motors},
            (*_SERVO, "rotor_angle", "rotor_rate", "servo_integral"),
        ),
        "contact_gap": block(
            "m",
            DEVIATION,
            "Way from the sphere at the TCP to the plane of the contact",
            {"contact.gap": "1 without one"},
            (
                "q_cmd",
                "anchor",
                "contact",
                "contact_normal",
                TIME,
                "deflection",
                "rotor_angle",
            ),
        ),
    }

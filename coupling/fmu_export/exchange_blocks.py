"""All variables of the native FMU: those of co-simulation, and those of model exchange beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
from elastic_robot.fmi.variables import TIME, Array, Block, Names, Variable
from elastic_robot.hysteresis import REVERSAL_TIME


def all_blocks(robot: Robot, strings: Mapping[str, str] = MappingProxyType({})) -> dict[str, Block]:
    """Return the variables by block, in the order of their value references; the last has the strings.

    Args:
        strings: Start values of strings by name, where they are not the usual ones.

    Raises:
        ParameterError: As `elastic_robot.fmi.interface.blocks`.
    """
    table = blocks(robot, strings)
    texts = table.pop("strings")
    exchange = exchange_blocks(build_chain(robot), table, joints_with_motor(robot))
    named = {key: with_joint_names(block, robot) for key, block in exchange.items()}
    return {**table, **named, "strings": texts}


def exchange_blocks(
    chain: Chain, states: Mapping[str, Block], motors: Sequence[int] = ()
) -> dict[str, Block]:
    """Return, by block, derivatives of the states and event indicators.

    Args:
        states: The blocks of `STATES` among the outputs.
        motors: Joints with a motor, counted from 1.
    """

    def rate(
        state: str,
        of: Sequence[str],
        text: str,
        unit: str,
        nominal: float,
        starts_from: Names = (),
        exchanged: Names = (),
        elementwise: Names = (),
        tuned: Names = (),
    ) -> Block:
        """Return the derivatives of a state, each with a text and what it is one of."""
        variables = tuple(
            Variable(
                f"der({variable.name})",
                unit,
                f"{text} of {name} as the equation of motion has it",
                nominal=nominal,
            )
            for variable, name in zip(states[state].variables, of, strict=True)
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

    names, elements = chain.elastic_names, chain.elements
    elongated = [f"element {number} of {names[gear]}" for gear, number in elements.places]
    moving = (*HELD, "anchor_velocity", "qd_cmd", "qdd_cmd", "torque_cmd", TIME, *STATES)
    of_motor = ("deflection", "deflection_rate", "elongation", *ROTORS)
    servo = ("q_cmd", "qd_cmd", TIME)
    bend = "of the torque curve of"
    slips = f"to its slip angle; its rate times {REVERSAL_TIME:g} s while it slips"
    rotors = [f"the motor of joint[{i}]" for i in motors]
    by_rotor = {
        "starts_from": ("qd_cmd", "strings", TIME),
        "exchanged": ("rotor_rate",),
        "elementwise": ("rotor_rate",),
    }
    rates = [
        rate(
            "deflection",
            names,
            "Rate",
            "rad/s",
            RATE,
            exchanged=("deflection_rate",),
            elementwise=("deflection_rate",),
        ),
        rate(
            "deflection_rate",
            names,
            "Acceleration",
            "rad/s2",
            ACCELERATION,
            (*REST, "anchor_velocity", "qd_cmd", "qdd_cmd", "torque_cmd"),
            moving,
            tuned=TUNABLE,
        ),
        rate(
            "elongation",
            elongated,
            "Rate of elongation",
            "rad/s",
            RATE,
            exchanged=("deflection_rate",),
        ),
        rate("rotor_angle", rotors, "Rate", "rad/s", RATE, **by_rotor),
        rate(
            "rotor_rate",
            rotors,
            "Acceleration",
            "rad/s2",
            ACCELERATION,
            (*REST, "qd_cmd", "qdd_cmd", "torque_cmd", "friction"),
            (*servo, "torque_cmd", *of_motor),
            tuned=TUNABLE,
        ),
        rate(
            "servo_integral",
            rotors,
            "Growth of the integral",
            "N.m/s",
            GROWTH,
            ("q_cmd", "qd_cmd", "strings", TIME),
            (*servo, "rotor_angle", "rotor_rate", "servo_integral"),
        ),
        rate("presliding", rotors, "Rate of elongation of the friction", "rad/s", RATE, **by_rotor),
    ]
    return {
        **{STATES[block.derivative_of].derivative: block for block in rates},
        "bend": _indicators(
            [
                Variable(
                    f"{names[k]}.bend.{side}",
                    "rad",
                    f"Way to the next bend {bend} {names[k]} {side}; 1 where there is none",
                    nominal=ANGLE,
                )
                for k in chain.torsions
                for side in ("below", "above")
            ],
            "deflection",
            tuned=("backlash",),
        ),
        "slip": _indicators(
            [
                Variable(
                    f"{names[gear]}.slip[{number}]",
                    "rad",
                    f"Way of element {number} of {names[gear]} {slips}",
                    nominal=ELONGATION,
                )
                for gear, number in elements.places
            ],
            "deflection_rate",
            "elongation",
        ),
        "motor_slip": _indicators(
            [
                Variable(
                    f"joint[{i}].motor.slip",
                    "rad",
                    f"Way of the friction of the motor of joint[{i}] {slips}",
                    nominal=PRESLIDING,
                )
                for i in motors
            ],
            "rotor_rate",
            "presliding",
        ),
        "torque_room": _indicators(
            [
                Variable(
                    f"joint[{i}].motor.torque_room",
                    "N.m",
                    f"Way of the servo of joint[{i}] to the motor's torque limit; 1 where there is none",
                    nominal=TORQUE,
                )
                for i in motors
            ],
            *servo,
            "rotor_angle",
            "rotor_rate",
            "servo_integral",
        ),
        "contact_gap": _indicators(
            [
                Variable(
                    "contact.gap",
                    "m",
                    "Way from the sphere at the TCP to the plane of the contact; 1 where there is none",
                    nominal=DEVIATION,
                )
            ],
            *("q_cmd", "anchor", "contact", "contact_normal", TIME, "deflection", "rotor_angle"),
        ),
    }


def _indicators(variables: Sequence[Variable], *exchanged: str, tuned: Names = ()) -> Block:
    """Return a block of event indicators."""
    return Block(
        "local",
        "continuous",
        tuple(variables),
        exchanged=exchanged,
        is_event_indicator=True,
        tuned=tuned,
    )

"""Variables of model exchange beside the outputs."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from elastic_robot.chain import Chain
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


def exchange(chain: Chain, motors: Sequence[int] = ()) -> dict[str, Block]:
    """Return, by block, derivatives of the states and event indicators.

    Args:
        chain: The robot's chain.
        motors: Joints with a motor, counted from 1.
    """
    names, elements = chain.elastic_names, chain.elements
    elongated = [f"element {number} of {names[gear]}" for gear, number in elements.places]
    moving = (*HELD, "anchor_velocity", "qd_cmd", "qdd_cmd", "torque_cmd", TIME, *STATES)
    of_motor = ("deflection", "deflection_rate", "elongation", *ROTORS)
    servo = ("q_cmd", "qd_cmd", TIME)
    bend = "of the torque curve of"
    rotors = [f"the motor of joint[{i}]" for i in motors]

    def derivatives(
        state: str,
        unit: str,
        nominal: float,
        starts_from: Names,
        exchanged: Names,
        own: Names = (),
        tuned: Names = (),
    ) -> Block:
        text, numbers, of = {
            "deflection": ("Rate", itertools.count(1), names),
            "deflection_rate": ("Acceleration", itertools.count(1), names),
            "elongation": ("Rate of elongation", itertools.count(1), elongated),
            "rotor_angle": ("Rate", motors, rotors),
            "rotor_rate": ("Acceleration", motors, rotors),
            "servo_integral": ("Growth of the integral", motors, rotors),
            "presliding": ("Rate of elongation of the friction", motors, rotors),
        }[state]
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
                for k, name in zip(numbers, of, strict=False)
            ),
            starts_from=starts_from,
            arrays=(Array(f"der({state})", f"Derivatives of {state} by time", len(of)),),
            exchanged=exchanged,
            own=own,
            derivative_of=state,
            tuned=tuned,
        )

    return {
        STATES["deflection"].derivative: derivatives(
            "deflection", "rad/s", RATE, (), ("deflection_rate",), ("deflection_rate",)
        ),
        STATES["deflection_rate"].derivative: derivatives(
            "deflection_rate",
            "rad/s2",
            ACCELERATION,
            (*REST, "anchor_velocity", "qd_cmd", "qdd_cmd"),
            moving,
            tuned=TUNABLE,
        ),
        STATES["elongation"].derivative: derivatives(
            "elongation", "rad/s", RATE, (), ("deflection_rate",)
        ),
        STATES["rotor_angle"].derivative: derivatives(
            "rotor_angle",
            "rad/s",
            RATE,
            ("qd_cmd", "strings", TIME),
            ("rotor_rate",),
            ("rotor_rate",),
        ),
        STATES["rotor_rate"].derivative: derivatives(
            "rotor_rate",
            "rad/s2",
            ACCELERATION,
            (*REST, "qd_cmd", "qdd_cmd", "torque_cmd", "friction"),
            (*servo, "torque_cmd", *of_motor),
            tuned=TUNABLE,
        ),
        STATES["servo_integral"].derivative: derivatives(
            "servo_integral",
            "N.m/s",
            GROWTH,
            ("q_cmd", "qd_cmd", "strings", TIME),
            (*servo, "rotor_angle", "rotor_rate", "servo_integral"),
        ),
        STATES["presliding"].derivative: derivatives(
            "presliding",
            "rad/s",
            RATE,
            ("qd_cmd", "strings", TIME),
            ("rotor_rate",),
            ("rotor_rate",),
        ),
        "bend": Block(
            "local",
            "continuous",
            tuple(
                Variable(
                    f"{names[k]}.bend.{side}",
                    "rad",
                    f"Way to the next bend {bend} {names[k]} {side}; 1 where there is none",
                    nominal=ANGLE,
                )
                for k in chain.torsions
                for side in ("below", "above")
            ),
            exchanged=("deflection",),
            is_event_indicator=True,
            tuned=("backlash",),
        ),
        "slip": Block(
            "local",
            "continuous",
            tuple(
                Variable(
                    f"{names[gear]}.slip[{number}]",
                    "rad",
                    f"Way of element {number} of {names[gear]} to its slip angle; its rate times"
                    f" {REVERSAL_TIME:g} s while it slips",
                    nominal=ELONGATION,
                )
                for gear, number in elements.places
            ),
            exchanged=("deflection_rate", "elongation"),
            is_event_indicator=True,
        ),
        "motor_slip": Block(
            "local",
            "continuous",
            tuple(
                Variable(
                    f"joint[{i}].motor.slip",
                    "rad",
                    f"Way of the friction of the motor of joint[{i}] to its slip angle; its rate times"
                    f" {REVERSAL_TIME:g} s while it slips",
                    nominal=PRESLIDING,
                )
                for i in motors
            ),
            exchanged=("rotor_rate", "presliding"),
            is_event_indicator=True,
        ),
        "torque_room": Block(
            "local",
            "continuous",
            tuple(
                Variable(
                    f"joint[{i}].motor.torque_room",
                    "N.m",
                    f"Way of the servo of joint[{i}] to the motor's torque limit; 1 where there is none",
                    nominal=TORQUE,
                )
                for i in motors
            ),
            exchanged=(*servo, "rotor_angle", "rotor_rate", "servo_integral"),
            is_event_indicator=True,
        ),
        "contact_gap": Block(
            "local",
            "continuous",
            (
                Variable(
                    "contact.gap",
                    "m",
                    "Way from the sphere at the TCP to the plane of the contact; 1 where there is none",
                    nominal=DEVIATION,
                ),
            ),
            exchanged=(
                "q_cmd",
                "anchor",
                "contact",
                "contact_normal",
                TIME,
                "deflection",
                "rotor_angle",
            ),
            is_event_indicator=True,
        ),
    }

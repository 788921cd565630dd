"""Variables of model exchange beside the outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

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


@dataclass(frozen=True)
class Rate:
    """The derivatives of a block of states by time.

    Attributes:
        text: What one is, in a description.
        of: What each is one of.
        unit, nominal: Unit of one and its usual size.
        starts_from, exchanged, own, tuned: As of a `Block`.
    """

    text: str
    of: Sequence[str]
    unit: str
    nominal: float
    starts_from: Names = ()
    exchanged: Names = ()
    own: Names = ()
    tuned: Names = ()

    def block(self, state: str, variables: Sequence[Variable]) -> Block:
        """Return their block, one for each variable of the state."""
        return Block(
            "local",
            "continuous",
            tuple(
                Variable(
                    f"der({variable.name})",
                    self.unit,
                    f"{self.text} of {name} as the equation of motion has it",
                    nominal=self.nominal,
                )
                for variable, name in zip(variables, self.of, strict=True)
            ),
            starts_from=self.starts_from,
            arrays=(Array(f"der({state})", f"Derivatives of {state} by time", len(variables)),),
            exchanged=self.exchanged,
            own=self.own,
            derivative_of=state,
            tuned=self.tuned,
        )


def exchange(
    chain: Chain, states: Mapping[str, Block], motors: Sequence[int] = ()
) -> dict[str, Block]:
    """Return, by block, derivatives of the states and event indicators.

    Args:
        states: The blocks of `STATES` among the outputs.
        motors: Joints with a motor, counted from 1.
    """
    names, elements = chain.elastic_names, chain.elements
    elongated = [f"element {number} of {names[gear]}" for gear, number in elements.places]
    moving = (*HELD, "anchor_velocity", "qd_cmd", "qdd_cmd", "torque_cmd", TIME, *STATES)
    of_motor = ("deflection", "deflection_rate", "elongation", *ROTORS)
    servo = ("q_cmd", "qd_cmd", TIME)
    bend = "of the torque curve of"
    rotors = [f"the motor of joint[{i}]" for i in motors]
    by_rotor = {
        "starts_from": ("qd_cmd", "strings", TIME),
        "exchanged": ("rotor_rate",),
        "own": ("rotor_rate",),
    }
    rates = {
        "deflection": Rate(
            "Rate",
            names,
            "rad/s",
            RATE,
            exchanged=("deflection_rate",),
            own=("deflection_rate",),
        ),
        "deflection_rate": Rate(
            "Acceleration",
            names,
            "rad/s2",
            ACCELERATION,
            (*REST, "anchor_velocity", "qd_cmd", "qdd_cmd"),
            moving,
            tuned=TUNABLE,
        ),
        "elongation": Rate(
            "Rate of elongation", elongated, "rad/s", RATE, exchanged=("deflection_rate",)
        ),
        "rotor_angle": Rate("Rate", rotors, "rad/s", RATE, **by_rotor),
        "rotor_rate": Rate(
            "Acceleration",
            rotors,
            "rad/s2",
            ACCELERATION,
            (*REST, "qd_cmd", "qdd_cmd", "torque_cmd", "friction"),
            (*servo, "torque_cmd", *of_motor),
            tuned=TUNABLE,
        ),
        "servo_integral": Rate(
            "Growth of the integral",
            rotors,
            "N.m/s",
            GROWTH,
            ("q_cmd", "qd_cmd", "strings", TIME),
            (*servo, "rotor_angle", "rotor_rate", "servo_integral"),
        ),
        "presliding": Rate("Rate of elongation of the friction", rotors, "rad/s", RATE, **by_rotor),
    }
    return {
        **{
            state.derivative: rates[key].block(key, states[key].variables)
            for key, state in STATES.items()
        },
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

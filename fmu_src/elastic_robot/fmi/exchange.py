"""Variables of model exchange beside the outputs."""

from __future__ import annotations

from elastic_robot.chain import Chain
from elastic_robot.fmi.outputs import HELD, REST, STATES, TUNABLE
from elastic_robot.fmi.sizes import ACCELERATION, ANGLE, DEVIATION, ELONGATION, RATE
from elastic_robot.fmi.variables import TIME, Array, Block, Names, Variable
from elastic_robot.hysteresis import REVERSAL_TIME


def exchange(chain: Chain) -> dict[str, Block]:
    """Return, by block, derivatives of the states and event indicators."""
    names, elements = chain.elastic_names, chain.elements
    elongated = [f"element {number} of {names[gear]}" for gear, number in elements.places]
    moving = (*HELD, "anchor_velocity", "qd_cmd", "qdd_cmd", TIME, *STATES)
    bend = "of the torque curve of"

    def derivatives(
        state: str,
        unit: str,
        nominal: float,
        starts_from: Names,
        exchanged: Names,
        own: Names = (),
        tuned: Names = (),
    ) -> Block:
        text, of = {
            "deflection": ("Rate", names),
            "deflection_rate": ("Acceleration", names),
            "elongation": ("Rate of elongation", elongated),
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
                for k, name in enumerate(of, start=1)
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
            exchanged=("q_cmd", "anchor", "contact", "contact_normal", TIME, "deflection"),
            is_event_indicator=True,
        ),
    }

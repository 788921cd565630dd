"""All that is said of a robot's parameters, a row each; a new one is a row here and its physics.

Cases, studies, replays, usual ranges, fits, robot files and reports go by these rows, in this order.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from coupling.robot.parameter_kind import (
    MotionTerm,
    ParameterKind,
    UsualRange,
    Variation,
    drive_field_kind,
    drive_kind,
    entries_kind,
    field_kind,
)
from elastic_robot.body import Body
from elastic_robot.description import Joint
from elastic_robot.drive import Drive
from elastic_robot.torque_curves import CurveClass

# Stiffness and rotor come from data sheets: standard deviation around the file's, in parts of it.
_DATA_SHEET = 0.5
# A data sheet says at most how much backlash there is: likewise.
_BACKLASH = 1.0
_STIFFNESS = UsualRange(
    1e3, 2e8, "N m/rad", "from gears of small arms to those of the heaviest robots"
)
_DAMPING = UsualRange(
    1e-2, 1e6, "N m s/rad", "some milliseconds times the stiffness at most", or_none=True
)
_FRICTION = UsualRange(
    1e-2, 5e3, "N m", "friction of motors and gears at rest, at the gears' output", or_none=True
)
_RADIANS = UsualRange(0.0, 6.3, "rad", "up to one turn")


def _without_table(part: Any, curve: CurveClass) -> bool:
    """Return whether a torque curve takes no table of the part in place of its numbers."""
    return not (curve.takes_tables and getattr(part, "torque_table", None) is not None)


def dry_friction(drive: Drive) -> tuple[float, float]:
    """Return the friction at high rates, and what there is more of it at rest [N m]."""
    more = drive.stribeck * drive.friction
    return drive.friction - more, more


def _with_dry(drive: Drive, slipping: float, more: float) -> Drive:
    at_rest = slipping + more
    return replace(drive, friction=at_rest, stribeck=more / at_rest if at_rest > 0.0 else 0.0)


def _dry_size(joint: Joint) -> float:
    return max(dry_friction(joint.drive)[0], 1.0) if joint.drive else 1.0


def _stiction(joint: Joint) -> dict[str, object]:
    """Return the friction at rest in a file, where it is another than that in motion."""
    assert joint.drive is not None
    slipping, more = dry_friction(joint.drive)
    return {"drive.friction.stiction_Nm": slipping + more} if more > 0.0 else {}


def _coulomb(joint: Joint) -> dict[str, object]:
    assert joint.drive is not None
    return {"drive.friction.coulomb_Nm": dry_friction(joint.drive)[0], **_stiction(joint)}


def _scaled_balancer(joint: Joint, factor: float) -> Joint:
    points = joint.balancer or ()
    return replace(joint, balancer=tuple((angle, factor * torque) for angle, torque in points))


def _scaled_gains(drive: Drive, factor: float) -> Drive:
    return replace(
        drive,
        position_gain=factor * drive.position_gain,
        rate_gain=factor * drive.rate_gain,
        integral_gain=factor * drive.integral_gain,
    )


def _shifted_errors(joint: Joint, shift: float) -> Joint:
    errors = (replace(sine, phase=sine.phase + shift) for sine in joint.kinematic_error)
    return replace(joint, kinematic_error=tuple(errors))


def _centre(k: int) -> ParameterKind:
    """Return the kind of a coordinate of a body's centre of mass."""

    def write(body: Body, value: float) -> Body:
        return replace(body, com=(*body.com[:k], value, *body.com[k + 1 :]))

    return ParameterKind(
        "m",
        lambda body: float(body.com[k]),
        write,
        motion=MotionTerm("payload", "payload", size=lambda _: 0.1, is_needed=True, is_signed=True),
        in_file=lambda body: {"com": list(body.com)},
    )


# By what stands in a parameter's name behind its joint, its tilt or the payload.
PARAMETER_KINDS = {
    "stiffness": field_kind(
        "stiffness",
        "N m/rad",
        acts=_without_table,
        at_rest=True,
        inverse=True,
        # What a data sheet or a static identification is known to.
        prior=0.1,
        motion=MotionTerm("stiffness", "gear", is_needed=True, prior=_DATA_SHEET),
        variation=Variation("stiffness", replays=(1.02, 0.98), above_zero=True),
        usual={
            "joint.stiffness": _STIFFNESS,
            "joint.stiffness_range": _STIFFNESS,
            "joint.tilt.stiffness": UsualRange(
                1e3, 1e9, "N m/rad", "bearings and links, from small arms to the heaviest robots"
            ),
        },
    ),
    "damping": field_kind(
        "damping",
        "N m s/rad",
        prior=0.3,
        variation=Variation("damping", replays=(0.8,)),
        usual={"joint.damping": _DAMPING, "joint.tilt.damping": _DAMPING},
    ),
    "backlash": field_kind(
        "backlash",
        "rad",
        acts=lambda part, curve: curve.has_backlash and _without_table(part, curve),
        at_rest=True,
        prior=0.3,
        motion=MotionTerm("backlash", "gear", vanishes=True, most=3.0, prior=_BACKLASH),
        variation=Variation("backlash", replays=(1.2, 0.8)),
        usual={
            "joint.backlash": UsualRange(
                1e-6, 3e-3, "rad", "half a backlash of up to 20 arc minutes", or_none=True
            )
        },
    ),
    # The torque at which all elements of a gear slip; they keep their shares of it.
    "hysteresis": entries_kind(
        "hysteresis",
        "slip_torque",
        "N m",
        sum,
        least=1e-9,
        at_rest=True,
        prior=0.3,
        motion=MotionTerm("hysteresis", "gear"),
        variation=Variation("hysteresis", replays=(1.3, 0.7), place="gears"),
        usual={
            "joint.gear.hysteresis.slip_torque": UsualRange(
                1e-3, 1e4, "N m", "friction in gears, from small arms to the heaviest robots", True
            )
        },
    ),
    # The largest slip angle of a gear's elements, to which the others are in proportion.
    "slip_angle": entries_kind(
        "hysteresis",
        "slip_angle",
        "rad",
        max,
        at_rest=True,
        usual={
            "joint.gear.hysteresis.slip_angle": UsualRange(
                1e-7, 3e-3, "rad", "up to the width of a loop of 10 arc minutes"
            )
        },
    ),
    "balancer": ParameterKind(
        "of the start's",
        lambda part: float(getattr(part, "balancer", None) is not None),
        _scaled_balancer,
        motion=MotionTerm("balancer", "balancer"),
        usual={
            "joint.balancer.torque_table.torque": UsualRange(
                20.0, 2e5, "N m", "balancers, from medium arms to the heaviest robots"
            ),
            "joint.balancer.gas_spring.pressure_Pa": UsualRange(1e5, 1e8, "Pa", "gas springs"),
        },
        scaled_in_file=("balancer.gas_spring.pressure_Pa", "balancer.torque_table"),
    ),
    # Friction of a motor at rest; it falls by a third as the motor gets warm.
    "friction": drive_field_kind(
        "friction",
        "N m",
        prior=0.3,
        variation=Variation(
            "friction",
            replays=(1.3, 0.7),
            also=("drive.friction.viscous_Nm_s",),
            place="motors",
        ),
        usual={"joint.drive.friction.stiction_Nm": _FRICTION},
        scaled_in_file=("drive.friction.coulomb_Nm", "drive.friction.stiction_Nm"),
    ),
    "drive.friction.coulomb_Nm": drive_kind(
        "N m",
        lambda drive: dry_friction(drive)[0],
        lambda drive, value: _with_dry(drive, value, dry_friction(drive)[1]),
        motion=MotionTerm("friction", "motor", size=_dry_size),
        usual={"joint.drive.friction.coulomb_Nm": _FRICTION},
        in_file=_coulomb,
    ),
    "drive.friction.more_at_rest": drive_kind(
        "N m",
        lambda drive: dry_friction(drive)[1],
        lambda drive, value: _with_dry(drive, dry_friction(drive)[0], value),
        motion=MotionTerm("Stribeck", "motor", size=_dry_size),
        in_file=_stiction,
    ),
    "drive.friction.viscous_Nm_s": drive_field_kind(
        "viscous",
        "N m s/rad",
        motion=MotionTerm(
            "viscous friction", "motor", size=lambda joint: max(joint.drive.viscous, 1.0)
        ),
        usual={
            "joint.drive.friction.viscous_Nm_s": UsualRange(
                1e-3, 1e5, "N m s/rad", "motors and gears, at the gears' output", or_none=True
            )
        },
        in_file=lambda joint: {"drive.friction.viscous_Nm_s": joint.drive.viscous},
    ),
    "drive.inertia": drive_field_kind(
        "inertia",
        "kg m^2",
        least=1e-9,
        motion=MotionTerm("rotor", "motor", is_needed=True, prior=_DATA_SHEET),
        usual={
            "joint.drive.rotor_inertia_kg_m2": UsualRange(
                1e-7, 1.0, "kg m2", "rotors of servo motors"
            )
        },
        scaled_in_file=("drive.rotor_inertia_kg_m2",),
    ),
    "drive.load_friction": drive_field_kind(
        "load_friction",
        "1",
        most=0.99,
        motion=MotionTerm("load friction", "motor"),
        in_file=lambda joint: {"gear.efficiency": 1.0 / (1.0 + joint.drive.load_friction)},
    ),
    "drive.servo.gains": drive_kind(
        "of the start's",
        lambda _: 1.0,
        _scaled_gains,
        variation=Variation("servo_gain", replays=(1.2, 0.8), above_zero=True, place="motors"),
    ),
    # The largest amplitude of its sines, to which the others are in proportion.
    "gear.kinematic_error.amplitude": entries_kind(
        "kinematic_error",
        "amplitude",
        "rad",
        max,
        variation=Variation("kinematic_error", place="gears"),
        usual={
            "joint.gear.kinematic_error.amplitude": UsualRange(
                1e-7, 1e-3, "rad", "sines of up to 3 arc minutes, as of toothed belts"
            )
        },
    ),
    "gear.kinematic_error.phase": ParameterKind(
        "rad from the start's",
        lambda _: 0.0,
        _shifted_errors,
        acts=lambda part, curve: bool(getattr(part, "kinematic_error", ())),
        # The mean square of what a sine does more with any phase is that of one a quarter turn on.
        variation=Variation(
            "kinematic_error_phase",
            replays=(0.5 * np.pi,),
            words="kinematic error's phase",
            replay_words="kinematic error, phase unknown",
            is_shift=True,
            place="gears",
        ),
        usual={"joint.gear.kinematic_error.phase": _RADIANS},
    ),
    "mass": field_kind(
        "mass", "kg", least=1e-6, motion=MotionTerm("payload", "payload", is_needed=True)
    ),
    **{f"com.{axis}": _centre(k) for k, axis in enumerate("xyz")},
}

# The kinds in which robots differ from their description, by the names of the variations.
VARIED = {
    kind.variation.name: (key, kind.variation)
    for key, kind in PARAMETER_KINDS.items()
    if kind.variation is not None
}

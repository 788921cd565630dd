"""Robots with usual values of what their files leave out: backlash, hysteresis, servos and friction.

Backlash and the width of the loop are those of gears of robots in general [Nabtesco].  Motors are the
medians of the nine gears whose drives are published, in the files kuka_kr300 [Weigand2021] and
manutec_r3 [Tuerk1990], over the stiffness of the gear.  docs/references.md lists the sources,
docs/study.md the ranges.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import pi

from coupling.case.case import PlacedRobot
from coupling.case.robots import OneOfDrives
from coupling.files.gear_table import ARCMIN, sheet_elements
from elastic_robot.description import Joint
from elastic_robot.drive import Drive
from elastic_robot.torque_curves import TORQUE_CURVES

# Half of the backlash and width of the loop at no torque [rad]; the former is 0.1 to 0.3 arc minutes in
# all, the latter below 1: middles.
BACKLASH, LOOP_WIDTH = 0.5 * 0.2 * ARCMIN, 0.5 * ARCMIN
# Frequency of a rotor on its gear, k = J (2 pi f)^2 [Hz], and its rate loop, Kp = 2 pi f J [Hz].
ROTOR_FREQUENCY, RATE_BANDWIDTH = 13.8, 57.5
# Gain of the position loop [1/s]; time of the rate loop's integral [s], which one of the two robots has.
POSITION_GAIN, INTEGRAL_TIME = 10.0, 0.05
# Coulomb friction [rad] and viscous friction [s] over the stiffness.
FRICTION, VISCOUS = 2.0e-4, 2.3e-4


def _with_backlash(joint: Joint) -> Joint:
    return joint if joint.backlash else replace(joint, backlash=BACKLASH)


def _with_hysteresis(joint: Joint) -> Joint:
    assert joint.stiffness is not None
    if joint.hysteresis:
        return joint
    return replace(joint, hysteresis=sheet_elements(LOOP_WIDTH, joint.stiffness))


def _with_servo(joint: Joint) -> Joint:
    return joint if joint.drive else replace(joint, drive=usual_drive(joint))


def _with_friction(joint: Joint) -> Joint:
    assert joint.stiffness is not None
    drive = joint.drive or usual_drive(joint)
    if drive.friction or drive.viscous:
        return replace(joint, drive=drive)
    friction, viscous = FRICTION * joint.stiffness, VISCOUS * joint.stiffness
    return replace(joint, drive=replace(drive, friction=friction, viscous=viscous))


def usual_drive(joint: Joint) -> Drive:
    """Return a drive without friction for an elastic joint."""
    assert joint.stiffness is not None
    inertia = joint.stiffness / (2.0 * pi * ROTOR_FREQUENCY) ** 2
    rate_gain = 2.0 * pi * RATE_BANDWIDTH * inertia
    return Drive(inertia, POSITION_GAIN, rate_gain, rate_gain / INTEGRAL_TIME)


@dataclass(frozen=True)
class UsualValue:
    """Something that a robot has and that its file, or the case, may leave out.

    Attributes:
        name: Its usual value, in words.
        complete: Function that returns an elastic joint with it, where it has none.
        backlash: Whether its torque curve must have a backlash.
        drive: Drive that it needs; None: that of the case.
    """

    name: str
    complete: Callable[[Joint], Joint]
    backlash: bool = False
    drive: OneOfDrives | None = None

    def completed(self, placed: PlacedRobot) -> PlacedRobot:
        """Return a robot with it."""
        joints = [
            joint if joint.stiffness is None else self.complete(joint)
            for joint in placed.description.joints
        ]
        needs_curve = self.backlash and not TORQUE_CURVES[placed.torque_curve].has_backlash
        return replace(
            placed,
            description=replace(placed.description, joints=tuple(joints)),
            torque_curve="backlash" if needs_curve else placed.torque_curve,
            drive=self.drive or placed.drive,
        )


USUAL_VALUES = (
    UsualValue("backlash of 0.2 arc minutes", _with_backlash, backlash=True),
    UsualValue("hysteresis 0.5 arc minutes wide", _with_hysteresis),
    UsualValue("servos", _with_servo, drive="servo"),
    UsualValue("servos and friction", _with_friction, drive="servo"),
)


def left_out(robots: Sequence[PlacedRobot]) -> tuple[UsualValue, ...]:
    """Return what any of the robots has not.

    Of two that complete the robots alike, as where a file has servos with friction and the case leaves
    both out, the last.
    """
    values: list[UsualValue] = []
    for number, value in enumerate(USUAL_VALUES):
        same = [value.completed(placed) for placed in robots]
        later = USUAL_VALUES[number + 1 :]
        if any(map(_differs, same, robots)) and not any(
            not any(map(_differs, same, [completion.completed(placed) for placed in robots]))
            for completion in later
        ):
            values.append(value)
    return tuple(values)


def _differs(placed: PlacedRobot, other: PlacedRobot) -> bool:
    return (placed.description, placed.torque_curve, placed.drive) != (
        other.description,
        other.torque_curve,
        other.drive,
    )


def completed(
    robots: Sequence[PlacedRobot], values: Sequence[UsualValue]
) -> tuple[PlacedRobot, ...]:
    """Return robots with usual values."""
    whole = []
    for placed in robots:
        for value in values:
            placed = value.completed(placed)
        whole.append(placed)
    return tuple(whole)

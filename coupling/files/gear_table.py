"""[joint.gear] of a robot file: hysteresis by its elements or its data sheet's loop, kinematic error."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Annotated

from pydantic import Field, model_validator

from coupling.errors import locate_errors
from coupling.files.toml_file import Positive, Schema
from elastic_robot.gear_parts import KinematicError, StopElement

ARCMIN = pi / 10800.0  # [rad]
# What the C core holds of a gear (ER_MAX_STOPS and ER_MAX_ERRORS in robot_data.h).
MOST_ELEMENTS = 6
MOST_ERRORS = 8
# The keys of a data sheet, which take the place of elements of hysteresis.
SHEET_KEYS = ("hysteresis_width_arcmin", "lost_motion_arcmin", "rated_torque_Nm")
# Part of the rated torque, to both sides, between which lost motion is measured.
_LOST_MOTION_AT = 0.03
# Slip angles by what the elements add to the width of the loop, and equal slip torques: no data sheet
# tells them, so this is an assumption.  Behind a reversal the loop bends over 1 1/4 of that width.
_SLIP_ANGLES = (1.0 / 12.0, 1.0 / 4.0, 5.0 / 8.0)


class StopElementTable(Schema):
    """An entry of a gear's `hysteresis`."""

    slip_torque: float
    slip_angle: float


class KinematicErrorTable(Schema):
    """An entry of a gear's `kinematic_error`: one sine, by the turns of the part that makes it."""

    amplitude: float
    per_turn_of_joint: Positive | None = None
    per_turn_of_motor: Positive | None = None
    phase: float = 0.0

    @model_validator(mode="after")
    def _one_part(self) -> KinematicErrorTable:
        if (self.per_turn_of_joint is None) == (self.per_turn_of_motor is None):
            got = "neither" if self.per_turn_of_joint is None else "both"
            raise ValueError(f"expected either per_turn_of_joint or per_turn_of_motor, got {got}")
        return self

    def error(self, gear_ratio: float | None) -> KinematicError:
        """Return the sine over the turn of the joint.

        Args:
            gear_ratio: Turns of the motor for one of the joint, or None where the file has none.

        Raises:
            ValueError: If the ratio is needed, or no gear has such an error.

        Example:
            >>> KinematicErrorTable(amplitude=5e-5, per_turn_of_motor=2.0).error(200.0).order
            400.0
        """
        order = self.per_turn_of_joint
        if order is None:
            assert self.per_turn_of_motor is not None
            if gear_ratio is None:
                raise ValueError(
                    "per_turn_of_motor: expected gear_ratio in [joint.drive] beside it, got no drive:"
                    " give one, or per_turn_of_joint"
                )
            order = self.per_turn_of_motor * gear_ratio
        return KinematicError(self.amplitude, order, self.phase)


class GearTable(Schema):
    """[joint.gear]: what a gear has beside stiffness, damping and backlash."""

    hysteresis: Annotated[list[StopElementTable], Field(max_length=MOST_ELEMENTS)] = []
    hysteresis_width_arcmin: Positive | None = None
    lost_motion_arcmin: Positive | None = None
    rated_torque_Nm: Positive | None = None
    kinematic_error: Annotated[list[KinematicErrorTable], Field(max_length=MOST_ERRORS)] = []
    efficiency: Annotated[float, Field(gt=0.5, le=1.0)] | None = None

    @model_validator(mode="after")
    def _one_form(self) -> GearTable:
        sheet = sorted(self.model_fields_set & set(SHEET_KEYS))
        if sheet and "hysteresis" in self.model_fields_set:
            raise ValueError(
                "expected either the elements of hysteresis or the numbers of a data sheet, got"
                f" hysteresis and {sheet[0]}"
            )
        for key in ("hysteresis_width_arcmin", "rated_torque_Nm"):
            if sheet and key not in sheet:
                raise ValueError(f"{key}: expected a number > 0 beside {sheet[0]}, got none")
        return self

    @property
    def from_sheet(self) -> bool:
        """Whether it has the numbers of a data sheet."""
        return self.hysteresis_width_arcmin is not None

    @property
    def load_friction(self) -> float:
        """Friction over the gear's torque, 1 / eta - 1."""
        return 0.0 if self.efficiency is None else 1.0 / self.efficiency - 1.0

    def kinematic_errors(self, gear_ratio: float | None) -> tuple[KinematicError, ...]:
        """Return the sines of the gear's kinematic error; the ratio is None where the file has none."""
        errors = []
        for number, table in enumerate(self.kinematic_error, start=1):
            with locate_errors(f"kinematic_error {number}", ValueError):
                errors.append(table.error(gear_ratio))
        return tuple(errors)

    def hysteresis_of(
        self, stiffness: float, backlash: float
    ) -> tuple[float, tuple[StopElement, ...]]:
        """Return the half width of the backlash [rad] and the elements of the gear.

        Those of a data sheet follow from its loop of torque and wind-up.  With the torque curve S,
        stiffness k outside the backlash +-B, and all elements slipping at F together, the torque T is
        S(e) + F where it rises and S(e) - F where it falls:

            width at T = 0:                            2 F / k + 2 B
            lost motion, between the middles at +-t:   2 t / k + 2 B   if F <= t,   2 t / k   if F > t

        t is 3 % of the rated torque.  Where F > t the gear is on the flank of the other side while the
        torque rises through t, and lost motion does not know the backlash.  F <= t is a lost motion of
        at least the width.

        Args:
            stiffness: Stiffness k of the gear outside its backlash [N m/rad], > 0.
            backlash: Half width of its backlash in the file [rad]; that of the lost motion, where it is
                given, takes its place.

        Raises:
            ValueError: If no gear has such a loop.

        Example:
            >>> table = GearTable(hysteresis_width_arcmin=1.2, rated_torque_Nm=3000.0)
            >>> _, elements = table.hysteresis_of(stiffness=1e6, backlash=0.0)
            >>> [(round(own.slip_torque, 2), round(1e6 * own.slip_angle, 2)) for own in elements]
            [(58.18, 29.09), (58.18, 87.27), (58.18, 218.17)]
        """
        if self.hysteresis_width_arcmin is None or self.rated_torque_Nm is None:
            return backlash, tuple(_elements(self.hysteresis))
        if stiffness <= 0.0:
            raise ValueError(f"expected a stiffness > 0 [N m/rad] beside it, got {stiffness!r}")
        width, rated = self.hysteresis_width_arcmin, self.rated_torque_Nm
        if self.lost_motion_arcmin is not None:
            backlash = self._backlash(self.lost_motion_arcmin, width, rated, stiffness)
        whole = 2.0 * backlash / ARCMIN
        if width <= whole:
            key = "backlash" if self.lost_motion_arcmin is None else "lost_motion_arcmin"
            raise ValueError(
                f"hysteresis_width_arcmin: expected more than {whole:.6g}, the whole backlash by"
                f" {key}, got {width:.6g}"
            )
        hysteresis_width = (width - whole) * ARCMIN
        slip_torque = 0.5 * stiffness * hysteresis_width
        # From the rated torque T to zero the gear turns by (T - 2 F) / k; an element slips after 2 a.
        enough = 2.0 * slip_torque * (1.0 + 2.0 * _SLIP_ANGLES[-1])
        if enough > rated:
            raise ValueError(
                f"rated_torque_Nm: expected at least {enough:.6g}, from which to zero all elements slip,"
                f" {slip_torque:.6g} N m together by hysteresis_width_arcmin = {width:.6g} and stiffness"
                f" = {stiffness:.6g} N m/rad, got {rated:.6g}"
            )
        return backlash, sheet_elements(hysteresis_width, stiffness)

    @staticmethod
    def _backlash(lost: float, width: float, rated: float, stiffness: float) -> float:
        """Return the half width of the backlash by a lost motion [rad]."""
        elastic = 2.0 * _LOST_MOTION_AT * rated / stiffness / ARCMIN
        if lost < elastic:
            raise ValueError(
                f"lost_motion_arcmin: expected at least {elastic:.6g}, by which the gear winds up"
                f" between +-3 % of {rated:.6g} N m with stiffness = {stiffness:.6g} N m/rad, got"
                f" {lost:.6g}"
            )
        if lost < width:
            raise ValueError(
                f"lost_motion_arcmin: expected at least hysteresis_width_arcmin, {width:.6g}, got"
                f" {lost:.6g}: elements that slip at more than 3 % of the rated torque hide the backlash"
                " from the lost motion: leave it out and give backlash"
            )
        return 0.5 * (lost - elastic) * ARCMIN


def sheet_elements(width: float, stiffness: float) -> tuple[StopElement, ...]:
    """Return the elements by which a loop has a width at no load.

    Args:
        stiffness: Stiffness of the gear [N m/rad].
    """
    each = 0.5 * stiffness * width / len(_SLIP_ANGLES)
    return tuple(StopElement(each, part * width) for part in _SLIP_ANGLES)


def errors_in_words(errors: Sequence[KinematicError]) -> str:
    """Return the sines of a gear's kinematic error."""
    return ", ".join(f"{e.amplitude:.4g} rad {e.order:.6g} times a turn" for e in errors)


def _elements(tables: list[StopElementTable]) -> list[StopElement]:
    elements = []
    for number, table in enumerate(tables, start=1):
        with locate_errors(f"hysteresis {number}", ValueError):
            elements.append(StopElement(table.slip_torque, table.slip_angle))
    return elements

"""Tables of the case file for robots that are not the model: [plant], and [study] of many."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from coupling.case.robots import (
    OneOfCurves,
    OneOfDrives,
    described,
    drive_of,
    resolved_description,
)
from coupling.errors import CaseError
from coupling.files.toml_file import Positive, Schema, Vector3
from coupling.robot.mismatch import FACTORS, ModelMismatch, Plant, PlantRobot
from coupling.robot.mounting import Mounting
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import IDEAL

NotNegative = Annotated[float, Field(ge=0.0)]


def _as_list(value: object) -> object:
    """Return a number as a list of one."""
    return value if isinstance(value, list) else [value]


# One factor for all joints, or one for each.
_Several = Annotated[list[NotNegative], Field(min_length=1)]
_SeveralPositive = Annotated[list[Positive], Field(min_length=1)]
_SeveralAngles = Annotated[list[float], Field(min_length=1)]
Factors = Annotated[
    _Several, BeforeValidator(_as_list, json_schema_input_type=NotNegative | _Several)
]
PositiveFactors = Annotated[
    _SeveralPositive, BeforeValidator(_as_list, json_schema_input_type=Positive | _SeveralPositive)
]
Angles = Annotated[
    _SeveralAngles, BeforeValidator(_as_list, json_schema_input_type=float | _SeveralAngles)
]


class _PlantRobotTable(Schema):
    """One robot of the plant: another description or curve, servos, factors, a mass at its tool."""

    description: str | None = None
    torque_curve: OneOfCurves | None = None
    drive: OneOfDrives | None = None
    stiffness_factor: PositiveFactors = [1.0]
    damping_factor: Factors = [1.0]
    backlash_factor: Factors = [1.0]
    hysteresis_factor: Factors = [1.0]
    friction_factor: Factors = [1.0]
    servo_gain_factor: PositiveFactors = [1.0]
    kinematic_error_factor: Factors = [1.0]
    kinematic_error_phase_deg: Angles = [0.0]
    payload_kg: NotNegative = 0.0
    payload_position_m: Vector3 | None = None

    def robot(
        self,
        model: Robot,
        torque_curve: str,
        drive: OneOfDrives,
        mounting: Mounting,
        folder: Path,
    ) -> PlantRobot:
        """Return the robot that moves in place of a model.

        Args:
            model: The model, as it stands.
            drive: Motion of its drives; as those of another description do unless that is given.
            mounting: Mounting of the robot and of the plant's.
            folder: Folder in which relative files begin.

        Raises:
            CaseError: If its file cannot be read or has no motors for servos, or joints or factors are
                not as many as the model's.
        """
        robot = model
        own_drive = self.drive or (drive if self.description is None else None)
        if self.description is not None:
            robot = mounting.of(described(self.description, folder))
        if len(robot.joints) != len(model.joints):
            raise CaseError(
                f"description: expected a robot of {len(model.joints)} joints, as the model that is"
                f" commanded, got {len(robot.joints)}"
            )
        moved = drive_of(robot, own_drive)
        place = self.payload_position_m
        difference = ModelMismatch(
            tuple(self.stiffness_factor),
            tuple(self.damping_factor),
            tuple(self.backlash_factor),
            tuple(self.hysteresis_factor),
            tuple(self.friction_factor),
            tuple(self.servo_gain_factor),
            tuple(self.kinematic_error_factor),
            tuple(np.deg2rad(self.kinematic_error_phase_deg).tolist()),
            self.payload_kg,
            None if place is None else tuple(place),
        )
        curve = self.torque_curve or torque_curve
        keys = {name: f"{name}_factor" for name in FACTORS}
        for name, key in {**keys, "kinematic_error_phase": "kinematic_error_phase_deg"}.items():
            count = len(getattr(difference, name))
            if count not in (1, len(robot.joints)):
                raise CaseError(
                    f"{key}: expected one number, or {len(robot.joints)}, one for each joint,"
                    f" got {count}"
                )
        for name in ("friction", "servo_gain"):
            if moved == IDEAL and set(getattr(difference, name)) != {1.0}:
                raise CaseError(
                    f'{name}_factor: expected drive = "servo" beside it, got "{moved}", which has none'
                )
        try:
            described_so = difference.description(robot)
        except ValueError as cause:  # kinematic errors that no gear has
            raise CaseError(f"kinematic_error_factor: {cause}") from cause
        return PlantRobot(described_so, curve, difference, moved)

    def resolved(self, folder: Path) -> dict[str, Any]:
        """Return the table with a file of the user's as an absolute path."""
        found = self.model_dump(exclude_none=True, mode="json")
        if self.description is not None:
            found["description"] = resolved_description(self.description, folder)
        return found


class PlantTable(_PlantRobotTable):
    """[plant]: the robot that really moves in place of [robot]; [plant.support], in place of [support].

    Attributes:
        force_factor: Factor of the process's whole wrench, on all tools.
        couple: Whether the process is evaluated on the path that the plant takes.
        support: The supporting robot; as its model unless given.
    """

    force_factor: NotNegative = 1.0
    couple: bool = False
    support: _PlantRobotTable | None = None

    def plant(
        self, models: Sequence[tuple[Robot, str, OneOfDrives, Mounting]], folder: Path
    ) -> Plant:
        """Return the plant.

        Args:
            models: Description, torque curve, drive and mounting of each of the case's robots.
            folder: Folder in which relative files begin.

        Raises:
            CaseError: If a robot cannot be read or does not fit, or there is no second one.
        """
        tables = [self, self.support or _PlantRobotTable()]
        if self.support is not None and len(models) < 2:
            raise CaseError("support: expected none, as the case has no [support], got a table")
        robots = []
        for name, table, model in zip(("", "support: "), tables, models, strict=False):
            try:
                robots.append(table.robot(*model, folder))
            except CaseError as cause:
                raise CaseError(f"{name}{cause}") from cause
        return Plant(tuple(robots), self.force_factor, self.couple)

    def resolved(self, folder: Path) -> dict[str, Any]:
        """Return the tables with files of the user's as absolute paths."""
        found = super().resolved(folder)
        if self.support is not None:
            found["support"] = self.support.resolved(folder)
        return found


# Standard deviations beyond which a normal distribution is cut off.
CUT_OFF = 3.0


class Distribution(Schema):
    """Distribution of an uncertain parameter: uniform from low to high, or normal about a mean.

    The normal one is cut off at three standard deviations.
    """

    low: float | None = None
    high: float | None = None
    mean: float | None = None
    deviation: Positive | None = None

    @model_validator(mode="after")
    def _is_one(self) -> Distribution:
        uniform, normal = (self.low, self.high), (self.mean, self.deviation)
        if (None in uniform) == (None in normal) or any(
            value is not None for value in (normal if None in normal else uniform)
        ):
            raise ValueError("expected [low, high] or { mean = .., deviation = .. }, got neither")
        if self.low is not None and self.high is not None and not self.low < self.high:
            raise ValueError(f"expected [low, high], low < high, got [{self.low}, {self.high}]")
        return self

    @property
    def least(self) -> float:
        """Lowest value."""
        if self.low is not None:
            return self.low
        assert self.mean is not None
        assert self.deviation is not None
        return self.mean - CUT_OFF * self.deviation


def _as_spread(value: object) -> object:
    """Return [low, high] as the table that it is short for."""
    if isinstance(value, list) and len(value) == 2:
        return {"low": value[0], "high": value[1]}
    if isinstance(value, dict | Distribution):
        return value
    raise ValueError(f"expected [low, high] or {{ mean = .., deviation = .. }}, got {value!r}")


_Range = Annotated[list[float], Field(min_length=2, max_length=2)]
Uncertain = Annotated[
    Distribution | None, BeforeValidator(_as_spread, json_schema_input_type=_Range | Distribution)
]


class StudyTable(Schema):
    """[study]: uncertain parameters, [low, high] or { mean, deviation } each, and how to sample them.

    Attributes:
        samples, seed, design: Number of sampled robots, seed and kind of their design.
        coverage: Share of further robots that the band is to hold.
        joints: "alike": one factor for all joints; "each": one for each joint, independent.
        stiffness_factor, damping_factor, backlash_factor: Factors of the robots' gears and tilts.
        hysteresis_factor: Factor of the slip torques of the gears that have elements.
        friction_factor: Factor of the friction of motors, at rest and viscous.
        servo_gain_factor: Factor of the gains of their servos.
        kinematic_error_factor: Factor of the amplitudes of gears' kinematic errors.
        kinematic_error_phase_deg: Shifts of the phases of their sines.
        force_factor: Factor of the process's whole wrench.
        payload_kg: Mass that the tool of the first robot carries in addition.
        payload_position_m: Its place in the last body's frame; the TCP unless given.
    """

    samples: Annotated[int, Field(ge=1, le=100_000)] = 200
    seed: Annotated[int, Field(ge=0)] = 1
    design: Literal["sobol", "latin-hypercube"] = "sobol"
    coverage: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.9
    joints: Literal["alike", "each"] = "alike"
    stiffness_factor: Uncertain = None
    damping_factor: Uncertain = None
    backlash_factor: Uncertain = None
    hysteresis_factor: Uncertain = None
    friction_factor: Uncertain = None
    servo_gain_factor: Uncertain = None
    kinematic_error_factor: Uncertain = None
    kinematic_error_phase_deg: Uncertain = None
    force_factor: Uncertain = None
    payload_kg: Uncertain = None
    payload_position_m: Vector3 | None = None

    @model_validator(mode="after")
    def _are_possible(self) -> StudyTable:
        for name, spread in self.spreads().items():
            if name in ("stiffness_factor", "servo_gain_factor") and spread.least <= 0.0:
                raise ValueError(f"{name}: expected values > 0, got {spread.least:.6g}")
            if spread.least < 0.0 and name != PHASE:
                raise ValueError(f"{name}: expected values >= 0, got {spread.least:.6g}")
        return self

    def spreads(self) -> dict[str, Distribution]:
        """Return the uncertain parameters, by key: as given, or the defaults where none is."""
        given = {name: getattr(self, name) for name in SPREADS}
        found = {name: spread for name, spread in given.items() if spread is not None}
        return found or dict(DEFAULT_SPREADS)


PHASE = "kinematic_error_phase_deg"
SPREADS = (*(f"{name}_factor" for name in FACTORS), PHASE, "force_factor", "payload_kg")
DEFAULT_SPREADS = {
    "stiffness_factor": Distribution(low=0.98, high=1.02),
    "damping_factor": Distribution(low=0.8, high=1.2),
    "backlash_factor": Distribution(low=0.8, high=1.2),
    "hysteresis_factor": Distribution(low=0.7, high=1.3),
    "friction_factor": Distribution(low=0.7, high=1.3),
    "servo_gain_factor": Distribution(low=0.8, high=1.2),
    "kinematic_error_factor": Distribution(low=0.7, high=1.3),
    "kinematic_error_phase_deg": Distribution(low=-180.0, high=180.0),
    "force_factor": Distribution(low=0.95, high=1.05),
}

"""Tables of the case file for robots that are not the model: [plant], and [study] of many."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, create_model, model_validator

from coupling.case.robots import (
    OneOfCurves,
    OneOfDrives,
    drive_of,
    read_described_robot,
    resolved_description,
)
from coupling.errors import CaseError
from coupling.files.toml_file import Positive, Schema, Vector3
from coupling.robot.differences import Plant, PlantRobot, RobotDifference
from coupling.robot.mounting import Mounting
from coupling.robot.parameter_kind import Variation
from coupling.robot.parameter_table import PARAMETER_KINDS, VARIED
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import IDEAL

NotNegative = Annotated[float, Field(ge=0.0)]


def _as_list(value: object) -> object:
    return value if isinstance(value, list) else [value]


def _amounts(variation: Variation) -> Any:
    """Return the type of one factor or shift for all joints, or one for each, as a list."""
    bounded: Any = Positive if variation.above_zero else NotNegative
    number: Any = float if variation.is_shift else bounded
    numbers: Any = Annotated[list.__class_getitem__(number), Field(min_length=1)]
    return Annotated[numbers, BeforeValidator(_as_list, json_schema_input_type=number | numbers)]


class _DifferingRobot(Schema):
    """Another description or curve, and servos."""

    description: str | None = None
    torque_curve: OneOfCurves | None = None
    drive: OneOfDrives | None = None


if TYPE_CHECKING:
    _DifferingParameters = _DifferingRobot
else:
    _DifferingParameters = create_model(
        "_DifferingParameters",
        __base__=_DifferingRobot,
        **{kind.key: (_amounts(kind), [kind.neutral]) for _, kind in VARIED.values()},
    )


class _PlantRobotTable(_DifferingParameters):
    """One robot of the plant: another description or curve, servos, factors, a mass at its tool."""

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
            drive: Motion of its drives; as those of another description do unless that is given.

        Raises:
            CaseError: If its file cannot be read or has no motors for servos, or joints or factors are
                not as many as the model's.
        """
        robot = model
        requested = self.drive or (drive if self.description is None else None)
        if self.description is not None:
            robot = mounting.of(read_described_robot(self.description, folder))
        if len(robot.joints) != len(model.joints):
            raise CaseError(
                f"description: expected a robot of {len(model.joints)} joints, as the model that is"
                f" commanded, got {len(robot.joints)}"
            )
        moved_by = drive_of(robot, requested)
        amounts = {}
        for name, (kind, variation) in VARIED.items():
            amounts[name] = tuple(
                variation.unit * amount for amount in getattr(self, variation.key)
            )
            count, is_neutral = len(amounts[name]), set(amounts[name]) == {variation.neutral}
            if count not in (1, len(robot.joints)):
                raise CaseError(
                    f"{variation.key}: expected one number, or {len(robot.joints)}, one for each joint,"
                    f" got {count}"
                )
            if moved_by == IDEAL and PARAMETER_KINDS[kind].of_motor and not is_neutral:
                raise CaseError(
                    f'{variation.key}: expected drive = "servo" beside it, got "{moved_by}", which has'
                    " none"
                )
        position = self.payload_position_m
        place = None if position is None else tuple(position)
        difference = RobotDifference(amounts, self.payload_kg, place)
        plant = PlantRobot(robot, self.torque_curve or torque_curve, difference, moved_by)
        try:
            plant.robot  # noqa: B018  (numbers that no robot has are refused)
        except ValueError as cause:
            key = "kinematic_error_factor: " if "kinematic_error" in str(cause) else ""
            raise CaseError(f"{key}{cause}") from cause
        return plant

    def resolved(self, folder: Path) -> dict[str, Any]:
        """Return the table with a file of the user's as an absolute path."""
        table = self.model_dump(exclude_none=True, mode="json")
        if self.description is not None:
            table["description"] = resolved_description(self.description, folder)
        return table


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
        table = super().resolved(folder)
        if self.support is not None:
            table["support"] = self.support.resolved(folder)
        return table


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


class _Sampling(Schema):
    """How to sample uncertain parameters."""

    samples: Annotated[int, Field(ge=1, le=100_000)] = 200
    seed: Annotated[int, Field(ge=0)] = 1
    design: Literal["sobol", "latin-hypercube"] = "sobol"
    coverage: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.9
    joints: Literal["alike", "each"] = "alike"


if TYPE_CHECKING:
    _UncertainParameters = _Sampling
else:
    _UncertainParameters = create_model(
        "_UncertainParameters",
        __base__=_Sampling,
        **{kind.key: (Uncertain, None) for _, kind in VARIED.values()},
    )


class StudyTable(_UncertainParameters):
    """[study]: uncertain parameters, [low, high] or { mean, deviation } each, and how to sample them.

    Attributes:
        samples, seed, design: Number of sampled robots, seed and kind of their design.
        coverage: Share of further robots that the band is to hold.
        joints: "alike": one factor for all joints; "each": one for each joint, independent.
        force_factor: Factor of the process's whole wrench.
        payload_kg: Mass that the tool of the first robot carries in addition.
        payload_position_m: Its place in the last body's frame; the TCP unless given.

    Those of `VARIED`, as stiffness_factor, are factors of the robots' parameters, and shifts of them.
    """

    force_factor: Uncertain = None
    payload_kg: Uncertain = None
    payload_position_m: Vector3 | None = None

    @model_validator(mode="after")
    def _are_possible(self) -> StudyTable:
        above_zero = [kind.key for _, kind in VARIED.values() if kind.above_zero]
        shifts = [kind.key for _, kind in VARIED.values() if kind.is_shift]
        for name, spread in self.spreads().items():
            if name in above_zero and spread.least <= 0.0:
                raise ValueError(f"{name}: expected values > 0, got {spread.least:.6g}")
            if spread.least < 0.0 and name not in shifts:
                raise ValueError(f"{name}: expected values >= 0, got {spread.least:.6g}")
        return self

    def spreads(self) -> dict[str, Distribution]:
        """Return the parameters that are varied on purpose, by key; none: as they are expected."""
        keys = (*(kind.key for _, kind in VARIED.values()), "force_factor", "payload_kg")
        return {key: getattr(self, key) for key in keys if getattr(self, key) is not None}

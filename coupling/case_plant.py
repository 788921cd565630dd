"""Tables of the case file for robots that are not the model: [plant], and [study] of many."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from coupling.case_tables import OneOfCurves, described, resolved_description
from coupling.errors import CaseError
from coupling.files.toml_file import Positive, Schema, Vector3
from coupling.robot.difference import Difference, Plant, PlantRobot
from elastic_robot.description import Robot

NotNegative = Annotated[float, Field(ge=0.0)]


def _as_list(value: object) -> object:
    """Return a number as a list of one."""
    return value if isinstance(value, list) else [value]


# One factor for all joints, or one for each.
Factors = Annotated[list[NotNegative], BeforeValidator(_as_list), Field(min_length=1)]
PositiveFactors = Annotated[list[Positive], BeforeValidator(_as_list), Field(min_length=1)]


class _PlantRobotTable(Schema):
    """How one robot really is: another description or curve, factors, a mass at its tool."""

    description: str | None = None
    torque_curve: OneOfCurves | None = None
    stiffness_factor: PositiveFactors = [1.0]
    damping_factor: Factors = [1.0]
    backlash_factor: Factors = [1.0]
    payload_kg: NotNegative = 0.0
    payload_position_m: Vector3 | None = None

    def robot(self, model: Robot, torque_curve: str, folder: Path) -> PlantRobot:
        """Return the robot that moves in place of a model.

        Raises:
            CaseError: If its file cannot be read, or joints or factors are not as many as the model's.
        """
        robot = model if self.description is None else described(self.description, folder)
        if len(robot.joints) != len(model.joints):
            raise CaseError(
                f"description: expected a robot of {len(model.joints)} joints, as the model that is"
                f" commanded, got {len(robot.joints)}"
            )
        place = self.payload_position_m
        difference = Difference(
            tuple(self.stiffness_factor),
            tuple(self.damping_factor),
            tuple(self.backlash_factor),
            self.payload_kg,
            None if place is None else tuple(place),
        )
        curve = self.torque_curve or torque_curve
        for name in ("stiffness", "damping", "backlash"):
            count = len(getattr(difference, name))
            if count not in (1, len(robot.joints)):
                raise CaseError(
                    f"{name}_factor: expected one number, or {len(robot.joints)}, one for each joint,"
                    f" got {count}"
                )
        return PlantRobot(difference.description(robot), curve, difference)

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

    def plant(self, models: Sequence[tuple[Robot, str]], folder: Path) -> Plant:
        """Return the plant.

        Args:
            models: Description and torque curve of each of the case's robots.
            folder: Folder in which relative files begin.

        Raises:
            CaseError: If a robot cannot be read or does not fit, or there is no second one.
        """
        tables = [self, self.support or _PlantRobotTable()]
        if self.support is not None and len(models) < 2:
            raise CaseError("support: expected none, as the case has no [support], got a table")
        robots = []
        for name, table, (model, curve) in zip(("", "support: "), tables, models, strict=False):
            try:
                robots.append(table.robot(model, curve, folder))
            except CaseError as cause:
                raise CaseError(f"{name}{cause}") from cause
        return Plant(tuple(robots), self.force_factor, self.couple)

    def resolved(self, folder: Path) -> dict[str, Any]:
        """Return the tables with files of the user's as absolute paths."""
        found = super().resolved(folder)
        if self.support is not None:
            found["support"] = self.support.resolved(folder)
        return found


class NormalTable(Schema):
    """A normal distribution, cut off at three standard deviations."""

    mean: float
    deviation: Positive


Range = Annotated[list[float], Field(min_length=2, max_length=2)]
Spread = Range | NormalTable


class StudyTable(Schema):
    """[study]: uncertain parameters, [low, high] or { mean, deviation } each, and how to sample them.

    Attributes:
        samples, seed, design: Number of sampled robots, seed and kind of their design.
        coverage: Share of further robots that the band is to hold.
        joints: "alike": one factor for all joints; "each": one for each joint, independent.
        stiffness_factor, damping_factor, backlash_factor: Of the robots' gears and tilts.
        force_factor: Of the process's whole wrench.
        payload_kg: Mass that the tool of the first robot carries in addition.
        payload_position_m: Its place in the last body's frame; the TCP unless given.
    """

    samples: Annotated[int, Field(ge=1, le=100_000)] = 200
    seed: Annotated[int, Field(ge=0)] = 1
    design: Literal["sobol", "latin-hypercube"] = "sobol"
    coverage: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.9
    joints: Literal["alike", "each"] = "alike"
    stiffness_factor: Spread | None = None
    damping_factor: Spread | None = None
    backlash_factor: Spread | None = None
    force_factor: Spread | None = None
    payload_kg: Spread | None = None
    payload_position_m: Vector3 | None = None

    @model_validator(mode="before")
    @classmethod
    def _spreads(cls, data: Any) -> Any:
        """Refuse what is no spread with one sentence, where a union would give two."""
        for name in SPREADS:
            value = data.get(name) if isinstance(data, dict) else None
            if value is None or isinstance(value, NormalTable):
                continue
            _require_spread(name, value)
        return data

    def spreads(self) -> dict[str, list[float] | NormalTable]:
        """Return what is uncertain, by key: as given, or the defaults where nothing is."""
        given = {name: getattr(self, name) for name in SPREADS}
        found = {name: spread for name, spread in given.items() if spread is not None}
        return found or dict(DEFAULT_SPREADS)


SPREADS = ("stiffness_factor", "damping_factor", "backlash_factor", "force_factor", "payload_kg")
DEFAULT_SPREADS: dict[str, list[float] | NormalTable] = {
    "stiffness_factor": [0.98, 1.02],
    "damping_factor": [0.8, 1.2],
    "backlash_factor": [0.8, 1.2],
    "force_factor": [0.95, 1.05],
}


def _require_spread(name: str, value: object) -> None:
    """Raise a ValueError unless a value is a spread whose least value is possible."""
    if isinstance(value, dict):
        table = NormalTable.model_validate(value)
        low = table.mean - CUT_OFF * table.deviation
        shown = f"{low:.6g} at three standard deviations below the mean"
    else:
        ends = value if isinstance(value, list) else []
        if len(ends) != 2 or not all(type(end) in (int, float) for end in ends):
            raise ValueError(
                f"{name}: expected [low, high] or {{ mean = .., deviation = .. }}, got {value!r}"
            )
        low, high = ends
        if not low < high:
            raise ValueError(f"{name}: expected [low, high], low < high, got {value!r}")
        shown = f"{low:.6g}"
    if low < 0.0 or (name == "stiffness_factor" and low == 0.0):
        bound = "> 0" if name == "stiffness_factor" else ">= 0"
        raise ValueError(f"{name}: expected values {bound}, got {shown}")


# Standard deviations beyond which a normal distribution is cut off.
CUT_OFF = 3.0

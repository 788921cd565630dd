"""export.json, what exported programs do to the moving robots."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from coupling.path.deviation import Deviation
from coupling.results.base import ResultFile, ResultPart
from coupling.results.drive_result import DriveMotion


class NearestSingularity(ResultPart):
    """The posture of a path that is nearest to a singular one.

    Attributes:
        value: Smallest singular value of the Jacobian, lengths in units of the reach; 0 is singular.
        kind: "wrist", "elbow", "shoulder", or which joint moves most.
    """

    time: float
    value: float
    kind: str


class ExportedFileResult(ResultPart):
    """A file of a program."""

    name: str
    bytes: int


class ExportedProgramResult(ResultPart):
    """The program of one robot, and what its files do.

    Attributes:
        points_on_every_cycle: Number of points that a program with one on every cycle has.
        points_tolerance_m: Smallest tolerance of its points along the command.
        shortest_time_s, median_time_s: Times between two targets.
        loss_m: Largest distance between the tool of the moving robot under the files and under the
            command.
        loss_on_joint_lines_m: The same if the drives go straight from set point to set point; None where
            the controller's motion is a spline through the targets.
        deviation_of_command_m, deviation_of_file_m: Deviation from the desired path under the command,
            and under the files; None where a command came without a desired path.
        counted_as_controller: Whether the robot file says how the controller counts.
    """

    robot: str
    program: str
    files: tuple[ExportedFileResult, ...]
    points: int
    points_on_every_cycle: int
    points_tolerance_m: float
    shortest_time_s: float
    median_time_s: float
    loss_m: float
    loss_on_joint_lines_m: float | None = None
    deviation_of_command_m: Deviation | None
    deviation_of_file_m: Deviation | None
    base: tuple[float, ...] | None
    tool: tuple[float, ...] | None
    counted_as_controller: bool
    nearest_singularity: NearestSingularity
    drives: tuple[DriveMotion, ...]


class ExportResult(ResultFile):
    """Figures of an export; docs/export.md says what they are."""

    what = "the figures of an export"

    language: str
    targets: str
    tolerance_m: float
    robots: Annotated[tuple[ExportedProgramResult, ...], Field(min_length=1)]

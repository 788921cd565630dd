"""export.json, what exported programs do to the moving robots."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from coupling.path.deviation import Deviation
from coupling.results.base import From, ResultFile, ResultPart
from coupling.results.run_result import DriveMotion


class NearestSingularity(ResultPart):
    """The posture of a path that is nearest to a singular one.

    Attributes:
        time: When [s].
        value: Smallest singular value of the Jacobian, lengths in units of the reach; 0 is singular.
        kind: "wrist", "elbow", "shoulder", or which joint moves most.
    """

    time: float
    value: float
    kind: str


class ExportedFileResult(ResultPart):
    """A file of a program."""

    name: str
    bytes: Annotated[int, From("text.__len__")]


class ExportedProgramResult(ResultPart):
    """The program of one robot, and what its files do."""

    robot: str
    program: Annotated[str, From("program.name")]
    files: tuple[ExportedFileResult, ...]
    points: int
    points_on_every_cycle: Annotated[int, From("candidates")]
    points_tolerance_m: float
    shortest_time_s: Annotated[float, From("shortest")]
    median_time_s: Annotated[float, From("median")]
    loss_m: float
    loss_on_joint_lines_m: Annotated[float | None, From("loss_on_joint_lines")]
    deviation_of_command_m: Annotated[Deviation | None, From("command")]
    deviation_of_file_m: Annotated[Deviation | None, From("read_back")]
    base: Annotated[tuple[float, ...] | None, From("program.base")]
    tool: Annotated[tuple[float, ...] | None, From("program.tool")]
    counted_as_controller: Annotated[bool, From("counted")]
    nearest_singularity: Annotated[NearestSingularity, From("nearest")]
    drives: tuple[DriveMotion, ...]


class ExportResult(ResultFile):
    """Figures of an export; docs/export.md says what they are."""

    what = "the figures of an export"

    language: Annotated[str, From("language.name")]
    targets: str
    tolerance_m: float
    robots: Annotated[tuple[ExportedProgramResult, ...], Field(min_length=1)]

"""result.json of a run, of one robot or of a whole cell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, PrivateAttr

from coupling.path.deviation import Deviation, ToolGap, measure_tools, worst_of
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.results.base import ResultFile, ResultPart
from coupling.results.cut_result import CutResult, CutStability, MeanForceAcross
from coupling.results.drive_result import CommandResult
from coupling.results.expected_deviation import ExpectedDeviation
from coupling.results.forecast import RunForecast
from coupling.results.gear_result import BacklashReversal, GearDiagnosis
from coupling.results.iteration_result import CorrectionIteration
from coupling.results.limit_warning import LimitWarning
from coupling.results.outlook import WorstReplay
from coupling.results.repeatability import ForceNoise, Repeatability
from coupling.results.replay import Replay

Kind = Literal["couple", "compensate"]
# What the path under a corrected command is called.
COMPENSATED = "after compensation"
Three = tuple[float, float, float]


def shown_name(stage: str) -> str:
    """Return what a picture calls a stage of a run: a real robot leaves more than its file says.

    Example:
        >>> shown_name("after compensation"), shown_name("with backlash +20 %")
        ('after, if the file is right', 'with backlash +20 %')
    """
    return "after, if the file is right" if stage == COMPENSATED else stage


def three(vector: np.ndarray) -> Three:
    """Return a vector (3,), any unit, as it is stored."""
    x, y, z = vector.tolist()
    return x, y, z


class SharesResult(ResultPart):
    """Deviations by cause; those after compensation are None after a coupling."""

    gravity: Deviation
    process: Deviation
    gravity_after: Deviation | None = None
    process_after: Deviation | None = None
    dynamic_after: Deviation | None


class PlantCouplingResult(ResultPart):
    """How the plant was coupled with its process."""

    converged: bool
    outcome: str
    reason: str
    process_evaluations: int


class PlantReplay(ResultPart):
    """What the command leaves on the plant.

    Attributes:
        differences: Differences from the model, in words.
        wrench: Whether the wrench is the model's, times a factor, or that of plant and process.
        remark: Reason why the process was not evaluated on the plant as it should have been, or empty.
        deviation_m, peak_force_N: Worst figures of all tools.
    """

    differences: tuple[str, ...]
    wrench: Literal["model", "coupled"]
    remark: str
    deviation_m: Deviation
    peak_force_N: float
    coupling: PlantCouplingResult | None
    _path: ToolPath = PrivateAttr()
    _loads: WrenchHistory = PrivateAttr()
    _deviations: tuple[Deviation, ...] = PrivateAttr()

    @classmethod
    def of(
        cls,
        path: ToolPath,
        desired: ToolPath,
        loads: WrenchHistory,
        differences: tuple[str, ...],
        coupling: PlantCouplingResult | None,
        remark: str,
    ) -> PlantReplay:
        """Return what the plant's tools leave, by their paths and the wrenches on them.

        Args:
            differences, coupling, remark: As of the attributes.
        """
        deviations = measure_tools(path, desired)
        replay = cls(
            differences=differences,
            wrench="model" if coupling is None else "coupled",
            remark=remark,
            deviation_m=worst_of(deviations),
            peak_force_N=loads.on(path).peak_force,
            coupling=coupling,
        )
        replay._path, replay._loads, replay._deviations = path, loads, deviations
        return replay

    @property
    def path(self) -> ToolPath:
        """Paths that the plant's tools take, at the same times; not of one that was read."""
        return self._path

    @property
    def loads(self) -> WrenchHistory:
        """Wrenches on the tools; not of one that was read."""
        return self._loads

    def of_tool(self, tool: int | None) -> PlantReplay:
        """Return what is left of one tool, by its number from 0; None: the worst of all."""
        if tool is None:
            return self
        force = self.loads.on(self.path).tools[tool].peak_force
        return self.model_copy(
            update={"deviation_m": self._deviations[tool], "peak_force_N": force}
        )


class GapResult(ResultPart):
    """Gap between two tools [m]."""

    commanded: float
    narrowest_before: float
    widest_before: float
    narrowest_after: float
    widest_after: float

    @classmethod
    def extremes(cls, gap: ToolGap) -> GapResult:
        """Return the extremes of a gap."""
        ends = [gap.commanded + end() for w in (gap.before, gap.after) for end in (w.min, w.max)]
        return cls(**dict(zip(cls.model_fields, (gap.commanded, *ends), strict=True)))


class ToothPassingResult(ResultPart):
    """What a periodic process leaves, slow part and ripple apart."""

    period_s: float
    slow_m: float
    ripple_m: float
    envelope_m: dict[str, tuple[float, float]]


class TouchOffResult(ResultPart):
    """Where the part really is, and how far the robot's own frame of it is off."""

    part_position_m: Three
    part_rpy_deg: Three
    shift_m: Three
    turn_rad: Three
    residual_m: float


Pose = Annotated[tuple[float, ...], Field(min_length=7, max_length=7)]


class ChainResult(ResultPart):
    """A robot as a chain of bodies whose frames are parallel to its base at zero angles, to draw it.

    Attributes:
        base_pose: Its base in the world: x, y, z [m], qx, qy, qz, qw.
        origins_m: Origin of each joint in the body before it.
        tool_pose: The TCP in the last body, as `base_pose`.
    """

    base_pose: Pose
    origins_m: tuple[Three, ...]
    axes: tuple[Three, ...]
    tool_pose: Pose


class RobotResult(ResultPart):
    """A robot of a run: its files, how its drives move, sources of its numbers, links."""

    name: str
    title: str
    description: str
    torque_curve: str
    drive: Literal["ideal", "servo"] = "ideal"
    sources: dict[str, list[str]]
    files: dict[str, str] = {}
    stiffness_range_Nm_rad: tuple[float, float] | None = None
    touch_off: TouchOffResult | None = None
    links_m: Annotated[tuple[Three, ...], Field(min_length=2)]
    chain: ChainResult | None = None


class RunResult(ResultFile):
    """Figures of a run; docs/run_folder.md says what they are."""

    what = "the figures of a run"
    sparse: ClassVar = ("pinch_gap_m", "stability", "cut", "mean_force_across")

    case: str
    kind: Kind
    mode: Literal["dynamic", "quasistatic"]
    converged: bool
    outcome: str
    reason: str
    process_evaluations: int
    repeatability: Repeatability | None = None
    noise: ForceNoise | None = None
    before: Literal["coupled", "one-way"]
    deviation_before_m: Deviation
    deviation_after_m: Deviation
    consistency_m: float
    peak_force_N: float
    shares_m: SharesResult
    robustness: tuple[Replay, ...]
    outlook: WorstReplay | None = None
    stability: CutStability | None = None
    cut: CutResult | None = None
    mean_force_across: MeanForceAcross | None = None
    forecast: RunForecast | None = None
    plant: PlantReplay | None
    backlash_reversals: tuple[BacklashReversal, ...] | None
    gears: tuple[GearDiagnosis, ...]
    command: CommandResult
    pinch_gap_m: GapResult | None = None
    tooth_passing: ToothPassingResult | None
    iterations: tuple[CorrectionIteration, ...]
    warnings: tuple[LimitWarning, ...] = ()
    rate_warnings: tuple[str, ...]
    remarks: tuple[str, ...] = ()
    evaluation_keys: tuple[str, ...]
    fmu_fingerprint: str
    versions: dict[str, str]
    robots: Annotated[tuple[RobotResult, ...], Field(min_length=1)]

    def expected_deviation(self, further: float | None = None) -> ExpectedDeviation | None:
        """Return the deviation to expect on the real robot; None where nothing tells.

        Args:
            further: As of `ExpectedDeviation.among`.
        """
        if self.forecast is not None:
            return ExpectedDeviation(maximum=self.forecast.maximum, is_whole=True)
        if self.outlook is None:
            return None
        return ExpectedDeviation.among(self.outlook.deviation, self.outlook.expected, further)

    @property
    def disturbing_difference(self) -> Repeatability | None:
        """Difference of two answers to one path, where it kept the iteration from its end; else None."""
        repeated = self.repeatability
        if repeated is None or self.converged or not repeated.disturbs:
            return None
        return repeated if repeated.sentence() in self.reason else None

    @property
    def is_stable(self) -> bool:
        """Whether no cut of the run chatters."""
        return self.stability is None or self.stability.stable

    @property
    def gains(self) -> bool:
        """Whether the command is better than the uncorrected one, as `WorstReplay.gains`."""
        return self.outlook is None or self.outlook.gains

    @property
    def touched_off(self) -> bool:
        """Whether the part was touched off."""
        return any(robot.touch_off is not None for robot in self.robots)

    @property
    def stages(self) -> tuple[str, ...]:
        """What to call the actual paths of a run, which has only one if it is coupled only."""
        if self.kind == "couple":
            return ("actual",)
        return ("before compensation", COMPENSATED)

    @property
    def deviations(self) -> Sequence[Deviation]:
        """Deviations by `stages`."""
        return (self.deviation_before_m, self.deviation_after_m)[: len(self.stages)]

    @property
    def reversals(self) -> tuple[BacklashReversal, ...]:
        """Passages of gears through their backlash; none where the method does not know them."""
        return self.backlash_reversals or ()

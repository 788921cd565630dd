"""result.json of a run, of one robot or of a whole cell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from coupling.path.deviation import Deviation, ToolGap
from coupling.results.base import From, ResultFile, ResultPart
from coupling.results.forecast import RunForecast
from coupling.results.outlook import WorstReplay

Kind = Literal["couple", "compensate"]
Three = tuple[float, float, float]


class RepeatabilityResult(ResultPart):
    """Difference of two answers to one path."""

    largest_N: float
    rms_N: float
    peak_N: float


class NoiseResult(ResultPart):
    """Noise of the process's forces."""

    level_N: Annotated[float, From("force")]
    cutoff_Hz: Annotated[float | None, From("filter.cutoff")]
    adaptive: bool
    counts: Annotated[bool, From("significant")]
    sentence: str


class SharesResult(ResultPart):
    """Deviations by cause; those after compensation are None after a coupling."""

    gravity: Deviation
    process: Deviation
    gravity_after: Deviation | None = None
    process_after: Deviation | None = None
    dynamic_after: Annotated[Deviation | None, From("dynamic")]


class ReplayResult(ResultPart):
    """What the command leaves where something differs."""

    name: str
    deviation_m: Deviation


class PlantCouplingResult(ResultPart):
    """How the plant was coupled with its process."""

    converged: bool
    outcome: Annotated[str, From("outcome.value")]
    reason: str
    process_evaluations: Annotated[int, From("evaluations.__len__")]


class PlantResult(ResultPart):
    """What the command leaves on the plant."""

    differences: tuple[str, ...]
    wrench: Literal["model", "coupled"]
    remark: str
    deviation_m: Deviation
    peak_force_N: float
    coupling: PlantCouplingResult | None


class ReversalResult(ResultPart):
    """Passage of a gear through its backlash."""

    robot: str
    joint: int
    begins_s: float
    ends_s: float
    before: int
    after: int


class GearResult(ResultPart):
    """What a gear goes through along a path."""

    sparse: ClassVar = ("robot", "hysteresis_30_percent_m", "swing_Nm")

    robot: str | None = None
    joint: int
    backlash_rad: float
    backlash_reversals: Annotated[int, From("reversals")]
    in_backlash_s: float
    margin_Nm: float
    backlash_20_percent_m: Annotated[float, From("backlash_error")]
    hysteresis_30_percent_m: Annotated[float | None, From("hysteresis_error")] = None
    torque_Nm: float
    torque_time_s: float
    base_tilt_rad: Annotated[float | None, From("base_tilt.angle")]
    base_tilt_direction_rad: Annotated[float | None, From("base_tilt.direction")]
    swing_Nm: float | None = None


class MotorLoad(ResultPart):
    """What a motion asks of the motor of one drive, seen at its gear's output.

    Attributes:
        torque: Largest torque that it needs, to either side [N m].
        torque_time: Instant of it [s].
        limit: Largest torque that it has [N m], or None.
        reversals: Number of times that its friction slips the other way than before.
        presliding: Share of the time in which its friction sticks: at rest, and behind reversals.
    """

    torque: float
    torque_time: float
    limit: float | None
    reversals: int
    presliding: float


class DriveMotion(ResultPart):
    """What a motion asks of one drive, between its rows as well.

    Attributes:
        joint: Number, from 1.
        lowest, highest: Range of the angle [rad].
        lower_limit, upper_limit: Limits of the joint's angle [rad], or None.
        rate: Largest |q'| [rad/s].
        rate_time: Instant of it [s].
        rate_limit: Highest rate that the joint allows [rad/s], or None.
        acceleration: Largest |q''| [rad/s^2].
        acceleration_time: Instant of it [s].
        acceleration_limit: Highest acceleration that joint and controller allow [rad/s^2], or None.
        motor: Demands on the motor; None where there is none, or it was not looked at.
    """

    sparse: ClassVar = ("motor",)

    joint: int
    lowest: float
    highest: float
    lower_limit: float | None
    upper_limit: float | None
    rate: float
    rate_time: float
    rate_limit: float | None
    acceleration: float
    acceleration_time: float
    acceleration_limit: float | None
    motor: MotorLoad | None = None

    @property
    def margin(self) -> float:
        """Smallest distance from the limits of the angle [rad]; negative beyond them, else infinite."""
        below = np.inf if self.lower_limit is None else self.lowest - self.lower_limit
        above = np.inf if self.upper_limit is None else self.upper_limit - self.highest
        return min(below, above)

    @property
    def beyond(self) -> list[str]:
        """Names of what exceeds its limit."""
        rate, most = self.rate_limit, self.acceleration_limit
        exceeded = {
            "angle": self.margin < 0.0,
            "rate": rate is not None and self.rate > rate,
            "acceleration": most is not None and self.acceleration > most,
        }
        return [name for name, is_exceeded in exceeded.items() if is_exceeded]


class DriveResult(ResultPart):
    """What the command asks of a drive."""

    sparse: ClassVar = (
        *("motor_torque_Nm", "motor_torque_time_s", "motor_torque_limit_Nm"),
        *("motor_reversals", "motor_presliding_share"),
    )

    robot: str
    joint: int
    range_rad: tuple[float, float]
    range_limit_rad: tuple[float | None, float | None]
    rate_rad_s: float
    rate_time_s: float
    rate_limit_rad_s: float | None
    acceleration_rad_s2: float
    acceleration_time_s: float
    acceleration_limit_rad_s2: float | None
    motor_torque_Nm: Annotated[float | None, From("motor.torque")] = None
    motor_torque_time_s: Annotated[float | None, From("motor.torque_time")] = None
    motor_torque_limit_Nm: Annotated[float | None, From("motor.limit")] = None
    motor_reversals: Annotated[int | None, From("motor.reversals")] = None
    motor_presliding_share: Annotated[float | None, From("motor.presliding")] = None


class CommandResult(ResultPart):
    """Demands on the drives."""

    rows: int
    drives: tuple[DriveResult, ...]


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


class EvaluationResult(ResultPart):
    """One evaluation of the process; none is before the first, by which its force could change."""

    number: int
    path_change_max_m: Annotated[float, From("path_change")]
    path_change_rms_m: float
    force_change_relative: float | None
    springs_relative: Annotated[float, From("spring_change")]
    peak_force_N: float
    worst_time_s: float


class IterationResult(ResultPart):
    """One iteration of a correction; the steps are of one that corrects sample by sample."""

    sparse: ClassVar = (
        *("largest_correction_step_m", "largest_correction_step_time_s", "rate_limited_samples"),
    )

    number: int
    deviation_m: Deviation
    largest_correction_step_m: Annotated[float | None, From("correction.largest_step")] = None
    largest_correction_step_time_s: Annotated[float | None, From("correction.step_time")] = None
    rate_limited_samples: Annotated[int | None, From("correction.limited_samples")] = None
    evaluations: Annotated[tuple[EvaluationResult, ...], From("coupling")]


class WarningResult(ResultPart):
    """A limit that is passed."""

    name: str
    value: float
    limit: float
    time: float
    joint: int | None
    robot: str
    text: str


class TouchOffResult(ResultPart):
    """Where the part really is, and how far the robot's own frame of it is off."""

    part_position_m: Three
    part_rpy_deg: Three
    shift_m: Three
    turn_rad: Three
    residual_m: float


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


class RunResult(ResultFile):
    """Figures of a run; docs/run_folder.md says what they are."""

    what = "the figures of a run"
    sparse: ClassVar = ("pinch_gap_m",)

    case: str
    kind: Kind
    mode: Literal["dynamic", "quasistatic"]
    converged: bool
    outcome: Annotated[str, From("outcome.value")]
    reason: str
    process_evaluations: Annotated[int, From("evaluations")]
    repeatability: RepeatabilityResult | None = None
    noise: NoiseResult | None = None
    before: Annotated[Literal["coupled", "one-way"], From("before.how")]
    deviation_before_m: Deviation
    deviation_after_m: Deviation
    consistency_m: float
    peak_force_N: float
    shares_m: SharesResult
    robustness: tuple[ReplayResult, ...]
    outlook: WorstReplay | None = None
    forecast: RunForecast | None = None
    plant: PlantResult | None
    backlash_reversals: tuple[ReversalResult, ...] | None
    gears: tuple[GearResult, ...]
    command: CommandResult
    pinch_gap_m: GapResult | None = None
    tooth_passing: ToothPassingResult | None
    iterations: tuple[IterationResult, ...]
    warnings: tuple[WarningResult, ...] = ()
    rate_warnings: tuple[str, ...]
    remarks: tuple[str, ...] = ()
    evaluation_keys: Annotated[tuple[str, ...], From("keys")]
    fmu_fingerprint: str
    versions: dict[str, str]
    robots: Annotated[tuple[RobotResult, ...], Field(min_length=1)]

    @property
    def stages(self) -> tuple[str, ...]:
        """What to call the actual paths of a run, which has only one if it is coupled only."""
        if self.kind == "couple":
            return ("actual",)
        return ("before compensation", "after compensation")

    @property
    def deviations(self) -> Sequence[Deviation]:
        """Deviations by `stages`."""
        return (self.deviation_before_m, self.deviation_after_m)[: len(self.stages)]

    @property
    def reversals(self) -> tuple[ReversalResult, ...]:
        """Passages of gears through their backlash; none where the method does not know them."""
        return self.backlash_reversals or ()

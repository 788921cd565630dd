"""What a gear goes through along a path, and its passages through the backlash."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from coupling.results.base import ResultPart

# What a wrong backlash does not show at the tool [m].
_NO_ERROR = 1e-7


class BacklashReversal(ResultPart):
    """A gear passes through its backlash: a wrong backlash would show here.

    Attributes:
        begins, ends: Time at which it leaves one flank and reaches the next [s].
        before, after: These flanks, -1 or 1; 0 at the ends of a path that begins or ends in the
            backlash.
    """

    robot: str = ""
    joint: int
    begins: Annotated[float, Field(alias="begins_s")]
    ends: Annotated[float, Field(alias="ends_s")]
    before: int
    after: int


class GearDiagnosis(ResultPart):
    """Diagnosis of one gear along a path.

    Attributes:
        backlash: Half width of its backlash [rad].
        in_backlash: Time during which it carries nothing at rest: it is unloaded in its backlash, or
            held there by the elements of its hysteresis [s]; 0 where it has neither.
        margin: By how much its torque stays clear of zero [N m]; negative where it does not, and then
            minus the constant torque (preload) that avoids its reversals.
        backlash_error: Error of the tool at rest behind a backlash reversal if the backlash is 20 %
            off [m]; in motion it is several times as much.
        hysteresis_error: Error of the tool at rest behind a reversal if the slip torques of its
            elements are 30 % off [m]; None where it has none.
        torque: Largest torque that it carries, to either side [N m].
        base_tilt: Angle of the smallest tilt of the base with which gravity avoids its reversals [rad];
            None where it has none, or no tilt does.
        base_tilt_direction: Angle of that tilt's axis in the base's x-y plane, from x [rad].
        swing: Range of its torque over the part's places [N m]; None where it is not placed.
    """

    sparse: ClassVar = ("robot", "hysteresis_30_percent_m", "swing_Nm")

    robot: str | None = None
    joint: int
    backlash: Annotated[float, Field(alias="backlash_rad")]
    reversals: Annotated[int, Field(alias="backlash_reversals")]
    in_backlash: Annotated[float, Field(alias="in_backlash_s")]
    margin: Annotated[float, Field(alias="margin_Nm")]
    backlash_error: Annotated[float, Field(alias="backlash_20_percent_m")]
    hysteresis_error: Annotated[float | None, Field(alias="hysteresis_30_percent_m")] = None
    torque: Annotated[float, Field(alias="torque_Nm")]
    torque_time: Annotated[float, Field(alias="torque_time_s")]
    base_tilt: Annotated[float | None, Field(alias="base_tilt_rad")]
    base_tilt_direction: Annotated[float | None, Field(alias="base_tilt_direction_rad")]
    swing: Annotated[float | None, Field(alias="swing_Nm")] = None

    @property
    def at_risk(self) -> bool:
        """Whether a wrong backlash would show at the tool."""
        return self.backlash_error > _NO_ERROR and (self.reversals > 0 or self.in_backlash > 0.0)

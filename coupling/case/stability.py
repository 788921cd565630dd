"""Table [stability] of the case file: tool and spindle, of which the robot file knows nothing."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from coupling.files.toml_file import FilePath, Schema

# No cutter has longer edges [m].
LONGEST_EDGE = 1.0
# No spindle turns faster [1/min], and no flank that cuts has a wider land [m]: one in mm would damp all.
FASTEST_SPINDLE, _WIDEST_LAND = 1e6, 2e-3


def _rises(ends: list[float]) -> list[float]:
    if not ends[0] < ends[1]:
        raise ValueError(f"expected [lowest, highest], lowest < highest, got {ends}")
    return ends


class ToolModeTable(Schema):
    """[[stability.tool_mode]]: a bending mode of tool, holder and spindle, at the tip.

    Attributes:
        frequency_Hz, damping_ratio, stiffness_N_m: Eigenfrequency, damping ratio and stiffness with the
            spindle's housing held; alike along both axes across the tool's.
    """

    frequency_Hz: Annotated[float, Field(ge=1.0, le=1e6)]
    damping_ratio: Annotated[float, Field(gt=0.0, lt=1.0)]
    stiffness_N_m: Annotated[float, Field(ge=1e3, le=1e15)]


class ProcessDampingTable(Schema):
    """[stability.process_damping]: force of a worn flank on the waves of the surface.

    Attributes:
        indentation_N_m3: Indentation force coefficient of the material.
        wear_land_m: Length of the flank's land.
        friction: Coefficient of friction there.
    """

    indentation_N_m3: Annotated[float, Field(gt=0.0, le=1e16)]
    wear_land_m: Annotated[float, Field(gt=0.0, le=_WIDEST_LAND)]
    friction: Annotated[float, Field(ge=0.0, le=2.0)] = 0.3


class StabilityTable(Schema):
    """[stability]: what vibrates besides the robot, and speeds and depths to look at.

    Attributes:
        spindle_rpm: Range of the spindle; a quarter of the programmed speed to its double.
        max_depth_m: Depth up to which a limit is looked for; four diameters of the cutter.
        tool_mode: Modes of the tool.
        tool_response: Measured responses of the tool in its spindle, `xx` and `yy` across its axis.
        process_damping: Damping by the flank.
    """

    spindle_rpm: (
        Annotated[
            list[Annotated[float, Field(ge=1.0, le=FASTEST_SPINDLE)]],
            Field(min_length=2, max_length=2),
            AfterValidator(_rises),
        ]
        | None
    ) = None
    max_depth_m: Annotated[float, Field(gt=0.0, le=LONGEST_EDGE)] | None = None
    tool_mode: list[ToolModeTable] = []
    tool_response: FilePath | None = None
    process_damping: ProcessDampingTable | None = None

"""modes.json: eigenfrequencies, shapes and compliance of a robot where it works."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from coupling.results.base import ResultFile, ResultPart
from coupling.results.run_result import Three

Matrix = tuple[Three, Three, Three]
# Numbers over a part, row by row; None where the robot cannot be.
Grid = tuple[tuple[float | None, ...], ...]


class ModeResult(ResultPart):
    """A mode that swings."""

    frequency_Hz: float
    damping_ratio: float
    tcp_direction: Three
    energy_by_joint: tuple[float, ...]


class PlaceModesResult(ResultPart):
    """Modes and compliance of a posture, base axes."""

    sparse: ClassVar = ("time_s", "in_contact_m_N")

    time_s: float | None = None
    posture_deg: tuple[float, ...]
    force_N: Three
    unloaded_joints: tuple[int, ...]
    compliance_m_N: Matrix | None
    softest_m_N: float | None
    softest_direction: Three | None
    in_contact_m_N: float | None = None
    dynamic_m_N: float | None
    dynamic_Hz: float
    modes: tuple[ModeResult, ...]


class ResponseResult(ResultPart):
    """Dynamic compliance along an axis of the base."""

    name: str
    frequency_Hz: tuple[float, ...]
    real_m_N: tuple[float, ...]
    imag_m_N: tuple[float, ...]


class PartModesResult(ResultPart):
    """Softest static compliance and lowest mode over the part."""

    x_m: tuple[float, ...]
    y_m: tuple[float, ...]
    softest_m_N: Grid
    lowest_Hz: Grid


class ModesResult(ResultFile):
    """Modes of a robot; docs/modes.md says what they are."""

    what = "the modes of a robot"
    sparse: ClassVar = ("part",)

    name: str
    robot: str
    torque_curve: str
    motors: Literal["locked"] = "locked"
    loads: str
    places: Annotated[tuple[PlaceModesResult, ...], Field(min_length=1)]
    computed: tuple[ResponseResult, ...]
    measured: tuple[ResponseResult, ...] = ()
    part: PartModesResult | None = None
    version: str

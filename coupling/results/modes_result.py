"""modes.json: eigenfrequencies, shapes and compliance of a robot where it works."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from coupling.results.base import ResultFile, ResultPart, Shown
from coupling.results.run_result import ChainResult, Three

# File with the figures, in the folder of the result.
FIGURES = "modes.json"

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


class SwingResult(ResultPart):
    """Mode of a robot that is drawn: amplitude of every joint of its chain, of any scale."""

    frequency_Hz: float
    amplitude: tuple[float, ...]


class SwingingRobotResult(ResultPart):
    """A robot in a posture with its slowest modes, to draw it; of a tilt the chain has a joint.

    Attributes:
        name, description: Name of the robot, and its file as cases name it.
        chain: Its joints, each tilt one behind that of its gear.
        bodies: Body of the chain by the body of the robot's file.
    """

    name: str
    description: str
    chain: ChainResult
    angles_rad: tuple[float, ...]
    bodies: tuple[int, ...]
    swings: tuple[SwingResult, ...]

    @model_validator(mode="after")
    def _is_one_chain(self) -> Self:
        joints = len(self.chain.axes)
        lengths = [len(self.chain.origins_m), len(self.angles_rad)]
        lengths += [len(swing.amplitude) for swing in self.swings]
        if set(lengths) != {joints} or not all(0 <= body <= joints for body in self.bodies):
            raise ValueError(f"expected all of {joints} joints, got {lengths}")
        return self


class ModesResult(Shown, ResultFile):
    """Modes of a robot; docs/modes.md says what they are.

    `source` is the case or robot that they are of, as commands name it.
    """

    what = "the modes of a robot"
    sparse: ClassVar = ("part", "swinging")

    name: str
    source: str = ""
    robot: str
    torque_curve: str
    motors: Literal["locked"] = "locked"
    loads: str
    places: Annotated[tuple[PlaceModesResult, ...], Field(min_length=1)]
    computed: tuple[ResponseResult, ...]
    measured: tuple[ResponseResult, ...] = ()
    part: PartModesResult | None = None
    swinging: SwingingRobotResult | None = None
    version: str

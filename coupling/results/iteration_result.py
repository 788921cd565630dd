"""Evaluations of a process and iterations of a correction, as they go on and as they are stored."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from coupling.events import Event
from coupling.path.deviation import Deviation
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.results.base import ResultPart, Unbounded

# What a mirroring counts that ends without a result as it may take no more of them.
CORRECTIONS = "corrections"
# What to do about an inverse of the moving robot that is validated on one without inertia.
QUASISTATIC_VALIDATION = (
    'the command is that of the moving robot: validate it with mode = "dynamic"'
)


class Evaluation(ResultPart):
    """One evaluation of the process and the robot's answer to it.

    Attributes:
        path_change: Largest distance between the path the process saw and the robot's answer [m].
        force_change: Largest change of force since the last evaluation, relative to the peak; infinite
            in the first.
        spring_change: Largest force that springs, and what they cannot give, add to the process's at the
            robot's answer, relative to the peak; 0 without.
        worst_time: Instant at which the path changes most [s].
    """

    number: int
    path_change: Annotated[float, Field(alias="path_change_max_m")]
    path_change_rms: Annotated[float, Field(alias="path_change_rms_m")]
    force_change: Annotated[Unbounded, Field(alias="force_change_relative")]
    spring_change: Annotated[float, Field(alias="springs_relative")] = 0.0
    peak_force: Annotated[float, Field(alias="peak_force_N")]
    worst_time: Annotated[float, Field(alias="worst_time_s")]

    @classmethod
    def of(
        cls,
        number: int,
        path: ToolPath,
        answer: ToolPath,
        wrench: WrenchHistory,
        last: WrenchHistory | None,
        spring_change: float = 0.0,
    ) -> Evaluation:
        """Return the figures of a process's answer `wrench` to a path, and the robots' to that."""
        distance = answer.distance_to(path)
        return cls(
            number=number,
            path_change=float(distance.max()),
            path_change_rms=float(np.sqrt(np.mean(distance**2))),
            force_change=np.inf if last is None else wrench.change_from(last),
            peak_force=wrench.peak_force,
            worst_time=float(answer.time[distance.argmax()]),
            spring_change=spring_change,
        )


class CorrectionIteration(ResultPart, Event):
    """One iteration of a correction.

    Attributes:
        number: 0 for the uncorrected command.
        deviation: Deviation from the desired path of the path that the iteration leads to.
        largest_step: Largest step of the correction between neighbouring samples [m], where it was found
            sample by sample.
        step_time: Instant of that step [s], likewise.
        limited_samples: Samples at which the correction's rate was limited, likewise.
    """

    sparse: ClassVar = (
        *("largest_correction_step_m", "largest_correction_step_time_s", "rate_limited_samples"),
    )

    number: int
    deviation: Annotated[Deviation, Field(alias="deviation_m")]
    largest_step: Annotated[float | None, Field(alias="largest_correction_step_m")] = None
    step_time: Annotated[float | None, Field(alias="largest_correction_step_time_s")] = None
    limited_samples: Annotated[int | None, Field(alias="rate_limited_samples")] = None
    evaluations: tuple[Evaluation, ...]

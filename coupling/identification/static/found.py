"""What measurements tell of a robot, as a value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.identification.static.accuracy import ConfidenceIntervals
from coupling.identification.static.elastic import Candidate
from coupling.identification.static.fit import StaticFit
from coupling.identification.static.judge import IdentifiedParameter
from coupling.identification.static.measurements import Measurements
from coupling.identification.static.noise import MeasurementNoise
from coupling.identification.static.points import MovedPoint
from coupling.identification.static.separable import Separability
from coupling.identification.static.support import CommonLoss, Evidence
from elastic_robot.description import Robot

# A robot that is off by more than so many times what the start file is is not written.
_WORSE = 1.2


@dataclass(frozen=True)
class CandidateTest:
    """A parameter that the robot does not have, tested beside those that it has.

    Attributes:
        candidate: Which.
        value: Its compliance [rad/(N m)] or half width [rad] beside the others.
        support: Whether the data support it.
    """

    candidate: Candidate
    value: float
    support: Evidence


@dataclass(frozen=True)
class LoopErrors:
    """Rms errors of a loading loop [m], as of `rms`.

    Attributes:
        number: Number of the loop in the table.
        fit: Left by the fit.
        left_out: Left by a fit of all other loops.
        without: By such a fit of a robot without hysteresis.
    """

    number: int
    fit: float
    left_out: float
    without: float


@dataclass(frozen=True)
class Identification:
    """What measurements tell of a robot.

    Attributes:
        measured: The measurements.
        fit: The fit of all parameters.
        added: Names of parameters that the start file does not have.
        intervals: 95 % intervals of all of them.
        parameters: Verdict on each.
        written: Values of p in the robot as written: those of the start where not identified, beside
            them identified ones that fit best within their intervals, (P,).
        left_out: Errors of rows predicted by a fit of all others [m, rad], (k, r).
        rms_start, rms_written: Of the start's and the written robot's error [m]; nan where one finds
            no rest.
        separability: What postures and loads can tell.
        further: Parameters that were tested beside.
        loss: What every row lacks.
        points: Whether load and measured point seem to be elsewhere.
        noise: Standard deviations that were given.
        loops: Errors of loading loops, where rows are such.
    """

    measured: Measurements
    fit: StaticFit
    added: tuple[str, ...]
    intervals: ConfidenceIntervals
    parameters: tuple[IdentifiedParameter, ...]
    written: np.ndarray
    left_out: np.ndarray
    rms_start: float
    rms_written: float
    separability: Separability
    further: tuple[CandidateTest, ...]
    loss: CommonLoss | None
    points: tuple[MovedPoint, ...]
    noise: MeasurementNoise
    loops: tuple[LoopErrors, ...] = ()

    @property
    def residual(self) -> np.ndarray:
        """Measured less predicted deflections [m, rad], (k, r)."""
        return self.measured.deflection - self.fit.prediction.deflection

    @property
    def refusal(self) -> str:
        """Why no robot should be written, in words; "" where one may be."""
        if not self.fit.converged:
            return f"the fit has not converged: {self.fit.reason}"
        if not any(parameter.identifiable for parameter in self.parameters):
            return "nothing is identified"
        if not np.isfinite(self.rms_written):
            return "with the values that would be kept the robot finds no rest under these loads"
        if self.rms_written > _WORSE * self.rms_start:
            return (
                "with the values that would be kept the robot would be off by"
                f" {1e3 * self.rms_written:.3g} mm rms, the start file is by"
                f" {1e3 * self.rms_start:.3g} mm"
            )
        return ""

    @property
    def robot(self) -> Robot:
        """The robot as written; an added tilt that is not identified is not in it."""
        return self.fit.elasticity.described(self.written)

    def worst(self, count: int = 5) -> list[int]:
        """Return the rows that the others predict worst, the worst first."""
        size = np.linalg.norm(self.left_out[:, :3], axis=1)
        return [int(k) for k in np.argsort(-size, kind="stable")[:count]]


def rms(errors: np.ndarray) -> float:
    """Return the root mean square over all components of positions [m], of (k, r)."""
    return float(np.sqrt(np.mean(errors[:, :3] ** 2)))

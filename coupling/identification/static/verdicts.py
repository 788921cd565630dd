"""What measurements identify of a robot: a verdict on each parameter, refusal and warnings."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from coupling.identification.intervals import ConfidenceIntervals
from coupling.identification.separability import STRONG
from coupling.identification.static.elastic import Candidate
from coupling.identification.static.fit import StaticFit
from coupling.identification.static.measurements import Measurements, rms
from coupling.identification.static.suspicions import MovedPoint, loss_suspicion
from coupling.results.base import finite
from coupling.results.identified_result import CommonLossResult, LoopResult
from coupling.results.parameter_result import EvidenceResult, ParameterResult
from elastic_robot.description import Robot

# A robot that is off by more than so many times what the start file is is not written.
_WORSE = 1.2
# A row that a fit of the others predicts to no better than this part of it is not of the posture told:
# right ones leave 0.03 to 0.19 on six robots whose links bend as well; exchanged postures, joints or
# axes 0.46 to 1.2 (medians).
_PREDICTED = 0.35
# Noise that explains so large an error was given with the measurements [standard deviations].
_BY_NOISE = 1.5


def judge_parameters(fit: StaticFit, added: Collection[str] = ()) -> tuple[ParameterResult, ...]:
    """Return the verdicts on all parameters of a fit, with the fitted values to be written.

    Args:
        added: Names of those that the start file does not have.
    """
    elasticity, sure = fit.elasticity, fit.intervals
    # Compliances turn round: the largest one is the smallest stiffness.
    ends = np.sort([elasticity.in_units(sure.low), elasticity.in_units(sure.high)], axis=0)
    numbers = np.array([elasticity.in_units(fit.at.x), *ends]).T.tolist()
    verdicts = []
    for j, parameter in enumerate(elasticity.parameters):
        reason, tested = _reason(fit, j), fit.supports.get(j)
        if not reason and tested is not None and not tested.supported:
            reason = tested.in_words
        value, low, high = map(finite, numbers[j])
        verdict = ParameterResult(
            name=parameter.name,
            unit=parameter.unit,
            start=None if parameter.name in added else parameter.value,
            value=value,
            low=low,
            high=high,
            written=value,
            identified=not reason,
            reason=reason,
            added=parameter.name in added,
            support=tested,
        )
        verdicts.append(verdict)
    return tuple(verdicts)


def _reason(fit: StaticFit, j: int) -> str:
    sure, separable, kind = fit.intervals, fit.separability, fit.elasticity.parameters[j].kind
    name = fit.elasticity.names[j]
    if not fit.converged:
        return "the fit has not converged"
    if name in separable.without_effect:
        if kind in ("hysteresis", "slip_angle"):
            return "no loop reverses the load of this gear"
        if kind == "backlash":
            return "no effect on any measurement: no load brings this gear to its other flank"
        return (
            "no effect on any measurement: no load acts on it, or the measured point does not move"
        )
    if fit.rigid.unobservable[j]:
        mixed = [d.in_words for d in separable.unseen if name in d.names]
        return f"not distinguishable: {' and '.join(mixed)} have no effect on any measurement"
    if sure.against[j] and kind == "hysteresis":
        return "its loops are narrower than without hysteresis"
    if sure.against[j]:
        return "deflections are opposite to its load: it would be negative"
    if not np.isfinite(sure.high[j]):
        return "as many unknowns as measured values: no error can be estimated"
    if sure.low[j] <= 0.0 and not fit.elasticity.is_compliance[j]:
        return "its confidence interval includes zero"
    if sure.low[j] <= 0.0:
        return "its confidence interval includes a rigid joint"
    return ""


@dataclass(frozen=True)
class CandidateTest:
    """A parameter that the robot does not have, tested beside those that it has.

    Attributes:
        candidate: The parameter.
        value: Its compliance [rad/(N m)] or half width [rad] beside the others.
        support: Whether the data support it.
    """

    candidate: Candidate
    value: float
    support: EvidenceResult


@dataclass(frozen=True)
class Identification:
    """What measurements identify of a robot.

    Attributes:
        fit: The fit of all parameters.
        verdicts: Verdict on each parameter, before others are kept.
        kept: Values of those that are not identified, in p's units, (P,).
        left_out: Errors of rows predicted by a fit of all others [m, rad], (k, r).
        rms_start: Rms error of the start [m]; nan where it finds no rest.
        further: Parameters that were tested beside.
        loss: Deflection that every row lacks.
        points: Whether load and measured point seem to be elsewhere.
        loops: Errors of loading loops, where rows are such.
    """

    fit: StaticFit
    verdicts: tuple[ParameterResult, ...]
    kept: np.ndarray
    left_out: np.ndarray
    rms_start: float
    further: tuple[CandidateTest, ...] = ()
    loss: CommonLossResult | None = None
    points: tuple[MovedPoint, ...] = ()
    loops: tuple[LoopResult, ...] = ()

    @property
    def measured(self) -> Measurements:
        """The measurements."""
        return self.fit.at.experiment.measured

    @property
    def intervals(self) -> ConfidenceIntervals:
        """95 % intervals of all parameters."""
        return self.fit.intervals

    @property
    def is_noise_known(self) -> bool:
        """Whether standard deviations were given."""
        return self.fit.at.experiment.noise.is_known

    @cached_property
    def written(self) -> np.ndarray:
        """Values of p in the robot as written, in its units: kept ones, the best beside them, (P,).

        These are kept ones, and beside them those that fit best in their intervals: the fit's where
        nothing that is kept acts together with what is identified.
        """
        at, sure = self.fit.at, self.fit.intervals
        identified = np.array([verdict.identified for verdict in self.verdicts])
        written = np.where(identified, at.x, self.kept)
        if identified.all() or not identified.any():
            return written
        problem = at.problem.weighted(at.weight)
        residual = problem.residual(np.where(identified, 0.0, self.kept))
        of_identified = replace(problem.only(identified), target=residual)
        written[identified] = of_identified.solve(sure.low[identified], sure.high[identified])
        return written

    @cached_property
    def parameters(self) -> tuple[ParameterResult, ...]:
        """Verdict on each parameter, with its value as written."""
        values = self.fit.elasticity.in_units(self.written).tolist()
        return tuple(
            verdict.model_copy(
                update={
                    "written": finite(value)
                    if verdict.identified or verdict.added
                    else verdict.start
                }
            )
            for verdict, value in zip(self.verdicts, values, strict=True)
        )

    @cached_property
    def rms_written(self) -> float:
        """Rms error of the written robot [m]; nan where it finds no rest."""
        return self.fit.model.rms_at(self.written)

    @property
    def residual(self) -> np.ndarray:
        """Measured less predicted deflections [m, rad], (k, r)."""
        return self.measured.deflection - self.fit.at.prediction.deflection

    @property
    def refusal(self) -> str:
        """Why no robot should be written, in words; "" where one may be."""
        if not self.fit.converged:
            return f"the fit has not converged: {self.fit.reason}"
        if not any(verdict.identified for verdict in self.verdicts):
            return "nothing is identified"
        error, size = _typical(self.left_out), _typical(self.measured.deflection)
        is_noise = self.is_noise_known and self.intervals.scale < _BY_NOISE
        if error > _PREDICTED * size and not is_noise:
            return (
                f"half of the rows are predicted by a fit of the others to no better than"
                f" {1e3 * error:.3g} mm, of {1e3 * size:.3g} mm that were measured (expected"
                f" {100.0 * _PREDICTED:.0f} % at most): no robot like the start file gives way so in the"
                " postures told: check q (radians, order and signs of the joints, each row with its"
                " posture), axes of loads and deflections (base), units and robot file; if the"
                " instrument is as coarse as that, say so (--sd-m)"
            )
        if not np.isfinite(self.rms_written):
            return (
                "with the start values that would be kept there is no equilibrium under these loads"
            )
        if self.rms_written > _WORSE * self.rms_start:
            return (
                "with the start values that would be kept the residual would be"
                f" {1e3 * self.rms_written:.3g} mm rms, with the start file it is"
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


def _typical(displacements: np.ndarray) -> float:
    """Return the median length of displacements [m], of (k, r)."""
    return float(np.median(np.linalg.norm(displacements[:, :3], axis=1)))


def warnings(result: Identification) -> list[str]:
    """Return what the user should look at."""
    measured, fit, separable = result.measured, result.fit, result.fit.separability
    said = list(measured.remarks)
    if not fit.converged:
        said.append(f"the fit has not converged: {fit.reason}")
    idle = [n for n, w in zip(measured.names, measured.wrench, strict=True) if not w.any()]
    if idle and not result.loops:
        said.append(f"rows without a load: {', '.join(idle[:5])}{' ..' * (len(idle) > 5)}")
    if np.abs(measured.q).max() > 4.0 * np.pi:
        said.append(f"an angle is {np.abs(measured.q).max():.3g} rad: are they in degrees?")
    size = rms(measured.deflection) / max(rms(_start(result)), 1e-300)
    if not 0.02 < size < 50.0:
        said.append(
            f"deflections are {size:.3g} times those of the start file: are they in m and loads in N?"
        )
    along = float(np.sum(measured.deflection[:, :3] * _start(result)[:, :3]))
    if along < 0.0:
        said.append(
            "deflections are opposite to those of the start file: is the load that on the robot, in base"
            " axes, and the deflection loaded less unloaded?"
        )
    if not fit.converged:
        return said
    if separable.condition > STRONG:
        said.append(
            f"parameters are strongly correlated, condition number {separable.condition:.0f}: hardly"
            f" distinguishable are {'; '.join(d.in_words for d in separable.weak)}"
        )
    said += [
        f"{p.name}: the start value that is kept, {p.start:.4g}, is outside the confidence interval,"
        f" {_end(p.low)} to {_end(p.high)}"
        for p, against in zip(result.verdicts, result.intervals.against, strict=True)
        if not (p.identified or against or p.start is None or p.contains(p.start))
    ]
    rests: dict[int, list[str]] = {}
    for verdict, row in zip(result.verdicts, result.intervals.rests_on.tolist(), strict=True):
        if row >= 0 and verdict.identified:
            rests.setdefault(row, []).append(verdict.name)
    said += [
        f"{', '.join(names)} depend on {measured.names[row]} alone" for row, names in rests.items()
    ]
    if result.is_noise_known and result.intervals.freedom > 0:
        if result.intervals.scale > 1.5:
            said.append(
                f"residuals are {result.intervals.scale:.2g} times as large as the standard"
                " deviations: the model is incomplete, or the standard deviations are too small"
            )
        elif result.intervals.scale < 0.6:
            said.append(
                f"residuals are {result.intervals.scale:.2g} times as large as the standard deviations,"
                " which are too large"
            )
    suspicions = [point.suspicion() for point in result.points]
    suspicions += [loss_suspicion(result.loss)] if result.loss is not None else []
    said += [suspicion for suspicion in suspicions if suspicion]
    if result.rms_written > 1.2 * rms(result.residual):
        said.append(
            "with the start values that were kept the residual of the robot file as written is"
            f" {1e3 * result.rms_written:.3g} mm rms, that of the fit {1e3 * rms(result.residual):.3g}"
            " mm: measure what was not identified, or remove tilts that are not supported from the start"
            " file"
        )
    return said


def _start(result: Identification) -> np.ndarray:
    """Return what the start values predict in the rigid posture, (k, r)."""
    rigid = result.fit.rigid
    return result.fit.at.in_units(rigid.columns @ rigid.start)


def _end(value: float | None) -> str:
    """Return the end of an interval that bounds a value."""
    return "inf" if value is None else f"{value:.4g}"

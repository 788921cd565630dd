"""What measurements identify of a robot: a verdict on each parameter, refusal and warnings."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from coupling.identification.evidence import poor_prediction
from coupling.identification.robot_file import Identification
from coupling.identification.separability import STRONG
from coupling.identification.static.elastic import Candidate
from coupling.identification.static.fit import StaticFit
from coupling.identification.static.measurements import rms
from coupling.identification.static.prediction import RigidPostures
from coupling.identification.static.suspicions import loss_suspicion
from coupling.results.base import finite
from coupling.results.identified_result import (
    CommonLossResult,
    FurtherResult,
    IdentifiedResult,
    LoopResult,
    MeasuredRowResult,
    RmsResult,
)
from coupling.results.parameter_result import EvidenceResult, ParameterResult
from coupling.results.run_result import three
from coupling.robot.parameters import unit_of

# A robot that is off by more than so many times what the start file is is not written.
_WORSE = 1.2
# Noise that explains so large an error was given with the measurements [standard deviations].
_BY_NOISE = 1.5
# Rows that are named, those that the others predict worst.
_WORST = 5


def judge_parameters(fit: StaticFit, added: Collection[str] = ()) -> tuple[ParameterResult, ...]:
    """Return the verdicts on all parameters of a fit, with the fitted values to be written.

    Args:
        added: Names of those that the start file does not have.
    """
    elasticity, sure = fit.elasticity, fit.intervals
    # Compliances turn round: the largest one is the smallest stiffness.
    ends = np.sort([elasticity.in_units(sure.low), elasticity.in_units(sure.high)], axis=0)
    numbers = np.array([elasticity.in_units(fit.x), *ends]).T.tolist()
    verdicts = []
    for j, parameter in enumerate(elasticity.parameters):
        reason, tested = _reason(fit, j), fit.supports.get(j)
        if not reason and tested is not None and not tested.supported:
            reason = tested.in_words
        value, *interval = numbers[j]
        is_added = parameter.name in added
        start = None if is_added else parameter.value
        of_parameter = parameter.name, parameter.unit, start, value, interval, reason
        verdicts.append(ParameterResult.judged(*of_parameter, added=is_added, support=tested))
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


def further_result(candidate: Candidate, value: float, evidence: EvidenceResult) -> FurtherResult:
    """Return the test of a parameter, of a value in p's units; a tilt's is shown as its stiffness."""
    unit = "N m/rad" if candidate.axis is not None else unit_of(candidate.name)
    value = candidate.in_units(value)
    return FurtherResult(**dict(evidence), name=candidate.name, unit=unit, value=finite(value))


def conclude(
    fit: StaticFit,
    verdicts: Sequence[ParameterResult],
    default: np.ndarray,
    left_out: np.ndarray,
    rms_start: float,
    further: Sequence[FurtherResult] = (),
    loss: CommonLossResult | None = None,
    suspicions: Sequence[str] = (),
    loops: Sequence[LoopResult] = (),
) -> Identification[StaticFit, IdentifiedResult]:
    """Return what measurements identify of a robot.

    Args:
        fit: The fit of all parameters.
        verdicts: Verdict on each parameter, before others are kept.
        default: Values of those that are not identified, in p's units, (P,).
        left_out: Errors of rows predicted by a fit of all others [m, rad], (k, r).
        rms_start: Rms error of the start [m]; nan where it finds no rest.
        further: Parameters that were tested beside.
        loss: Deflection that every row lacks.
        suspicions: Sentences on where load and measured point seem to be.
        loops: Errors of loading loops, where rows are such.
    """
    at, measured, separable = fit.experiment, fit.experiment.problem.measured, fit.separability
    is_identified = np.array([verdict.identified for verdict in verdicts])
    values = _written(fit, is_identified, default)
    parameters = tuple(
        verdict.model_copy(update={"written": finite(value) if is_own else verdict.start})
        for verdict, value, is_own in zip(
            verdicts,
            fit.elasticity.in_units(values).tolist(),
            [verdict.identified or verdict.added for verdict in verdicts],
            strict=True,
        )
    )
    residual = measured.deflection - at.prediction.deflection
    sizes = RmsResult(
        measured=finite(rms(measured.deflection)),
        start=finite(rms_start),
        fit=finite(rms(residual)),
        left_out=finite(rms(left_out)),
        written=finite(fit.model.rms_at(values)),
    )
    places = RigidPostures.of(fit.elasticity.robot, measured).point
    worst = np.argsort(-np.linalg.norm(left_out[:, :3], axis=1), kind="stable")[:_WORST]
    result = IdentifiedResult(
        converged=fit.converged,
        reason=fit.reason,
        refusal=_refusal(fit, is_identified, left_out, sizes),
        rows=measured.count,
        rms_m=sizes,
        residual_over_deviation=finite(fit.intervals.scale),
        parameters=parameters,
        further=tuple(further),
        condition=finite(separable.condition),
        without_effect=separable.without_effect,
        unseen=separable.unseen,
        weak=separable.weak,
        alike=separable.pairs,
        common_loss=loss,
        warnings=_warnings(
            fit, parameters, sizes, [*suspicions, loss_suspicion(loss)], bool(loops)
        ),
        measurements=tuple(
            MeasuredRowResult(
                name=name,
                position_m=three(places[k]),
                force_N=three(measured.wrench[k, :3]),
                measured=measured.deflection[k].tolist(),
                predicted=at.prediction.deflection[k].tolist(),
                left_out_error=left_out[k].tolist(),
                weight=float(at.weight[k] ** 2),
            )
            for k, name in enumerate(measured.names)
        ),
        worst=tuple(measured.names[k] for k in worst),
        loops=tuple(loops),
    )
    in_mm = {key: np.nan if size is None else 1e3 * size for key, size in sizes}
    words = (
        f"Residual {in_mm['fit']:.4f} mm rms over all components, leave-one-out of"
        f" {'loops' if loops else 'rows'} {in_mm['left_out']:.4f} mm; this file"
        f" {in_mm['written']:.4f} mm, the start file {in_mm['start']:.4f} mm."
    )
    remarks = {p.name: _lower_bound(p) + _shape(p, parameters) for p in parameters}
    return Identification(fit, fit.elasticity.described(values), result, words, remarks)


def _written(fit: StaticFit, is_identified: np.ndarray, default: np.ndarray) -> np.ndarray:
    """Return the values of p in the robot as written, in its units, (P,).

    These are kept ones, and beside them those that fit best in their intervals: the fit's where
    nothing that is kept acts together with what is identified.
    """
    at, sure = fit.experiment, fit.intervals
    written = np.where(is_identified, at.x, default)
    if is_identified.all() or not is_identified.any():
        return written
    problem = at.linear.weighted(at.weight)
    residual = problem.residual(np.where(is_identified, 0.0, default))
    of_identified = replace(problem.only(is_identified), target=residual)
    written[is_identified] = of_identified.solve(sure.low[is_identified], sure.high[is_identified])
    return written


def _refusal(
    fit: StaticFit, is_identified: np.ndarray, left_out: np.ndarray, sizes: RmsResult
) -> str:
    """Return why no robot should be written, in words; "" where one may be."""
    if not fit.converged:
        return f"the fit has not converged: {fit.reason}"
    if not is_identified.any():
        return "nothing is identified"
    problem = fit.experiment.problem
    error, size = (
        1e3 * np.linalg.norm(rows[:, :3], axis=1)
        for rows in (left_out, problem.measured.deflection)
    )
    is_noise = problem.noise.is_known and fit.intervals.scale < _BY_NOISE
    words = "" if is_noise else poor_prediction("rows", "others", error, size, "mm")
    if words:
        return (
            f"{words}: no robot like the start file gives way so in the postures told: check q"
            " (radians, order and signs of the joints, each row with its posture), axes of loads and"
            " deflections (base), units and robot file; if the instrument is as coarse as that, say so"
            " (--sd-m)"
        )
    if sizes.written is None:
        return "with the start values that would be kept there is no equilibrium under these loads"
    if sizes.start is not None and sizes.written > _WORSE * sizes.start:
        return (
            f"with the start values that would be kept the residual would be {1e3 * sizes.written:.3g}"
            f" mm rms, with the start file it is {1e3 * sizes.start:.3g} mm"
        )
    return ""


def _warnings(
    fit: StaticFit,
    parameters: Sequence[ParameterResult],
    sizes: RmsResult,
    suspicions: Sequence[str],
    has_loops: bool,
) -> tuple[str, ...]:
    """Return what the user should look at."""
    measured, separable, sure = fit.experiment.problem.measured, fit.separability, fit.intervals
    remarks = list(measured.remarks)
    if not fit.converged:
        remarks.append(f"the fit has not converged: {fit.reason}")
    idle = [n for n, w in zip(measured.names, measured.wrench, strict=True) if not w.any()]
    if idle and not has_loops:
        remarks.append(f"rows without a load: {', '.join(idle[:5])}{' ..' * (len(idle) > 5)}")
    if np.abs(measured.q).max() > 4.0 * np.pi:
        remarks.append(f"an angle is {np.abs(measured.q).max():.3g} rad: are they in degrees?")
    # What the start values predict in the rigid posture.
    of_start = fit.experiment.in_units(fit.rigid.columns @ fit.rigid.start)
    size = rms(measured.deflection) / max(rms(of_start), 1e-300)
    if not 0.02 < size < 50.0:
        remarks.append(
            f"deflections are {size:.3g} times those of the start file: are they in m and loads in N?"
        )
    if float(np.sum(measured.deflection[:, :3] * of_start[:, :3])) < 0.0:
        remarks.append(
            "deflections are opposite to those of the start file: is the load that on the robot, in base"
            " axes, and the deflection loaded less unloaded?"
        )
    if not fit.converged:
        return tuple(remarks)
    if separable.condition > STRONG:
        remarks.append(
            f"parameters are strongly correlated, condition number {separable.condition:.0f}: hardly"
            f" distinguishable are {'; '.join(d.in_words for d in separable.weak)}"
        )
    remarks += [
        f"{p.name}: the start value that is kept, {p.start:.4g}, is outside the confidence interval,"
        f" {_end(p.low)} to {_end(p.high)}"
        for p, against in zip(parameters, sure.against, strict=True)
        if not (p.identified or against or p.start is None or p.contains(p.start))
    ]
    rests: dict[int, list[str]] = {}
    for parameter, row in zip(parameters, sure.rests_on.tolist(), strict=True):
        if row >= 0 and parameter.identified:
            rests.setdefault(row, []).append(parameter.name)
    remarks += [
        f"{', '.join(names)} depend on {measured.names[row]} alone" for row, names in rests.items()
    ]
    if fit.experiment.problem.noise.is_known and sure.freedom > 0 and not 0.6 <= sure.scale <= 1.5:
        meaning = ", which are too large"
        if sure.scale > 1.5:
            meaning = ": the model is incomplete, or the standard deviations are too small"
        remarks.append(
            f"residuals are {sure.scale:.2g} times as large as the standard deviations{meaning}"
        )
    remarks += [suspicion for suspicion in suspicions if suspicion]
    if sizes.written is not None and sizes.fit is not None and sizes.written > 1.2 * sizes.fit:
        remarks.append(
            "with the start values that were kept the residual of the robot file as written is"
            f" {1e3 * sizes.written:.3g} mm rms, that of the fit {1e3 * sizes.fit:.3g}"
            " mm: measure what was not identified, or remove tilts that are not supported from the start"
            " file"
        )
    return tuple(remarks)


def _end(value: float | None) -> str:
    """Return the end of an interval that bounds a value."""
    return "inf" if value is None else f"{value:.4g}"


def _shape(parameter: ParameterResult, parameters: Sequence[ParameterResult]) -> str:
    """Return how sure the slip angles are that go with a slip torque; "" for what has none."""
    name = parameter.name.replace("hysteresis", "slip_angle")
    for other in parameters:
        if other.kind == "slip_angle" and other.name == name != parameter.name:
            return f"; largest slip angle: {other.remark.replace('start value kept', 'assumed')}"
    return ""


def _lower_bound(parameter: ParameterResult) -> str:
    """Return what is known of a stiffness that is not identified, in words; "" for others."""
    is_bounded = parameter.kind == "stiffness" and (parameter.low or 0.0) > 0.0
    if parameter.identified or not is_bounded:
        return ""
    return f"; 95 %: {parameter.low:.4g} or more"

"""Identification as a whole: fit, verdict on every parameter, tests of further ones."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import IdentifyError, one_of
from coupling.identification.evidence import support
from coupling.identification.intervals import ConfidenceIntervals, intervals, left_out
from coupling.identification.separability import separability
from coupling.identification.static.elastic import Candidate, ElasticParameters, candidates
from coupling.identification.static.fit import StaticFit, fit_static
from coupling.identification.static.measurements import MeasurementNoise, Measurements
from coupling.identification.static.prediction import Prediction, StaticModel, candidate_column
from coupling.identification.static.suspicions import common_loss, shifted_points
from coupling.identification.static.verdicts import (
    CandidateTest,
    Identification,
    IdentifiedParameter,
    judge_parameters,
    rms,
)
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError

# Sizes of a further parameter that are worth a test [rad/(N m), rad].
_SIZE = {True: 1e-9, False: 1e-6}
SUPPORTED = "supported"


@dataclass(frozen=True)
class IdentifyOptions:
    """How to identify.

    Attributes:
        torque_curve: A name of `TORQUE_CURVES`.
        noise: Standard deviations.
        loss: A name of `LOSSES`.
        add: Names of candidates to add to the robot, or `SUPPORTED` for all that are supported.
    """

    noise: MeasurementNoise
    torque_curve: str = "backlash"
    loss: str = "squares"
    add: tuple[str, ...] = ()


def identify(robot: Robot, measured: Measurements, options: IdentifyOptions) -> Identification:
    """Identify a robot's elasticity.

    Args:
        robot: The start: joints that give way, and values that are kept where not identifiable.
        options: Noise, torque curve, loss, parameters to add.

    Raises:
        IdentifyError: If nothing can be identified at all, or no candidate has an added name.
    """
    if measured.loop is not None:
        raise IdentifyError(
            "measurements: expected single loads, got loading loops: identify_loops"
        )
    before = ElasticParameters.of(robot, options.torque_curve)
    require_deflected(before, measured)
    model = StaticModel(before, measured, options.torque_curve)
    rms_start = rms_of(model.predict, before.start, measured)
    added: list[str] = []
    for name in options.add:
        if name != SUPPORTED:
            robot, added_name = _with(robot, measured, options, name)
            added.append(added_name)
    identification = _once(robot, measured, options, tuple(added), rms_start)
    while SUPPORTED in options.add:
        best = [further for further in identification.further if further.support.is_supported]
        if not best:
            break
        chosen = min(best, key=lambda further: further.support.within)
        robot, added_name = chosen.candidate.added_to(robot, chosen.value)
        added.append(added_name)
        identification = _once(robot, measured, options, tuple(added), rms_start)
    return identification


def require_deflected(elasticity: ElasticParameters, measured: Measurements) -> None:
    """Refuse measurements without loads, and a robot that does not give way.

    Raises:
        IdentifyError: With what was expected.
    """
    if not measured.wrench.any():
        raise IdentifyError("loads: expected a force or moment in at least one row, got none")
    if not elasticity.names:
        raise IdentifyError(
            f"{elasticity.robot.name}: expected an elastic joint or tilt, got a rigid robot"
        )


def _with(
    robot: Robot, measured: Measurements, options: IdentifyOptions, name: str
) -> tuple[Robot, str]:
    """Return the robot with a candidate, at the value that fits beside the others, and its name."""
    by_name = {candidate.name: candidate for candidate in candidates(robot, options.torque_curve)}
    if name not in by_name:
        raise IdentifyError(f"--add: {one_of([SUPPORTED, *by_name], name)}")
    elasticity = ElasticParameters.of(robot, options.torque_curve)
    fit = fit_static(elasticity, measured, options.torque_curve, options.noise, options.loss)
    (further,) = _further(fit, measured, options, [by_name[name]])
    return by_name[name].added_to(robot, further.value)


def _once(
    robot: Robot,
    measured: Measurements,
    options: IdentifyOptions,
    added: tuple[str, ...],
    rms_start: float,
) -> Identification:
    elasticity = ElasticParameters.of(robot, options.torque_curve)
    fit = fit_static(elasticity, measured, options.torque_curve, options.noise, options.loss)
    is_noise_known = options.noise.is_known
    sure = intervals(fit.at.problem, fit.at.weight, fit.at.x, is_noise_known)
    tested = np.flatnonzero(~elasticity.is_torsion)
    every = np.arange(len(elasticity.names))
    supports = {
        int(j): support(fit.at.problem, every == j, fit.at.weight, len(tested)) for j in tested
    }
    separable = separability(fit.rigid, elasticity.names)
    parameters = judge_parameters(fit, sure, supports, separable)
    written = values_to_write(fit, parameters, elasticity.start, added, sure)
    errors = fit.at.in_units(left_out(fit.at.problem, fit.at.weight))
    model = StaticModel(elasticity, measured, options.torque_curve)
    further = _further(fit, measured, options, candidates(robot, options.torque_curve))
    return Identification(
        measured,
        fit,
        added,
        sure,
        parameters,
        written,
        errors,
        rms_start,
        rms_of(model.predict, written, measured),
        separable,
        options.noise,
        tuple(further),
        common_loss(fit.at.problem, fit.at.weight, fit.at.white, fit.at.prediction.deflection),
        tuple(shifted_points(fit, measured)),
    )


def values_to_write(
    fit: StaticFit,
    parameters: Sequence[IdentifiedParameter],
    start: np.ndarray,
    added: Collection[str],
    sure: ConfidenceIntervals,
) -> np.ndarray:
    """Return the values to write: kept ones, and beside them those that fit best in their intervals.

    They are in p's units, (P,).  Where nothing that is kept acts together with what is identified, these
    are the fit's.

    Args:
        parameters: Verdicts on the parameters.
        start: Values of those that are not identified, in p's units, (P,).
        added: Names of those that the robot had not: not identified they vanish, but for slip angles.
    """
    identified = np.array([item.identifiable for item in parameters])
    vanishes = [item.name in added and item.parameter.kind != "slip_angle" for item in parameters]
    start_values = np.where(np.array(vanishes), fit.elasticity.least, start)
    written = np.where(identified, fit.at.x, start_values)
    if identified.all() or not identified.any():
        return written
    problem = fit.at.problem.weighted(fit.at.weight)
    residual = problem.residual(np.where(identified, 0.0, start_values))
    of_identified = replace(problem.only(identified), target=residual)
    written[identified] = of_identified.solve(sure.low[identified], sure.high[identified])
    return written


def _further(
    fit: StaticFit,
    measured: Measurements,
    options: IdentifyOptions,
    tested_candidates: Sequence[Candidate],
) -> list[CandidateTest]:
    """Return candidates tested one by one beside the parameters of a fit."""
    robot, results, whole = fit.elasticity.robot, [], []
    for candidate in tested_candidates:
        try:
            column = candidate_column(robot, options.torque_curve, candidate, measured)
        except ElasticRobotError:  # it would move no inertia
            continue
        whole.append((candidate, (fit.at.white @ column[:, :, None])[:, :, 0]))
    for candidate, column in whole:
        problem = fit.at.problem.also(column, _SIZE[candidate.axis is not None])
        last = np.arange(len(problem.start)) == len(fit.at.x)
        tested = support(problem, last, fit.at.weight, len(whole))
        value = float(problem.weighted(fit.at.weight).solve()[-1])
        results.append(CandidateTest(candidate, value, tested))
    return results


def rms_of(
    predict: Callable[[np.ndarray], Prediction], values: np.ndarray, measured: Measurements
) -> float:
    """Return the rms error [m] at values of p, in its units, (P,); nan where the robot finds no rest."""
    try:
        return rms(measured.deflection - predict(values).deflection)
    except IdentifyError:
        return float("nan")

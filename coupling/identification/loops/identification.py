"""Identification from loading loops: fit, verdicts, loops predicted by a fit of the others."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from coupling.errors import IdentifyError
from coupling.files.gear_table import sheet_elements
from coupling.identification.evidence import Evidence, support
from coupling.identification.intervals import ConfidenceIntervals, intervals
from coupling.identification.loops.fit import fit_loops, fit_loops_from
from coupling.identification.loops.model import LoopModel
from coupling.identification.loops.parameters import (
    LoopParameters,
    joint_of,
    loop_rows,
    reversed_ranges,
    with_elements,
    without_elements,
)
from coupling.identification.separability import separability
from coupling.identification.static.elastic import Candidate
from coupling.identification.static.fit import StaticExperiment, StaticFit
from coupling.identification.static.identification import (
    IdentifyOptions,
    require_deflected,
    rms_of,
    values_to_write,
)
from coupling.identification.static.measurements import Measurements
from coupling.identification.static.verdicts import (
    CandidateTest,
    Identification,
    IdentifiedParameter,
    LoopErrors,
    judge_parameters,
    rms,
)
from coupling.robot.parameters import RobotParameter
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot

# What the loops that are left see of a direction by less than this part of what all do counts as unseen.
_HELD = 1e-2


def identify_loops(
    robot: Robot, measured: Measurements, options: IdentifyOptions
) -> Identification:
    """Identify a robot's elasticity and the hysteresis of its gears from loading loops.

    A gear without elements whose load turns back is given three; it keeps them where they are supported
    and predict loops that were left out better.

    Args:
        robot: The start.
        measured: The measurements, with loops.
        options: Noise, torque curve, loss; nothing to add.

    Raises:
        IdentifyError: If nothing can be identified at all, or something is to be added.
    """
    if options.add:
        raise IdentifyError(
            f"--add: expected none beside loading loops, got {', '.join(options.add)}: add it to the"
            " robot file, or take the column loop away"
        )
    start = LoopParameters.of_loops(robot, options.torque_curve)
    require_deflected(start, measured)
    model = LoopModel(start, measured, options.torque_curve)
    rms_start = rms_of(model.predict, start.start, measured)
    ranges = _bare_gears(robot, measured)
    wider = with_elements(robot, ranges)
    shaped, dropped = set(ranges), list[CandidateTest]()
    while True:
        fit, supports = _fit(wider, shaped, measured, options)
        parameters = fit.elasticity.parameters
        weak = [
            j
            for j in supports
            if parameters[j].kind == "hysteresis" and joint_of(parameters[j]) in shaped
        ]
        weak = [j for j in weak if not supports[j].is_supported]
        if not weak:
            break
        dropped += [_candidate_test(parameters[j], float(fit.at.x[j]), supports[j]) for j in weak]
        gone = {joint_of(parameters[j]) for j in weak}
        wider, shaped = without_elements(wider, gone), shaped - gone
    identification = _conclude(fit, supports, shaped, measured, options, rms_start)
    return replace(identification, further=tuple(dropped))


def _bare_gears(robot: Robot, measured: Measurements) -> dict[int, float]:
    """Return the ranges of torques [N m] of gears without elements that turn back, by joint from 0."""
    chain, ranges = build_chain(robot), reversed_ranges(robot, measured)
    return {
        int(chain.elastic_joint[row]): float(ranges[row])
        for row in chain.torsions
        if ranges[row] > 0.0 and not robot.joints[int(chain.elastic_joint[row])].hysteresis
    }


def _fit(
    robot: Robot, shaped: set[int], measured: Measurements, options: IdentifyOptions
) -> tuple[StaticFit, dict[int, Evidence]]:
    """Return the fit, and the tests of tilts, backlash and hysteresis by their number."""
    elasticity = LoopParameters.of_loops(robot, options.torque_curve, shaped)
    fit = fit_loops(elasticity, measured, options.torque_curve, options.noise, options.loss)
    angles = elasticity.chosen("slip_angle")
    tested = np.flatnonzero(~elasticity.is_torsion & ~angles)
    return fit, {
        int(j): support(fit.at.problem, elasticity.together(int(j)), fit.at.weight, len(tested))
        for j in tested
    }


def _candidate_test(parameter: RobotParameter, value: float, tested: Evidence) -> CandidateTest:
    return CandidateTest(Candidate(parameter.name, joint_of(parameter), None), value, tested)


def _conclude(
    fit: StaticFit,
    supports: dict[int, Evidence],
    shaped: set[int],
    measured: Measurements,
    options: IdentifyOptions,
    rms_start: float,
) -> Identification:
    elasticity = fit.elasticity
    assert isinstance(elasticity, LoopParameters)
    sure = intervals(fit.at.problem, fit.at.weight, fit.at.x, options.noise.is_known)
    separable = separability(fit.rigid, elasticity.names)
    left_out = _left_out(fit, measured, options)
    bare_robot = without_elements(elasticity.robot, range(len(elasticity.robot.joints)))
    bare = LoopParameters.of_loops(bare_robot, options.torque_curve)
    plain = fit_loops(bare, measured, options.torque_curve, options.noise, options.loss)
    without = _left_out(plain, measured, options)
    parameters = judge_parameters(fit, sure, supports, separable)
    if not _squares(fit, left_out) < _squares(fit, without):
        reason = "loops that are left out are not predicted better with hysteresis than without"
        acting = {name for name in elasticity.names if name not in separable.without_effect}
        parameters = _refused(parameters, "hysteresis", acting, reason)
    # A slip angle is nothing without its gear's slip torque.
    unknown = {
        item.name.replace("hysteresis", "slip_angle")
        for item in parameters
        if item.parameter.kind == "hysteresis" and not item.identifiable
    }
    reason = "its gear's hysteresis is not identified"
    parameters = _refused(parameters, "slip_angle", unknown, reason)
    added = tuple(
        item.name
        for item in elasticity.parameters
        if item.kind in ("hysteresis", "slip_angle") and joint_of(item) in shaped
    )
    start = np.where(elasticity.chosen("slip_angle"), _assumed(fit, sure), elasticity.start)
    written = values_to_write(fit, parameters, start, added, sure)
    model = LoopModel(elasticity, measured, options.torque_curve)
    residual = measured.deflection - fit.at.prediction.deflection
    assert measured.loop is not None
    loops = tuple(
        LoopErrors(
            int(measured.loop[rows[0]]), *(rms(e[rows]) for e in (residual, left_out, without))
        )
        for rows in loop_rows(measured)
    )
    return Identification(
        measured,
        fit,
        added,
        sure,
        parameters,
        written,
        left_out,
        rms_start,
        rms_of(model.predict, written, measured),
        separable,
        options.noise,
        loops=loops,
    )


def _assumed(fit: StaticFit, sure: ConfidenceIntervals) -> np.ndarray:
    """Return slip angles by a data sheet's loop of that slip torque, in their intervals, (P,)."""
    elasticity, assumed = fit.elasticity, fit.at.x.copy()
    of = {
        (parameter.kind, parameter.coordinate): value
        for parameter, value in zip(elasticity.parameters, fit.at.x, strict=True)
    }
    for j, parameter in enumerate(elasticity.parameters):
        if parameter.kind == "slip_angle":
            torque, compliance = (
                of["hysteresis", parameter.coordinate],
                of["stiffness", parameter.coordinate],
            )
            stops = sheet_elements(2.0 * torque * compliance, 1.0 / compliance)
            assumed[j] = np.clip(stops[-1].slip_angle, sure.low[j], sure.high[j])
    return np.maximum(assumed, elasticity.least)


def _left_out(fit: StaticFit, measured: Measurements, options: IdentifyOptions) -> np.ndarray:
    """Return the errors of each loop predicted by a fit of all others [m, rad], (k, r).

    A gear that no other loop turns back has the hysteresis of the start file, or none.  What the others
    hardly see besides stays as fitted, as with rows that are left out.
    """
    elasticity = fit.elasticity
    assert isinstance(elasticity, LoopParameters)
    errors = np.empty_like(measured.deflection)
    white = fit.at.white * fit.at.weight[:, None, None]
    scale = fit.at.problem.scale
    prior = np.divide(_HELD, scale, out=np.zeros_like(scale), where=scale > 0.0)
    for rows in loop_rows(measured):
        kept_rows = np.setdiff1d(np.arange(measured.count), rows)
        others, loop = measured.at_rows(kept_rows), measured.at_rows(rows)
        model = LoopModel(elasticity, others, options.torque_curve)
        start = np.where(model.effective, fit.at.x, _before(elasticity))
        experiment = StaticExperiment(
            elasticity,
            others,
            model.predict,
            options.noise,
            white=white[kept_rows],
            prior=prior,
            prior_mean=start,
        )
        values = fit_loops_from(experiment, start).x
        prediction = LoopModel(elasticity, loop, options.torque_curve).predict(values)
        errors[rows] = loop.deflection - prediction.deflection
    return errors


def _before(elasticity: LoopParameters) -> np.ndarray:
    """Return the start file's values, and none of what it has no elements for, (P,)."""
    values = elasticity.start.copy()
    for j in range(len(values)):
        if (
            elasticity.parameters[j].kind == "hysteresis"
            and np.count_nonzero(elasticity.together(j)) > 1
        ):
            values[j] = elasticity.least[j]
    return values


def _squares(fit: StaticFit, errors: np.ndarray) -> float:
    white = np.einsum("kij,kj->ki", fit.at.white, errors) * fit.at.weight[:, None]
    return float(np.sum(white**2))


def _refused(
    parameters: tuple[IdentifiedParameter, ...], kind: str, names: Collection[str], reason: str
) -> tuple[IdentifiedParameter, ...]:
    """Return the verdicts, those of a kind and of some names not identifiable for a reason."""
    return tuple(
        replace(verdict, reason=reason)
        if verdict.parameter.kind == kind and verdict.name in names
        else verdict
        for verdict in parameters
    )

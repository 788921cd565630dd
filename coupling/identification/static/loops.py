"""Hysteresis of gears from loading loops: fit, verdicts, loops predicted by a fit of the others."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from coupling.files.gear_table import sheet_elements
from coupling.identification.evidence import predict_left_out
from coupling.identification.robot_file import Identification
from coupling.identification.static.elastic import Candidate, ElasticParameters, joint_of
from coupling.identification.static.fit import (
    IdentifyOptions,
    StaticFit,
    StaticProblem,
    fit_from,
    fit_static,
)
from coupling.identification.static.measurements import Measurements, rms
from coupling.identification.static.model import StaticModel
from coupling.identification.static.prediction import reversed_ranges
from coupling.identification.static.verdicts import conclude, further_result, judge_parameters
from coupling.results.identified_result import FurtherResult, IdentifiedResult, LoopResult
from coupling.results.parameter_result import ParameterResult
from coupling.robot.parameters import with_joints
from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Robot

# What the loops that are left see of a direction by less than this part of what all do counts as unseen.
_HELD = 1e-2
# Slip torque at the start of a fit, over the range of the gear's torque in the loops.
_START = 0.1


def identify_loops(
    robot: Robot, measured: Measurements, options: IdentifyOptions, rms_start: float
) -> Identification[StaticFit, IdentifiedResult]:
    """Identify a robot's elasticity and the hysteresis of its gears from loading loops.

    A gear without elements whose load turns back is given three; it keeps them where they are supported
    and predict loops that were left out better.

    Args:
        robot: The start.
        options: Noise, torque curve, loss.
        rms_start: Rms error of the start [m].
    """
    ranges = _bare_gears(robot, measured)
    wider = _with_elements(robot, ranges)
    shaped, dropped = set(ranges), list[FurtherResult]()
    while True:
        elasticity = ElasticParameters.of(wider, options.torque_curve, shaped)
        fit = fit_static(elasticity, measured, options)
        weak = [
            (parameter, float(fit.x[j]), fit.supports[j])
            for j, parameter in enumerate(elasticity.parameters)
            if parameter.kind == "hysteresis"
            and joint_of(parameter) in shaped
            and not fit.supports[j].supported
        ]
        if not weak:
            break
        dropped += [
            further_result(Candidate(parameter.name, joint_of(parameter), None), value, tested)
            for parameter, value, tested in weak
        ]
        gone = {joint_of(parameter) for parameter, _, _ in weak}
        wider, shaped = _without_elements(wider, gone), shaped - gone
    return _conclude(fit, shaped, options, rms_start, dropped)


def _bare_gears(robot: Robot, measured: Measurements) -> dict[int, float]:
    """Return the ranges of torques [N m] of gears without elements that turn back, by joint from 0."""
    chain, ranges = build_chain(robot), reversed_ranges(robot, measured)
    return {
        int(chain.elastic_joint[row]): float(ranges[row])
        for row in chain.torsions
        if ranges[row] > 0.0 and not robot.joints[int(chain.elastic_joint[row])].hysteresis
    }


def _with_elements(robot: Robot, ranges: Mapping[int, float]) -> Robot:
    """Return the robot with elements for gears that have none, three as a data sheet's loop has them.

    Args:
        ranges: Ranges of gears' torques [N m] by their joints' numbers, from 0.
    """

    def add_elements(joint: Joint, largest: float) -> Joint:
        assert joint.stiffness is not None
        lost = 2.0 * _START * largest / joint.stiffness
        return replace(joint, hysteresis=sheet_elements(lost, joint.stiffness))

    return with_joints(
        robot,
        {i: add_elements(robot.joints[i], torque_range) for i, torque_range in ranges.items()},
    )


def _without_elements(robot: Robot, joints: Collection[int]) -> Robot:
    """Return the robot with gears that have no hysteresis, by their joints' numbers, from 0."""
    return with_joints(robot, {i: replace(robot.joints[i], hysteresis=()) for i in joints})


def _conclude(
    fit: StaticFit,
    shaped: set[int],
    options: IdentifyOptions,
    rms_start: float,
    dropped: Sequence[FurtherResult],
) -> Identification[StaticFit, IdentifiedResult]:
    elasticity, measured = fit.elasticity, fit.experiment.problem.measured
    left_out = _left_out(fit, options)
    bare_robot = _without_elements(elasticity.robot, range(len(elasticity.robot.joints)))
    bare = ElasticParameters.of(bare_robot, options.torque_curve)
    without = _left_out(fit_static(bare, measured, options), options)
    added = tuple(
        item.name
        for item in elasticity.parameters
        if item.kind in ("hysteresis", "slip_angle") and joint_of(item) in shaped
    )
    verdicts = judge_parameters(fit, added)
    if not _squares(fit, left_out) < _squares(fit, without):
        reason = "loops that are left out are not predicted better with hysteresis than without"
        acting = set(elasticity.names).difference(fit.separability.without_effect)
        verdicts = _refused(verdicts, "hysteresis", acting, reason)
    # A slip angle is nothing without its gear's slip torque.
    unknown = {
        item.name.replace("hysteresis", "slip_angle")
        for item in verdicts
        if item.kind == "hysteresis" and not item.identified
    }
    verdicts = _refused(verdicts, "slip_angle", unknown, "its gear's hysteresis is not identified")
    vanishing = np.isin(elasticity.names, added) & elasticity.chosen("hysteresis")
    default = np.where(vanishing, elasticity.least, elasticity.start)
    residual = measured.deflection - fit.experiment.prediction.deflection
    assert measured.loop is not None
    loops = tuple(
        LoopResult(
            number=int(measured.loop[rows[0]]),
            fit_m=rms(residual[rows]),
            left_out_m=rms(left_out[rows]),
            without_hysteresis_m=rms(without[rows]),
        )
        for rows in measured.sequences
    )
    default = np.where(elasticity.chosen("slip_angle"), _assumed(fit), default)
    return conclude(fit, verdicts, default, left_out, rms_start, dropped, loops=loops)


def _assumed(fit: StaticFit) -> np.ndarray:
    """Return slip angles by a data sheet's loop of that slip torque, in their intervals, (P,)."""
    elasticity, sure, assumed = fit.elasticity, fit.intervals, fit.x.copy()
    of = {
        (parameter.kind, parameter.coordinate): value
        for parameter, value in zip(elasticity.parameters, fit.x, strict=True)
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


def _left_out(fit: StaticFit, options: IdentifyOptions) -> np.ndarray:
    """Return the errors of each loop predicted by a fit of all others [m, rad], (k, r).

    A gear that no other loop turns back has the hysteresis of the start file, or none.  What the others
    hardly see besides stays as fitted, as with rows that are left out.
    """
    elasticity, measured = fit.elasticity, fit.experiment.problem.measured
    white = fit.experiment.white * fit.experiment.weight[:, None, None]
    scale, loops = fit.experiment.linear.scale, measured.sequences
    prior = np.divide(_HELD, scale, out=np.zeros_like(scale), where=scale > 0.0)

    def loop_error(fitted: list[int], number: int) -> np.ndarray:
        rows = np.concatenate([loops[k] for k in fitted])
        others, loop = measured.at_rows(rows), measured.at_rows(loops[number])
        model = StaticModel(elasticity, others, options.torque_curve)
        start = np.where(model.effective, fit.x, _before(elasticity))
        problem = StaticProblem(
            elasticity,
            others,
            model.predict,
            options.noise,
            white=white[rows],
            prior=prior,
            prior_mean=start,
        )
        values = fit_from(problem, start).x
        prediction = StaticModel(elasticity, loop, options.torque_curve).predict(values)
        return loop.deflection - prediction.deflection

    # Rows of a loop stand one after the other, and loops in their order.
    return np.concatenate(predict_left_out(len(loops), loop_error))


def _before(elasticity: ElasticParameters) -> np.ndarray:
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
    white = np.einsum("kij,kj->ki", fit.experiment.white, errors) * fit.experiment.weight[:, None]
    return float(np.sum(white**2))


def _refused(
    verdicts: tuple[ParameterResult, ...], kind: str, names: Collection[str], reason: str
) -> tuple[ParameterResult, ...]:
    """Return the verdicts, those of a kind and of some names not identified for a reason."""
    refusal = {"identified": False, "reason": reason}
    return tuple(
        verdict.model_copy(update=refusal)
        if verdict.kind == kind and verdict.name in names
        else verdict
        for verdict in verdicts
    )

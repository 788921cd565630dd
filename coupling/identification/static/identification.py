"""Identification from deflections as a whole: fit, verdict on every parameter, tests of further ones."""

from __future__ import annotations

import numpy as np

from coupling.errors import HysteresisError, IdentifyError, one_of
from coupling.identification.evidence import support
from coupling.identification.intervals import left_out
from coupling.identification.robot_file import Identification
from coupling.identification.static.elastic import ElasticParameters, candidates
from coupling.identification.static.fit import IdentifyOptions, StaticFit, fit_static
from coupling.identification.static.loops import identify_loops
from coupling.identification.static.measurements import Measurements
from coupling.identification.static.model import StaticModel
from coupling.identification.static.prediction import candidate_column
from coupling.identification.static.suspicions import common_loss, point_suspicions
from coupling.identification.static.verdicts import conclude, further_result, judge_parameters
from coupling.results.identified_result import FurtherResult, IdentifiedResult
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError

# Sizes of a further parameter that are worth a test [rad/(N m), rad].
_SIZE = {True: 1e-9, False: 1e-6}
SUPPORTED = "supported"


def identify(
    robot: Robot, measured: Measurements, options: IdentifyOptions
) -> Identification[StaticFit, IdentifiedResult]:
    """Identify a robot's elasticity, and from loading loops the hysteresis of its gears.

    Args:
        robot: The start: joints that give way, and values that are kept where not identifiable.
        options: Noise, torque curve, loss, parameters to add, none to loops.

    Raises:
        HysteresisError: If a gear has hysteresis, and rows are no loops.
        IdentifyError: If nothing can be identified at all, or no candidate has an added name.
    """
    if measured.loop is None:
        require_no_hysteresis(robot)
    elif options.add:
        raise IdentifyError(
            f"--add: expected none beside loading loops, got {', '.join(options.add)}: add it to the"
            " robot file, or take the column loop away"
        )
    elasticity = ElasticParameters.of(robot, options.torque_curve)
    if not measured.wrench.any():
        raise IdentifyError("loads: expected a force or moment in at least one row, got none")
    if not elasticity.names:
        raise IdentifyError(f"{robot.name}: expected an elastic joint or tilt, got a rigid robot")
    model = StaticModel(elasticity, measured, options.torque_curve)
    identify_measured = _identify_single if measured.loop is None else identify_loops
    return identify_measured(robot, measured, options, model.rms_at(elasticity.start))


def require_no_hysteresis(robot: Robot) -> None:
    """Refuse a robot whose gears have hysteresis, of which single loads do not tell.

    Raises:
        HysteresisError: With the joint.
    """
    for number, joint in enumerate(robot.joints, start=1):
        if joint.hysteresis:
            raise HysteresisError(
                f"{robot.name}: joint {number} has hysteresis, which identify does not know from"
                " single loads: measure loading loops, a table with a column loop, or take the"
                " [joint.gear] hysteresis out of the robot file"
            )


def _identify_single(
    robot: Robot, measured: Measurements, options: IdentifyOptions, rms_start: float
) -> Identification[StaticFit, IdentifiedResult]:
    """Return what single loads identify, with parameters that are added one after the other."""
    added: list[str] = []
    names_to_add = [name for name in options.add if name != SUPPORTED]
    while True:
        elasticity = ElasticParameters.of(robot, options.torque_curve)
        fit = fit_static(elasticity, measured, options)
        further = {each.name: each for each in _further(fit, options)}
        with_support = [each for each in further.values() if each.supported]
        if names_to_add:
            name = names_to_add.pop(0)
            if name not in further:
                raise IdentifyError(f"--add: {one_of([SUPPORTED, *further], name)}")
        elif SUPPORTED in options.add and with_support:
            name = min(with_support, key=lambda each: each.left_out_change or 0.0).name
        else:
            break
        value = further[name].value
        (candidate,) = [
            each for each in candidates(robot, options.torque_curve) if each.name == name
        ]
        robot, added_name = candidate.added_to(
            robot, candidate.in_units(np.inf if value is None else value)
        )
        added.append(added_name)
    return conclude(
        fit,
        judge_parameters(fit, added),
        # What is added and not identified vanishes.
        np.where(np.isin(elasticity.names, added), elasticity.least, elasticity.start),
        fit.experiment.in_units(left_out(fit.experiment.linear, fit.experiment.weight)),
        rms_start,
        tuple(further.values()),
        common_loss(fit.experiment),
        point_suspicions(fit.experiment),
    )


def _further(fit: StaticFit, options: IdentifyOptions) -> list[FurtherResult]:
    """Return parameters that the robot does not have, tested one by one beside those of a fit."""
    robot, at, results, whole = fit.elasticity.robot, fit.experiment, [], []
    for candidate in candidates(robot, options.torque_curve):
        try:
            column = candidate_column(robot, options.torque_curve, candidate, at.problem.measured)
        except ElasticRobotError:  # it would move no inertia
            continue
        whole.append((candidate, (at.white @ column[:, :, None])[:, :, 0]))
    for candidate, column in whole:
        problem = at.linear.also(column, _SIZE[candidate.axis is not None])
        last = np.arange(len(problem.start)) == len(at.x)
        evidence = support(problem, last, at.weight, len(whole))
        value = float(problem.weighted(at.weight).solve()[-1])
        results.append(further_result(candidate, value, evidence))
    return results

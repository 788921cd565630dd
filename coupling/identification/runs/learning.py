"""Learning as a whole: align, fit, ask how sure it is, judge every parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from coupling.errors import LearnError
from coupling.events import Progress, Watch, unwatched
from coupling.identification.motor_torques import MotorTorques, torque_remarks
from coupling.identification.runs.backlash_selection import select_backlashes
from coupling.identification.runs.effect import ParameterEffect
from coupling.identification.runs.experiment import RunExperiment
from coupling.identification.runs.fit import fit_runs
from coupling.identification.runs.judge import judge_absent, judge_parameters
from coupling.identification.runs.measurement import MeasuredPath
from coupling.identification.runs.motors import MeasuredMotors
from coupling.identification.runs.parameters import factors_between, learnable, prior_of
from coupling.identification.runs.problem import ANYWHERE, FitProblem, FramePrior
from coupling.identification.runs.residual import weigh_motors
from coupling.identification.runs.results import Learned, conclude
from coupling.identification.runs.slow_part import SlowPart
from coupling.identification.runs.source import MeasuredFile, require_comparable
from coupling.inverse.diagnosis import diagnose
from coupling.inverse.inversion import MovingRobot
from coupling.robot.parameters import apply_values, value_of
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.fmu_pool import FmuPool
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import IDEAL

# A motor under its command is no farther off the model's than this [rad], or this part of its motion.
_ANGLE_OFF, _PART_OFF = 1e-3, 0.5


def learn(
    sources: Sequence[MeasuredFile], frame: FramePrior, models: FmuPool, watch: Watch = unwatched
) -> Learned:
    """Learn a robot's parameters from measured runs.

    Args:
        sources: Runs and what was measured under their commands; the robot of the first
            one is what is known of it before, that of the last one the start.
        frame: Prior of the measuring frame in the robot's base frame.
        models: Simulation models of the robots.
        watch: Function called with the progress.

    Raises:
        LearnError: If a measurement is none of its run, or the runs' robots differ by more than is
            learned.
    """
    require_comparable(sources)
    first, last = sources[0], sources[-1]
    fmus = models.side_by_side(models.of(first.robot, first.torque_curve, first.drive).fmu)
    of_file = learnable(first.robot, first.torque_curve, first.drive)
    runs, effects = [], []
    for number, source in enumerate(sources):
        watch(Progress("learning: what the parameters do", number, len(sources) + 1))
        model_fmu = models.of(source.robot, source.torque_curve, source.drive).fmu
        model = model_fmu.simulate(source.stored.joints, source.stored.wrench, "dynamic")
        run = _with_motors(source.whole(frame == ANYWHERE, model), first)
        by = ParameterEffect(first.robot, first.torque_curve, of_file, run)
        effects.append(by)
        runs.append(_with_weights(run, by, fmus[0], first.robot))
    file_problem = FitProblem(fmus, of_file, tuple(runs), tuple(effects), frame)
    selected = select_backlashes(runs[0], effects[0], first.robot, fmus[0])
    problem = _selected(file_problem, first, selected)
    parameters = problem.parameters
    unstated = {name: b for name, b in selected.items() if not value_of(last.robot, name)}
    start = factors_between(parameters, apply_values(last.robot, unstated))
    fit = fit_runs(
        problem, start, lambda done, total: watch(Progress("learning: fit", done, total))
    )
    x = fit.x[: len(parameters)]
    effect = effect_of(problem, x)
    moving = MovingRobot(problem.robot_at(x), first.torque_curve)
    gears = diagnose(moving, problem.runs[-1].desired_motion)
    verdicts = judge_parameters(
        parameters, x, fit.deviation, fit.half, prior_of(parameters), effect, gears
    )
    # The file states no backlash of gears that have some, and some of gears that have none.
    names = {parameter.name for parameter in of_file}
    verdicts = tuple(
        v if v.name in names else v.model_copy(update={"start": 0.0}) for v in verdicts
    )
    verdicts += tuple(judge_absent(p) for p in of_file if selected.get(p.name) == 0.0)
    identifiable = any(parameter.identified for parameter in verdicts)
    whole = gears if identifiable else diagnose(moving, last.desired_motion)
    settled = replace(file_problem, spectrum=fit.experiment.problem.spectrum)
    before = RunExperiment.behind_frame(settled, np.zeros(len(of_file)))
    return conclude(sources, fit, before, verdicts, gears, whole)


def _selected(
    problem: FitProblem, source: MeasuredFile, selected: Mapping[str, float]
) -> FitProblem:
    """Return the problem of the file's robot with other backlashes [rad], by name."""
    if not selected:
        return problem
    robot = apply_values(source.robot, selected)
    parameters = learnable(robot, source.torque_curve, source.drive)
    effects = tuple(
        ParameterEffect(robot, source.torque_curve, parameters, run) for run in problem.runs
    )
    return replace(problem, parameters=parameters, effects=effects)


def _with_motors(run: MeasuredPath, source: MeasuredFile) -> MeasuredPath:
    """Return a measured run with what was recorded of motors that its robot has, and of no others."""
    motors = run.measured.motors
    if motors is not None:
        motors = None if source.drive == IDEAL else motors.of(source.robot, run.measured.name)
    return replace(run, measured=replace(run.measured, motors=motors))


def _with_weights(
    run: MeasuredPath, effect: ParameterEffect, fmu: RobotFmu, robot: Robot
) -> MeasuredPath:
    """Return a measured run whose motors count by what no parameter explains of them.

    Raises:
        LearnError: If the robot's motors cannot have their angles or torques.
    """
    motors, time = run.measured.motors, run.measured.time
    if motors is None:
        return run
    path = run.simulated(fmu, robot)
    predicted = path.motors(time)
    columns = effect(np.zeros(len(effect.parameters)), time)[:, 6:]
    columns = np.concatenate([columns, path.motors(time, 1)[:, :, None]], axis=2)
    _require_followed(run.measured.name, motors, predicted)
    motors = weigh_motors(motors, time, predicted, columns)
    motors = replace(motors, remarks=_torque_remarks(run, motors, predicted, robot))
    return replace(run, measured=replace(run.measured, motors=motors))


def _require_followed(name: str, motors: MeasuredMotors, predicted: np.ndarray) -> None:
    """Refuse angles of motors that move otherwise than the model's, predicted columns, any zero."""
    off = np.std(motors.values - predicted, axis=0)
    most = np.maximum(_ANGLE_OFF, _PART_OFF * np.std(predicted, axis=0))
    for name, (kind, _), far, bound in zip(motors.names, motors.columns, off, most, strict=True):
        if kind == "motor" and far > bound:
            raise LearnError(
                f"{name}: {name}: expected the motor's angle over the gear ratio in rad, within"
                f" {bound:.2g} rad of the model's, got a difference of {far:.2g} rad rms: is it in"
                " degrees, not divided by the gear ratio, of another joint or of another time?"
            )


def _torque_remarks(
    run: MeasuredPath, motors: MeasuredMotors, predicted: np.ndarray, robot: Robot
) -> tuple[str, ...]:
    """Return a sentence on each joint whose torque a robot hardly explains, from predicted columns."""
    torques = [k for k, (kind, _) in enumerate(motors.columns) if kind == "motor_torque"]
    joints, time = [motors.columns[k][1] for k in torques], run.measured.time
    rate = run.command.trajectory.at(np.clip(time, *run.command.time[[0, -1]]))[1][:, joints]
    values, predicted = motors.values[:, torques], predicted[:, torques]
    torques_of_run = MotorTorques(run.measured.name, joints, time, values, predicted, rate)
    return torque_remarks(torques_of_run, robot, LearnError)


def effect_of(problem: FitProblem, x: np.ndarray) -> np.ndarray:
    """Return what prior standard deviations do to the tool, less a constant [m], (P,)."""
    squares = np.zeros(len(x))
    for effect, run in zip(problem.effects, problem.runs, strict=True):
        mean = SlowPart.of(run.measured.time)
        columns = mean(effect(x, run.measured.time)[:, :3])
        columns = (columns - columns.mean(axis=0)) * prior_of(problem.parameters)
        squares += np.mean(np.sum(columns**2, axis=1), axis=0) / len(problem.runs)
    return np.sqrt(squares)

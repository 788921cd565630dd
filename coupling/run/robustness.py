"""The command as written, replayed on robots that are not quite the model, and under noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.path.linear import interpolated
from coupling.path.low_pass import low_pass
from coupling.process.smoothing import ForceNoise
from coupling.results.outlook import Replay
from coupling.robot.cell import Cell
from coupling.robot.mismatch import AS_THE_MODEL, ModelMismatch
from coupling.robot.robot_fmu import ChangedRobot, RobotFmu
from coupling.solve.correction import Correction
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import IDEAL


@dataclass(frozen=True)
class RobotVariation:
    """Robots and a load that differ from the model, all robots alike.

    Attributes:
        name: Difference from the model, in words.
        difference: Difference of every robot.
        force: Factor of the wrench.

    Example:
        >>> RobotVariation("force +5 %", force=1.05).difference is AS_THE_MODEL
        True
    """

    name: str
    difference: ModelMismatch = AS_THE_MODEL
    force: float = 1.0


VARIATIONS = (
    RobotVariation("stiffness +2 %", ModelMismatch(stiffness=(1.02,))),
    RobotVariation("stiffness -2 %", ModelMismatch(stiffness=(0.98,))),
    RobotVariation("damping -20 %", ModelMismatch(damping=(0.8,))),
    RobotVariation("backlash +20 %", ModelMismatch(backlash=(1.2,))),
    RobotVariation("backlash -20 %", ModelMismatch(backlash=(0.8,))),
    RobotVariation("hysteresis +30 %", ModelMismatch(hysteresis=(1.3,))),
    RobotVariation("hysteresis -30 %", ModelMismatch(hysteresis=(0.7,))),
    RobotVariation("friction +30 %", ModelMismatch(friction=(1.3,))),
    RobotVariation("friction -30 %", ModelMismatch(friction=(0.7,))),
    RobotVariation("servo gain +20 %", ModelMismatch(servo_gain=(1.2,))),
    RobotVariation("servo gain -20 %", ModelMismatch(servo_gain=(0.8,))),
    # The mean square of what a sine does more with any phase is that of one a quarter turn on.
    RobotVariation(
        "kinematic error, phase unknown", ModelMismatch(kinematic_error_phase=(0.5 * np.pi,))
    ),
    RobotVariation("force +5 %", force=1.05),
)


@dataclass(frozen=True)
class SimulatedModel:
    """A robot with the FMU that simulates it.

    Attributes:
        robot: Its description.
        torque_curve: Name of its gears' torque curve.
        fmu: Its FMU.
        drive: "ideal", or "servo": its motors follow the command as their servos do.
    """

    robot: Robot
    torque_curve: str
    fmu: RobotFmu
    drive: str = IDEAL


# What simulates a robot, by its description, torque curve and drive.
Simulate = Callable[[Robot, str, str], SimulatedModel]

# Lowest and highest stiffness by the number of the joint, from 1 [N m/rad].
StiffnessRanges = Mapping[int, tuple[float, float]]

# Of the noise that is drawn.
_SEED = 1


def replayed(
    cell: Cell,
    models: Sequence[SimulatedModel],
    found: Correction,
    simulate: Simulate,
) -> tuple[Replay, ...]:
    """Replay a command as written, under the validation's wrench, on moving robots that differ.

    Args:
        models: Simulation of each of them, in their order.
        found: The command.
        simulate: Function that gives the simulation of a robot with other motors or kinematic errors.

    Returns:
        A replay for each of `VARIATIONS`, but for those that change nothing, and none of rigid
        robots.

    Raises:
        SimulationError: If a robot cannot be simulated.
    """
    if all(model.robot.is_rigid for model in models):
        return ()
    replays = []
    loaded = found.response.wrench
    for variation in VARIATIONS:
        differences = [variation.difference] * len(models)
        pushes = variation.force != 1.0 and bool(np.any(loaded.wrench))
        if not (any_effect(models, differences) or pushes):
            continue
        others = [_described(model, variation.difference, simulate) for model in models]
        path = differing(cell, others, differences, variation.name).simulate(
            found.joints, loaded.scaled(variation.force), "dynamic"
        )
        replays.append(Replay.of(variation.name, path, found.desired))
    return tuple(replays)


def any_effect(models: Sequence[SimulatedModel], differences: Sequence[ModelMismatch]) -> bool:
    """Return whether models move otherwise for differences."""
    pairs = zip(models, differences, strict=True)
    return any(own.has_effect(model.robot, model.torque_curve, model.drive) for model, own in pairs)


def _described(
    model: SimulatedModel, difference: ModelMismatch, simulate: Simulate
) -> SimulatedModel:
    """Return a model with the motors, which ideal drives have not, and errors of a difference."""
    other = difference.under(model.drive).description(model.robot)
    if other == model.robot:
        return model
    return simulate(other, model.torque_curve, model.drive)


def differing(
    cell: Cell,
    models: Sequence[SimulatedModel],
    differences: Sequence[ModelMismatch],
    what: str,
) -> Cell:
    """Return the cell with robots whose parameters differ from the models'.

    Args:
        models: Simulation of each of them, with its payload, in their order.
        differences: Differences of each of them.
        what: Difference from the model, in words.
    """
    robots = zip(cell.members, models, differences, strict=True)
    return Cell(
        tuple(
            replace(
                member,
                robot=ChangedRobot(
                    model.fmu, own.parameters(model.robot, model.torque_curve), what
                ),
            )
            for member, model, own in robots
        )
    )


def noise_replays(
    cell: Cell, samples: np.ndarray, noise: ForceNoise | None, found: Correction
) -> tuple[Replay, ...]:
    """Replay a command under its forces with noise as it is left in them.

    A command that was made for forces with noise of their own is off by as much under those without.

    Args:
        samples: Times at which the process is evaluated [s], (k,).
        noise: Noise of its forces as they come.
        found: The command, with the forces without what was taken off.

    Returns:
        The replay, of white noise low-passed at the lowest cutoff of what takes it off the forces; none
        where there is no noise.

    Raises:
        SimulationError: If a robot cannot be simulated.
    """
    if noise is None or not noise.significant:
        return ()
    draw = np.random.default_rng(_SEED)
    loads, time = found.response.wrench, found.response.wrench.instants
    forces = []
    for level in noise.level:
        drawn = level[:3] * draw.standard_normal((len(samples), 3))
        if noise.filter is not None:
            drawn = low_pass(samples, drawn, noise.filter.cutoff)
        forces.append(interpolated(time, samples, drawn))
    path = cell.simulate(found.joints, loads.plus(np.stack(forces)), "dynamic")
    return (Replay.of("noise", path, found.desired),)

"""The command as written, replayed on robots that are not quite the model, and under noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.path.linear import interpolate_rows
from coupling.path.low_pass import low_pass
from coupling.results.repeatability import ForceNoise
from coupling.results.replay import BACKLASH, Replay, deviation_table
from coupling.results.run_result import RunResult
from coupling.results.section import Section
from coupling.robot.cell import Cell
from coupling.robot.differences import AS_THE_MODEL, RobotDifference
from coupling.robot.parameter_table import VARIED
from coupling.run.check import Check, CheckedCommand, of_corrections
from coupling.run.replayed_command import ReplayedCommand
from coupling.solve.correction import Correction


@dataclass(frozen=True)
class RobotVariation:
    """Robots and a load that differ from the model, all robots alike."""

    name: str
    difference: RobotDifference = AS_THE_MODEL
    force: float = 1.0


VARIATIONS = (
    *(
        RobotVariation(words, RobotDifference({name: (amount,)}))
        for name, (_, variation) in VARIED.items()
        for words, amount in variation.named_replays.items()
    ),
    RobotVariation("force +5 %", force=1.05),
)

# Of the noise that is drawn.
_SEED = 1


def replayed(command: ReplayedCommand) -> tuple[Replay, ...]:
    """Replay a command as written, under the validation's wrench, on moving robots that differ.

    Returns:
        A replay for each of `VARIATIONS`, but for those that change nothing, and none of rigid
        robots.
    """
    models = command.models
    if all(model.robot.is_rigid for model in models):
        return ()
    replays = []
    for variation in VARIATIONS:
        differing = [model.differing(variation.difference, variation.name) for model in models]
        pushes = variation.force != 1.0 and bool(np.any(command.wrench.wrench))
        differs = any(
            new.robot is not model.robot for new, model in zip(differing, models, strict=True)
        )
        if not (differs or pushes):
            continue
        replay, path = command.replay(variation.name, differing, variation.force)
        replays.append(replay.keeping(path) if variation.name.startswith(BACKLASH) else replay)
    return tuple(replays)


def noise_replays(
    cell: Cell, samples: np.ndarray, noise: ForceNoise | None, correction: Correction
) -> tuple[Replay, ...]:
    """Replay a command under its forces with noise as it is left in them.

    A command that was made for forces with noise of their own is off by as much under those without.

    Args:
        samples: Times at which the process is evaluated [s], (k,).
        noise: Noise of its forces as they come.

    Returns:
        The replay, of white noise low-passed at the lowest cutoff of what takes it off the forces; none
        where there is no noise.
    """
    if noise is None or not noise.significant:
        return ()
    draw = np.random.default_rng(_SEED)
    loads, time = correction.response.wrench, correction.response.wrench.instants
    forces = []
    for level in noise.level:
        drawn = level[:3] * draw.standard_normal((len(samples), 3))
        if noise.cutoff is not None:
            drawn = low_pass(samples, drawn, noise.cutoff)
        forces.append(interpolate_rows(time, samples, drawn))
    path = cell.simulate(correction.joints, loads.plus(np.stack(forces)), "dynamic")
    return (Replay.of("noise", path, correction.desired),)


def _compute(command: CheckedCommand) -> tuple[Replay, ...]:
    cell, correction, time = command.cell, command.correction, command.case.desired.time
    return (
        *replayed(ReplayedCommand.of(command)),
        *noise_replays(cell, time, command.noise, correction),
    )


def _sections(figures: RunResult) -> list[Section]:
    if not figures.robustness:
        return []
    text = (
        "Deviation under the command as written and under the same wrench, on dynamic robots of"
        " which one parameter differs from the model, in all gears and tilts or in all motors:"
    )
    rows = [(row.name, row.deviation) for row in figures.robustness]
    if figures.kind == "couple":
        text = "Deviation as it is estimated for a process that is evaluated twice as often:"
        return [Section("Samples of the process", (text, deviation_table(rows)))]
    return [Section("On robots that differ from the model", (text, deviation_table(rows)))]


ROBUSTNESS = Check[tuple[Replay, ...]](
    "robustness", _compute, (), of_corrections, sections=_sections
)

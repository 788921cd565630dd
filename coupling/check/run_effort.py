"""What a compensation would take, time and memory, roughly."""

from __future__ import annotations

from coupling.errors import ProcessError
from coupling.path.controller import Controller
from coupling.path.histories import ToolPath
from coupling.process.base import ProcessRequest
from coupling.results.repeatability import Repeatability
from coupling.robot.inverter import Inverter
from coupling.store import EvaluatedProcess

# What whole compensations by the inverse took on one core of a small virtual machine: cone.toml 35 s for
# 150.7 s of path and 7 535 samples, iso9283.toml 20 s for 43.1 s and 2 155 samples, two_robots.toml 32 s
# for both robots on 48.6 s and 2 431 samples; milling_20000.toml 11 s for 1.8 s and 18 021 samples,
# milling_40000.toml as long at twice the steps, pockets of other robots 42 s for 24.4 s and 121 948
# samples, 43 s for 61.5 s and 123 002, a short slot 11 s for 2.3 s and 2 348; with servos a slot 18 s
# for 2.6 s and 13 000, a pocket 44 s for 14.7 s and 73 600.
_START, _PER_SECOND, _PER_SAMPLE = 3.0, 0.1, 1.5e-4
# The same of each robot that is drawn, and how much longer servos take.
_PER_DRAW, _DRAW_PER_SECOND, _DRAW_PER_SAMPLE, _SERVOS = 0.06, 1e-3, 7e-6, 1.6
# A process that is marched, by step of its time, and how often it is: before and behind the inverse.
_PER_MARCHED_STEP, _MARCHES = 1e-4, 2.0
# Most memory that they held, in all, and by row of the path of one tool [GB]: 0.36 GB with 40 s of path
# (10 000 rows 4 ms apart), 0.50 GB with 160 s, 0.91 GB with 480 s.
_MEMORY, _MEMORY_PER_ROW = 0.3, 5e-6
# What is said before the work begins, not behind it [GB].
_REMARKED_MEMORY = 2.0
# Gears that reverse often, limits and the machine change it by so much.
_TIME_FACTOR = 2.0
# Rows that follow the inverse nearly everywhere: on longer ones every inverse is improved by as many
# simulations as it may take, each with its share of steps and servos' commands, by second of path.
_CLOSE_ROWS, _PER_SIMULATION = 0.004, 0.018
# An evaluation that takes less is made twice [s].
_ASKED_TWICE = 60.0


def estimate_run(
    desired: ToolPath,
    controller: Controller,
    rounds: int,
    each: float | None,
    draws: int = 0,
    has_servos: bool = False,
    marched_steps: float = 0.0,
) -> str:
    """Return time and memory of a compensation by the inverse of the moving robot, in words.

    Args:
        each: Time of one evaluation of the process [s], None where it was not measured.
        has_servos: Whether a robot's motors follow as their servos do.
        marched_steps: Steps of a process that is coupled marching in time; 0: of none.
    """
    duration = float(desired.time[-1] - desired.time[0])
    rows = max(len(desired.time), marched_steps)  # which samples are refined to
    work = _PER_SECOND * duration + _PER_SAMPLE * rows
    work += draws * (_PER_DRAW + _DRAW_PER_SECOND * duration + _DRAW_PER_SAMPLE * rows)
    work *= len(desired.pose) * (_SERVOS if has_servos else 1.0)
    work += _MARCHES * _PER_MARCHED_STEP * marched_steps
    low, high, improved = _START + work / _TIME_FACTOR, _START + work * _TIME_FACTOR, ""
    if controller.cycle > _CLOSE_ROWS:
        simulations = rounds * Inverter.simulations
        high += len(desired.pose) * simulations * _PER_SIMULATION * duration
        improved = (
            f" (the longest where rows every {1e3 * controller.cycle:.3g} ms are too far apart for the"
            f" path: then up to {simulations} simulations improve the command)"
        )
    measured = (
        "of unknown duration (--evaluate measures one)"
        if each is None
        else f"of {each:.2g} s each (one was measured)"
    )
    return (
        f"Estimated time of a compensation: {low:.0f} to {high:.0f} s for the robot{improved}, and"
        f" 2 to {rounds + 1} evaluations of the process {measured};"
        f" memory: about {_memory(desired):.1f} GB"
    )


def _memory(desired: ToolPath) -> float:
    """Return the memory that a compensation holds [GB]; a check holds about as much."""
    return _MEMORY + _MEMORY_PER_ROW * len(desired.pose) * len(desired.time)


def warn_of_memory(desired: ToolPath) -> str:
    """Return a sentence on a path that takes much memory; nothing on others."""
    memory = _memory(desired)
    if memory < _REMARKED_MEMORY:
        return ""
    duration = desired.time[-1] - desired.time[0]
    return (
        f"The path of {duration:.0f} s has {len(desired.time)} rows: this check and a compensation take"
        f" about {memory:.0f} GB of memory each; where there is less, divide the path at a rest"
    )


def check_repeatability(process: EvaluatedProcess, first: ProcessRequest) -> str:
    """Return whether a process is repeatable, in words."""
    seconds = first.seconds
    if seconds >= _ASKED_TWICE:
        return (
            f"the process was evaluated once, as an evaluation takes {seconds:.0f} s (twice below"
            f" {_ASKED_TWICE:.0f} s): its repeatability is not known"
        )
    try:
        return Repeatability.of(
            first.response.wrench, process.computed(first.path).wrench
        ).sentence()
    except ProcessError as error:
        return f"the process failed in a second evaluation on the same path: {error}"

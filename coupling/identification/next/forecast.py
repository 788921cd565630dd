"""Forecast of the deviation under the next command.

What the robot's model does else under the next command than under the one that was measured adds to what
was measured:

    measured + s(next command) - s(command that was measured).
"""

from __future__ import annotations

import numpy as np

from coupling.identification.next.command import CommandPlan
from coupling.identification.next.deviation_size import signal_filter
from coupling.identification.runs.measurement import SimulatedPath
from coupling.path.deviation import less_constant
from coupling.path.histories import WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.results.forecast import RunForecast

# Part of a change of the path by which the robot is expected to do another one at most, of the change's
# rms; factor by which an rms is off beside that.
_PART_OFF, _FACTOR_OFF = 0.15, 1.5


def forecast(found: CommandPlan, command: JointPath, wrench: WrenchHistory) -> RunForecast:
    """Return what a command is expected to leave.

    Args:
        found: Plan by which it was computed.
        command: The command.
        wrench: Wrench on the tool under it, axes of the robot's base.

    Raises:
        SimulationError: If the robot cannot be simulated.
    """
    history, model, absolute = found.history, found.model, found.options.absolute
    number = found.reference
    run = history.runs[number]
    time, low = run.measured.time, signal_filter(run.measured.time)

    def slow(off: np.ndarray) -> np.ndarray:
        kept = low.at_samples(low(off))
        return kept if absolute else less_constant(time, kept)

    after = history.fmu.simulate(command, wrench, "dynamic", history.robot_at(model.x))
    change = SimulatedPath(after).position(time) - history.simulated(number, model.x).position(time)
    left = slow(run.deviation + change)
    noise = 3.0 * run.noise**2 * low.of_noise
    square = max(_mean_square(time, left) - noise, 0.0) + run.size.fast**2
    if found.correction is not None:
        # The command takes off noise of the very run from which it is computed; in the next one it is
        # there.
        square += 6.0 * run.noise**2 * found.correction.noise_share
    rms = float(np.sqrt(square))
    off = _PART_OFF**2 * _mean_square(time, slow(change)) + found.options.random**2
    return RunForecast(
        rms=rms,
        low=rms / _FACTOR_OFF,
        high=float(np.sqrt((_FACTOR_OFF * rms) ** 2 + off)),
        maximum=max(float(np.linalg.norm(left, axis=1).max()), rms),
        absolute=absolute,
        before=found.options.rms_of(history.runs[-1].size),
        robots=tuple(
            {
                own.name: float(np.exp(value))
                for own, value in zip(history.parameters, x, strict=True)
            }
            for x in model.robots
        ),
        left_over=model.left_over,
    )


def _mean_square(time: np.ndarray, off: np.ndarray) -> float:
    """Return the mean over time of the square of displacements (n, 3)."""
    return float(np.trapezoid(np.sum(off**2, axis=1), time) / np.ptp(time))

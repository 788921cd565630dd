"""Forecast of the deviation under the next command: measured + s(next command) - s(measured command).

s is the robot's model; what it does not describe is expected to repeat.
"""

from __future__ import annotations

import numpy as np

from coupling.identification.next.command import CommandPlan
from coupling.identification.next.deviation_size import signal_filter
from coupling.identification.next.learning_filter import low_passed
from coupling.identification.runs.measurement import SimulatedPath
from coupling.path.deviation import less_constant
from coupling.path.histories import WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.results.forecast import RunForecast

# Least rms by which a peak is told [m].
_LEAST = 1e-9
# Part of a change of the path that the robot does not do as its model, of the change's rms, up to
# frequencies that a run has tried, with parameters that were learned and with those of the file; factor
# within which an rms is expected beside that.
_PART_OFF, _PART_OFF_OF_FILE, _FACTOR = 0.15, 0.25, 1.5


def forecast(plan: CommandPlan, command: JointPath, wrench: WrenchHistory) -> RunForecast:
    """Return what a command is expected to leave.

    Args:
        plan: Plan by which it was computed.
        wrench: Wrench on the tool under it, axes of the robot's base.

    Raises:
        SimulationError: If the robot cannot be simulated.
    """
    history, model, absolute = plan.history, plan.model, plan.options.absolute
    base, newest = plan.step.base, len(history.runs) - 1
    run = history.runs[base]
    low_pass = signal_filter(run.measured.time)

    def slow(deviation: np.ndarray) -> np.ndarray:
        part = low_pass(deviation)
        return part if absolute else less_constant(low_pass.time, part)

    after = SimulatedPath(
        history.fmu.simulate(command, wrench, "dynamic", history.robot_at(model.x))
    )

    def change_since(number: int) -> np.ndarray:
        time = history.runs[number].measured.time
        change: np.ndarray = after.position(time) - history.simulated(number, model.x).position(
            time
        )
        return change

    change = change_since(base)
    deviation = run.deviation + change
    # A constant is learned from the last run, whichever goes on.
    constant = np.median(history.runs[newest].deviation + change_since(newest), axis=0)
    residual = slow(deviation - np.median(deviation, axis=0) + constant)
    noise = 3.0 * run.noise**2 * low_pass.of_noise
    square = max(_mean_square(residual) - noise, 0.0) + run.size.fast**2
    if plan.correction is not None:
        # The correction takes off noise of the run that it is computed from; the next one has its own.
        square += 6.0 * run.noise**2 * plan.correction.noise_share
    rms = float(np.sqrt(square))
    moved = slow(change)
    spacing = float(low_pass.time[1] - low_pass.time[0])
    untried = moved - low_passed(spacing, moved, plan.tried_cutoff)
    part_off = _PART_OFF if model.has_parameters else _PART_OFF_OF_FILE
    uncertainty = part_off**2 * _mean_square(moved) + _mean_square(untried) + plan.options.random**2
    before = plan.options.rms_of(history.runs[-1].size)
    last = history.runs[-1].source.forecast
    if last is not None and last.absolute == absolute:  # what it missed may be missed again
        uncertainty += max(before**2 - last.rms**2, 0.0)
    size, largest = run.size, float(np.linalg.norm(residual, axis=1).max())
    largest_measured = size.maximum if absolute else size.maximum_less_constant
    measured_peak = largest_measured / max(plan.options.rms_of(size), _LEAST)
    peaks = (max(measured_peak, largest / max(rms, _LEAST)), max(measured_peak, _peak(moved)))
    return RunForecast(
        rms=rms,
        low=rms / _FACTOR,
        high=upper_end(rms, uncertainty),
        maximum=upper_end(rms, uncertainty, *peaks),
        absolute=absolute,
        before=before,
    )


def upper_end(
    rms: float, uncertainty: float, peak_left: float = 1.0, peak_unknown: float = 1.0
) -> float:
    """Return the upper end of the range of an rms, or of the largest distance [m].

    Args:
        rms: Rms that is expected [m].
        uncertainty: Mean square of what may come to it [m^2].
        peak_left: Largest distance of what is left over its rms: as measured, or as the model expects.
        peak_unknown: The same of what is uncertain: as measured, or as the change, such as a constant.

    Example:
        >>> print(f"{1e3 * upper_end(9e-5, (25e-2 * 3.2e-3) ** 2, 5.0, 1.2):.2f} mm")
        1.17 mm
    """
    return float(np.hypot(_FACTOR * peak_left * rms, peak_unknown * np.sqrt(uncertainty)))


def _peak(values: np.ndarray) -> float:
    """Return the largest of vectors (n, 3) over their rms."""
    return float(np.linalg.norm(values, axis=1).max()) / max(_mean_square(values) ** 0.5, _LEAST)


def _mean_square(values: np.ndarray) -> float:
    return float(np.mean(np.sum(values**2, axis=1)))

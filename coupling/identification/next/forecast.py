"""Forecast of the deviation under the next command, from robots that are possible.

A robot s that is possible has beyond its model what was measured less what it does under the command
that was measured.  If it does that again, the next run is

    measured + s(next command) - s(command that was measured),

so that each s predicts where the tool will be; the true one does but for what is new.  How far possible
robots lie from the model, and how much is new, follows from the runs so far (`repeatability`): the
forecast is drawn from all of that.
"""

from __future__ import annotations

import numpy as np

from coupling.events import Progress, Watch, unwatched
from coupling.identification.next.command import CommandPlan
from coupling.identification.next.deviation_size import signal_filter
from coupling.identification.next.repeatability import VALUES
from coupling.identification.runs.measurement import SimulatedPath
from coupling.path.deviation import less_constant
from coupling.path.histories import WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.results.forecast import RunForecast

# Forecasts that are drawn, and what of them the interval holds.
_DRAWN, _INTERVAL = 4000, (0.05, 0.95)
# Spread of the logarithm of an rms that no robot tells of: what a gear does that is unloaded in its
# backlash.
_UNTOLD = 0.15


def forecast(
    found: CommandPlan, command: JointPath, wrench: WrenchHistory, watch: Watch = unwatched
) -> RunForecast:
    """Return what a command is expected to leave.

    Args:
        found: Plan by which it was computed.
        command: The command.
        wrench: Wrench on the tool under it, axes of the robot's base.
        watch: Function called with the progress.

    Raises:
        SimulationError: If the robot cannot be simulated.
    """
    history, model, beyond = found.history, found.move.model, found.repeating
    number, absolute = found.reference, found.options.absolute
    run = history.runs[number]
    time, low = run.measured.time, signal_filter(run.measured.time)

    def slow(off: np.ndarray) -> np.ndarray:
        kept = low.at_samples(low(off))
        return kept if absolute else less_constant(time, kept)

    def moved(x: np.ndarray) -> np.ndarray:
        after = history.fmu.simulate(command, wrench, "dynamic", history.robot_at(x))
        change: np.ndarray = SimulatedPath(after).position(time) - history.simulated(
            number, x
        ).position(time)
        return change

    likely = moved(model.x)
    left, off = slow(run.deviation + likely), []
    for k, x in enumerate(model.close):
        watch(Progress("forecast: robots that are possible", k, len(model.close)))
        off.append(slow(moved(x) - likely))

    rng = np.random.default_rng(found.options.seed)
    drawn = found.hypotheses.drawn(_DRAWN, rng)
    robot = np.arange(_DRAWN) % len(off)
    square = _mean(time, left, left) - 3.0 * run.noise**2 * low.of_noise + run.size.fast**2
    crossed = np.array([_mean(time, left, own) for own in off])[robot]
    spread = np.array([_mean(time, own, own) for own in off])[robot]
    squares = square + 2.0 * np.sqrt(drawn.factor) * crossed + drawn.factor * spread
    doubt = run.size.doubt
    # What was new in that run is in what is left of it, but for the part w that the command takes off;
    # of two new ones with the squares n^2 the next run has 1 + w^2, what is left (1 - w)^2.
    weight = 0.0 if beyond is None or not beyond.weights else beyond.weights[-1]
    own = rng.chisquare(VALUES, _DRAWN) / VALUES
    squares += (own + 2.0 * weight - 1.0) * drawn.new
    # Its product with what is left is that of one of so many components.
    along = np.sqrt(max(square, 0.0) * drawn.new / VALUES)
    squares += 2.0 * along * rng.standard_normal(_DRAWN)
    if beyond is not None:
        # The command takes off noise of the very run from which it is computed; in the next one it is
        # there.
        squares += 6.0 * run.noise**2 * beyond.own_noise
    squares += doubt * rng.standard_normal(_DRAWN)
    rms = np.sqrt(np.maximum(squares, 0.0)) * np.exp(_UNTOLD * rng.standard_normal(_DRAWN))
    least, most = np.quantile(rms, _INTERVAL)
    largest = [np.linalg.norm(left + own, axis=1).max() for own in off]
    return RunForecast(
        rms=float(np.median(rms)),
        low=float(least),
        high=float(most),
        maximum=float(max(np.median(largest), np.median(rms))),
        absolute=absolute,
        before=found.left(history.runs[-1].size),
        robots=tuple(
            {
                own.name: float(np.exp(value))
                for own, value in zip(history.parameters, x, strict=True)
            }
            for x in model.robots
        ),
        scales=tuple(model.scales.tolist()),
        left_over=model.left_over,
    )


def _mean(time: np.ndarray, one: np.ndarray, other: np.ndarray) -> float:
    """Return the mean over time of the product of displacements (n, 3)."""
    return float(np.trapezoid(np.sum(one * other, axis=1), time) / np.ptp(time))

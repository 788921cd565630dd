"""What the next command will leave, told by robots that are possible.

A robot s that is possible has beyond its model what was measured less what it does under the command
that was measured.  If it does that again, the next pass is

    measured + s(next command) - s(command that was measured),

so that each s tells where the tool will be; a robot that is the true one tells it but for what is new.
"""

from __future__ import annotations

import numpy as np

from coupling.events import Progress, Watch, unwatched
from coupling.learn.history import Size
from coupling.learn.next_command import Plan
from coupling.learn.parameters import changed
from coupling.learn.passes import Simulated
from coupling.path.histories import JointPath, WrenchHistory
from coupling.run.forecast import Forecast

# 90 of 100 of a normal variable lie within so many deviations.
_NINETY = 1.6449
# Spread of the logarithm of an rms that no robot tells of: what a gear does that hangs in its backlash.
_UNTOLD = 0.15


def forecast(
    found: Plan, command: JointPath, wrench: WrenchHistory, watch: Watch = unwatched
) -> Forecast:
    """Return what a command is expected to leave.

    Args:
        found: How it was computed.
        command: The command.
        wrench: Wrench on the tool under it, axes of the robot's base.
        watch: Told how far it is.

    Raises:
        SimulationError: If the robot cannot be simulated.
    """
    history, robots, beyond = found.history, found.move.model.robots, found.repeating
    number = found.told_from
    run = history.runs[number]
    sizes = []
    for k, x in enumerate(robots):
        watch(Progress("forecast: robots that are possible", k, len(robots)))
        values = changed(history.parameters, x)
        after = Simulated(history.fmu.simulate(command, wrench, "dynamic", values))
        moved = after.position(run.seen.time) - history.simulated(number, x).position(run.seen.time)
        sizes.append(Size.of(run.seen.time, run.deviation + moved, run.noise))
    absolute = found.options.absolute
    rms = np.array([found.left(own) for own in sizes])
    if beyond is not None:
        # The command takes off noise of the very pass that it is told from; in the next one it is there.
        rms = np.sqrt(rms**2 + 6.0 * run.noise**2 * beyond.own_noise + beyond.new**2)
    most = np.array([own.maximum if absolute else own.maximum_less_constant for own in sizes])
    doubt = _NINETY * max(own.doubt for own in sizes)
    logs = np.log(np.maximum(rms, 1e-9))
    middle, spread = float(np.median(logs)), float(np.hypot(np.std(logs), _UNTOLD))
    return Forecast(
        rms=float(np.exp(middle)),
        low=float(np.sqrt(max(np.exp(2.0 * (middle - _NINETY * spread)) - doubt, 0.0))),
        high=float(np.sqrt(np.exp(2.0 * (middle + _NINETY * spread)) + doubt)),
        maximum=float(max(np.median(most), np.exp(middle))),
        absolute=absolute,
        before=found.left(history.runs[-1].size),
        robots=tuple(
            {
                own.name: float(np.exp(factor))
                for own, factor in zip(history.parameters, x, strict=True)
            }
            for x in robots
        ),
    )

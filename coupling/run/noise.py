"""What noise that is left in the forces costs a command."""

from __future__ import annotations

import numpy as np

from coupling.path.deviation import measure
from coupling.path.linear import interpolated
from coupling.path.low_pass import low_pass
from coupling.process.smoothing import ForceNoise
from coupling.results.outlook import Replay
from coupling.robot.cell import Cell
from coupling.solve.correction import Correction

# Of the noise that is drawn.
_SEED = 1


def noise_replays(
    cell: Cell, samples: np.ndarray, noise: ForceNoise | None, found: Correction
) -> tuple[Replay, ...]:
    """Replay a command under its forces with noise as it is left in them.

    A command that was made for forces with noise of their own is off by as much under those without.

    Args:
        cell: The robots.
        samples: Times at which the process is asked [s], (k,).
        noise: Noise of its forces as they come.
        found: The command, with the forces without what was taken off.

    Returns:
        The replay, of white noise low-passed at the lowest cutoff of what takes it off the forces; none
        where there is no noise.

    Raises:
        SimulationError: If a robot cannot be simulated.
    """
    if noise is None or not noise.heard:
        return ()
    draw = np.random.default_rng(_SEED)
    loads, time = found.answer.wrench, found.answer.wrench.instants
    forces = []
    for level in noise.level:
        drawn = level[:3] * draw.standard_normal((len(samples), 3))
        if noise.filter is not None:
            drawn = low_pass(samples, drawn, noise.filter.cutoff)
        forces.append(interpolated(time, samples, drawn))
    path = cell.simulate(found.joints, loads.plus(np.stack(forces)), "dynamic")
    pairs = zip(path.tools, found.desired.tools, strict=True)
    tools = tuple(measure(own, desired) for own, desired in pairs)
    return (Replay("noise", measure(path, found.desired), tools),)

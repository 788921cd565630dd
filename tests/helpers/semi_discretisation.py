"""Growth of a vibration in a cut by first-order semi-discretisation, as an independent computation.

Each period is divided into steps; within a step the gain is its mean, and the delayed motion a
straight line between its values at the steps (Insperger and Stepan). The state is that of the structure
and the tip's motion at all steps of the longest delay.
"""

import numpy as np
from scipy.linalg import expm

from coupling.stability.steady_cut import SteadyCut
from coupling.stability.structure import Structure

# Gauss points of the mean gain within a step.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def real_states(structure: Structure) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return A, B and C of x' = A x + B w, u = C x, from the modes and their conjugates."""
    rate, pair = structure.eigenvalue, structure.is_pair
    blocks, drive, shown = [], [], []
    for k, value in enumerate(rate):
        b, c = structure.driving[k], structure.displacement[:, k]
        if pair[k]:
            blocks.append(np.array([[value.real, -value.imag], [value.imag, value.real]]))
            drive += [b.real, b.imag]
            shown += [c.real, -c.imag]
        else:
            blocks.append(np.array([[value.real]]))
            drive.append(b.real)
            shown.append(c.real)
    size = sum(len(block) for block in blocks)
    a, start = np.zeros((size, size)), 0
    for block in blocks:
        a[start : start + len(block), start : start + len(block)] = block
        start += len(block)
    return a, np.array(drive), np.array(shown).T


def semi_discretised_growth(structure: Structure, cut: SteadyCut, steps: int) -> float:
    """Return the growth [1/s]; all delays must be whole steps of the period."""
    a, b, c = real_states(structure)
    step, size = cut.period / steps, len(a)
    regeneration = [channel for channel in cut.channels if channel.delay is not None]
    delays = [round(channel.delay / step) for channel in regeneration]
    longest = max(delays)
    whole = np.eye(size + 2 * longest)
    for number in range(steps):
        times = step * (number + 0.5 * (1.0 + _NODES))
        means = [
            np.einsum("t,tij->ij", 0.5 * _WEIGHTS, cut.gain(channel, times))
            for channel in regeneration
        ]
        now = a + b @ sum(means) @ c
        # exp of the matrix that holds the answers to a constant and to a straight line.
        inputs = np.hstack([b @ mean for mean in means])
        count = inputs.shape[1]
        large = np.zeros((size + 2 * count, size + 2 * count))
        large[:size, :size] = now
        large[:size, size : size + count] = -inputs
        large[size : size + count, size + count :] = np.eye(count)
        answer = expm(large * step)
        advance = np.zeros_like(whole)
        advance[:size, :size] = answer[:size, :size]
        for k, delay in enumerate(delays):
            constant = answer[:size, size + 2 * k : size + 2 * k + 2]
            slope = answer[:size, size + count + 2 * k : size + count + 2 * k + 2] / step
            # The motion a delay before this step begins, and before it ends.
            earlier, later = size + 2 * (delay - 1), size + 2 * (delay - 2)
            advance[:size, earlier : earlier + 2] += constant - slope
            if delay == 1:
                advance[:size, :size] += slope @ c
            else:
                advance[:size, later : later + 2] += slope
        advance[size : size + 2, :size] = c
        advance[size + 2 :, size:-2] = np.eye(2 * longest - 2)
        whole = advance @ whole
    return float(np.log(np.abs(np.linalg.eigvals(whole)).max()) / cut.period)

"""Least squares over simulations, intervals of its parameters, and which of them are identifiable.

Residuals are correlated over time and between channels: a fit without one block of a recording, for
every block, shows how much the values owe to it [Kunsch1989].  Blocks are several times as long as the
residuals are correlated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import correlate

from coupling.identification.motion.problem import MotionProblem
from coupling.identification.motion.sensors import SensorParameter
from coupling.identification.verdict import quantile

# Iterations, each with the channels weighed by what is left of them: most steps, and what settles them.
_ITERATIONS = ((5, 1e-2), (8, 1e-4))
# The solver starts so far inside its bounds.
_INSIDE = 1e-6
# An encoder's error is identifiable with an interval below this part of itself, or of its usual size,
# which shows that there is none.
_OF_ITSELF, _NARROW = 1.0, 0.3
# A channel weighs at most so many times as much as its measured size says.
_LEAST_PART = 1e-3
# What is left of a channel counts as this at least [rad, N m]: below is rounding.
_EXACT = 1e-9
# Length of a block over the correlation time, and how many there are at least and at most.
_TIMES, _FEWEST, _MOST = 8.0, 12, 60
# Size of slow errors, over the usual one, at least and at most: data sheets do not allow more.  Steps to
# the likeliest.
_LEAST_SLOW, _MOST_SLOW, _SIZINGS = 0.01, 1.0, 60
# Eigenvalues of scaled normal matrices below this part of the largest are not seen.
_UNSEEN = 1e-11


@dataclass(frozen=True)
class MotionFit:
    """A fitted robot.

    Attributes:
        problem: The problem with the last weights.
        x: Values as the fit counts, parts of usual sizes [1], (P,).
        blocks: Its normal equations, block by block.
        converged: Whether the last step moved nothing.
    """

    problem: MotionProblem
    x: np.ndarray
    blocks: NormalBlocks
    converged: bool


def fitted(problem: MotionProblem, x: np.ndarray | None = None) -> MotionFit:
    """Return the fit of a problem's parameters, from given values [1], (P,), or those of the start."""
    if x is None:
        x = _with_beside(problem, problem.start)
    converged = True
    for most, settled in _ITERATIONS:
        problem = reweighed(problem, x)
        if not len(x):
            break
        lowest, highest = problem.bounds
        residual, jacobian = _with_prior(problem)
        found = least_squares(
            residual,
            np.clip(x, lowest + _INSIDE, highest - _INSIDE),
            jacobian,
            bounds=(lowest, highest),
            x_scale=1.0,
            max_nfev=most,
            xtol=settled,
            ftol=settled,
        )
        x, converged = found.x, found.status > 0
    return MotionFit(problem, x, _blocks(problem, x), converged)


def _with_beside(problem: MotionProblem, x: np.ndarray) -> np.ndarray:
    """Return x with what is beside the model solved for: it is linear, and the lag nearly."""
    own = np.array([isinstance(p, SensorParameter) for p in problem.parameters], dtype=bool)
    if not own.any():
        return x
    beside = reweighed(problem, x).only(own)
    residual, jacobian = _with_prior(beside)
    step = np.linalg.lstsq(jacobian(x[own]), -residual(x[own]), rcond=1e-9)[0]
    found = x.copy()
    found[own] += step
    return np.clip(found, *problem.bounds)


def sized(fit: MotionFit) -> MotionProblem:
    """Return a fit's problem with the size of slow errors that its recordings make likeliest.

    Expectation maximisation of the marginal likelihood (evidence, [MacKay1992]),
    joint by joint, all parameters to first order.
    """
    problem, blocks = fit.problem, fit.blocks
    prior = np.array([p.prior for p in problem.parameters])
    slow = np.array(
        [isinstance(p, SensorParameter) and p.of_slow_error for p in problem.parameters]
    )
    joints = np.array([p.joint for p in problem.parameters])
    for _ in range(_SIZINGS):
        blocks = replace(blocks, prior=problem.correlated / prior**2)
        square = (fit.x + blocks.step) ** 2 + blocks.spread
        for i in set(joints[slow].tolist()):
            own = slow & (joints == i)
            prior[own] = np.clip(np.sqrt(np.mean(square[own])), _LEAST_SLOW, _MOST_SLOW)
    parameters = zip(problem.parameters, prior.tolist(), strict=True)
    return replace(problem, parameters=tuple(replace(p, prior=own) for p, own in parameters))


def _with_prior(
    problem: MotionProblem,
) -> tuple[Callable[[np.ndarray], np.ndarray], Callable[[np.ndarray], np.ndarray]]:
    """Return residual and derivatives by x, with rows of what is known before beneath."""
    root, start = np.sqrt(problem.prior), problem.start
    return (
        lambda x: np.concatenate([problem.residual(x), root * (x - start)]),
        lambda x: np.vstack([problem.jacobian(x), np.diag(root)]),
    )


def reweighed(problem: MotionProblem, x: np.ndarray) -> MotionProblem:
    """Return the problem with channels weighed by the rms of what is left of them at x [1], (P,)."""
    wind_up, torque = [], []
    for moved in problem.moved:
        left = problem.left(moved, problem.predicted(moved, x))
        wind_up.append(left[0])
        torque.append(left[1])
    measured = np.vstack([moved.recording.torque for moved in problem.moved])
    least = _LEAST_PART * rms(measured)
    return replace(
        problem,
        wind_up_deviation=np.maximum(rms(np.vstack(wind_up)), _EXACT),
        torque_deviation=np.maximum(rms(np.vstack(torque)), np.maximum(least, _EXACT)),
    )


def rms(values: np.ndarray) -> np.ndarray:
    """Return the rms of columns (n, k), any unit, (k,); nan where one holds nan."""
    return np.sqrt(np.mean(values**2, axis=0))


def _blocks(problem: MotionProblem, x: np.ndarray) -> NormalBlocks:
    residual, jacobian = problem.residual(x), problem.jacobian(x)
    rows = [len(moved.recording.time) for moved in problem.moved]
    blocks = NormalBlocks.of(jacobian, residual, rows, len(residual) // sum(rows))
    away = problem.start - x
    return replace(blocks, prior=problem.prior, away=away, correlated=problem.correlated)


def identifiable(fit: MotionFit) -> np.ndarray:
    """Return the mask of parameters of a fit that the recordings identify, (P,).

    What an interval does not bound to its usual size, or, of what is not negative, away from none, stays
    as in the start, the widest first; the others answer, to first order.  What is known before is not
    left out: it is between start and recordings.
    """
    known = fit.problem.prior > 0.0
    chosen = np.ones(len(fit.x), dtype=bool)
    away = fit.problem.start - fit.x
    while chosen.any():
        blocks = fit.blocks.only(chosen, away)
        x = fit.x[chosen] + blocks.step
        width = blocks.half * blocks.deviation / _allowed(fit.problem.only(chosen), x)
        width[known[chosen]] = 0.0
        worst = int(np.argmax(width))
        if width[worst] <= 1.0:
            break
        chosen[np.flatnonzero(chosen)[worst]] = False
    return chosen


def narrow(fit: MotionFit) -> np.ndarray:
    """Return the mask of parameters with an interval as narrow as `identifiable` asks, (P,)."""
    width = fit.blocks.half * fit.blocks.deviation / _allowed(fit.problem, fit.x)
    own = [isinstance(p, SensorParameter) and p.of_slow_error for p in fit.problem.parameters]
    return np.asarray(width <= 1.0) & ~np.array(own, dtype=bool)


def _allowed(problem: MotionProblem, x: np.ndarray) -> np.ndarray:
    """Return half of the widest interval of an identifiable parameter, (P,)."""
    allowed = np.where([p.signed for p in problem.parameters], 1.0, np.clip(x, 1e-9, 1.0))
    for k, p in enumerate(problem.parameters):
        if p.vanishes:
            allowed[k] = _NARROW
        if isinstance(p, SensorParameter):
            allowed[k] = max(_OF_ITSELF * abs(x[k]), _NARROW)
    return allowed


def correlation_time(residual: np.ndarray) -> float:
    """Return the integrated correlation time of the slowest channel [rows]: 1 of white noise.

    Args:
        residual: Residuals, any unit, (n, channels).
    """
    longest = 1.0
    for channel in residual.T:
        centred = channel - channel.mean()
        covariance = correlate(centred, centred, method="fft")[len(centred) - 1 :]
        if covariance[0] <= 0.0:
            continue
        correlation = covariance / covariance[0]
        ends = np.flatnonzero(correlation <= 0.0)
        last = int(ends[0]) if len(ends) else len(correlation)
        longest = max(longest, float(1.0 + 2.0 * np.sum(correlation[1:last])))
    return longest


@dataclass(frozen=True)
class NormalBlocks:
    """Normal equations of least squares, block of time by block: sums over g are the whole problem.

    Attributes:
        matrices: J^T J of each block [1], (g, P, P).
        vectors: -J^T r of each block [1], (g, P).
        prior: Weights of squares of departures from what is known before [1], (P,).
        away: From the values to what is known before [1], (P,).
        correlated: Number of rows that count as one beside the prior.
    """

    matrices: np.ndarray
    vectors: np.ndarray
    prior: np.ndarray
    away: np.ndarray
    correlated: float = 1.0

    @classmethod
    def of(
        cls, jacobian: np.ndarray, residual: np.ndarray, rows: Sequence[int], channels: int
    ) -> NormalBlocks:
        """Return the blocks of a linearised problem.

        Args:
            jacobian: Derivatives of the residual [1], rows of time with all channels, (r, P).
            residual: The weighed residual [1], (r,).
            rows: Number of rows of time of each recording.
            channels: Number of channels in each row.
        """
        ends = np.cumsum(rows)[:-1]
        parts = np.split(residual.reshape(-1, channels), ends)
        own = np.split(jacobian.reshape(-1, channels, jacobian.shape[1]), ends)
        length = _TIMES * max(correlation_time(part) for part in parts)
        total = int(np.clip(sum(rows) / length, _FEWEST, _MOST))
        matrices, vectors = [], []
        for part, columns in zip(parts, own, strict=True):
            count = max(1, round(total * len(part) / sum(rows)))
            for r, a in zip(
                np.array_split(part, count), np.array_split(columns, count), strict=True
            ):
                flat = a.reshape(-1, a.shape[2])
                matrices.append(flat.T @ flat)
                vectors.append(-flat.T @ r.ravel())
        none = np.zeros(jacobian.shape[1])
        return cls(np.array(matrices), np.array(vectors), none, none)

    def only(self, chosen: np.ndarray, others: np.ndarray) -> NormalBlocks:
        """Return the problem of some parameters with the others moved.

        Args:
            chosen: Mask of those that stay, (P,).
            others: Change of the others [1], (P,); what stands at those chosen does not count.
        """
        moved = self.matrices[:, :, ~chosen] @ others[~chosen]
        return NormalBlocks(
            self.matrices[:, chosen][:, :, chosen],
            (self.vectors - moved)[:, chosen],
            self.prior[chosen],
            self.away[chosen],
            self.correlated,
        )

    @property
    def _whole(self) -> tuple[np.ndarray, np.ndarray]:
        matrix = self.matrices.sum(axis=0) + np.diag(self.prior)
        return matrix, self.vectors.sum(axis=0) + self.prior * self.away

    @property
    def step(self) -> np.ndarray:
        """Solution of the whole problem [1], (P,)."""
        return _solved(*self._whole)

    @property
    def spread(self) -> np.ndarray:
        """Variances of the solution, were so many rows one and of size 1 [1], (P,)."""
        return self.correlated * np.diag(_inverse(self._whole[0]))

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations of the solution by jackknife over blocks and by the prior [1], (P,)."""
        matrix, vector = self._whole
        each = np.array(
            [
                _solved(matrix - own, vector - part)
                for own, part in zip(self.matrices, self.vectors, strict=True)
            ]
        )
        count = len(each)
        away = each - each.mean(axis=0)
        by_prior = self.correlated * _inverse(matrix) ** 2 @ self.prior
        deviation = np.sqrt((count - 1) / count * np.sum(away**2, axis=0) + by_prior)
        return np.where(np.diag(matrix) > 0.0, deviation, np.inf)

    @property
    def half(self) -> np.ndarray:
        """Half of 95 % intervals over the standard deviations [1], (P,).

        Student's, with the number of blocks that carry the information on a parameter, which may be few.
        """
        inverse = _inverse(self._whole[0])
        carried = np.einsum("ij,gjk,ki->gi", inverse, self.matrices, inverse)
        whole = np.maximum(np.sum(carried**2, axis=0), 1e-300)
        count = np.maximum(np.sum(carried, axis=0) ** 2 / whole, 2.0)
        return np.array([quantile(own - 1.0) for own in count.tolist()])


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Return the inverse of normal equations, zero along what they do not see."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    scale[scale == 0.0] = np.inf
    both = np.outer(scale, scale)
    return np.linalg.pinv(matrix / both, rcond=_UNSEEN, hermitian=True) / both


def _solved(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Return the solution of normal equations, none along what they do not see."""
    return _inverse(matrix) @ vector

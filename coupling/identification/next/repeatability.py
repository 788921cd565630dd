"""What is new in every measured run, and how well a model predicts what a changed command does.

Both make a run other than the ones before it say: what is new by as much in every run, a wrong model
by more where the command changed more.  How large they are is not known, so a Kalman filter takes the
runs for each of many pairs of them, and each pair counts by how well it explains what was measured,
and by what is likely before (multiple models [BarShalom2001, section 11.6]).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# Rms distance of what is new, by the repeatability RP of ISO 9283: RP is the mean of the distances and
# three standard deviations of them, 3.6 standard deviations of a coordinate.
_OF_RP = float(np.sqrt(3.0) / 3.6)
# What is new, by its likely size; factor of the variance that possible robots tell of a change, with the
# standard deviation of its logarithm: possible robots are themselves only an estimate.
_SIZES = np.concatenate([[0.0], np.geomspace(0.1, 20.0, 24)])
_FACTORS, _FACTOR_SPREAD = np.exp(np.linspace(-3.0, 5.0, 17)), 1.0
# Independent values of a slow displacement in a run: a shift and a drift in three directions.
VALUES = 6.0
# Least variance [m^2], so that measurements without noise are compared as well.
_LEAST = 1e-18


@dataclass(frozen=True)
class Hypotheses:
    """Pairs of what is new and how wrong a model is, with how likely each is.

    Attributes:
        new: Mean square of what is new in a run [m^2], (g,).
        factor: Factor of the variance that possible robots tell of a change [1], (g,).
        likely: Probability of each pair [1], (g,).
    """

    new: np.ndarray
    factor: np.ndarray
    likely: np.ndarray

    @classmethod
    def before(cls, repeatability: float) -> Hypotheses:
        """Return what is likely before there are runs to compare.

        Args:
            repeatability: RP of the robot [m].
        """
        size, factor = (own.ravel() for own in np.meshgrid(_SIZES, _FACTORS, indexing="ij"))
        width = np.gradient(_SIZES).repeat(len(_FACTORS))
        likely = width / (1.0 + size**2) ** 2
        likely *= np.exp(-0.5 * (np.log(factor) / _FACTOR_SPREAD) ** 2)
        new = (size * _OF_RP * repeatability) ** 2
        return cls(new, factor, likely / likely.sum())

    @property
    def rms(self) -> float:
        """Expected rms distance of what is new in a run [m]."""
        return float(np.sqrt(self.likely @ self.new))

    def drawn(self, count: int, rng: np.random.Generator) -> Hypotheses:
        """Return pairs by chance, as likely as they are here, (count,)."""
        rows = rng.choice(len(self.likely), count, p=self.likely)
        return Hypotheses(self.new[rows], self.factor[rows], np.full(count, 1.0 / count))


@dataclass(frozen=True)
class ComparedRuns:
    """Runs, compared.

    Attributes:
        weights: Weights of the runs in what repeats, (runs,).
        hypotheses: Hypotheses on what is new in a run, and on how wrong the model is.
    """

    weights: np.ndarray
    hypotheses: Hypotheses

    @classmethod
    def of(
        cls,
        repeating: Sequence[np.ndarray],
        noise: Sequence[float],
        changes: Sequence[float],
        before: Hypotheses,
        gain: float = 1.0,
    ) -> ComparedRuns:
        """Return how much each run counts.

        Args:
            repeating: Part that repeats, as each run tells it: displacement [m] and rotation vector
                [rad], (k, 6).
            noise: Mean square of the noise in it [m^2], (runs,).
            changes: Mean square of what possible robots differ by in the change from the run before
                [m^2], (runs,); the first does not count.
            before: Hypotheses before any run is compared.
            gain: Largest weight of a run.
        """
        new, factor = before.new, before.factor
        variance = noise[0] + new
        weights = np.full((len(new), 1), gain)
        score = np.log(np.maximum(before.likely, 1e-300))
        places = np.array(repeating)[:, :, :3]
        products = np.einsum("pkc,qkc->pq", places, places) / places.shape[1]
        for number in range(1, len(repeating)):
            known = variance + factor * changes[number]
            expected = np.maximum(known + noise[number] + new, _LEAST)
            # The surprise is the difference of this run and the weighted ones before.
            off = np.append(-weights, np.ones((len(new), 1)), axis=1)
            own = products[: number + 1, : number + 1]
            square = np.maximum(np.einsum("gp,pq,gq->g", off, own, off), 0.0)
            score -= 0.5 * VALUES * (np.log(expected) + square / expected)
            part = np.minimum(gain, known / expected)[:, None]
            weights = np.append((1.0 - part) * weights, part, axis=1)
            variance = (1.0 - part[:, 0]) * known
        likely = np.exp(score - score.max())
        found = Hypotheses(new, factor, likely / likely.sum())
        return cls(found.likely @ weights, found)

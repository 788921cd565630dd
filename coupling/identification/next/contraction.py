"""When learning along the path converges: every robot that is possible must shrink what is left.

A correction d of the tool's path goes through the inverse of the model, G_model^-1, and the robot makes
R d = G_true G_model^-1 d of it.  With the gain g and the filter Q of zero phase what is left of a
deviation e after the next run is (I - g Q R) e [Bristow2006].  Where Q lets through what the robot
answers with its own modes this grows from run to run, so Q ends below them, for all robots that are
possible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from coupling.errors import LearnError
from coupling.inverse.link_model import LinkModel
from coupling.results.next_result import Contraction
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

# Part of what is estimated that is corrected at most: all of it.
GAIN = 1.0
# What may be left of a deviation after a measured run, up to the cutoff where it is learned.
LEARNED = 0.7
# What may be left at any frequency: no filter that lets anything through keeps to 1 where the robot
# answers against the model, between the mode of the one and that of the other; 1 % a run is 10 % in
# ten.
EVERYWHERE = 1.01
# Cutoffs to choose from [Hz]: above 5 Hz few robots of the size that this is for follow.
CUTOFFS = (5.0, 4.0, 3.0, 2.5, 2.0, 1.6, 1.3, 1.0, 0.8, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1)
# Frequencies that are looked at [Hz], closer than the width of a mode of damping ratio 0.01.
_FREQUENCIES = np.concatenate([np.linspace(0.05, 5.0, 100), np.geomspace(5.05, 60.0, 250)])


@dataclass(frozen=True)
class Responses:
    """What possible robots make of a correction, by what the model makes of it.

    Attributes:
        frequency: Frequencies [Hz], (f,).
        ratio: R for positions of every pair of posture and robot at every frequency [m/m], complex,
            (pairs, f, 3, 3).
        lowest_mode: Lowest eigenfrequency of the model on its path [Hz].
    """

    frequency: np.ndarray
    ratio: np.ndarray
    lowest_mode: float

    @classmethod
    def of(
        cls,
        robot: Robot,
        postures: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        frequency: np.ndarray = _FREQUENCIES,
    ) -> Responses:
        """Return the responses of robots that differ from a model in stiffness and damping.

        The gears are on their flanks: M x'' + d x' + k x = -M_xq q'', tool = J_x x + J_q q.

        Args:
            robot: The model.
            postures: Joint angles [rad], (p, joints).
            stiffness, damping: Factors of the elastic coordinates of each robot [1], (r, m).
            frequency: Frequencies [Hz], (f,).
        """
        model, nominal = LinkModel(robot), Parameters.of(robot)
        chain = model.chain
        theta = np.array([chain.theta(angles) for angles in postures])
        at_rest = np.zeros_like(theta)
        _, by = model.linearised(theta, at_rest, at_rest, np.zeros((len(theta), 6)))
        ratios, lowest = [], np.inf
        for mass, jacobian in zip(by.load[:, 2, chain.elastic], by.jacobian, strict=True):
            system = _Posture(
                mass[:, chain.elastic],
                mass[:, chain.drive],
                jacobian[:, chain.elastic],
                jacobian[:, chain.drive],
            )
            lowest = min(lowest, system.lowest_mode(nominal.stiffness))
            nominally = system.response(nominal.stiffness, nominal.damping, frequency)
            inverse = np.linalg.pinv(nominally)[..., :3]
            for k, d in zip(stiffness, damping, strict=True):
                true = system.response(k * nominal.stiffness, d * nominal.damping, frequency)
                ratios.append(true[:, :3] @ inverse)
        return cls(frequency, np.array(ratios), lowest)

    def remaining(self, gain: float, passed: np.ndarray) -> np.ndarray:
        """Return what is left of a deviation at worst, |I - g Q R| over all robots [1], (f,).

        Args:
            gain: g.
            passed: Q at the frequencies [1], (f,).
        """
        eye = np.eye(3)
        remaining = eye - (gain * passed)[:, None, None] * self.ratio
        worst: np.ndarray = np.linalg.norm(remaining, ord=2, axis=(2, 3)).max(axis=0)
        return worst


@dataclass(frozen=True)
class _Posture:
    """Mass matrix of the elastic coordinates, theirs with the drives, and their Jacobians."""

    mass: np.ndarray
    driven: np.ndarray
    elastic: np.ndarray
    drives: np.ndarray

    def response(
        self, stiffness: np.ndarray, damping: np.ndarray, frequency: np.ndarray
    ) -> np.ndarray:
        """Return the tool's pose by the drives' angles, complex, (f, 6, joints)."""
        omega = 2.0 * np.pi * frequency[:, None, None]
        stiff = np.diag(stiffness) + 1j * omega * np.diag(damping) - omega**2 * self.mass
        pushed = np.linalg.solve(stiff, omega**2 * self.driven)
        return self.drives + self.elastic @ pushed

    def lowest_mode(self, stiffness: np.ndarray) -> float:
        """Return the lowest eigenfrequency without damping [Hz]."""
        if not len(stiffness):
            return np.inf
        squares = eigh(np.diag(stiffness), self.mass, eigvals_only=True, subset_by_index=(0, 0))
        return float(np.sqrt(squares[0]) / (2.0 * np.pi))


def contraction(responses: Responses, gain: float, cutoff: float) -> Contraction:
    """Return what a gain and a cutoff [Hz] leave at worst.

    The filter is the Gaussian of `SlowPart`.
    """
    frequency = responses.frequency
    remaining = responses.remaining(gain, 0.5 ** (0.5 * (frequency / cutoff) ** 2))
    low = frequency <= cutoff
    learned, everywhere = float(remaining[low].max()), float(remaining.max())
    return Contraction(
        gain,
        cutoff,
        learned,
        everywhere,
        float(frequency[remaining.argmax()]),
        responses.lowest_mode,
        len(responses.ratio),
        holds=learned <= LEARNED and everywhere <= EVERYWHERE,
    )


def chosen(responses: Responses, gain: float = GAIN, cutoff: float | None = None) -> Contraction:
    """Return the contraction with the highest cutoff that holds for all robots, or the one asked for.

    Args:
        responses: Responses of possible robots to a correction.
        gain: g.
        cutoff: Cutoff that is asked for [Hz]; None: the highest of `CUTOFFS` that holds.

    Raises:
        LearnError: If the cutoff that is asked for, or every one, lets a deviation grow.
    """
    offered = CUTOFFS if cutoff is None else (cutoff,)
    contractions = []
    for offered_cutoff in offered:
        contractions.append(contraction(responses, gain, offered_cutoff))
        if contractions[-1].holds:
            return contractions[-1]
    if cutoff is None:
        raise LearnError(
            "expected a robot on which a correction along the path converges, got one whose stiffness is"
            f" so uncertain that at every cutoff down to {CUTOFFS[-1]:g} Hz a deviation may grow:"
            f" {contractions[-1].sentence}"
        )
    best, refused = chosen(responses, gain), contractions[0]
    raise LearnError(
        f"--cutoff-Hz: expected at most {best.cutoff:g} Hz on this robot and path, got {cutoff:g} Hz,"
        f" where of a deviation below that {100 * refused.learned:.0f} % may remain after the next run"
        f" (limit {100 * LEARNED:.0f} %), and {100 * refused.everywhere:.1f} % at"
        f" {refused.worst_frequency:.1f} Hz (limit {100 * EVERYWHERE:.0f} %)"
    )

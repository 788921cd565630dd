"""Motion of the drives that follow commands given at the starts of steps, without those to come.

Over a step of length h after one of length k, with [x]_b for x limited to the range from 0 to b,

    q(s) = q + q' s + q'' s^2 / 2 + j s^3 / 6 + o(s / h)

    j = [4 q'' + 2 q''_last - 6 (q' - q'_last) / k]_2(q'' - q''_last) / max(k, h / r)
    o(u) = (1 - u)^3 (a + (3 a + b) u),     o(0) = a,  h o'(0) = b,  o = o' = o'' = 0 at u = 1
    a = -[q - q_end]_B,  b = -h [q' - q'_end]_C,    B = c^2 (q'' - q''_end) / 2,  C = c (q'' - q''_end)

where q_end is where the drive arrived in the last step, c = min(k, r h) and r the setting
`neighbour_ratio`.  j is the present slope of the parabola that is q'' at both commands and whose
integral q' has gained in between.  The offset o leads the drive from where it arrived to where it is
commanded, continuous in angle and rate.  What q'' cannot explain by one change, at any time of the last
step, is a jump of the command: the drive is there at once, and the deflections are as they were.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf

import numpy as np

from elastic_robot.settings import SETTINGS

# A step that is not longer is not taken [s]: it says nothing of how the drives go on.
_NO_STEP = SETTINGS.shortest_step * SETTINGS.longest_step
# Coefficients of 1 to u^4 of (1 - u)^3 (a + (3 a + b) u) by a and b.
_OFFSET = np.array([[1.0, 0.0], [0.0, 1.0], [-6.0, -3.0], [8.0, 3.0], [-3.0, -1.0]])
_EXPONENTS = np.arange(5.0)[:, None]


@dataclass(frozen=True)
class Command:
    """Command of the drives at a step's start.

    Attributes:
        q, qd, qdd: Angle, rate and acceleration [rad, rad/s, rad/s^2], (n,).
        jerk: Rate of qdd over the step [rad/s^3], (n,); nan where it is not given.
    """

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    jerk: np.ndarray


@dataclass(frozen=True)
class LastStep:
    """The last step, as the next one needs it.

    Attributes:
        length: Its length [s].
        end: q, q', q'' of the drives at its end [rad, rad/s, rad/s^2], (3, n).
        rate, acceleration: Command at its start [rad/s, rad/s^2], (n,).
    """

    length: float
    end: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray


@dataclass(frozen=True)
class CommandedMotion:
    """Drives over one step.

    Attributes:
        command: Command at its start.
        start: Time of its start [s].
        powers: Coefficients of 1 to s^4 in the angles [rad], s from the step's start [s], (5, n).
    """

    command: Command
    start: float
    powers: np.ndarray

    @classmethod
    def after(
        cls, past: LastStep | None, command: Command, start: float, length: float
    ) -> CommandedMotion:
        """Return the motion over a step.

        Args:
            past: The step before; None where there was none: the command is followed as it is.
            command: Command at its start.
            start: Time of its start [s].
            length: Its length [s].

        Example:
            >>> rising = Command(*np.array([[0.0], [0.0], [2.0], [np.nan]]))
            >>> past = LastStep(0.1, np.array([[0.0], [0.0], [1.0]]), np.array([-0.15]), np.ones(1))
            >>> motion = CommandedMotion.after(past, rising, 0.0, 0.1)
            >>> float(motion.at(np.array([0.1]))[2, 0, 0].round(9))  # q'' grows by 1 rad/s^2 a step
            3.0
        """
        powers = np.zeros((5, len(command.q)))
        powers[:3] = command.q, command.qd, 0.5 * command.qdd
        estimated_jerk = 0.0
        if past is not None and length > _NO_STEP:
            gained, q, qd = _explain_change(past, command, length)
            powers += _OFFSET @ np.array([-q, -length * qd]) / length**_EXPONENTS
            estimated_jerk = gained / max(past.length, length / SETTINGS.neighbour_ratio)
        powers[3] += np.where(np.isnan(command.jerk), estimated_jerk, command.jerk) / 6.0
        return cls(command, start, powers)

    @cached_property
    def _columns(self) -> np.ndarray:
        """Coefficients of q, q' and q'' side by side, (5, 3 n)."""
        columns = np.zeros((5, 3, self.powers.shape[1]))
        columns[:, 0] = self.powers
        columns[:4, 1] = _EXPONENTS[1:] * self.powers[1:]
        columns[:3, 2] = _EXPONENTS[1:4] * columns[1:4, 1]
        return columns.reshape(5, -1)

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return q, q', q'' [rad, rad/s, rad/s^2] at times (k,) [s], (3, k, n)."""
        values: np.ndarray = (times - self.start)[:, None] ** _EXPONENTS[:, 0] @ self._columns
        return values.reshape(len(times), 3, -1).swapaxes(0, 1)

    def next_kink(self, time: float, jump: float) -> float:
        """Return infinity: the motion is a polynomial."""
        del time, jump
        return inf

    def past(self, end: float, before: LastStep | None) -> LastStep | None:
        """Return the step as the next one's last; if too short to be taken, the one before it."""
        length = end - self.start
        if length <= _NO_STEP:
            return before
        drives = self.at(np.array([end]))[:, 0]
        return LastStep(length, drives, self.command.qd, self.command.qdd)


def _explain_change(past: LastStep, command: Command, length: float) -> np.ndarray:
    """Return what q'' would gain over one more step like the last one, and what was missed, (3, n).

    In angle and rate, as far as the accelerations explain it.
    """
    c = min(past.length, SETTINGS.neighbour_ratio * length)
    q, qd, qdd = command.q - past.end[0], command.qd - past.end[1], command.qdd - past.end[2]
    mean = (command.qd - past.rate) / past.length
    gained = 4.0 * command.qdd + 2.0 * past.acceleration - 6.0 * mean
    values = np.array([gained, q, qd])
    bounds = np.array([2.0 * (command.qdd - past.acceleration), 0.5 * c * c * qdd, c * qdd])
    upper, lower = np.maximum(bounds, 0.0), np.minimum(bounds, 0.0)
    return np.maximum(np.minimum(values, upper), lower)

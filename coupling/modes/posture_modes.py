"""Modes and compliance of a robot in a posture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.modes.locked_robot import LockedRobot
from elastic_robot.errors import ParameterError
from elastic_robot.linearisation import Linearisation

# Frequencies of a response: between these shares of the lowest and the highest mode, and how many.
_BELOW, _ABOVE, _COUNT = 0.3, 2.0, 600
# Points close to a mode, within so many of its half widths.
_CLOSE = np.linspace(-4.0, 4.0, 17)
# Where no mode swings [Hz].
_LOW, _HIGH = 1.0, 100.0


@dataclass(frozen=True)
class PostureModes:
    """A robot in a posture under a wrench, its motors locked.

    Attributes:
        q: Angles of its drives [rad], (joints,).
        wrench: Wrench on the tool, base axes [N, N m], (6,).
        joints: Number of the joint of each elastic coordinate, from 1.
        unloaded: Numbers of the joints whose gears are unloaded in their backlash, from 1.
        contact: Stiffness of the process against displacements of the TCP, base axes [N/m], (3, 3);
            zero: none.
    """

    q: np.ndarray
    wrench: np.ndarray
    linear: Linearisation
    joints: tuple[int, ...]
    unloaded: tuple[int, ...]
    contact: np.ndarray

    @classmethod
    def of(
        cls,
        locked: LockedRobot,
        q: np.ndarray,
        wrench: np.ndarray,
        contact: np.ndarray | None = None,
    ) -> PostureModes:
        """Return the modes of a robot.

        Args:
            q: Angles of its drives [rad], (joints,).
            wrench: Wrench on the tool, base axes [N, N m], (6,).
            contact: Stiffness of the process, base axes [N/m], (3, 3); None: none.
        """
        stiffness = np.zeros((3, 3)) if contact is None else contact
        linear = locked.linear(q, wrench)
        return cls(q, wrench, linear, locked.joints, locked.unloaded_joints(linear), stiffness)

    @property
    def swinging(self) -> np.ndarray:
        """Numbers of the modes that swing, slowest first, (k,)."""
        return np.flatnonzero(np.isfinite(self.linear.modes.frequency))

    @property
    def frequency(self) -> np.ndarray:
        """Eigenfrequencies of the modes that swing [Hz], (k,)."""
        return self.linear.modes.frequency[self.swinging]

    @property
    def damping_ratio(self) -> np.ndarray:
        """Their damping ratios [1], (k,)."""
        return self.linear.modes.damping_ratio[self.swinging]

    @property
    def tcp(self) -> np.ndarray:
        """Direction in which each of them moves the TCP most, base axes, of length 1, (k, 3)."""
        amplitudes = self.linear.modes.tcp[:3, self.swinging].T
        return np.array([_main_axis(vector) for vector in amplitudes]).reshape(-1, 3)

    @property
    def energy(self) -> np.ndarray:
        """Share of each joint in the elastic energy of each of them [1], (k, joints)."""
        shape = self.linear.modes.shape[:, self.swinging]
        return np.array([self.shares(column) for column in shape.T]).reshape(-1, len(self.q))

    def shares(self, elastic: np.ndarray) -> np.ndarray:
        """Return the joints' shares in the elastic energy of a motion [1], (joints,).

        Args:
            elastic: Amplitudes of the elastic coordinates [rad], complex, (m,).
        """
        energy = np.abs(np.diag(self.linear.stiffness)) * np.abs(elastic) ** 2
        by_joint = np.zeros(len(self.q))
        np.add.at(by_joint, np.array(self.joints, dtype=int) - 1, energy)
        total = by_joint.sum()
        return by_joint / total if total > 0.0 else by_joint

    @cached_property
    def compliance(self) -> np.ndarray | None:
        """Static compliance of the TCP, base axes [m/N], (3, 3); None where a gear is free."""
        return self._static(np.zeros((3, 3)))

    @cached_property
    def compliance_in_contact(self) -> np.ndarray | None:
        """The same with the process, which holds the TCP too [m/N], (3, 3); None without one."""
        return self._static(self.contact) if np.any(self.contact) else None

    def _static(self, contact: np.ndarray) -> np.ndarray | None:
        lever = self.linear.output[:3, : len(self.linear.mass)]
        stiffness = self.linear.stiffness + lever.T @ contact @ lever
        if len(stiffness) == 0:
            return np.zeros((3, 3))
        if self.unloaded:
            return None
        static: np.ndarray = lever @ np.linalg.solve(stiffness, self.linear.forcing[:, :3])
        return static

    @property
    def response_frequencies(self) -> np.ndarray:
        """Frequencies at which the response is worth looking at, closest at the modes [Hz], (n,)."""
        f, zeta = self.frequency, np.clip(self.damping_ratio, 1e-3, 0.5)
        if len(f) == 0:
            return np.geomspace(_LOW, _HIGH, _COUNT)
        wide = np.geomspace(_BELOW * f.min(), _ABOVE * f.max(), _COUNT)
        close = (f[:, None] * (1.0 + zeta[:, None] * _CLOSE)).ravel()
        return np.unique(np.concatenate([wide, close[close > 0.0]]))

    def response(self, frequency: np.ndarray) -> np.ndarray:
        """Return the dynamic compliance of the TCP, base axes [m/N], complex, (n, 3, 3).

        Args:
            frequency: Frequencies [Hz], (n,).
        """
        if len(self.linear.mass) == 0:
            return np.zeros((len(frequency), 3, 3), dtype=complex)
        return self.linear.dynamic_compliance(frequency)[:, :3, :3]

    @cached_property
    def peak(self) -> tuple[float, float]:
        """Largest dynamic compliance in any direction [m/N], and its frequency [Hz]."""
        frequency = self.response_frequencies
        try:
            size = np.linalg.norm(self.response(frequency), ord=2, axis=(1, 2))
        except ParameterError:
            return np.inf, 0.0
        largest = int(np.argmax(size))
        return float(size[largest]), float(frequency[largest])

    def softest(self, compliance: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the largest displacement by a unit force [m/N], and its direction, (3,).

        Args:
            compliance: A static compliance, base axes [m/N], (3, 3).
        """
        directions, size, _ = np.linalg.svd(compliance)
        return float(size[0]), _upright(directions[:, 0])


def _main_axis(vector: np.ndarray) -> np.ndarray:
    """Return the direction in which a complex amplitude is largest, (3,)."""
    in_phase = vector * np.exp(-0.5j * np.angle(np.sum(vector**2)))
    length = float(np.linalg.norm(in_phase.real))
    return _upright(in_phase.real / length) if length > 0.0 else np.zeros(3)


def _upright(direction: np.ndarray) -> np.ndarray:
    """Return a direction whose largest component is positive."""
    sign = np.sign(direction[np.argmax(np.abs(direction))])
    return direction * (sign if sign else 1.0) + 0.0

"""What vibrates at the tool's tip: modes of robot and tool in series, driven by the wrench of the cut.

    z' = lambda z + B w,    u = Re(C z)

in modal coordinates z; w is the wrench on the tool and u the displacement of its tip along the feed and
to its left, in the axes of the cut (`coupling.process.cutting_force`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.errors import StabilityError
from elastic_robot.linearisation import Linearisation

# Components of a wrench: force and moment.
WRENCH = 6
# Eigenvectors that are nearer to each other have no modal coordinates.
_DEFECTIVE = 1e13


@dataclass(frozen=True)
class ToolMode:
    """Bending mode of tool, holder and spindle, alike in all directions across the tool's axis.

    Attributes:
        frequency: Eigenfrequency without damping [Hz], > 0.
        damping_ratio: Damping ratio [1], > 0, < 1.
        stiffness: Modal stiffness at the tip, as if the spindle's housing were held [N/m], > 0.
    """

    frequency: float
    damping_ratio: float
    stiffness: float


@dataclass(frozen=True)
class Structure:
    """Modes that the cut can move.

    Attributes:
        eigenvalue: lambda [1/s], (k,): of each conjugate pair that whose imaginary part is > 0, and all
            that are real.
        driving: Matrix B, modal participation of a wrench in the axes of the cut, (k, 6).
        displacement: Matrix C, displacement of the tip along the feed and to its left [m], (2, k), twice
            where the eigenvalue stands for a pair.

    Example:
        >>> spring = Structure.of_modes([ToolMode(922.0, 0.011, 1.34e6)])
        >>> compliance = spring.answer(np.array([0.0]), np.eye(6)[:, :2])[0]
        >>> abs(compliance).round(9).tolist()  # 1/k along the feed and across
        [[7.46e-07, 0.0], [0.0, 7.46e-07]]
    """

    eigenvalue: np.ndarray
    driving: np.ndarray
    displacement: np.ndarray

    @classmethod
    def of_robot(cls, linear: Linearisation, base_from_cut: np.ndarray) -> Structure:
        """Return the modes of a robot.

        Args:
            linear: The robot, linearised.
            base_from_cut: Rotation from the axes of the cut (feed, left of it, spindle) to its base,
                (3, 3).

        Raises:
            StabilityError: If its eigenvectors are not independent.
        """
        a, b, _, _ = linear.state_space
        count = len(linear.mass)
        turn = np.kron(np.eye(2), base_from_cut)
        outputs = base_from_cut[:, :2].T @ linear.output[:3, :count]
        return cls._of_states(a, b[:, :WRENCH] @ turn, np.hstack([outputs, np.zeros_like(outputs)]))

    @classmethod
    def of_modes(cls, modes: list[ToolMode]) -> Structure:
        """Return the bending modes of a tool, each along the feed and to its left."""
        parts = [cls._of_mode(mode, axis) for mode in modes for axis in range(2)]
        return cls.in_series(*parts)

    @classmethod
    def _of_mode(cls, mode: ToolMode, axis: int) -> Structure:
        omega = 2.0 * np.pi * mode.frequency
        a = np.array([[0.0, 1.0], [-(omega**2), -2.0 * mode.damping_ratio * omega]])
        b, c = np.zeros((2, WRENCH)), np.zeros((2, 2))
        b[1, axis], c[axis, 0] = omega**2 / mode.stiffness, 1.0
        return cls._of_states(a, b, c)

    @classmethod
    def _of_states(cls, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> Structure:
        """Return the modes of x' = a x + b w, u = c x."""
        values, vectors = np.linalg.eig(a)
        # Displacements in m and rates in m/s: columns of one length.
        if not np.linalg.cond(vectors) < _DEFECTIVE:
            raise StabilityError(
                "expected modes that are independent, got two that are the same: change a damping or a"
                " stiffness of the robot by a thousandth"
            )
        driving = np.linalg.solve(vectors, b.astype(complex))
        shown = np.flatnonzero(values.imag >= 0.0)
        twice = np.where(values[shown].imag > 0.0, 2.0, 1.0)
        eigenvalue = values[shown].astype(complex)
        return cls(eigenvalue, driving[shown], (c @ vectors)[:, shown] * twice)

    @classmethod
    def in_series(cls, *parts: Structure) -> Structure:
        """Return the structure whose tip moves by the sum of the parts under one wrench."""
        return cls(
            np.concatenate([part.eigenvalue for part in parts]),
            np.vstack([part.driving for part in parts]),
            np.hstack([part.displacement for part in parts]),
        )

    @property
    def is_pair(self) -> np.ndarray:
        """Mask of the eigenvalues that stand for a conjugate pair, (k,)."""
        paired: np.ndarray = self.eigenvalue.imag > 0.0
        return paired

    @property
    def fastest(self) -> float:
        """Highest angular frequency of a mode that swings [rad/s]; 0 where none does."""
        return float(self.eigenvalue.imag.max(initial=0.0))

    def answer(self, exponent: np.ndarray, wrench: np.ndarray) -> np.ndarray:
        """Return the displacement of the tip by wrenches that go with exp(s t).

        Args:
            exponent: Exponents s [1/s], i omega for a vibration, complex, (n,).
            wrench: Wrenches in the axes of the cut [N, N m], columns, (6, c).

        Returns:
            Along the feed and to its left [m], complex, (n, 2, c).
        """
        s = np.asarray(exponent, dtype=complex)[:, None]
        # Half of C for each of a pair; an eigenvalue that is real has no conjugate.
        half, pair = np.where(self.is_pair, 0.5, 1.0) * self.displacement, self.is_pair
        driven = self.driving @ wrench
        rates = np.append(self.eigenvalue, self.eigenvalue[pair].conj())
        shown = np.hstack([half, half[:, pair].conj()])
        part = np.vstack([driven, self.driving[pair].conj() @ wrench])
        columns = (shown[:, :, None] * part[None]).transpose(1, 0, 2).reshape(len(rates), -1)
        # A mode that moves freely has no answer at rest: a large one stands for it.
        apart = np.where(s == rates, np.finfo(float).tiny ** 0.25, s - rates)
        total = (1.0 / apart) @ columns
        return total.reshape(len(s), 2, -1)

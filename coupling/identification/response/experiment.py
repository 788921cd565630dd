"""Frequency responses of a robot in several postures as a nonlinear least squares problem.

With the robot's linearisation in a posture, of mass M, stiffness K = G + diag(a k) and dampers d, the
motion along c by a force along b is

    H = c^T Z^-1 b,    Z = G + diag(a k) + i w diag(d) - w^2 M
    dH/dk_i = -(Z^-1 c)_i (Z^-1 b)_i a_i,    dH/dd_i = -i w (Z^-1 c)_i (Z^-1 b)_i

where a_i is 1 for a tilt and a gear on its flank, 0 for a gear in its backlash, and G is of gravity.
Residuals are the real and imaginary part of log H: peaks and valleys count alike, and a model whose
peaks are elsewhere is not out of reach.  Parameters are the logs of factors of k and d, then for each
posture the log of a factor and a delay [0.1 ms] of what was measured, those of sensors and filters.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.identification.least_squares import HUBER, reduced_rows
from coupling.modes.measured_response import MeasuredResponse
from elastic_robot.linearisation import Linearisation

_AXES = "xyz"
# Noise floor of a response, in parts of its largest value: valleys below it tell of noise alone.
_FLOOR = 0.05
# Parameters of the instruments in a posture: a factor and a delay, which is in this unit [s].
INSTRUMENT, DELAY = 2, 1e-4


@dataclass(frozen=True)
class PostureResponse:
    """A robot in a posture, and what was measured there.

    Attributes:
        mass: M of the elastic coordinates [kg m^2], (m, m).
        constant: G, the stiffness that is not of springs [N m/rad], (m, m).
        active: Mask a of the coordinates whose spring acts, 1 or 0, (m,).
        lever: Displacement of the TCP by the elastic coordinates, base axes [m/rad], (3, m).
        measured: The measured responses.
    """

    mass: np.ndarray
    constant: np.ndarray
    active: np.ndarray
    lever: np.ndarray
    measured: tuple[MeasuredResponse, ...]

    @classmethod
    def of(
        cls, linear: Linearisation, stiffness: np.ndarray, measured: tuple[MeasuredResponse, ...]
    ) -> PostureResponse:
        """Return a posture of a robot with springs of a stiffness [N m/rad], (m,)."""
        diagonal = np.diag(linear.stiffness)
        active = (diagonal > 0.5 * stiffness).astype(float)
        constant = linear.stiffness - np.diag(active * stiffness)
        lever = linear.output[:3, : len(stiffness)]
        return cls(linear.mass, 0.5 * (constant + constant.T), active, lever, measured)

    def log_residual(
        self, stiffness: np.ndarray, damping: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return log of model over measurement and its derivatives by the logs of k and d.

        Args:
            stiffness, damping: k and d [N m/rad, N m s/rad], (m,).

        Returns:
            Complex residuals [1], (n,), and their derivatives, (n, 2 m).
        """
        residuals, columns = [], []
        spring = self.constant + np.diag(self.active * stiffness)
        for frequency, responses in self._by_frequency:
            omega = 2.0 * np.pi * frequency[:, None, None]
            impedance = spring + 1j * omega * np.diag(damping) - omega**2 * self.mass
            sides = np.broadcast_to(self.lever.T, (len(omega), *self.lever.T.shape))
            moved = np.linalg.solve(impedance, sides)  # symmetric: of forces and of motions alike
            for response in responses:
                to, by = (_AXES.index(axis) for axis in response.name)
                value = moved[:, :, by] @ self.lever[to]
                product = -moved[:, :, to] * moved[:, :, by] / value[:, None]
                by_damping = 1j * omega[:, :, 0] * damping * product
                residuals.append(np.log(value / response.compliance))
                columns.append(np.hstack([product * self.active * stiffness, by_damping]))
        return np.concatenate(residuals), np.vstack(columns)

    def modes(self, stiffness: np.ndarray, damping: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return frequencies [Hz], rising, and damping ratios [1] of the modes that swing, (k,) each."""
        spring = self.constant + np.diag(self.active * stiffness)
        count = len(spring)
        rates = -np.linalg.solve(self.mass, np.hstack([spring, np.diag(damping)]))
        values = np.linalg.eigvals(np.vstack([np.eye(count, 2 * count, count), rates]))
        swinging = values[values.imag > 0.0]
        swinging = swinging[np.argsort(np.abs(swinging))]
        return np.abs(swinging) / (2.0 * np.pi), -swinging.real / np.abs(swinging)

    @cached_property
    def trust(self) -> np.ndarray:
        """Weight of each residual [1], (n,): 1 / sqrt(1 + (f / |H|)^2) with a noise floor f."""
        sizes = [np.abs(response.compliance) for response in self.in_order]
        relative = np.concatenate([_FLOOR * size.max() / size for size in sizes])
        return 1.0 / np.hypot(1.0, relative)

    @cached_property
    def by_instrument(self) -> np.ndarray:
        """Derivatives of the residuals by the log of a factor and a delay [1, 1/0.1 ms], (n, 2)."""
        frequency = np.concatenate([response.frequency for response in self.in_order])
        delay = 2j * np.pi * frequency * DELAY
        return np.column_stack([-np.ones(len(frequency)), delay])

    @cached_property
    def in_order(self) -> list[MeasuredResponse]:
        """The responses in the order of their residuals."""
        return [response for _, responses in self._by_frequency for response in responses]

    @cached_property
    def _by_frequency(self) -> list[tuple[np.ndarray, list[MeasuredResponse]]]:
        """Return the responses by the frequencies that they share."""
        groups: list[tuple[np.ndarray, list[MeasuredResponse]]] = []
        for response in self.measured:
            for frequency, responses in groups:
                if np.array_equal(frequency, response.frequency):
                    responses.append(response)
                    break
            else:
                groups.append((response.frequency, [response]))
        return groups


@dataclass(frozen=True)
class ResponseProblem:
    """What was measured, and what is known before.

    Attributes:
        postures: Postures with their responses.
        stiffness, damping: k and d where all factors are 1 [N m/rad, N m s/rad], (m,).
        prior: Standard deviations of the parameters around 0, their units, (2 m + 2 postures,).
        deviation: Standard deviation of the real and imaginary residuals [1].
    """

    postures: tuple[PostureResponse, ...]
    stiffness: np.ndarray
    damping: np.ndarray
    prior: np.ndarray
    deviation: float

    def at(self, x: np.ndarray) -> ResponseExperiment:
        """Return the experiment around values of the parameters, their units."""
        stiffness, damping = self.parameters(x)
        residuals, columns = [], []
        at = 2 * len(self.stiffness)
        for posture in self.postures:
            residual, rows = posture.log_residual(stiffness, damping)
            place = slice(at, at + INSTRUMENT)
            by_all = np.zeros((len(rows), len(x)), dtype=complex)
            by_all[:, : rows.shape[1]], by_all[:, place] = rows, posture.by_instrument
            residuals.append(posture.trust * (residual + posture.by_instrument @ x[place]))
            columns.append(posture.trust[:, None] * by_all)
            at += INSTRUMENT
        return ResponseExperiment(self, x, np.concatenate(residuals), np.vstack(columns))

    def parameters(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return k and d [N m/rad, N m s/rad], (m,) each."""
        by_stiffness, by_damping = np.split(x[: 2 * len(self.stiffness)], 2)
        return self.stiffness * np.exp(by_stiffness), self.damping * np.exp(by_damping)


@dataclass(frozen=True)
class ResponseExperiment:
    """An experiment around values of its parameters.

    Attributes:
        experiment: The problem.
        x: The values, their units, (P,).
        residual: Weighted log of model over measurement [1], complex, (n,).
        columns: Its derivatives by them [1 per unit of x], complex, (n, P).
    """

    problem: ResponseProblem
    x: np.ndarray
    residual: np.ndarray
    columns: np.ndarray
    is_exact = True
    unit = 1.0

    @cached_property
    def weight(self) -> np.ndarray:
        """Square roots of Huber's weights over the standard deviation [1], (n,)."""
        size = np.abs(self.residual) / self.problem.deviation
        return np.sqrt(HUBER / np.maximum(size, HUBER)) / self.problem.deviation

    @cached_property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Weighted derivatives and residual with what is known before, reduced to P rows."""
        columns, prior = self.columns * self.weight[:, None], self.problem.prior
        matrix = np.vstack([columns.real, columns.imag, np.diag(1.0 / prior)])
        return reduced_rows(matrix.T @ matrix, matrix.T @ self._weighted(self.weight))

    def _weighted(self, weight: np.ndarray) -> np.ndarray:
        residual = self.residual * weight
        return np.concatenate([residual.real, residual.imag, self.x / self.problem.prior])

    def cost(self, weighted: ResponseExperiment) -> float:
        """Return half the squares of the residual [1], with the weights around other values."""
        return 0.5 * float(np.sum(self._weighted(weighted.weight) ** 2))

    @property
    def robust_cost(self) -> float:
        """Half the squares, beyond Huber's constant the lengths, of the residual [1]."""
        size = np.abs(self.residual) / self.problem.deviation
        loss = np.where(size < HUBER, 0.5 * size**2, HUBER * (size - 0.5 * HUBER))
        return float(np.sum(loss) + 0.5 * np.sum((self.x / self.problem.prior) ** 2))

    def at(self, x: np.ndarray) -> ResponseExperiment:
        """Return the experiment around other values, units of x, (P,)."""
        return self.problem.at(x)

    def recompute(self) -> ResponseExperiment:
        """Return this one; its derivatives are exact."""
        return self

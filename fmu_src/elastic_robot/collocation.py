"""The collocation equations of one step, solved by simplified Newton iteration."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt
from typing import Protocol

import numpy as np

from elastic_robot import gauss
from elastic_robot.errors import IntegrationError
from elastic_robot.settings import Settings

STAGE_ROWS = slice(0, gauss.STAGES)
END_ROW = slice(gauss.STAGES, gauss.STAGES + 1)


class System(Protocol):
    """What is integrated: residual(x, v, a) = 0 with dr/da = M, dr/dv ~ D, dr/dx ~ K."""

    @property
    def half_width(self) -> np.ndarray:
        """The law of coordinate k changes where |x_k| passes half_width[k]; infinite: never."""
        ...

    def next_kink(self, time: float) -> float:
        """Return the first time after `time` at which the forcing is not smooth, or infinity."""
        ...

    @property
    def contacting(self) -> bool:
        """Whether there is a contact, whose depth counts as well as the coordinates."""
        ...

    def begin(self, times: np.ndarray, region: np.ndarray, touching: bool) -> None:
        """Fix the times of the following residuals, one per row, and the branches of the laws."""
        ...

    def depths(
        self, times: np.ndarray, x: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return depth [m] and approach [m/s] of the contact, (k,), at times (k,) and states (k, m)."""
        ...

    def residual(self, motion: np.ndarray, rows: slice) -> np.ndarray:
        """Return the residual (k, m) of x, v, a stacked (3, k, m), at the times of these rows."""
        ...

    def matrices(
        self, x: np.ndarray, v: np.ndarray, row: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return M (m, m), D or its diagonal, (m, m) or (m,), and K (m, m) at the time of a row."""
        ...


@dataclass(frozen=True)
class NewtonMatrix:
    """Inverses of the matrices of the simplified Newton iteration.

    Attributes:
        step: Length of the step that they belong to [s].
        mass, damping, stiffness: M (m, m), D or its diagonal alone, and K (m, m) they are made of.
        stages: Inverse for all stages, (4 m, 4 m).
        end: Inverse that filters the error estimate, (m, m).
    """

    step: float
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    stages: np.ndarray
    end: np.ndarray

    @classmethod
    def build(
        cls, step: float, mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray
    ) -> NewtonMatrix:
        """Return the matrices of a step."""
        m, h, own = len(mass), step, stiffness.diagonal()
        whole = damping if damping.ndim == 2 else None
        damping = damping if whole is None else whole.diagonal()
        matrix = np.zeros((gauss.STAGES, m, gauss.STAGES, m))
        stage, diagonal = np.arange(gauss.STAGES), np.arange(m)
        matrix[stage, :, stage, :] = mass
        matrix[:, diagonal, :, diagonal] += np.multiply.outer(
            h * damping, gauss.A1
        ) + np.multiply.outer(h * h * own, gauss.A2)
        g = gauss.GAMMA * h
        end = mass.copy()
        end[diagonal, diagonal] += g * damping + g * g * own
        if whole is not None:
            coupling = whole - np.diag(damping)
            matrix += np.einsum("ij,ab->iajb", h * gauss.A1, coupling)
            end += g * coupling
        coupling = stiffness - np.diag(own)
        if coupling.any():
            matrix += np.einsum("ij,ab->iajb", h * h * gauss.A2, coupling)
            end += g * g * coupling
        try:
            stages = np.linalg.inv(matrix.reshape(gauss.STAGES * m, gauss.STAGES * m))
            return cls(
                step,
                mass,
                damping if whole is None else whole,
                stiffness,
                stages,
                np.linalg.inv(end),
            )
        except np.linalg.LinAlgError as error:
            raise IntegrationError("the mass matrix is singular or not finite") from error


@dataclass(frozen=True)
class State:
    """State of an integration; all of it, so that a copy continues identically.

    Attributes:
        time: Time [s].
        x, v: Coordinates and rates, (m,).
        region: Branch of each coordinate's law: -1, 0, 1, (m,).
        step: Length proposed for the next step [s].
        predictor: Stage accelerations of the last step, (4, m); None at the start.
        predictor_step: Length of that step [s].
        newton: Matrices of the last step, kept while they serve; None: to be built.
        touching: Whether the contact presses: 0, 1; -1: not known yet.
    """

    time: float
    x: np.ndarray
    v: np.ndarray
    region: np.ndarray
    step: float
    predictor: np.ndarray | None = None
    predictor_step: float = 1.0
    newton: NewtonMatrix | None = None
    touching: int = -1


@dataclass(frozen=True)
class Step:
    """A solved step.

    Attributes:
        length: h [s].
        rows: x, v at its start and the stage accelerations, (6, m).
        end: x, v and the polynomial's acceleration at its end, (3, m).
        error: Estimate of the local error of x at its end.
        newton: Matrices it was solved with; None if they should be built anew for the next.
    """

    length: float
    rows: np.ndarray
    end: np.ndarray
    error: float
    newton: NewtonMatrix | None


class Collocation:
    """Solves single steps.

    Args:
        settings: Numbers of the iteration.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._operator = _StageOperator()

    def solve(
        self, system: System, state: State, h: float, guess: np.ndarray, accuracy: float
    ) -> Step | None:
        """Solve the collocation equations of a step; None if Newton's method fails.

        Args:
            system: The equations of motion.
            state: State at its start.
            h: Its length [s].
            guess: Stage accelerations to start from, (4, m).
            accuracy: Error that the iteration may leave in x.
        """
        touching = system.contacting and state.touching == 1
        system.begin(state.time + h * _TIMES, state.region, touching)
        newton = state.newton
        stages, end = self._operator.of(h)
        rows = np.concatenate([state.x[None], state.v[None], guess])
        a = rows[2:]
        if newton is None or touching or abs(newton.step - h) > self._settings.same_length * h:
            middle, x, v = gauss.STAGES // 2, state.x, state.v
            if touching:  # what a contact exerts changes a lot in a step
                x, v, _ = stages.dot(rows).reshape(3, gauss.STAGES, -1)[:, middle]
            newton = NewtonMatrix.build(h, *system.matrices(x, v, middle))
        inverse = newton.stages
        # An error of the acceleration shifts x by its h^2-fold at once, and by its h-fold times the
        # time scale of the motion later; the longest step stands for the latter.
        target, last = accuracy / (h * max(h, self._settings.longest_step)), 0.0
        for passes in range(1, self._settings.most_passes + 1):
            motion = stages.dot(rows).reshape(3, gauss.STAGES, -1)
            residual = system.residual(motion, STAGE_ROWS)
            correction = inverse.dot(residual.ravel())
            a -= correction.reshape(a.shape)
            size = sqrt(correction.dot(correction))
            # At least two passes: after one, errors that the extrapolation enlarges could pass unseen.
            if passes > 1:
                # Error left after a linearly converging iteration (Hairer and Wanner 1996, sec. IV.8).
                rate = size / last if last > 0.0 else 0.0
                if size <= target or size * rate <= target * (1.0 - rate):
                    break
                if not rate < 1.0:
                    return None
            last = size
        else:
            return None
        ending = end.dot(rows)
        # The defect of the polynomial at the step's end, filtered by the matrix of an implicit step
        # (as in Hairer and Wanner 1996, sec. IV.8) and scaled to a length of x.
        defect = newton.end.dot(system.residual(ending[:, None], END_ROW)[0])
        error = h * h * sqrt(defect.dot(defect))
        if not error < inf:
            return None
        return Step(
            h, rows, ending, error, newton if passes <= self._settings.usual_passes else None
        )


class _StageOperator:
    """Matrices that take x_0, v_0 and the stage accelerations to x, v, a at the stages and the end."""

    def __init__(self) -> None:
        self._step = 0.0

    def of(self, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the matrices of a step of length h [s]: (3 * 4, 6) and (3, 6)."""
        if h != self._step:
            powers = np.array([0.0, 1.0 / (h * h), 1.0 / h, 1.0, h, h * h])
            self._both = _COEFFICIENTS * powers[_POWERS]
            self._step = h
        return self._both[:-3], self._both[-3:]


def _coefficients() -> tuple[np.ndarray, np.ndarray]:
    """Return the entries of both matrices for h = 1 and, for each, an index of its power of h."""
    s, one, zero = gauss.STAGES, np.ones, np.zeros
    blocks = [
        np.column_stack([one(s), gauss.NODES, gauss.A2]),
        np.column_stack([zero(s), one(s), gauss.A1]),
        np.column_stack([zero(s), zero(s), np.eye(s)]),
        np.concatenate([[1.0, 1.0], gauss.B2])[None],
        np.concatenate([[0.0, 1.0], gauss.B1])[None],
        np.concatenate([[0.0, 0.0], gauss.B0])[None],
    ]
    of_row = np.repeat([0, 1, 2, 0, 1, 2], [s, s, s, 1, 1, 1])
    of_column = np.concatenate([[0, 1], np.full(s, 2)])
    return np.vstack(blocks), 3 + of_column[None, :] - of_row[:, None]


_COEFFICIENTS, _POWERS = _coefficients()
_TIMES = np.append(gauss.NODES, 1.0)

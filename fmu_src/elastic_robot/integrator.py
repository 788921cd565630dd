"""Time stepper for second-order equations with piecewise smooth forces; it knows no robot.

Three-stage Gauss collocation in the accelerations, simplified Newton iteration, step length from
an estimate of the local error.  Each coordinate obeys one smooth law (its region) through a whole
step; where the collocation polynomial leaves a region the step is ended there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.linalg import lapack

from elastic_robot import collocation as gauss
from elastic_robot.errors import IntegrationError


class System(Protocol):
    """What is integrated: residual(x, v, a) = 0 with dr/da = M, dr/dv ~ D, dr/dx ~ K."""

    @property
    def half_width(self) -> np.ndarray:
        """The law of coordinate k changes where |x_k| passes half_width[k]; infinite: never."""
        ...

    def begin(self, times: np.ndarray, region: np.ndarray) -> None:
        """Fix the times of the following residuals, one per row, and the branch of the law."""
        ...

    def residual(self, motion: np.ndarray, first_row: int) -> np.ndarray:
        """Return the residual (k, m) of x, v, a stacked (3, k, m), at the times of rows first_row.."""
        ...

    def matrices(self, x: np.ndarray, row: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return M (m, m), the diagonal of D (m,) and the diagonal of K (m,) at the time of a row."""
        ...


@dataclass(frozen=True)
class State:
    """State of an integration; all of it, so that a copy continues identically.

    Attributes:
        time: [s].
        x, v: Coordinates and rates, (m,).
        region: Branch of each coordinate's law: -1, 0, 1, (m,).
        step: Length proposed for the next step [s].
        predictor: Power coefficients of the last step's acceleration, (3, m); None after a kink.
        predictor_step: Length of that step [s].
    """

    time: float
    x: np.ndarray
    v: np.ndarray
    region: np.ndarray
    step: float
    predictor: np.ndarray | None = None
    predictor_step: float = 1.0


@dataclass(frozen=True)
class _Trial:
    """A solved step: its stage accelerations and where it ends."""

    step: float
    a: np.ndarray
    x: np.ndarray
    v: np.ndarray
    error: float


@dataclass(frozen=True)
class _Crossing:
    """The first place where a step leaves a region."""

    coordinate: int
    boundary: float
    outward: float  # +1 if x rises through the boundary
    region: int
    fraction: float  # of the step


class GaussStepper:
    """Steps a system through time.

    Args:
        tolerance: Limit of the local error estimate, in the coordinates' unit.
        longest: Longest step [s].
        first: Length of the first step, and of the first after a kink [s].
    """

    # A landing on a region's boundary is accepted within this fraction of the half width.
    LANDING = 1e-9
    # Shortest step relative to the longest, before the integration is given up.
    SHORTEST = 1e-9
    # Steps of one length for which the iteration matrix is kept.
    MATRIX_LIFE = 8
    MAX_NEWTON = 8
    MAX_LANDINGS = 20

    def __init__(self, tolerance: float, longest: float, first: float) -> None:
        self.tolerance = tolerance
        self.longest = longest
        self.first = first
        self._matrix_key: tuple[float, bytes] | None = None
        self._uses = 0

    def start(self, time: float, x: np.ndarray, v: np.ndarray, region: np.ndarray) -> State:
        """Return the state at the beginning of an integration."""
        self._matrix_key = None
        return State(time, x, v, region, self.first)

    def advance(self, system: System, state: State, end: float) -> State:
        """Integrate to a time.

        Raises:
            IntegrationError: If the motion grows beyond all bounds or needs too short steps.
        """
        # What is left after a crossing just before the end may be less than any step.
        negligible = max(self.SHORTEST * self.longest, 8.0 * np.spacing(abs(end)))
        while end - state.time > negligible:
            state = self._step(system, state, end)
        return replace(state, time=end)

    def _step(self, system: System, state: State, end: float) -> State:
        """Take one step, at most to `end`."""
        wanted = min(state.step, self.longest)
        left = end - state.time
        # Two equal steps rather than one full and a sliver.
        step = (
            left if wanted >= left else min(wanted, 0.5 * left) if wanted > 0.5 * left else wanted
        )
        reaches_end = step == left
        while True:
            if step < self.SHORTEST * self.longest:
                raise IntegrationError(
                    f"the motion at t = {state.time:.6g} s needs steps below"
                    f" {self.SHORTEST * self.longest:.1g} s; it is unstable or the load is not physical"
                )
            trial = self._solve(system, state, step)
            crossing = None if trial is None else _first_crossing(state, trial, system.half_width)
            if trial is None:
                step = 0.25 * step
            elif crossing is not None:
                landed = self._land(system, state, trial, crossing)
                if landed is not None and landed.error <= self.tolerance:
                    return self._after_crossing(state, landed, crossing)
                step = 0.5 * crossing.fraction * step
            else:
                factor = 0.9 * (self.tolerance / max(trial.error, 1e-300)) ** _ERROR_EXPONENT
                if trial.error <= self.tolerance:
                    break
                step = step * max(0.2, factor)
            wanted, reaches_end = step, False
        # A step cut short by `end` says little about the step that the error would allow; a small
        # gain in length is not worth a new iteration matrix.
        proposal = step * min(3.0, factor)
        if step < wanted:
            proposal = max(proposal, wanted)
        elif factor < 1.2:
            proposal = step * min(1.0, factor)
        return replace(
            state,
            time=end if reaches_end else state.time + step,
            x=trial.x,
            v=trial.v,
            step=min(proposal, self.longest),
            predictor=gauss.QUADRATIC @ trial.a,
            predictor_step=step,
        )

    def _after_crossing(self, state: State, trial: _Trial, crossing: _Crossing) -> State:
        region = state.region.copy()
        region[crossing.coordinate] = crossing.region
        return replace(
            state,
            time=state.time + trial.step,
            x=trial.x,
            v=trial.v,
            region=region,
            step=min(self.first, state.step),
            # The acceleration is continuous across the boundary, its derivative is not.
            predictor=np.vstack([gauss.B0 @ trial.a, np.zeros((2, len(trial.x)))]),
            predictor_step=trial.step,
        )

    def _land(
        self, system: System, state: State, trial: _Trial, crossing: _Crossing
    ) -> _Trial | None:
        """Shorten the step until it ends on the boundary; None if that does not succeed."""
        step = crossing.fraction * trial.step
        k, allowed = crossing.coordinate, self.LANDING * abs(crossing.boundary)
        for _ in range(self.MAX_LANDINGS):
            landed = self._solve(system, state, step)
            if landed is None:
                return None
            beyond = crossing.outward * (landed.x[k] - crossing.boundary)
            rate = crossing.outward * landed.v[k]
            if abs(beyond) <= allowed:
                return landed
            if rate <= 0.0:
                return None
            correction = beyond / rate
            step -= float(np.clip(correction, -step, 0.5 * step))
        return None

    def _solve(self, system: System, state: State, step: float) -> _Trial | None:
        """Solve the collocation equations of a step; None if Newton's method fails."""
        h, x, v = step, state.x, state.v
        system.begin(state.time + h * _TIMES, state.region)
        self._refresh_matrix(system, x, h, state.region)
        if state.predictor is None:
            a = np.zeros((gauss.STAGES, len(x)))
        else:
            a = gauss.extrapolate(state.predictor, h / state.predictor_step)
        free = np.zeros((3, gauss.STAGES, len(x)))
        free[0] = x + np.multiply.outer(h * gauss.NODES, v)
        free[1] = v
        from_a = np.concatenate([(h * h) * gauss.A2, h * gauss.A1, _EYE])
        target = 1e-2 * self.tolerance / (h * h)
        last = np.inf
        for _ in range(self.MAX_NEWTON):
            residual = system.residual(free + (from_a @ a).reshape(free.shape), 0)
            correction = lapack.dgetrs(*self._stages, residual.ravel())[0]
            a = a - correction.reshape(a.shape)
            size = max(correction.max(), -correction.min())
            if not size < 4.0 * last:
                break
            # Error left after a linearly converging iteration (Hairer and Wanner 1996, sec. IV.8).
            rate = size / last if np.isfinite(last) else _USUAL_RATE
            left = size * rate / max(1.0 - rate, 1e-3)
            if left <= target or size <= 1e-12 * np.abs(a).max():
                return self._trial(system, state, h, a)
            if rate > 0.2:
                self._matrix_key = None  # converges slowly: build the matrix anew next time
            last = size
        self._matrix_key = None
        return None

    def _trial(self, system: System, state: State, h: float, a: np.ndarray) -> _Trial:
        """Complete a solved step by its end and its error estimate.

        The estimate is the defect of the collocation polynomial at the step's end, filtered by the
        matrix of an implicit step (as in Hairer and Wanner 1996, sec. IV.8) and scaled to an angle.
        """
        end = np.stack([(h * h) * gauss.B2, h * gauss.B1, gauss.B0]) @ a
        end[0] += state.x + h * state.v
        end[1] += state.v
        defect = lapack.dgetrs(*self._filter, system.residual(end[:, None], gauss.STAGES)[0])[0]
        error = h * h * max(defect.max(), -defect.min())
        return _Trial(h, a, end[0], end[1], float(error))

    def _refresh_matrix(self, system: System, x: np.ndarray, h: float, region: np.ndarray) -> None:
        key = (h, region.tobytes())
        if key == self._matrix_key and self._uses < self.MATRIX_LIFE:
            self._uses += 1
            return
        mass, damping, stiffness = system.matrices(x, 1)
        m = len(x)
        matrix = np.zeros((gauss.STAGES, m, gauss.STAGES, m))
        stage, diagonal = np.arange(gauss.STAGES), np.arange(m)
        matrix[stage, :, stage, :] = mass
        matrix[:, diagonal, :, diagonal] += np.multiply.outer(
            h * damping, gauss.A1
        ) + np.multiply.outer(h * h * stiffness, gauss.A2)
        g = gauss.GAMMA * h
        filter_matrix = mass.copy()
        filter_matrix[diagonal, diagonal] += g * damping + g * g * stiffness
        self._stages = _factorise(matrix.reshape(gauss.STAGES * m, gauss.STAGES * m))
        self._filter = _factorise(filter_matrix)
        self._matrix_key = key
        self._uses = 0


# The error estimate of a step of length h falls as h^5: h^2 times the defect, of order 3.
_ERROR_EXPONENT = 1.0 / 5.0
# Convergence rate assumed of a first Newton iteration; the matrix leaves out gyroscopic terms only.
_USUAL_RATE = 0.1
_TIMES = np.append(gauss.NODES, 1.0)
_EYE = np.eye(gauss.STAGES)
# A quadratic on [0, 1] exceeds its largest value at the Gauss points by at most this factor.
_LARGEST_STAGE_GAIN = float(
    np.abs(np.vander([0.0, 1.0], 3, increasing=True) @ gauss.QUADRATIC).sum(axis=1).max()
)


def _factorise(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    factors, pivots, failed = lapack.dgetrf(matrix)
    if failed:
        raise IntegrationError("the mass matrix is singular or not finite")
    return factors, pivots


def _first_crossing(state: State, trial: _Trial, half_width: np.ndarray) -> _Crossing | None:
    """Return where the collocation polynomial first leaves a region, if it does."""
    h = trial.step
    reach = np.abs(h * state.v) + (0.5 * h * h) * _LARGEST_STAGE_GAIN * np.abs(trial.a).max(axis=0)
    switching = np.flatnonzero(np.abs(np.abs(state.x) - half_width) <= reach)
    if len(switching) == 0:
        return None
    width, region = half_width[switching], state.region[switching]
    rows = np.vstack([state.x, h * state.v, (h * h) * trial.a])[:, switching]
    bernstein = gauss.BERNSTEIN @ rows
    # Outside the play (region +-1) only the side towards it is a boundary.
    slack = 10.0 * GaussStepper.LANDING * width
    upper = np.choose(region + 1, [-width, width, np.inf]) + slack
    lower = np.choose(region + 1, [-np.inf, -width, width]) - slack
    leaving = (bernstein > upper).any(axis=0) | (bernstein < lower).any(axis=0)
    first: _Crossing | None = None
    for k in np.flatnonzero(leaving):
        power = gauss.POWER @ rows[:, k]
        for boundary, outward in ((upper[k], 1.0), (lower[k], -1.0)):
            if not np.isfinite(boundary):
                continue
            fraction = _first_passage(power, boundary, outward)
            if fraction is not None and (first is None or fraction < first.fraction):
                edge = float(boundary - outward * slack[k])
                beyond = int(outward) if region[k] == 0 else 0
                first = _Crossing(int(switching[k]), edge, outward, beyond, fraction)
    return first


def _first_passage(power: np.ndarray, boundary: float, outward: float) -> float | None:
    """Return the smallest s in (0, 1] at which a polynomial passes a boundary outwards."""
    shifted = power.copy()
    shifted[0] -= boundary
    shifted *= outward
    if shifted[0] > 0.0:
        return None  # starts beyond it by rounding: it came from there
    roots = np.roots(shifted[::-1])
    real = np.sort(
        roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0.0) & (roots.real <= 1.0)]
    )
    slope = np.polyder(shifted[::-1])
    for s in real:
        if np.polyval(slope, s) > 0.0:
            return float(s)
    return None

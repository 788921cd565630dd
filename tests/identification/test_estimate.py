"""The least-squares solver against closed forms and SciPy's: steps, damping, bounds, stale Jacobians."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import pytest
from scipy.optimize import least_squares

from coupling.identification.estimate import estimate
from coupling.identification.least_squares import bounded_step

FREE = (np.full(2, -np.inf), np.full(2, np.inf))
# Predicted gains of the cost below it are rounding for residuals around one.
SETTLED = 1e-12


@dataclass(frozen=True)
class Rosenbrock:
    """r = (10 (x2 - x1^2), 1 - x1), whose minimum at (1, 1) lies in a bent valley."""

    x: np.ndarray
    jacobian_at: np.ndarray
    unit: float = 1.0

    @property
    def residual(self) -> np.ndarray:
        return np.array([10.0 * (self.x[1] - self.x[0] ** 2), 1.0 - self.x[0]])

    @property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        matrix = np.array([[-20.0 * self.jacobian_at[0], 10.0], [-1.0, 0.0]])
        return matrix, self.residual

    def cost(self, weighted: Self) -> float:
        return float(0.5 * self.residual @ self.residual)

    @property
    def is_exact(self) -> bool:
        return bool(np.array_equal(self.x, self.jacobian_at))

    def at(self, x: np.ndarray) -> Self:
        return replace(self, x=x).recompute()

    def recompute(self) -> Self:
        return replace(self, jacobian_at=self.x)


class LazyRosenbrock(Rosenbrock):
    """The same with the Jacobian of an earlier point until it is asked to be computed again."""

    def at(self, x: np.ndarray) -> Self:
        return replace(self, x=x)


def around(x: tuple[float, float], kind: type[Rosenbrock] = Rosenbrock) -> Rosenbrock:
    return kind(np.array(x), np.array(x))


@pytest.mark.parametrize("kind", [Rosenbrock, LazyRosenbrock])
@pytest.mark.parametrize("start", [(-1.2, 1.0), (5.0, -3.0), (0.0, 0.0)])
def test_a_bent_valley_is_followed_to_its_end(kind, start):
    fit = estimate(around(start, kind), FREE, 200, SETTLED)
    assert fit.converged
    np.testing.assert_allclose(fit.x, [1.0, 1.0], rtol=0, atol=1e-6)  # root of SETTLED


@pytest.mark.parametrize("high", [0.5, 0.9, -0.3])
def test_between_bounds_it_ends_where_scipy_does(high):
    bounds = (np.array([-2.0, -2.0]), np.array([high, 2.0]))
    fit = estimate(around((-1.2, 1.0)), bounds, 200, SETTLED)
    expected = least_squares(
        lambda x: around((x[0], x[1])).residual, [-1.2, 1.0], bounds=bounds, xtol=1e-15, ftol=1e-15
    )
    np.testing.assert_allclose(fit.x, expected.x, rtol=0, atol=1e-6)


def test_too_few_steps_have_not_converged():
    fit = estimate(around((-1.2, 1.0)), FREE, 2, SETTLED)
    assert not fit.converged


@pytest.mark.parametrize("settled", [SETTLED, 0.1, 10.0])
def test_it_has_converged_where_the_last_point_promises_little(settled):
    """The predicted gain that counts is that of the last point, however early it ended there."""
    for most in range(1, 40):
        fit = estimate(around((-1.2, 1.0)), FREE, most, settled)
        matrix, residual = fit.experiment.rows
        promises_little = bounded_step(matrix, residual, *FREE)[1] < max(1e-2, settled)
        assert fit.converged or not promises_little
        assert promises_little or not fit.converged or settled > SETTLED


class Kink(Rosenbrock):
    """r = 1 + |x1 - 1|, whose slopes promise at the minimum what no step gains."""

    @property
    def residual(self) -> np.ndarray:
        return np.array([1.0 + abs(self.x[0] - 1.0)])

    @property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array([[np.sign(self.x[0] - 1.0) or 1.0, 0.0]]), self.residual


def test_at_a_kink_it_has_converged_where_shorter_steps_promise_nothing():
    fit = estimate(around((-0.3, 0.0), Kink), FREE, 200, SETTLED)
    assert fit.converged
    assert fit.x[0] == pytest.approx(1.0, abs=1e-6)
    assert not estimate(around((-0.3, 0.0), Kink), FREE, 3, SETTLED).converged


def test_an_undamped_step_is_that_of_linear_least_squares():
    random = np.random.default_rng(3)
    matrix, residual = random.normal(size=(7, 2)) * [1.0, 1e6], random.normal(size=7)
    step, gain = bounded_step(matrix, residual, *FREE)
    expected = np.linalg.lstsq(matrix, -residual, rcond=None)[0]
    np.testing.assert_allclose(step, expected, rtol=1e-9)
    after = residual + matrix @ expected
    assert gain == pytest.approx(0.5 * (residual @ residual - after @ after), rel=1e-9)

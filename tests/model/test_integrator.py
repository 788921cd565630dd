"""The stepper alone, on systems with closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from elastic_robot import gauss
from elastic_robot.errors import IntegrationError
from elastic_robot.integrator import GaussStepper
from elastic_robot.settings import SETTINGS
from elastic_robot.step_length import StepLength


class Oscillator:
    """x'' + d x' + S(x) = f(t) with S free inside +-gap and of slope k outside."""

    contacting = False

    def __init__(self, k=400.0, d=0.0, gap=np.inf, force=lambda t: 0.0):
        self.k, self.d, self.gap, self.force = k, d, gap, force
        self.half_width = np.array([gap])

    def next_kink(self, time):
        return np.inf

    def begin(self, times, region, touching):
        self.f = np.array([[self.force(t)] for t in times])
        self.region = region

    def residual(self, motion, rows):
        x, v, a = motion
        offset = 0.0 if np.isinf(self.gap) else self.region * self.gap
        spring = self.k * (x - offset) * (self.region != 0)
        return a + self.d * v + spring - self.f[rows]

    def matrices(self, x, v, row):
        return np.eye(1), np.array([self.d]), np.diag(self.k * (self.region != 0))


def run(system, end, tolerance=1e-9, longest=0.1, x=1.0, v=0.0, region=1):
    stepper = GaussStepper(tolerance, replace(SETTINGS, longest_step=longest))
    state = stepper.start(0.0, np.array([x]), np.array([v]), np.array([region]))
    return stepper.advance(system, state, end)


def _fixed(step):
    """Steps of one length, solved exactly at a tolerance of 1e9, which never rejects one."""
    return replace(SETTINGS, longest_step=step, first_step=step, iteration=1e-22)


def test_collocation_is_exact_for_a_cubic_acceleration():
    a = 1.0 + 2.0 * gauss.NODES + 3.0 * gauss.NODES**2 + 4.0 * gauss.NODES**3
    assert gauss.B1 @ a == pytest.approx(1.0 + 1.0 + 1.0 + 1.0, abs=1e-13)
    assert gauss.B2 @ a == pytest.approx(0.5 + 1.0 / 3.0 + 0.25 + 0.2, abs=1e-13)
    assert gauss.B0 @ a == pytest.approx(10.0, abs=1e-12)
    later = 0.3 + 0.7 * gauss.NODES
    np.testing.assert_allclose(
        gauss.interpolation(0.3, 0.7) @ a,
        1.0 + 2.0 * later + 3.0 * later**2 + 4.0 * later**3,
        rtol=1e-13,
    )


@pytest.mark.parametrize("omega_h", [0.3, 3.0, 10.0, 1e3, 1e6])
def test_a_spring_of_any_stiffness_keeps_its_energy(omega_h):
    """The map of one step of x'' = -omega^2 x has both eigenvalues on the unit circle."""
    system = Oscillator(k=omega_h**2)
    columns = []
    for x, v in ((1.0, 0.0), (0.0, omega_h)):
        stepper = GaussStepper(1e9, _fixed(1.0))
        state = stepper.start(0.0, np.array([x]), np.array([v]), np.array([1]))
        state = stepper.advance(system, state, 1.0)
        columns.append([state.x[0], state.v[0] / omega_h])
    moduli = np.abs(np.linalg.eigvals(np.array(columns).T))
    np.testing.assert_allclose(moduli, 1.0, atol=1e-9)


def test_bernstein_coefficients_enclose_the_polynomial():
    rng = np.random.default_rng(1)
    rows = rng.normal(size=(6, 20))
    s = np.linspace(0.0, 1.0, 101)
    values = np.vander(s, 6, increasing=True) @ gauss.POWER @ rows
    bernstein = gauss.BERNSTEIN @ rows
    assert np.all(values <= bernstein.max(axis=0) + 1e-12)
    assert np.all(values >= bernstein.min(axis=0) - 1e-12)
    np.testing.assert_allclose(bernstein[[0, -1]], values[[0, -1]], atol=1e-12)


def test_order_eight_at_the_steps_end():
    """Fixed steps (a tolerance that never rejects): halving them divides the error by 256."""
    errors = []
    for longest in (1 / 8, 1 / 16, 1 / 32):  # binary fractions: every step is equally long
        stepper = GaussStepper(1e9, _fixed(longest))
        state = stepper.start(0.0, np.array([1.0]), np.array([0.0]), np.array([1]))
        state = stepper.advance(Oscillator(), state, 0.5)
        x, v = np.cos(20.0 * 0.5), -20.0 * np.sin(20.0 * 0.5)
        errors.append(np.hypot(state.x[0] - x, (state.v[0] - v) / 20.0))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 8.0, atol=0.4)


def test_error_falls_with_the_tolerance():
    """Tolerances over six decades; the error follows over at least five of them."""
    errors = [
        abs(run(Oscillator(d=0.3), 3.0, tolerance).x[0] - _damped(3.0))
        for tolerance in (1e-3, 1e-5, 1e-7, 1e-9)
    ]
    assert np.all(np.diff(np.log10(errors)) < -1.0)
    assert errors[0] / errors[-1] > 1e5


def _damped(t: float) -> float:
    omega = np.sqrt(400.0 - 0.15**2)
    return float(np.exp(-0.15 * t) * (np.cos(omega * t) + 0.15 / omega * np.sin(omega * t)))


def test_flight_through_the_gap_and_bounces_follow_the_closed_form():
    """Free flight at speed 1 over the gap 2 x 0.1, half a sine of pi/20 s on each flank."""
    flight, bounce = 0.2, np.pi / 20.0
    period = 2.0 * (flight + bounce)
    system = Oscillator(gap=0.1)
    for cycles in (1, 5):
        # From the middle of the gap, after whole periods: the middle of the gap again.
        state = run(system, cycles * period, tolerance=1e-10, x=0.0, v=1.0, region=0)
        assert state.x[0] == pytest.approx(0.0, abs=1e-8 * cycles)
        assert state.v[0] == pytest.approx(1.0, abs=1e-8 * cycles)
    quarter = run(system, 0.1 + bounce / 2.0, tolerance=1e-10, x=0.0, v=1.0, region=0)
    assert quarter.x[0] == pytest.approx(0.1 + 1.0 / 20.0, abs=1e-9)


def test_a_grazing_touch_is_not_stepped_over():
    """A forced flight that touches the flank by 1e-4 for a moment inside one long step."""
    # x = 0.1001 - (t - 0.05)^2 / 2 before the touch, as if free: 1e-4 beyond the gap for 28 ms.
    system = Oscillator(k=1e4, gap=0.1, force=lambda t: -1.0)
    state = run(system, 0.1, longest=0.1, x=0.1001 - 0.05**2 / 2, v=0.05, region=0, tolerance=1e-10)
    # On the flank x'' = -1 - k (x - 0.1): in from sqrt(2e-4) m/s, out again at the same speed.
    speed, omega = np.sqrt(2e-4), 100.0
    entry = 0.05 - speed
    contact = 2.0 * np.arctan(omega * speed) / omega
    rest = 0.1 - entry - contact
    assert state.x[0] == pytest.approx(0.1 - speed * rest - rest**2 / 2.0, abs=1e-8)


def test_communication_points_do_not_change_the_result():
    rng = np.random.default_rng(2)
    system = Oscillator(d=0.3, gap=0.02, force=lambda t: 5.0 * np.sin(7.0 * t))
    whole = run(system, 2.0, tolerance=1e-10, x=0.0, region=0)
    stepper = GaussStepper(1e-10, replace(SETTINGS, longest_step=0.1))
    state = stepper.start(0.0, np.zeros(1), np.zeros(1), np.zeros(1, dtype=int))
    for end in [*np.sort(rng.uniform(0.0, 2.0, 60)), 2.0]:
        state = stepper.advance(system, state, end)
        assert state.time == end
    assert state.x[0] == pytest.approx(whole.x[0], abs=1e-7)


def test_times_that_differ_by_rounding_only_are_no_steps():
    stepper = GaussStepper(1e-9, replace(SETTINGS, longest_step=0.1))
    state = stepper.start(0.0, np.ones(1), np.zeros(1), np.ones(1, dtype=int))
    state = stepper.advance(Oscillator(), state, 0.3)
    later = stepper.advance(Oscillator(), state, 0.3 + 1e-13)
    assert later.time == 0.3 + 1e-13
    assert np.array_equal(later.x, state.x)


def test_rest_is_kept_over_steps_of_any_length():
    """At rest Newton's corrections are rounding only and do not fall."""
    system = Oscillator(k=1e4, force=lambda t: 1e4 / 3.0)
    for length in (1e-7, 1e-4, 1.0):
        state = run(system, length, tolerance=1e-12, x=1.0 / 3.0)
        assert state.x[0] == pytest.approx(1.0 / 3.0, abs=1e-15)


def test_an_unstable_motion_is_an_error_not_a_hang():
    with pytest.raises(IntegrationError, match="needs steps below"), np.errstate(all="ignore"):
        run(Oscillator(force=lambda t: np.nan), 1.0)


def test_more_steps_than_a_motion_can_need_are_an_error():
    settings = replace(SETTINGS, longest_step=0.1, most_tries=10, most_tries_per_longest=1)
    stepper = GaussStepper(1e-3, settings)
    state = stepper.start(0.0, np.ones(1), np.zeros(1), np.ones(1, dtype=int))
    assert stepper.advance(Oscillator(k=1.0), state, 1.0).time == 1.0
    with pytest.raises(IntegrationError, match="into a step of 1 s, needs more than 20 tries"):
        stepper.advance(Oscillator(k=1e6), state, 1.0)


@pytest.mark.parametrize(("left", "length"), [(0.2, 0.2), (1.05, 1.05), (1.1, 0.55), (3.0, 1.0)])
def test_a_step_leaves_no_sliver_before_its_target(left, length):
    """In lengths wanted: a little longer than wanted, or the first of two equal ones."""
    assert StepLength(1.0, SETTINGS).towards(left, 1.0) == length

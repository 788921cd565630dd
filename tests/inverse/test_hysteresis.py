"""Gears with hysteresis: closed forms, a plain simulation, laws; the inverse of robots that have it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from coupling.inverse.gear_elements import GearElements, GearLaw
from coupling.inverse.gear_path import gear_path
from coupling.inverse.gear_pieces import pieces_of
from coupling.inverse.gears import solve_wind_up, static_wind_up
from elastic_robot.parameters import Parameters
from elastic_robot.torque_curves import TORQUE_CURVES

K, B = 1e5, 1e-4  # [N m/rad, rad]
SLIP = GearElements(np.array([4.0, 3.0, 5.0]), np.array([2e-5, 6e-5, 1.5e-4]))
SEEDS = st.integers(0, 2**32 - 1)


def curve_of(kind, gears=1):
    parameters = Parameters(
        gravity=np.zeros(3),
        stiffness=np.full(gears, K),
        damping=np.zeros(gears),
        backlash=np.full(gears, B),
        hysteresis=np.zeros(gears),
        tables=(None,) * gears,
    )
    return TORQUE_CURVES[kind].build(parameters)


def simulated(torque, curve, damping, elements, start, dt, steps):
    """d e' = T - S(e) - sum f s / a by explicit steps of dt, s = clip(s + de, +-a) in each: e, (steps + 1,)."""
    f, a = elements.slip_torque, elements.slip_angle
    e, s = start, np.clip(start, -a, a)
    found = [e]
    at = torque(dt * (np.arange(steps) + 0.5))
    for now in at:
        move = dt / damping * (now - curve.torque(np.array([e]))[0] - np.sum(f * s / a))
        e, s = e + move, np.clip(s + move, -a, a)
        found.append(e)
    return np.array(found)


def test_a_triangular_torque_makes_the_loop_of_its_elements_in_closed_form():
    """Without a damper to speak of: the virgin curve up, twice the virgin curve's way back and up again.

    T rises to T_1, falls to T_2 and rises to T_1: e = v(T), e_1 - 2 v((T_1 - T) / 2) (Masing's rule), and the
    loop closes where it began.
    """
    first, second = 30.0, -12.0
    up, down = np.linspace(0.0, first, 301), np.linspace(first, second, 421)[1:]
    torque = np.concatenate([up, down, np.linspace(second, first, 421)[1:]])
    coefficients = np.zeros((len(torque) - 1, 4))
    coefficients[:, 0], coefficients[:, 1] = torque[:-1], np.diff(torque) / 0.1
    law = GearLaw(pieces_of(curve_of("linear"), 0), SLIP)

    def virgin(pull):
        angles = np.append(0.0, SLIP.slip_angle)
        slopes = K + np.array([SLIP.stiffness[j:].sum() for j in range(4)])
        torques = np.append(0.0, np.cumsum(slopes[:-1] * np.diff(angles)))
        beyond = angles[-1] + (pull - torques[-1]) / K
        return np.where(pull < torques[-1], np.interp(pull, torques, angles), beyond)

    path = gear_path(0.1, coefficients, law, 1e-7 * K, 0.0)
    top = virgin(first)
    bottom = top - 2.0 * virgin((first - second) / 2.0)
    expected = np.concatenate(
        [
            virgin(up),
            top - 2.0 * virgin((first - down) / 2.0),
            bottom + 2.0 * virgin((torque[721:] - second) / 2.0),
        ]
    )
    # The damper lags by 1e-7 s at less than 1e-4 rad/s.
    np.testing.assert_allclose(path.angle, expected, rtol=0, atol=2e-11)
    assert path.angle[-1] == pytest.approx(top, abs=2e-11)
    assert static_wind_up(law, first) == pytest.approx(top, abs=1e-16)


@given(SEEDS, st.sampled_from(sorted(TORQUE_CURVES)), st.sampled_from([2e-4, 2e-3]))
@settings(max_examples=12, deadline=None, derandomize=True)
def test_any_torque_turns_a_gear_as_a_plain_simulation_does(seed, kind, tau):
    random = np.random.default_rng(seed)
    time = np.linspace(0.0, 0.1, 51)
    spline = CubicSpline(time, random.normal(size=51).cumsum() * random.choice([2.0, 10.0]))
    count = int(random.integers(1, 4))
    slips = GearElements(random.uniform(1.0, 10.0, count), random.uniform(1e-5, 2e-4, count))
    start, curve = random.normal() * 1e-4, curve_of(kind)
    wind_up = solve_wind_up(
        time, spline(time)[:, None], curve, np.array([tau * K]), np.array([start]), (slips,)
    )
    plain = simulated(spline, curve, tau * K, slips, start, 2e-6, 50_000)[::1000]
    half = simulated(spline, curve, tau * K, slips, start, 4e-6, 25_000)[::500]
    # The plain simulation's own error is what half its steps change.
    error = np.abs(half - plain).max()
    np.testing.assert_allclose(wind_up.angle[:, 0], plain, rtol=0, atol=2.0 * error + 1e-10)
    assert error < 1e-2 * np.ptp(plain)
    elongation = slips.along(
        wind_up.angle[:, 0], np.clip(start, -slips.slip_angle, slips.slip_angle)
    )
    assert (np.abs(elongation) <= slips.slip_angle).all()

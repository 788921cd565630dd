"""The wind-up of gears under a given torque: closed forms, an independent integrator, laws."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import cumulative_trapezoid, solve_ivp

from coupling.files.robot_file import find_robot, load_robot
from coupling.inverse import gear_path
from coupling.inverse.gears import (
    SHORTEST_TIME_CONSTANT,
    damping_in_backlash,
    gears_of,
    solve_wind_up,
)
from elastic_robot.chain import build_chain
from elastic_robot.parameters import Parameters
from elastic_robot.torque_curves import TORQUE_CURVES

K, B = 1e5, 1e-3  # [N m/rad, rad]
TIME_CONSTANTS = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1]  # d / k [s]
ANGLES = np.linspace(-4e-3, 4e-3, 17)
# A spring that hardens, and one with a soft side.
TABLE = tuple(zip(ANGLES, K * np.sinh(500.0 * ANGLES) / 500.0, strict=True))
UNEVEN = tuple(
    zip(
        [-3e-3, -2e-3, -1e-3, -2e-4, 3e-4, 1e-3, 1.5e-3, 3e-3],
        [-250.0, -140.0, -50.0, -10.0, 2.0, 20.0, 50.0, 190.0],
        strict=True,
    )
)
KINDS = ["linear", "backlash", "spline", "table", "uneven"]


def curve_of(kind, backlash=B, stiffness=K, gears=1):
    table = {"table": TABLE, "uneven": UNEVEN}.get(kind)
    parameters = Parameters(
        gravity=np.zeros(3),
        stiffness=np.full(gears, stiffness),
        damping=np.zeros(gears),
        backlash=np.full(gears, backlash),
        hysteresis=np.zeros(gears),
        tables=(table,) * gears,
    )
    return TORQUE_CURVES["spline" if table else kind].build(parameters)


def solve(time, torque, kind, tau, start, **curve):
    return solve_wind_up(
        time, torque[:, None], curve_of(kind, **curve), np.array([tau * K]), np.array([start])
    )


def integrated(time, torque, kind, tau, start):
    """A method of eighth order, started anew at each sample, where the torque bends."""
    curve, rtol = curve_of(kind), 1e-12 if kind in ("linear", "backlash") else 1e-10

    def rate(t, e):
        return (np.interp(t, time, torque) - curve.torque(e)) / (tau * K)

    angles = [start]
    for a, b in itertools.pairwise(time):
        done = solve_ivp(rate, (a, b), [angles[-1]], method="DOP853", rtol=rtol, atol=1e-15)
        angles.append(done.y[0, -1])
    return np.array(angles)


@pytest.mark.parametrize("tau", TIME_CONSTANTS)
def test_a_flank_follows_a_ramp_behind_an_exponential(tau):
    """e = B + (T_0 + a t) / k - a d / k^2 + A exp(-t / tau)."""
    time = np.linspace(2.0, 2.3, 301)
    t, a = time - 2.0, 400.0
    wind_up = solve(time, 50.0 + a * t, "backlash", tau, 2e-3)
    steady = B + (50.0 + a * t) / K - a * tau / K
    amplitude = 2e-3 - steady[0]
    decay = np.exp(-t / tau)
    np.testing.assert_allclose(wind_up.angle[:, 0], steady + amplitude * decay, rtol=0, atol=1e-15)
    rate = a / K - amplitude / tau * decay
    np.testing.assert_allclose(wind_up.rate[:, 0], rate, rtol=0, atol=1e-14 / tau)
    assert wind_up.reversals == ()


def test_in_its_backlash_a_gear_integrates_the_torque():
    """Straight pieces of T make parabolas; the gear stays inside."""
    time = np.linspace(0.0, 1.0, 101)
    torque = np.polynomial.Polynomial([0.05, -0.6, 1.0, -0.3])(time)
    wind_up = solve(time, torque, "backlash", 1e-3, -2e-4)
    moved = cumulative_trapezoid(torque, time, initial=0.0) / 100.0
    np.testing.assert_allclose(wind_up.angle[:, 0], -2e-4 + moved, rtol=0, atol=1e-16)
    np.testing.assert_allclose(wind_up.rate[:, 0], torque / 100.0, rtol=0, atol=1e-16)
    (only,) = wind_up.reversals
    assert (only.begins, only.ends, only.before, only.after) == (0.0, 1.0, 0, 0)


@pytest.mark.parametrize("tau", TIME_CONSTANTS)
@pytest.mark.parametrize("fall", [2e2, 2e5])
def test_a_crossing_leaves_flies_arrives_and_settles_as_in_closed_form(tau, fall):
    """T = -a (t - t_0): at the latest 2 B d = integral of T later the other flank is reached.

    From quasi-static wind-up on the flank, e - B = T / k + a d / k^2, it is left at t_0 + tau.
    """
    time = np.linspace(0.0, 0.4, 401)
    d, a, t_0 = tau * K, fall, 0.1003
    leaves = t_0 + tau
    gap = 2.0 * B * d
    # a ((t - t_0)^2 - (leaves - t_0)^2) / 2 = 2 B d
    arrives = t_0 + np.sqrt(tau**2 + 2.0 * gap / a)
    steady = -a * (time - t_0) / K + a * tau / K
    backlash = B - a * ((time - t_0) ** 2 - tau**2) / (2.0 * d)
    amplitude = -(-a * (arrives - t_0) / K + a * tau / K)
    settling = -B + steady + amplitude * np.exp(-np.maximum(time - arrives, 0.0) / tau)
    expected = np.where(time < leaves, B + steady, np.where(time < arrives, backlash, settling))
    wind_up = solve(time, -a * (time - t_0), "backlash", tau, expected[0])
    np.testing.assert_allclose(wind_up.angle[:, 0], expected, rtol=0, atol=1e-13 + 1e-13 * fall / K)
    if leaves < time[-1]:
        (crossing,) = wind_up.reversals
        # Between two samples of a millisecond the passage is taken for even.
        assert crossing.begins == pytest.approx(leaves, abs=1e-3)
        assert (crossing.before, crossing.after) == (1, -1 if arrives < 0.4 else 0)
        assert crossing.ends == pytest.approx(min(arrives, 0.4), abs=1e-3)


@pytest.mark.parametrize("tau", [1e-5, 1e-3, 1e-1])
@pytest.mark.parametrize("kind", KINDS)
def test_every_curve_agrees_with_an_independent_integrator(kind, tau):
    """To rounding where it is a polyline; chords of one that bends are off by 0.3 um a metre at most."""
    time = np.linspace(0.0, 0.03, 31)
    torque = 120.0 * np.sin(140.0 * time + 1.0) + 40.0 * np.sin(517.0 * time)
    wind_up = solve(time, torque, kind, tau, 2e-3)
    expected = integrated(time, torque, kind, tau, 2e-3)
    off = 1e-11 if kind in ("linear", "backlash") else 3e-7
    np.testing.assert_allclose(wind_up.angle[:, 0], expected, rtol=0, atol=off)
    curve = curve_of(kind)
    rate = (torque[:, None] - curve.torque(wind_up.angle)) / (tau * K)
    np.testing.assert_allclose(wind_up.rate, rate, rtol=0, atol=off / tau)


@pytest.mark.parametrize("kind", ["table", "uneven"])
def test_the_error_of_chords_falls_with_the_square_of_their_number(kind, monkeypatch):
    time = np.linspace(0.0, 0.03, 31)
    torque = 120.0 * np.sin(140.0 * time + 1.0)
    expected, errors = integrated(time, torque, kind, 1e-3, 2e-3), []
    for count in (8, 32):
        monkeypatch.setattr(gear_path, "_CHORDS", count)
        errors.append(np.abs(solve(time, torque, kind, 1e-3, 2e-3).angle[:, 0] - expected).max())
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.5)


SEEDS = st.integers(0, 2**32 - 1)


@given(
    SEEDS,
    st.sampled_from(KINDS),
    st.sampled_from([1e-6, 1e-4, 3e-3, 0.2]),
    st.sampled_from([1e-9, 1.0, 100.0]),
)
@settings(max_examples=25, deadline=None, derandomize=True)
def test_two_solutions_approach_and_the_backlash_is_told_whole(seed, kind, tau, size):
    """|e_1 - e_2| never grows; a sample is inside the backlash exactly where a crossing covers it."""
    random = np.random.default_rng(seed)
    time = np.linspace(0.0, 0.03, 31)
    torque = size * random.normal(size=(31, 1)) * (random.random(31) < 0.7)[:, None]
    starts = random.choice([0.0, B, -B, 0.5 * B, 2e-3, -3e-4, random.normal() * B], 2)
    curve = curve_of(kind, gears=2)
    wind_up = solve_wind_up(time, np.repeat(torque, 2, axis=1), curve, np.full(2, tau * K), starts)
    apart = np.abs(wind_up.angle[:, 0] - wind_up.angle[:, 1])
    assert (np.diff(apart) <= 1e-11).all()
    edge = {"backlash": B, "spline": 0.5 * B}.get(kind, 0.0)
    for gear in range(2):
        own = [c for c in wind_up.reversals if c.joint == gear + 1]
        for c, after in itertools.pairwise(own):
            assert c.begins <= c.ends <= after.begins
            assert c.after == after.before != 0
        covered = np.any([(time > c.begins) & (time < c.ends) for c in own] + [time < 0], axis=0)
        e = np.abs(wind_up.angle[:, gear])
        assert (e[covered] <= edge + 2e-13).all()
        assert covered[(e < edge - 2e-13) & (time > 0.0) & (time < time[-1])].all()


@pytest.mark.parametrize("kind", ["backlash", "spline"])
@pytest.mark.parametrize("start", [0.0, 0.3, 0.5, 1.0, -1.0, -0.5, 3.0])
def test_without_torque_a_gear_rests_in_its_backlash_or_falls_back_to_its_edge(kind, start):
    time = np.linspace(0.0, 5.0, 5001)
    edge = B if kind == "backlash" else 0.5 * B
    wind_up = solve(time, np.zeros(5001), kind, 1e-3, start * B)
    if abs(start) * B <= edge:
        assert (wind_up.angle == start * B).all()
        inside = abs(start) * B < edge
        assert [c.after for c in wind_up.reversals] == [0] * inside
    else:
        assert edge - 2e-13 <= abs(wind_up.angle[-1, 0]) < 1.3 * edge
        assert len(wind_up.reversals) <= 1


def test_a_torque_that_only_touches_zero_opens_no_backlash():
    time = np.linspace(0.0, 2.0, 2001)
    torque = 30.0 * (1.0 + np.cos(2.0 * np.pi * 5.0 * time))
    wind_up = solve(time, torque, "backlash", 1e-3, B)
    assert wind_up.reversals == ()
    assert (wind_up.angle >= B).all()


def test_a_gear_that_floats_for_seconds_makes_no_chatter():
    """Axis 1: noise of 1e-11 N m about zero on the edge of the backlash: a spring's rounding."""
    time = np.linspace(0.0, 20.0, 20001)
    torque = 1e-11 * np.random.default_rng(3).normal(size=20001)
    for start in (-B, B):
        wind_up = solve(time, torque, "backlash", 1e-3, start)
        assert len(wind_up.reversals) <= 1
        assert np.abs(wind_up.angle - start).max() < 1e-12


def test_without_backlash_a_gear_is_a_spring():
    time = np.linspace(0.0, 0.1, 101)
    torque = 100.0 * np.sin(60.0 * time)
    springs = [solve(time, torque, kind, 1e-3, 0.0, backlash=0.0) for kind in KINDS[:3]]
    for other in springs[1:]:
        np.testing.assert_allclose(other.angle, springs[0].angle, rtol=0, atol=1e-17)
        assert other.reversals == ()


@pytest.mark.parametrize("kind", KINDS)
def test_a_gear_without_damper_gets_a_small_one(kind):
    """By which it lags behind the angle that carries its torque."""
    time = np.linspace(0.0, 0.1, 101)
    torque = 100.0 * np.cos(60.0 * time)
    curve = curve_of(kind)
    (damping,) = damping_in_backlash(curve, np.zeros(1))
    angles = np.linspace(-5e-3, 5e-3, 2001)[:, None]
    assert damping == pytest.approx(SHORTEST_TIME_CONSTANT * curve.slope(angles).max(), rel=0.02)
    bare = solve(time, torque, kind, 0.0, B + 1e-3)
    damped = solve(time, torque, kind, damping / K, B + 1e-3)
    np.testing.assert_allclose(bare.angle, damped.angle, rtol=1e-12)


def test_the_gears_of_a_robot_are_its_torsions():
    robot = load_robot(find_robot("icme2008"))
    chain = build_chain(robot)
    gears = gears_of(Parameters.of(robot), chain)
    joints = [joint for joint in robot.joints if joint.stiffness is not None]
    assert len(gears.tables) == len(joints) == len(chain.torsions)
    assert gears.stiffness.tolist() == [joint.stiffness for joint in joints]
    assert gears.damping.tolist() == [joint.damping for joint in joints]
    assert gears.backlash.tolist() == [joint.backlash for joint in joints]


def test_gears_do_not_depend_on_each_other():
    time = np.linspace(0.0, 0.1, 101)
    torque = np.random.default_rng(1).normal(size=(101, 3)).cumsum(axis=0) * 30.0
    curve = curve_of("backlash", gears=3)
    damping, start = K * np.array([1e-4, 1e-3, 0.0]), np.array([0.0, B, -2e-3])
    together = solve_wind_up(time, torque, curve, damping, start)
    for gear in range(3):
        alone = solve_wind_up(
            time, torque[:, gear : gear + 1], curve_of("backlash"), damping[[gear]], start[[gear]]
        )
        assert (together.angle[:, gear] == alone.angle[:, 0]).all()
        own = [c for c in together.reversals if c.joint == gear + 1]
        assert [(c.begins, c.ends) for c in own] == [(c.begins, c.ends) for c in alone.reversals]

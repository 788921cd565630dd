"""Gears with hysteresis: closed forms, a plain simulation, laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from linked_gear import END, INERTIA, load, simulated_miss
from scipy.interpolate import CubicSpline

from coupling.inverse.command import gear_command
from coupling.inverse.drive_limits import DriveLimits
from coupling.inverse.gear_drive import GearDrive, GearTask
from coupling.inverse.gear_elements import GearElements
from coupling.inverse.gear_path import GearLaw
from coupling.inverse.gears import solve_wind_up
from coupling.inverse.rows import CommandRows
from coupling.inverse.spline import UniformSpline
from elastic_robot.parameters import Parameters
from elastic_robot.torque_curves import TORQUE_CURVES

K, B = 1e5, 1e-4  # [N m/rad, rad]
SLIP = GearElements(np.array([4.0, 3.0, 5.0]), np.array([2e-5, 6e-5, 1.5e-4]))
SEEDS = st.integers(0, 2**32 - 1)
KINDS = sorted(TORQUE_CURVES)


def curve_of(kind, gears=1):
    one = np.ones(gears)
    parameters = Parameters(np.zeros(3), K * one, 0 * one, B * one, 0 * one, (None,) * gears)
    return TORQUE_CURVES[kind].build(parameters)


def some_elements(random):
    count = int(random.integers(1, 4))
    return GearElements(random.uniform(1.0, 10.0, count), random.uniform(1e-5, 2e-4, count))


def stretched(elements, start):
    """Elongations of elements that come to a wind-up from unloaded."""
    return np.clip(start, -elements.slip_angle, elements.slip_angle)


def plainly(torque, curve, damping, elements, start, step, count):
    """d e' = T - S(e) - sum f s / a by explicit steps, s = clip(s + de, +-a) in each: e of n gears."""
    f, a = np.zeros((len(start), 3)), np.ones((len(start), 3))
    for k, own in enumerate(elements):
        f[k, : len(own.slip_torque)], a[k, : len(own.slip_angle)] = own.slip_torque, own.slip_angle
    e, s, slope = start, np.clip(start[:, None], -a, a), f / a
    found = [e]
    for now in torque(step * (np.arange(count) + 0.5)):
        move = step / damping * (now - curve.torque(e) - (slope * s).sum(axis=1))
        e, s = e + move, np.minimum(np.maximum(s + move[:, None], -a), a)
        found.append(e)
    return np.array(found)


def test_a_triangular_torque_makes_the_loop_of_its_elements_in_closed_form():
    """Without a damper to speak of T rises to T_1, falls to T_2 and rises to T_1, by Masing's rule:

    e = v(T) of the virgin curve, e_1 - 2 v((T_1 - T) / 2), e_2 + 2 v((T - T_2) / 2); the loop closes.
    """
    first, second = 30.0, -12.0
    up, down = np.linspace(0.0, first, 301), np.linspace(first, second, 421)[1:]
    again = np.linspace(second, first, 421)[1:]
    torque = np.concatenate([up, down, again])
    spring = GearLaw.of(curve_of("linear"), 0)

    def virgin(pull):
        angles = np.append(0.0, SLIP.slip_angle)
        slopes = K + np.array(
            [np.sum(SLIP.slip_torque[j:] / SLIP.slip_angle[j:]) for j in range(3)]
        )
        torques = np.append(0.0, np.cumsum(slopes * np.diff(angles)))
        beyond = angles[-1] + (pull - torques[-1]) / K
        return np.where(pull < torques[-1], np.interp(pull, torques, angles), beyond)

    angle, _ = spring.path(0.1, torque, 1e-7 * K, 0.0, SLIP)
    top = virgin(first)
    bottom = top - 2.0 * virgin((first - second) / 2.0)
    back, forth = virgin((first - down) / 2.0), virgin((again - second) / 2.0)
    expected = np.concatenate([virgin(up), top - 2.0 * back, bottom + 2.0 * forth])
    # The damper lags by 1e-7 s at less than 1e-4 rad/s.
    np.testing.assert_allclose(angle, expected, rtol=0, atol=2e-11)
    assert angle[-1] == pytest.approx(top, abs=2e-11)
    law = spring.with_elements(SLIP, 0.0, np.zeros(3))
    assert law.angle_at(first) == pytest.approx(top, abs=1e-16)


@pytest.mark.parametrize("kind", KINDS)
def test_any_torque_turns_a_gear_as_plain_steps_do(kind):
    """A dozen of gears at once, as one step takes as long for all."""
    random, gears = np.random.default_rng(1), 12
    time = np.linspace(0.0, 0.1, 51)
    rough = random.normal(size=(51, gears)).cumsum(axis=0) * random.choice([2.0, 10.0], gears)
    torque, start = CubicSpline(time, rough), random.normal(size=gears) * 1e-4
    damping = K * random.choice([2e-4, 2e-3], gears)
    slips, curve = tuple(some_elements(random) for _ in range(gears)), curve_of(kind, gears)
    # Straight between samples, and turning back at one, is as good as what it is compared with.
    dense = np.linspace(0.0, 0.1, 10_001)
    wind_up = solve_wind_up(dense, torque(dense), curve, damping, start, slips)
    fine = plainly(torque, curve, damping, slips, start, 4e-6, 25_000)[::500]
    coarse = plainly(torque, curve, damping, slips, start, 8e-6, 12_500)[::250]
    # Of first order: they are off by what half of them changes.
    error = np.abs(coarse - fine).max(axis=0)
    assert (np.abs(wind_up.angle[::200] - fine) <= 1.5 * error + 1e-8).all()
    assert (error < 4e-3 * np.ptp(fine, axis=0)).all()


@given(SEEDS, st.sampled_from(KINDS), st.sampled_from([1e-6, 1e-3, 0.1]))
@settings(max_examples=25, deadline=None, derandomize=True)
def test_the_wind_up_of_a_torque_asks_for_that_torque(seed, kind, tau):
    """Forward again: d e' + S(e) + sum f s / a = T with the elongations along the wind-up found."""
    random = np.random.default_rng(seed)
    time = np.linspace(0.0, 0.1, 2001)
    rough = random.normal(size=51).cumsum() * random.choice([2.0, 10.0])
    torque = CubicSpline(time[::40], rough)(time)
    slips, start, curve = some_elements(random), random.normal() * 1e-4, curve_of(kind)
    wind_up = solve_wind_up(
        time, torque[:, None], curve, np.array([tau * K]), np.array([start]), (slips,)
    )
    angle, a = wind_up.angle[:, 0], slips.slip_angle
    s, torques = stretched(slips, start), []
    for move in np.diff(angle, prepend=start):
        s = np.clip(s + move, -a, a)
        torques.append(np.sum(slips.slip_torque * s / a))
    asked = tau * K * wind_up.rate[:, 0] + curve.torque(wind_up.angle)[:, 0] + torques
    # Between samples it turns back by a little more than they show.
    turned = np.abs(np.diff(angle, 2)).max() * np.sum(slips.slip_torque / a)
    chords = 4e-4 if kind == "spline" else 1e-9  # [N m]
    np.testing.assert_allclose(asked, torque, rtol=0, atol=2.0 * turned + chords)
    # Its rates are those of its angles.
    middle = 0.5 * (wind_up.rate[1:, 0] + wind_up.rate[:-1, 0]) * time[1]
    # But where its law bends between two samples.
    wrong = np.quantile(np.abs(np.diff(angle) - middle), 0.9)
    assert tau < 1e-3 or wrong < 1e-3 * np.abs(np.diff(angle)).max()


@given(SEEDS, st.sampled_from([1e-6, 1e-3, 0.1]))
@settings(max_examples=25, deadline=None, derandomize=True)
def test_two_starts_approach_in_the_norm_of_springs_and_elements(seed, tau):
    random = np.random.default_rng(seed)
    time = np.linspace(0.0, 0.1, 401)
    torque = CubicSpline(time[::8], random.normal(size=51).cumsum() * 5.0)(time)
    slips, starts = some_elements(random), random.normal(size=2) * 2e-4
    found = [
        solve_wind_up(
            time, torque[:, None], curve_of("linear"), np.array([tau * K]), np.array([e]), (slips,)
        ).angle[:, 0]
        for e in starts
    ]
    one, two = (slips.along(e, stretched(slips, e[0])) for e in found)
    size = K * (found[0] - found[1]) ** 2 + (one - two) ** 2 @ (
        slips.slip_torque / slips.slip_angle
    )
    # Elongations between samples are taken one way.
    assert (np.diff(size) <= 1e-2 * size.max() + 1e-15).all()
    assert size[-1] < size[0]


def test_a_gear_comes_to_rest_where_its_curve_begins_to_bend():
    """It falls back until its element, of half the backlash, is slack: to the rounded backlash."""
    time = np.linspace(0.0, 1.0, 1001)
    half = GearElements(np.array([12.0]), np.array([0.5 * B]))
    wind_up = solve_wind_up(
        time,
        np.full((1001, 1), -2e-11),
        curve_of("spline"),
        np.array([1e-6 * K]),
        np.array([B]),
        (half,),
    )
    np.testing.assert_allclose(wind_up.angle[1:, 0], 0.5 * B, rtol=0, atol=1e-12)


def test_elements_that_slip_at_no_torque_change_nothing():
    time = np.linspace(0.0, 0.2, 201)
    torque = (20.0 * np.sin(60.0 * time))[:, None]
    none = GearElements(np.full(2, 1e-12), np.array([2e-5, 1e-4]))
    for kind in KINDS:
        curve, damping, start = curve_of(kind), np.array([1e-3 * K]), np.array([1e-5])
        plain = solve_wind_up(time, torque, curve, damping, start)
        slipping = solve_wind_up(time, torque, curve, damping, start, (none,))
        np.testing.assert_allclose(slipping.angle, plain.angle, rtol=0, atol=1e-12)
        assert len(slipping.reversals) == len(plain.reversals)
        for own, other in zip(slipping.reversals, plain.reversals, strict=True):
            assert own.before == other.before
            assert own.begins == pytest.approx(other.begins, abs=1e-7)
            assert own.ends == pytest.approx(other.ends, abs=1e-7)


def link_task(kind, damping):
    """A link that swings to and fro under a torque that does; its gear slips both ways."""
    knots = np.linspace(0.0, END, 81)
    swing = np.polynomial.Polynomial([0, 0, 0, 0, 35, -84, 70, -20])
    coefficients = 0.02 * swing(np.clip((np.arange(85) - 22) / 40.0, 0.0, 1.0))
    link = UniformSpline(0.0, float(knots[1]), coefficients[:, None], 5)
    time = np.linspace(0.0, END, 801)
    torque = load(time) - INERTIA * link.at(time, 2)[:, 0]
    curve = curve_of(kind)
    law = GearLaw.of(curve, 0).with_elements(SLIP, 0.0, np.zeros(3))
    start = law.angle_at(float(torque[0]))
    wind_up = solve_wind_up(
        time, torque[:, None], curve, np.array([damping]), np.array([start]), (SLIP,)
    )
    inertia = np.full(801, INERTIA)
    return GearTask(link, time, torque, wind_up.angle[:, 0], curve, damping, time, inertia, SLIP)


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("kind", KINDS)
def test_the_link_moves_as_wanted_behind_a_gear_that_slips(kind, degree):
    """Within 0.2 microrad, where the command of a gear without elements leaves 50 at least."""
    task = link_task(kind, 500.0)
    rows = CommandRows(0.0, 0.004, 200, degree)
    command = gear_command(task, rows, DriveLimits(1))
    assert np.abs(simulated_miss(task, command)).max() < 2e-7


def test_a_part_of_a_drive_goes_on_as_the_whole_does():
    """With other coefficients than before in both: its elements come from where the whole's do."""
    random, rows = np.random.default_rng(4), CommandRows(0.0, 0.004, 200, 5)
    drive = GearDrive.of(link_task("backlash", 500.0), rows)
    coefficients = 1e-4 * random.normal(size=rows.coefficients).cumsum()
    misses = 1e-6 * random.normal(size=drive.layout.nodes)
    whole = drive.along(coefficients, misses)
    coefficients[70:] += 1e-5
    part = whole.part(60, 140).along(coefficients[60:145], misses[120:281])
    own = part.defects(coefficients[60:145], misses[120:281])
    expected = drive.along(coefficients, misses).defects(coefficients, misses)[60:140]
    # The step before its first one is not here.
    np.testing.assert_allclose(own.ravel()[1:], expected.ravel()[1:], rtol=1e-9, atol=1e-15)


def test_limits_cost_a_gear_that_slips_accuracy_only_where_they_bind():
    task = link_task("backlash", 500.0)
    rows = CommandRows(0.0, 0.004, 200, 5)
    free = gear_command(task, rows, DriveLimits(1))
    bends = np.abs(free.at(task.time, 2)[:, 0])
    most = 0.8 * float(bends.max())
    command = gear_command(task, rows, DriveLimits(1, acceleration=most))
    dense = np.linspace(0.0, END, 8001)
    assert np.abs(command.at(dense, 2)).max() <= most * (1.0 + 1e-6)
    miss = simulated_miss(task, command)
    assert np.abs(miss).max() < 2e-5
    assert np.abs(miss[-100:]).max() < 2e-6

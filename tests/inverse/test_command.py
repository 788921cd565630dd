"""Commands on the controller's rows: one mass behind one gear, simulated by a program of its own."""

import functools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from linked_gear import END, INERTIA, load, simulated_miss
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, make_interp_spline

from coupling.errors import PlanningError
from coupling.inverse import fit as fit_module
from coupling.inverse.command import gear_command, rigid_command
from coupling.inverse.drive_limits import DriveLimits
from coupling.inverse.fit import SplineFit, end_conditions
from coupling.inverse.gear_drive import GearDrive, GearTask
from coupling.inverse.rows import CommandRows
from coupling.inverse.spline import UniformSpline
from coupling.inverse.torque_impulses import torque_impulses
from elastic_robot.kinematic_errors import KinematicErrors
from elastic_robot.parameters import Parameters
from elastic_robot.torque_curves import TORQUE_CURVES, TorqueCurve
from elastic_robot.trajectory import Trajectory
from tests.inverse import drive_oracle

STIFFNESS, BACKLASH, DAMPING = 2e5, 1e-4, 500.0
FREE = DriveLimits(1)


def curve_of(kind: str) -> TorqueCurve:
    one = np.ones(1)
    parameters = Parameters(
        np.zeros(3), STIFFNESS * one, DAMPING * one, BACKLASH * one, 0 * one, (None,)
    )
    return TORQUE_CURVES[kind].build(parameters)


def uniform(
    exact: Callable[[np.ndarray], np.ndarray], spacing: float, degree: int
) -> UniformSpline:
    """Return a spline on the path's even nodes as such, from one that can be evaluated."""
    count = round(END / spacing) + degree
    dense = np.linspace(0.0, END, 3 * count)
    unit = np.eye(count)
    design = UniformSpline(0.0, spacing, unit, degree).at(dense)
    return UniformSpline(0.0, spacing, np.linalg.lstsq(design, exact(dense))[0][:, None], degree)


def ramp(times: np.ndarray, order: int = 0) -> np.ndarray:
    """Rest-to-rest motion from 0 to 0.05 rad in the middle of the path, or its derivatives."""
    begin, length, rise = 0.2, 0.4, 0.05
    s = np.clip((times - begin) / length, 0.0, 1.0)
    motion = np.polynomial.Polynomial([0, 0, 0, 0, 35, -84, 70, -20])  # C3 at both ends
    value: np.ndarray = rise / length**order * motion.deriv(order)(s) if order else rise * motion(s)
    return value


REST = [(1, 0.0), (2, 0.0)]
NODES = np.linspace(0.0, END, 101)
LINK = uniform(make_interp_spline(NODES, ramp(NODES), 5, bc_type=(REST, REST)), NODES[1], 5)


@functools.cache
def gear_task(kind: str, damping: float = DAMPING) -> GearTask:
    """The gear carries T = load - M phi''; the wind-up by a stiff solver from d e' + S(e) = T."""
    times = np.linspace(0.0, END, 801)
    torque = load(times) - INERTIA * LINK.at(times, 2)[:, 0]
    curve = curve_of(kind)
    if damping > 0.0:
        between = CubicSpline(times, torque)
        slope = lambda t, e: (between(t) - curve.torque(e)) / damping  # noqa: E731
        start = curve.deflection(torque[:1])
        solved = solve_ivp(
            slope, (0.0, END), start, "LSODA", times, max_step=1e-3, rtol=1e-9, atol=1e-13
        )
        wind_up = solved.y[0]
    else:
        wind_up = curve.deflection(torque)
    return GearTask(LINK, times, torque, wind_up, curve, damping, times, np.full(801, INERTIA))


def rows_of(cycle: float, degree: int) -> CommandRows:
    return CommandRows(0.0, cycle, round(END / cycle), degree)


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("damping", [DAMPING, 5.0])
@pytest.mark.parametrize("kind", TORQUE_CURVES)
def test_the_link_moves_as_wanted_behind_its_gear(kind: str, damping: float, degree: int):
    """Within 0.3 microrad at 4 ms, though the backlash of 200 is crossed four times."""
    task = gear_task(kind, damping)
    command = gear_command(task, rows_of(0.004, degree), FREE)
    miss = simulated_miss(task, command)
    assert np.abs(miss).max() < 3e-7


def test_a_command_sampled_from_the_exact_drive_leaves_five_times_as_much():
    task = gear_task("backlash")
    drive = (LINK.at(task.time)[:, 0] - task.wind_up)[::4]
    sampled = uniform(CubicSpline(task.time[::4], drive, bc_type="clamped"), 0.004, 3)
    matched = gear_command(task, rows_of(0.004, 3), FREE)
    misses = [np.abs(simulated_miss(task, command)).max() for command in (matched, sampled)]
    assert misses[0] < 0.2 * misses[1]


@pytest.mark.parametrize("degree", [3, 5])
def test_a_linear_gear_without_damper_is_driven_by_link_plus_inertia(degree: int):
    """q = phi - (load - M phi'') / k in closed form."""
    task = gear_task("linear", damping=0.0)
    command = gear_command(task, rows_of(0.004, degree), FREE)
    closed = (
        LINK.at(task.time)[:, 0]
        - (load(task.time) - INERTIA * LINK.at(task.time, 2)[:, 0]) / STIFFNESS
    )
    np.testing.assert_allclose(command.at(task.time)[:, 0], closed, atol=2e-6)


@pytest.mark.parametrize(("degree", "order"), [(3, 3.5), (5, 4.0)])
def test_the_miss_of_a_linear_gear_falls_by_order_with_the_cycle(degree: int, order: float):
    task = gear_task("linear")
    misses = []
    for cycle in (0.04, 0.02, 0.01):
        command = gear_command(task, rows_of(cycle, degree), FREE)
        misses.append(np.abs(simulated_miss(task, command)).max())
    assert np.log2(misses[0] / misses[2]) / 2.0 > order, misses


@pytest.mark.parametrize("degree", [3, 5])
def test_rows_give_the_command_back(degree: int):
    rows = rows_of(0.01, degree)
    command = gear_command(gear_task("backlash"), rows, FREE)
    nodes, dense = command.nodes, np.linspace(0.0, END, 1001)
    given = [command.at(nodes, order) for order in range(3)] if degree == 5 else [command.at(nodes)]
    robot = Trajectory(nodes, *given).at(dense)
    for order, tolerance in enumerate((1e-14, 1e-11, 1e-8)):
        np.testing.assert_allclose(robot[order], command.at(dense, order), rtol=0, atol=tolerance)
    if degree == 3:
        other = CubicSpline(nodes, command.at(nodes), bc_type="clamped")
        np.testing.assert_allclose(other(dense), command.at(dense), rtol=0, atol=1e-14)


@pytest.mark.parametrize("degree", [3, 5])
def test_a_command_starts_in_equilibrium_and_rests_at_both_ends(degree: int):
    task = gear_task("backlash")
    command = gear_command(task, rows_of(0.01, degree), FREE)
    ends = np.array([0.0, END])
    assert command.at(ends)[0, 0] == pytest.approx(LINK.at(ends)[0, 0] - task.wind_up[0], abs=1e-13)
    np.testing.assert_allclose(command.at(ends, 1), 0.0, atol=1e-10)
    if degree == 5:
        np.testing.assert_allclose(command.at(ends, 2), 0.0, atol=1e-7)


@pytest.mark.parametrize("kind", TORQUE_CURVES)
@pytest.mark.parametrize(("degree", "cycle"), [(3, 0.004), (5, 0.008)])
def test_gradients_of_the_equations_are_those_of_differences(kind: str, degree: int, cycle: float):
    drive = GearDrive.of(gear_task(kind), rows_of(cycle, degree)).part(20, 60)
    layout, rng = drive.layout, np.random.default_rng(1)
    c = drive.link[:: 4 * layout.parts].mean() + 1e-3 * rng.standard_normal(layout.count + degree)
    misses = 1e-6 * rng.standard_normal(layout.nodes)
    gradient = drive.gradient(c, misses)
    change = rng.standard_normal(layout.size)
    step = 1e-10
    moved = [
        drive.defects(c + s * change[layout.coefficient], misses + s * change[layout.miss])
        for s in (step, -step)
    ]
    places = np.arange(layout.count)[:, None] * layout.stride + np.arange(layout.width)
    expected = np.einsum("nmw,nw->nm", gradient, change[places])
    np.testing.assert_allclose(
        (moved[0] - moved[1]) / (2 * step), expected, atol=2e-4 * np.abs(expected).max()
    )


@pytest.mark.parametrize("kind", TORQUE_CURVES)
@pytest.mark.parametrize(("degree", "cycle"), [(3, 0.008), (5, 0.02)])
def test_defects_and_a_step_are_those_of_the_dense_problem(kind: str, degree: int, cycle: float):
    """Away from the solution, across the edges of a backlash; integrals by many more points."""
    sines = KinematicErrors(1, np.zeros(1, int), *np.array([[1e-4], [30.0], [0.4]]))
    task, rows = replace(gear_task(kind), errors=sines), rows_of(cycle, degree)
    drive, rng = GearDrive.of(task, rows), np.random.default_rng(3)
    fit = SplineFit.whole(drive, end_conditions(rows, 0.1))
    coefficients = drive.link.mean() + 1e-3 * rng.standard_normal(rows.coefficients)
    misses = np.append(0.0, 1e-5 * rng.standard_normal(drive.layout.nodes - 1))
    expected = drive_oracle.defects(drive, coefficients, misses)
    found = drive.defects(coefficients, misses).ravel()
    np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max(), rtol=0.0)
    for damping in (0.0, 5.0):
        step = fit.band_step(coefficients, misses, damping, fit.whole_stretch)
        dense = drive_oracle.step(fit, coefficients, misses, damping)
        apart = (step - dense)[fit.free]
        assert np.abs(apart).max() < 1e-5 * np.abs(dense).max()


def test_a_step_of_a_stretch_is_that_of_its_dense_problem():
    """What meets others is held; elsewhere nothing changes, and the value is that of the stretch."""
    task, rows, rng = gear_task("backlash"), rows_of(0.02, 5), np.random.default_rng(4)
    drive = GearDrive.of(task, rows)
    fit = SplineFit.whole(drive, end_conditions(rows, 0.1))
    coefficients = drive.link.mean() + 1e-3 * rng.standard_normal(rows.coefficients)
    misses = np.append(0.0, 1e-5 * rng.standard_normal(drive.layout.nodes - 1))
    parts, stride, expected = drive.layout.parts, drive.layout.stride, np.zeros(drive.layout.size)
    stretches = np.array([[0, 14], [17, 29]])
    for begin, end in stretches.tolist():
        part = fit.part(begin, end)
        here = coefficients[begin : end + 5], misses[begin * parts : end * parts + 1]
        dense = drive_oracle.step(part, *here, 0.0)
        size = part.drive.layout.size
        expected[begin * stride : begin * stride + size][part.free] = dense[part.free]
    found = fit.band_step(coefficients, misses, 0.0, stretches)
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max(), rtol=0.0)
    assert not found[expected == 0.0].any()
    trial = coefficients + found[drive.layout.coefficient], misses + found[drive.layout.miss]
    rise, part = (
        fit.value(*trial, where) - fit.value(coefficients, misses, where)
        for where in (fit.whole_stretch, stretches)
    )
    assert part == pytest.approx(rise, rel=1e-9)


def test_the_command_of_a_long_path_is_that_of_one_store(monkeypatch: pytest.MonkeyPatch):
    """Small stores, and stretches that no longer change left out: what all at once gives."""
    task, rows = gear_task("backlash"), rows_of(0.002, 5)
    drive = GearDrive.of(task, rows)
    fit = SplineFit.whole(drive, end_conditions(rows, float(LINK.at(np.zeros(1))[0, 0])))
    begin = np.full(rows.coefficients, LINK.at(np.zeros(1))[0, 0]), np.zeros(drive.layout.nodes)
    monkeypatch.setattr(fit_module, "_LAG", rows.count)
    whole = fit.descend(*begin, SplineFit.band_step, lambda *_: fit.whole_stretch)
    monkeypatch.setattr(fit_module, "_LAG", 16)
    for found, expected in zip(fit.solve(*begin), whole, strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-11, rtol=0.0)


def test_impulses_are_the_integrals_of_scipys_spline():
    """Steps of any length, up to behind the last sample, where the torque stays."""
    rng = np.random.default_rng(5)
    for samples, steps, length in ((4, 3, 1.0), (5, 9, 0.31), (200, 71, 2.9)):
        torque = rng.normal(size=samples)
        spline = CubicSpline(0.1 * np.arange(samples), torque).antiderivative()
        edges, end = 0.1 * length * np.arange(steps + 1), 0.1 * (samples - 1)
        area = spline(np.minimum(edges, end)) + torque[-1] * np.maximum(edges - end, 0.0)
        found = torque_impulses(0.1, torque, steps, 0.1 * length)
        np.testing.assert_allclose(found, np.diff(area), atol=1e-14)
    with pytest.raises(ValueError, match="expected 4 samples or more, got 3"):
        torque_impulses(0.1, np.zeros(3), 2, 0.1)


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("kind", ["backlash", "spline"])
def test_limits_hold_between_rows_and_cost_little(kind: str, degree: int):
    """A tenth and a five-hundredth less than the best command takes; the link is off by microrads."""
    task, rows = gear_task(kind), rows_of(0.004, degree)
    dense = np.linspace(0.0, END, 20001)
    free = gear_command(task, rows, FREE)
    rate, acceleration = (np.abs(free.at(dense, order)).max() for order in (1, 2))
    limits = DriveLimits(1, rate=0.998 * rate, acceleration=0.9 * acceleration)
    command = gear_command(task, rows, limits)
    assert np.abs(command.at(dense, 1)).max() <= limits.rate
    assert np.abs(command.at(dense, 2)).max() <= limits.acceleration
    assert np.abs(simulated_miss(task, command)).max() < 2e-5


def test_no_feasible_command_is_better():
    """Random commands within the limits, the misses solved anew: all worse, for a linear gear surely."""
    task, rows, rng = gear_task("linear"), rows_of(0.02, 3), np.random.default_rng(2)
    limits = DriveLimits(1, acceleration=1.02 * np.abs(LINK.at(np.linspace(0, END, 4001), 2)).max())
    command = gear_command(task, rows, limits).coefficients[:, 0]
    assert (
        np.abs(np.diff(command, 2)).max() > 0.999 * limits.acceleration * rows.cycle**2
    )  # it binds
    drive = GearDrive.of(task, rows)
    conditions = end_conditions(rows, LINK.at(np.zeros(1))[0, 0] - task.wind_up[0])
    fit = SplineFit.whole(drive, conditions)
    nodes = drive.layout.nodes
    response = np.array([drive.defects(command, row) for row in np.eye(nodes)[1:]]).reshape(
        nodes - 1, -1
    )
    still = drive.defects(command, np.zeros(nodes)).ravel()
    matrix = response.T - still[:, None]

    def objective(coefficients: np.ndarray) -> float:
        misses = np.zeros(nodes)
        misses[1:] = np.linalg.solve(matrix, -drive.defects(coefficients, misses).ravel())
        return fit.value(coefficients, misses, fit.whole_stretch)

    ends = np.zeros((3, rows.coefficients))
    for row, condition in zip(ends, conditions, strict=True):
        row[condition.first : condition.first + 4] = condition.weights
    inside = np.eye(rows.coefficients) - np.linalg.pinv(ends) @ ends
    # The ends of stretches, held, cost the rest.
    best, tried = (1.0 - 1e-4) * objective(command), 0
    for size in np.logspace(-9, -4, 2000):
        trial = command + size * inside @ rng.standard_normal(rows.coefficients)
        # Towards the feasible side first, since most random changes break a limit that binds.
        trial = command + inside @ np.clip(trial - command, -size, size)
        if limits.excess(UniformSpline(0.0, rows.cycle, trial[:, None], 3)).max() <= 0.0:
            tried += 1
            assert objective(trial) > best
    assert tried > 100
    # A line to another feasible command leads up.
    slower = gear_command(task, rows, DriveLimits(1, acceleration=0.98 * limits.acceleration))
    for part in np.linspace(0.01, 1.0, 20):
        assert objective(command + part * (slower.coefficients[:, 0] - command)) > best


@settings(max_examples=15, deadline=None, derandomize=True)
@given(
    knots=st.lists(st.floats(-60.0, 60.0), min_size=6, max_size=6),
    kind=st.sampled_from(list(TORQUE_CURVES)),
    degree=st.sampled_from([3, 5]),
    damping=st.sampled_from([0.0, 2.0, 500.0]),
)
def test_any_torque_is_met_within_limits(
    knots: list[float], kind: str, degree: int, damping: float
):
    """Whatever the gear carries: the command keeps to its limits and the scalar robot to 1e-4 rad."""
    times = np.linspace(0.0, END, 801)
    torque = CubicSpline(np.linspace(0.0, END, 6), knots, bc_type="clamped")(times)
    curve = curve_of(kind)
    angles = np.linspace(-2e-3, 2e-3, 4001)
    wind_up = np.interp(torque, curve.torque(angles), angles)
    task = GearTask(LINK, times, torque, wind_up, curve, damping, times, np.full(801, INERTIA))
    limits = DriveLimits(1, acceleration=6.0)
    command = gear_command(task, rows_of(0.008, degree), limits)
    assert np.abs(command.at(np.linspace(0.0, END, 4001), 2)).max() <= 6.0 * (1 + 1e-9)
    away = LINK.at(times)[:, 0] - command.at(times)[:, 0]
    assert np.abs(away).max() < BACKLASH + 70.0 / STIFFNESS + 1e-3


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("angle", [0.0, 2.0])
def test_a_rigid_joint_is_driven_along_its_link(degree: int, angle: float):
    """Wherever it is, up to its ends."""
    times = np.linspace(0.0, END, 801)
    link = replace(LINK, coefficients=LINK.coefficients + angle)
    command = rigid_command(link, rows_of(0.004, degree), FREE)
    np.testing.assert_allclose(command.at(times), link.at(times), rtol=0, atol=1e-9)


def test_a_path_beyond_a_limit_is_refused_with_joint_time_value_and_limit():
    with pytest.raises(
        PlanningError, match=r"joint 6: expected at most 0.1 rad/s of rate.* at 0\.\d+ s"
    ):
        rigid_command(LINK, rows_of(0.004, 5), DriveLimits(6, rate=0.1))
    with pytest.raises(
        PlanningError, match=r"joint 2: expected at most 0.5 rad/s\^2 of acceleration, got"
    ):
        gear_command(gear_task("backlash"), rows_of(0.004, 5), DriveLimits(2, acceleration=0.5))
    with pytest.raises(
        PlanningError, match=r"joint 3: expected an angle of -1 to 0.02 rad, got 0.02"
    ):
        rigid_command(LINK, rows_of(0.004, 5), DriveLimits(3, lower=-1.0, upper=0.02))


def test_a_path_cut_in_motion_is_not_forced_to_rest():
    """Quintic rows alone can start and end in motion."""
    begin, end = 0.3, 0.5
    rows = CommandRows(begin, 0.004, 50, 5, rest=(False, False))
    command = rigid_command(LINK, rows, FREE)
    times = np.linspace(begin, end, 301)
    np.testing.assert_allclose(command.at(times), LINK.at(times), atol=1e-8)

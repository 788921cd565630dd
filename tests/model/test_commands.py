"""Motion of drives between commands, and from samples: exact for a constant jerk."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from elastic_robot.commands import Command, CommandedMotion, LastStep
from elastic_robot.errors import TrajectoryError
from elastic_robot.trajectory import HeldCommand, Trajectory, read_trajectory

UNKNOWN = np.array([np.nan])


def follow(steps, motion, jerk=UNKNOWN):
    """The motion over each step of a drive whose q, q', q'' at a time are given."""
    past, time, path = None, 0.0, []
    for length in steps:
        command = Command(*(np.array([value]) for value in motion(time)), jerk)
        path.append(CommandedMotion.after(past, command, time, length))
        past = path[-1].past(time + length, past)
        time += length
    return path


def at(motion: CommandedMotion, time: float) -> np.ndarray:
    return motion.at(np.array([time]))[:, 0, 0]


def test_a_constant_jerk_is_exact_from_the_second_command_on():
    """The first step does not know it; what it missed is led back within the second, in any lengths."""
    motion = np.polynomial.Polynomial([0.3, -0.2, 0.7, 1.5])
    derivatives = [motion, motion.deriv(), motion.deriv(2)]
    steps = np.array([0.01, 0.02, 0.005, 0.02, 0.01])
    path = follow(steps, lambda time: [d(time) for d in derivatives])
    ends = np.cumsum(steps)
    missed = at(path[0], ends[0]) - [d(ends[0]) for d in derivatives]
    np.testing.assert_allclose(missed, -9.0 * np.array([1e-6 / 6, 1e-4 / 2, 1e-2]), rtol=1e-9)
    for over, end in zip(path[1:], ends[1:], strict=True):
        np.testing.assert_allclose(at(over, end), [d(end) for d in derivatives], rtol=0, atol=1e-12)


@pytest.mark.parametrize("change", [-3.0, 5.0])
@pytest.mark.parametrize("part", [0.0, 0.3, 0.99])
def test_a_change_of_the_acceleration_at_any_time_leaves_the_drive_continuous(change, part):
    kink = 0.02 + 0.01 * part

    def motion(time):
        late = max(time - kink, 0.0)
        return (
            0.2 * time + 0.5 * time**2 + 0.5 * change * late**2,
            0.2 + time + change * late,
            1.0 + change * (time > kink),
        )

    path = follow([0.01] * 8, motion)
    for before, after in pairwise(path):
        ends = at(before, after.start), at(after, after.start)
        np.testing.assert_allclose(ends[0][:2], ends[1][:2], rtol=0, atol=1e-13)
    np.testing.assert_allclose(at(path[-1], 0.08), motion(0.08), rtol=0, atol=1e-12)


def test_what_the_accelerations_do_not_explain_is_a_jump():
    """An angle, and a rate, that jump: the drive is there at once and knows of no jerk."""

    def motion(time):
        return 0.1 * (time > 0.015) + 0.4 * max(time - 0.035, 0.0), 0.4 * (time > 0.035), 0.0

    for over in follow([0.01] * 6, motion):
        q, qd, _ = motion(over.start)
        np.testing.assert_allclose(
            at(over, over.start + 0.004), [q + qd * 0.004, qd, 0.0], rtol=0, atol=1e-15
        )


def test_a_step_too_short_to_be_taken_is_not_remembered():
    command = Command(*np.ones((3, 1)), UNKNOWN)
    before = LastStep(0.01, np.zeros((3, 1)), np.zeros(1), np.zeros(1))
    motion = CommandedMotion.after(before, command, 1.0, 1e-12)
    assert motion.past(1.0 + 1e-12, before) is before
    np.testing.assert_array_equal(at(motion, 1.0), np.ones(3))


def test_a_told_jerk_is_followed_from_the_first_step_on():
    motion = np.polynomial.Polynomial([0.3, -0.2, 0.7, 1.5])
    derivatives = [motion, motion.deriv(), motion.deriv(2)]
    steps = [0.01, 0.04, 0.001]
    path = follow(steps, lambda time: [d(time) for d in derivatives], jerk=np.array([9.0]))
    for over, end in zip(path, np.cumsum(steps), strict=True):
        np.testing.assert_allclose(at(over, end), [d(end) for d in derivatives], rtol=0, atol=1e-14)


def test_quintic_hermite_reproduces_a_quintic_with_its_derivatives():
    motion = np.polynomial.Polynomial([0.3, -1.0, 0.5, 2.0, -1.5, 0.7])
    time = np.array([0.0, 0.3, 0.5, 1.1, 1.6])
    columns = [motion.deriv(k)(time)[:, None] for k in (1, 2)]
    trajectory = Trajectory(time, motion(time)[:, None], *columns)
    t = np.linspace(0.0, 1.6, 57)
    for values, derivative in zip(
        trajectory.at(t), (motion, motion.deriv(1), motion.deriv(2)), strict=True
    ):
        np.testing.assert_allclose(values[:, 0], derivative(t), rtol=0, atol=1e-12)


def test_without_rates_a_clamped_cubic_spline_is_used():
    rng = np.random.default_rng(3)
    time, q = np.linspace(0.0, 2.0, 21), rng.normal(size=(21, 6))
    trajectory, spline = Trajectory(time, q), CubicSpline(time, q, bc_type="clamped")
    t = np.linspace(0.0, 2.0, 101)
    for order, values in enumerate(trajectory.at(t)):
        np.testing.assert_allclose(values, spline(t, order), rtol=0, atol=1e-9)
    for end in (0.0, 2.0):
        np.testing.assert_allclose(trajectory.at(np.array([end]))[1], 0.0, atol=1e-12)


def test_held_command_is_a_parabola():
    held = HeldCommand(1.0, np.array([1.0]), np.array([2.0]), np.array([3.0]))
    q, qd, qdd = held.at(np.array([1.0, 1.5]))
    np.testing.assert_allclose(q[:, 0], [1.0, 1.0 + 1.0 + 0.375])
    np.testing.assert_allclose(qd[:, 0], [2.0, 3.5])
    np.testing.assert_allclose(qdd[:, 0], 3.0)


def test_time_may_pass_the_ends_by_a_nanosecond_only():
    trajectory = Trajectory(np.array([0.0, 1.0]), np.array([[0.0], [1.0]]))
    assert trajectory.at(np.array([1.0 + 5e-10]))[0][0, 0] == pytest.approx(1.0, abs=1e-15)
    with pytest.raises(
        TrajectoryError, match=r"time: expected 0 to 1 s, the trajectory's, got 1\.1 s"
    ):
        trajectory.at(np.array([1.1]))
    with pytest.raises(TrajectoryError, match=r"time: .* got -0\.1 s"):
        trajectory.at(np.array([-0.1]))
    with pytest.raises(TrajectoryError, match=r"time: .* got (1\.000000002|1) s"):
        trajectory.at(np.array([1.0 + 2e-9]))
    with pytest.raises(TrajectoryError, match=r"time: .* got nan s"):
        trajectory.at(np.array([np.nan]))


def test_csv_and_npz_give_the_same_and_ignore_other_columns(tmp_path):
    time, q = np.linspace(0.0, 1.0, 5), np.arange(5.0)[:, None] ** 2
    table = np.column_stack([q, np.full(5, 7.0), time])
    np.savez(tmp_path / "t.npz", columns=["q1", "note", "time"], data=table)
    np.savetxt(
        tmp_path / "t.csv", table, delimiter=",", header="q1,note,time", comments="", fmt="%.17g"
    )
    t = np.array([0.37])
    results = [read_trajectory(tmp_path / name, 1).at(t)[0] for name in ("t.npz", "t.csv")]
    assert np.array_equal(*results)

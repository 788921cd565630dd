"""Joint motion from samples and files."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from elastic_robot.errors import TrajectoryError
from elastic_robot.trajectory import HeldCommand, Trajectory, read_trajectory


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

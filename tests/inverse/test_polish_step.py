"""Steps of the polish within limits: the optimum's own conditions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.polish_step import Step
from coupling.inverse.spline import UniformSpline

CYCLE, JOINTS = 0.01, 3


def step_of(degree: int, seed: int, part: float) -> Step:
    """A random model of a window in the middle of a wave, whose limits are a part more than it uses."""
    rng = np.random.default_rng(seed)
    places = CYCLE * np.arange(80)
    waves = 0.1 * np.sin(np.outer(places, 2.0 * np.pi * np.array([0.7, 1.1, 1.9])))
    command, free = UniformSpline(0.0, CYCLE, waves, degree), range(20, 50)
    fine = np.linspace(0.0, command.end, 4001)
    most = [np.abs(command.at(fine, order)).max(axis=0) * (1.0 + part) for order in (1, 2)]
    limits = JointLimits(np.full(JOINTS, -1.0), np.full(JOINTS, 1.0), *most)
    size = len(free) * JOINTS
    promised = rng.standard_normal((2 * size, size))
    return Step(
        free, promised.T @ promised, 1e-3 * size * rng.standard_normal(size), limits, command
    )


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("seed", range(5))
def test_a_step_within_limits_is_the_best_one(degree: int, seed: int):
    """Karush, Kuhn and Tucker: limits that bind hold against the gradient, and none is passed."""
    step = step_of(degree, seed, 0.05)
    change = step.change(0.0)
    free = -np.linalg.solve(step.hessian, step.gradient).reshape(change.shape)
    rows, slack = [], []
    for joint, own in enumerate(np.eye(JOINTS)):
        drive = UniformSpline(0.0, CYCLE, step.command.coefficients[:, [joint]], degree)
        each, low, high = step.limits.of_joint(joint).rows(drive)
        moved = each[:, step.free.start : step.free.stop]
        rows += [np.kron(moved.toarray(), own), -np.kron(moved.toarray(), own)]
        slack += [high - moved @ change[:, joint], moved @ change[:, joint] - low]
        assert np.any((moved @ free[:, joint] > high) | (moved @ free[:, joint] < low))
    room = np.concatenate(slack)
    assert room.min() > -1e-14
    pushed = step.hessian @ change.ravel() + step.gradient
    pushes, rest = nnls(np.vstack(rows)[room < 1e-9].T, -pushed)
    assert np.count_nonzero(pushes) > JOINTS
    assert rest < 1e-6 * np.abs(step.gradient).max()


def test_a_command_at_its_limits_can_stay_as_it_is():
    """Limits that the command passes by rounding do not forbid the change that is none."""
    step = step_of(5, 0, -1e-6)
    change = step.change(0.0)
    gain = 0.5 * change.ravel() @ step.hessian @ change.ravel() + step.gradient @ change.ravel()
    assert np.all(np.isfinite(change))
    assert gain <= 0.0

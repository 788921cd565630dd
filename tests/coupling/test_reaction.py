"""A gear in its play, which only the spring of the coupling holds: no stiffness of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from coupling.solve.reaction import Reaction

TRUE = 2e4  # -dF/dx of the process [N/m]


def places(stated: float, hold: float, most: int = 40, hard: float = 0.0) -> np.ndarray:
    """Return where a tool without stiffness of its own stands in every evaluation [m], from 0.1 mm on.

    The process pushes it to 0, but states another stiffness; the next sample, which rests, states the
    usual one.

    Args:
        stated: Stiffness that the process states [N/m].
        hold: What holds the tool beyond that to begin with [N/m].
        most: Number of evaluations.
        hard: Within this distance [m] the process is ten times as stiff.
    """
    still, usual = np.zeros(3), np.array([np.eye(3), TRUE / stated * np.eye(3)])
    known = stated * usual
    x, reaction = np.array([1e-4, 0.0, 0.0]), None
    found = []
    for _ in range(most):
        found.append(x[0])
        inside = np.clip(x, -hard, hard)
        position, force = np.array([[x, still]]), np.array([[-TRUE * (x + 9.0 * inside), still]])
        if reaction is None:
            first = Reaction.known(position, force, known)
            reaction = replace(first, hold=np.array([[hold, 0.0]]))
        else:
            reaction = reaction.then(position, force, known).held_after(reaction)
        x = x + np.linalg.solve(reaction.stiffness[0], force[0, 0])
    return np.abs(found)


def test_a_gear_that_jumps_too_far_is_held_until_it_settles():
    """At 0.4 of the true stiffness it would go 1.5 times as far every time, for ever."""
    loose = places(0.4 * TRUE, 0.0)
    assert loose[3] > 3.0 * loose[0]
    assert loose[-1] < 1e-9


@pytest.mark.parametrize("times", [30.0, 1e3, 1e5])
def test_a_gear_that_is_held_too_tightly_does_not_creep(times):
    """At n times the true stiffness 1 - 1/n of the way is left, every time; hundredfold takes 4.6 n."""
    path = places(0.1 * TRUE, times * TRUE)
    assert path[2] > 0.99 * (1.0 - 1.0 / times) ** 2 * path[0]
    assert np.count_nonzero(path > 0.01 * path[0]) < 8 + np.log(times) / np.log(4.0)
    assert np.all(np.diff(path) < 0.0)  # and never jumps on the way


def test_a_gear_that_settles_is_left_alone():
    """At 1.25 times the true stiffness a fifth of the way is left every time: nothing to improve."""
    path = places(1.25 * TRUE, 0.0, most=8)
    np.testing.assert_allclose(path[1:] / path[:-1], 0.2, rtol=1e-9)


def test_a_gear_that_jumped_when_it_was_held_less_settles_all_the_same():
    """Near its place the process is ten times as stiff as its last steps told."""
    path = places(0.1 * TRUE, 100.0 * TRUE, most=60, hard=3e-5)
    assert np.any(np.diff(path) > 0.0)
    assert path[-1] < 1e-8

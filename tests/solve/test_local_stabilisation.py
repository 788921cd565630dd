"""A gear in its backlash, which only the spring of the coupling holds: no stiffness of its own."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.solve.local_stabilisation import LocalStabilisation

TRUE = 2e4  # -dF/dx of the process [N/m]


def places(stated: float, hold: float, most: int = 40, hard: float = 0.0) -> np.ndarray:
    """Return where a tool without stiffness of its own stands in every evaluation [m], from 0.1 mm on.

    The process pushes it to 0, but states another stiffness.

    Args:
        stated: Stiffness that the process states [N/m].
        hold: What holds the tool beyond that to begin with [N/m].
        most: Number of evaluations.
        hard: Within this distance [m] the process is ten times as stiff.
    """
    x, settling = np.array([1e-4, 0.0, 0.0]), LocalStabilisation.initial(np.array([[hold]]))
    found = []
    for _ in range(most):
        found.append(x[0])
        force = -TRUE * (x + 9.0 * np.clip(x, -hard, hard))
        move = force / (stated + settling.hold[0, 0])
        settling = settling.after(move[None, None], usual=TRUE)
        x = x + settling.factor[0, 0] * move
    return np.abs(found)


def test_a_gear_that_jumps_too_far_is_held_until_it_settles():
    """At 0.4 of the true stiffness it would go 1.5 times as far every time, for ever."""
    loose = places(0.4 * TRUE, 0.0)
    assert loose[3] > 3.0 * loose[0]
    assert loose[-1] < 1e-9


@pytest.mark.parametrize("times", [3.0, 30.0, 1e3, 1e5])
def test_a_gear_that_is_held_too_tightly_does_not_creep(times):
    """At n times the true stiffness 1 - 1/n of the way is left, every time; hundredfold takes 4.6 n.

    The secant of two moves of a linear process is exact; its factor, which is n, grows fourfold at most.
    """
    path = places(0.1 * TRUE, times * TRUE)
    slow = 1.0 - 1.0 / (0.1 + times)
    np.testing.assert_allclose(path[:3], path[0] * slow ** np.arange(3), rtol=1e-9)
    reached = 2 + int(np.ceil(np.log(0.1 + times) / np.log(4.0)))
    assert path[reached - 1] > 1e-3 * path[0]
    assert path[reached] < 1e-6 * path[0]


def test_a_gear_that_settles_is_left_alone():
    """At 1.25 times the true stiffness a fifth of the way is left every time: nothing to improve."""
    path = places(1.25 * TRUE, 0.0, most=8)
    np.testing.assert_allclose(path[1:] / path[:-1], 0.2, rtol=1e-9)


@pytest.mark.parametrize("hard", [1e-6, 1e-5, 3e-5, 9e-5])
def test_a_gear_that_was_carried_too_far_comes_back(hard):
    """Near its place the process is ten times as stiff as its last moves told."""
    path = places(0.1 * TRUE, 100.0 * TRUE, most=25, hard=hard)
    assert path[-1] < 1e-9


def test_a_gear_that_turns_off_its_way_is_carried_no_farther():
    """Two moves along one axis, then one at a right angle: nothing is known of that direction."""
    settling = LocalStabilisation.initial(np.array([[TRUE]]))
    for move in ([1e-5, 0, 0], [1e-5, 0, 0], [9e-6, 0, 0], [8e-6, 0, 0]):
        settling = settling.after(np.array([[move]]), usual=TRUE)
    assert settling.factor > 1.0
    turned = settling.after(np.array([[[0.0, 8e-6, 0.0]]]), usual=TRUE)
    assert turned.factor == 1.0
    assert turned.most < settling.factor
    assert turned.hold == TRUE


def test_another_coupling_begins_with_what_is_held():
    """What hung in one pass hangs in the next; how far it was from its place is another matter."""
    settling = LocalStabilisation.initial(np.array([[TRUE]]))
    for move in (1e-5, 1e-5, 9e-6, 8e-6):
        settling = settling.after(np.array([[[move, 0.0, 0.0]]]), usual=TRUE)
    again = settling.restarted()
    assert (again.hold, again.factor, again.evaluations) == (TRUE, 1.0, 0)

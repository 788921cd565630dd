"""Robots that are possible, as far as they do in the runs what the learned one does."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from coupling.identification.next.command import _worth_learning
from coupling.identification.next.possible_robot import PossibleRobot, _change, _scales
from coupling.identification.runs.residual import UnexplainedPart

TIME = np.linspace(0.0, 10.0, 2001)  # [s]
NOISE = 2e-5  # [m]


class Line:
    """A run whose tool a parameter moves by a wave, and another one as a whole."""

    runs = (SimpleNamespace(measured=SimpleNamespace(time=TIME), noise=NOISE),)

    def simulated(self, number: int, x: np.ndarray) -> SimpleNamespace:
        def position(time: np.ndarray) -> np.ndarray:
            place = np.stack([0.1 * np.cos(time), 0.1 * np.sin(time), 0.0 * time], axis=1)
            place[:, 2] += 1e-3 * x[0] * np.sin(7.0 * time)
            place += 1e-3 * x[1] * np.array([1.0, 2.0, 0.0])
            return place + 1e-3 * x[1] * np.cross([0.0, 0.0, 1.0], place)

        return SimpleNamespace(position=position)


def test_a_shift_and_a_turn_of_the_whole_are_no_change():
    line = Line()
    assert _change(line, np.zeros(2), np.array([0.0, 0.3])) < 1e-22
    wave = _change(line, np.zeros(2), np.array([0.3, 0.3]))
    assert wave == pytest.approx((0.3e-3) ** 2 / 6.0, rel=0.05)


def test_robots_are_as_far_off_as_noise_lets_a_fit_be():
    """A parameter that is off by its standard deviation is possible, one by thirty of them is not."""
    sure = NOISE / 1e-3 / np.sqrt(len(TIME) / 2.0)
    robots = np.array([[sure, 0.0], [30.0 * sure, 0.0], [0.0, 5.0], [1e3 * sure, 0.0]])
    scales = _scales(Line(), np.zeros(2), robots, UnexplainedPart(1.0, 2.0))
    assert scales[0] == scales[2] == 1.0
    assert 0.0 < scales[1] < 0.1
    assert scales[3] == 0.0
    # What a fit leaves over noise makes it less sure.
    assert _scales(Line(), np.zeros(2), robots, UnexplainedPart(900.0, 2.0))[1] == 1.0


@pytest.mark.parametrize(
    ("runs", "left_over", "first", "worth"),
    [(1, None, True, True), (2, 1.3, False, False), (2, 9.0, False, True), (3, 9.0, False, False)],
)
def test_parameters_are_learned_again_where_the_first_fit_left_more_than_noise(
    runs, left_over, first, worth
):
    forecast = None if left_over is None else SimpleNamespace(left_over=left_over)
    run = SimpleNamespace(source=SimpleNamespace(forecast=forecast))
    assert _worth_learning(SimpleNamespace(runs=(run,) * runs), first) == worth


def test_robots_that_are_close_lie_between_the_model_and_those_that_are_possible():
    robots = np.array([[3.0, 1.0], [-1.0, 1.0]])
    model = PossibleRobot("", np.ones(2), 1, robots, np.array([0.5, 0.0]), None)
    np.testing.assert_allclose(model.close, [[2.0, 1.0], [1.0, 1.0]])

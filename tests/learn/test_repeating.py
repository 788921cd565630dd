"""What repeats is told from what does not: a Kalman filter over passes, and a cutoff of least error."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from coupling.learn.history import Size
from coupling.learn.moves import Judgement
from coupling.learn.repeating import repeating

TIME = np.linspace(0.0, 20.0, 4001)  # [s]
NOISE = 2e-5  # [m]


@dataclass
class Passes:
    """Passes whose model is the same under every command: only what is measured differs."""

    beyond_model: list[np.ndarray]
    moved: list[float]
    noise: float = NOISE
    runs: list[SimpleNamespace] = field(init=False)

    def __post_init__(self) -> None:
        pose = np.zeros((1, len(TIME), 7))
        pose[..., 6] = 1.0
        desired = SimpleNamespace(time=TIME, position=pose[..., :3])
        seen = SimpleNamespace(time=TIME)
        self.runs = [
            SimpleNamespace(seen=seen, noise=self.noise, desired=desired) for _ in self.beyond_model
        ]

    def beyond(self, number: int, x: np.ndarray) -> np.ndarray:
        return np.hstack([self.beyond_model[number], np.zeros((len(TIME), 3))])

    def simulated(self, number: int, x: np.ndarray) -> SimpleNamespace:
        place = self.moved[number]
        return SimpleNamespace(position=lambda time: np.tile([place, 0.0, 0.0], (len(time), 1)))


def wave(frequency: float, size: float = 1e-4) -> np.ndarray:
    return size * np.sin(2.0 * np.pi * frequency * TIME)[:, None] * np.array([1.0, -0.5, 0.2])


def white(seed: int) -> np.ndarray:
    return NOISE * np.random.default_rng(seed).standard_normal((len(TIME), 3))


def test_a_first_pass_tells_the_slow_part_and_what_it_will_leave():
    """A wave of 0.4 Hz is found to a tenth of the noise on it, and the forecast of that is right."""
    found = repeating(Passes([wave(0.4) + white(1)], [0.0]), np.zeros(0), 5.0, 1.0, (0,))
    off = found.at(TIME)[:, :3] - wave(0.4)
    inner = (TIME > 1.0) & (TIME < 19.0)
    left = float(np.sqrt(np.mean(np.sum(off[inner] ** 2, axis=1))))
    assert left < 0.15 * np.sqrt(3.0) * NOISE
    assert found.left == pytest.approx(left, rel=0.35)
    assert found.cutoff < 2.0
    assert found.weights == (1.0,)


def test_a_faster_deviation_takes_a_higher_cutoff_and_none_takes_the_lowest():
    fast = repeating(Passes([wave(2.2) + white(1)], [0.0]), np.zeros(0), 5.0, 1.0, (0,))
    none = repeating(Passes([white(1)], [0.0]), np.zeros(0), 5.0, 1.0, (0,))
    assert fast.cutoff > 2.2
    assert none.cutoff < 0.5
    assert np.sqrt(np.mean(none.deviation[:, :3] ** 2)) < 0.1 * NOISE


def test_passes_of_one_command_are_averaged():
    """The model says that nothing changed: each counts the same."""
    own = Passes([wave(0.4) + white(k) for k in range(4)], [0.0] * 4)
    found = repeating(own, np.zeros(0), 5.0, 1.0, range(4))
    np.testing.assert_allclose(found.weights, 0.25, atol=0.01)
    assert found.new < 3e-6


def test_a_pass_of_another_command_counts_for_all_of_it():
    """The command moved the tool by 1 mm: the model of that is less sure than a measurement."""
    own = Passes([wave(0.4, 3e-4) + white(1), wave(0.4) + white(2)], [0.0, 1e-3])
    found = repeating(own, np.zeros(0), 5.0, 1.0, (0, 1))
    assert found.weights[1] > 0.98
    careful = repeating(own, np.zeros(0), 5.0, 0.5, (0, 1))
    assert careful.weights[1] == pytest.approx(0.5)


def test_what_is_new_in_every_pass_is_told_from_three_and_then_averaged():
    """Slow waves of other phases, 40 um rms in each pass, under one command."""
    rng = np.random.default_rng(5)
    news = [
        4e-5
        * np.sqrt(2.0)
        * np.sin(2.0 * np.pi * 0.3 * TIME + rng.uniform(0.0, 6.0))[:, None]
        * np.array([0.6, 0.0, 0.8])
        for _ in range(5)
    ]
    own = Passes([wave(0.4) + new + white(k) for k, new in enumerate(news)], [0.0] * 5)
    found = repeating(own, np.zeros(0), 5.0, 1.0, range(5))
    assert 2e-5 < found.new < 8e-5
    assert max(found.weights) < 0.4


@pytest.mark.parametrize(
    ("left", "best", "worse", "doubt"),
    [
        ((9.0,), 0, False, 0.0),
        ((9.0, 4.0, 4.2), 1, False, 0.0),
        ((9.0, 4.0, 6.0), 1, True, 0.0),
        ((9.0, 4.0, 6.0), 1, False, 6.0),
        ((3.0, 9.0), 0, True, 0.0),
    ],
)
def test_a_last_pass_that_is_worse_than_the_best_is_seen(left, best, worse, doubt):
    runs = [SimpleNamespace(size=Size(0.0, own, 0.0, 0.0, doubt)) for own in left]
    found = Judgement.of(SimpleNamespace(runs=runs), absolute=True)
    assert (found.best, found.worse) == (best, worse)

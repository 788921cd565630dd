"""What repeats is told from what does not: a Kalman filter over runs, and a cutoff of least error."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from coupling.identification.next.deviation_size import deviation_size
from coupling.identification.next.moves import compared_runs
from coupling.identification.next.repeatability import VALUES, ComparedRuns, Hypotheses
from coupling.identification.next.repeating import compared, repeating
from coupling.results.next_result import DeviationSize

TIME = np.linspace(0.0, 20.0, 4001)  # [s]
NOISE = 2e-5  # [m]
# A model with two robots that are possible: they make a third more or less of every command.
MODEL = SimpleNamespace(
    x=np.zeros(1),
    close=np.array([[0.3], [-0.3]]),
    contraction=SimpleNamespace(cutoff=5.0, gain=1.0),
)
BEFORE = Hypotheses.before(2e-5)


@dataclass
class Runs:
    """Runs of a model whose tool is moved as a whole, by each command to another place."""

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
            SimpleNamespace(measured=seen, noise=self.noise, desired=desired)
            for _ in self.beyond_model
        ]

    def beyond(self, number: int, x: np.ndarray) -> np.ndarray:
        return np.hstack([self.beyond_model[number], np.zeros((len(TIME), 3))])

    def simulated(self, number: int, x: np.ndarray) -> SimpleNamespace:
        place = self.moved[number] * (1.0 + x[0])
        return SimpleNamespace(position=lambda time: np.tile([place, 0.0, 0.0], (len(time), 1)))


def wave(frequency: float, size: float = 1e-4) -> np.ndarray:
    return size * np.sin(2.0 * np.pi * frequency * TIME)[:, None] * np.array([1.0, -0.5, 0.2])


def white(seed: int) -> np.ndarray:
    return NOISE * np.random.default_rng(seed).standard_normal((len(TIME), 3))


def test_a_first_pass_tells_the_slow_part_and_what_it_will_leave():
    """A wave of 0.4 Hz is found to a tenth of the noise on it, and the forecast of that is right."""
    found = repeating(Runs([wave(0.4) + white(1)], [0.0]), MODEL, (0,), BEFORE)
    off = found.at(TIME)[:, :3] - wave(0.4)
    inner = (TIME > 1.0) & (TIME < 19.0)
    left = float(np.sqrt(np.mean(np.sum(off[inner] ** 2, axis=1))))
    assert left < 0.15 * np.sqrt(3.0) * NOISE
    assert found.left == pytest.approx(left, rel=0.35)
    assert found.cutoff < 2.0
    assert found.weights == (1.0,)


def test_a_faster_deviation_takes_a_higher_cutoff_and_none_takes_the_lowest():
    fast = repeating(Runs([wave(2.2) + white(1)], [0.0]), MODEL, (0,), BEFORE)
    none = repeating(Runs([white(1)], [0.0]), MODEL, (0,), BEFORE)
    assert fast.cutoff > 2.2
    assert none.cutoff < 0.5
    assert np.sqrt(np.mean(none.deviation[:, :3] ** 2)) < 0.1 * NOISE


def test_passes_of_one_command_are_averaged():
    """The model says that nothing changed: each counts the same."""
    own = Runs([wave(0.4) + white(k) for k in range(4)], [0.0] * 4)
    found = repeating(own, MODEL, range(4), BEFORE)
    np.testing.assert_allclose(found.weights, 0.25, atol=0.01)
    assert compared(own, MODEL, range(4), BEFORE).hypotheses.rms < 0.4 * BEFORE.rms


def test_a_pass_of_another_command_counts_for_all_of_it():
    """The command moved the tool by 1 mm: the model of that is less sure than a measurement."""
    own = Runs([wave(0.4, 3e-4) + white(1), wave(0.4) + white(2)], [0.0, 1e-3])
    found = repeating(own, MODEL, (0, 1), BEFORE)
    assert found.weights[1] > 0.98
    careful = repeating(own, MODEL, (0, 1), BEFORE, 0.5)
    assert careful.weights[1] == pytest.approx(0.5)
    assert careful.cutoff == found.cutoff
    assert careful.own_noise == pytest.approx(0.5 * found.own_noise, rel=0.03)


def test_what_is_new_in_every_pass_is_told_and_then_averaged():
    """Slow waves of other phases, 40 um rms in each run, under one command."""
    rng = np.random.default_rng(5)
    news = [
        4e-5
        * np.sqrt(2.0)
        * np.sin(2.0 * np.pi * 0.3 * TIME + rng.uniform(0.0, 6.0))[:, None]
        * np.array([0.6, 0.0, 0.8])
        for _ in range(5)
    ]
    own = Runs([wave(0.4) + new + white(k) for k, new in enumerate(news)], [0.0] * 5)
    found = repeating(own, MODEL, range(5), BEFORE)
    assert 2e-5 < compared(own, MODEL, range(5), BEFORE).hypotheses.rms < 8e-5
    assert max(found.weights) < 0.4


def test_what_is_likely_before_has_the_rms_of_a_robot_with_that_repeatability():
    """ISO 9283: poses of normal spread are a mean and three standard deviations within RP."""
    distance = np.linalg.norm(np.random.default_rng(1).standard_normal((200_000, 3)), axis=1)
    stated = float(distance.mean() + 3.0 * distance.std())
    rms = float(np.sqrt(np.mean(distance**2)))
    assert Hypotheses.before(stated).rms == pytest.approx(rms, rel=0.07)


def test_two_passes_count_as_a_kalman_filter_says():
    """Of one pair alone the weights are those of two estimates with their variances."""
    one = Hypotheses(np.array([4.0]), np.array([3.0]), np.array([1.0]))
    told = np.random.default_rng(3).standard_normal((2, 50, 6))
    found = ComparedRuns.of(told, (1.0, 2.0), (0.0, 5.0), one)
    before, after = 1.0 + 4.0 + 3.0 * 5.0, 2.0 + 4.0
    np.testing.assert_allclose(found.weights, np.array([after, before]) / (before + after))


@pytest.mark.parametrize(("new", "factor"), [(0.0, 1.0), (2e-5, 1.0), (2e-5, 0.1), (0.0, 9.0)])
def test_what_is_new_and_how_wrong_the_model_is_are_told_apart(new, factor):
    """Commands that change by less and less: a wrong model shows in the first, what is new in all.

    In the mean over 100 robots the pairs are those that the runs were made with; the prior is
    20 um of repeatability, and a factor of 1 within e.
    """
    rng, changes = np.random.default_rng(7), np.array([0.0, 6e-5, 2e-5, 2e-6, 1e-6, 1e-6]) ** 2
    found = []
    for _ in range(100):
        # As many independent values as a slow displacement is taken to have, two a coordinate.
        values = rng.standard_normal((2, len(changes), int(VALUES) // 3, 3)) / np.sqrt(3.0)
        wrong = np.cumsum(np.sqrt(factor * changes)[:, None, None] * values[0], axis=0)
        told = np.zeros((len(changes), int(VALUES) // 3, 6))
        told[:, :, :3] = wrong + new * values[1]
        pairs = ComparedRuns.of(told, np.full(len(changes), 1e-14), changes, BEFORE).hypotheses
        found.append((pairs.rms, np.exp(pairs.likely @ np.log(pairs.factor))))
    rms, own = np.median(found, axis=0)
    assert rms < 3e-6 if new == 0.0 else 0.75 < rms / new < 1.33
    assert (own > 2.5) == (factor > 3.0)
    assert (own < 0.6) == (factor < 0.3)


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
    runs = [SimpleNamespace(size=DeviationSize(0.0, own, 0.0, 0.0, doubt)) for own in left]
    found = compared_runs(SimpleNamespace(runs=runs), absolute=True)
    assert (found.best, found.worse) == (best, worse)


def test_a_last_pass_that_is_worse_by_what_is_new_in_each_is_none():
    """6 um after 4 um is worse, but not where 3 um rms are new in every run."""
    runs = [SimpleNamespace(size=DeviationSize(0.0, own, 0.0, 0.0)) for own in (9e-6, 4e-6, 6e-6)]
    judged = [compared_runs(SimpleNamespace(runs=runs), True, new).worse for new in (0.0, 3e-6)]
    assert judged == [True, False]


@pytest.mark.parametrize(("amplitude", "seen"), [(0.0, False), (4e-5, True)])
def test_what_is_faster_than_noise_would_be_is_part_of_a_size(amplitude, seen):
    """Gears that strike at 25 Hz count; noise that is estimated 2 % too low does not, 50 times of 50."""
    shaken = amplitude * np.sin(2.0 * np.pi * 25.0 * TIME)[:, None] * np.array([1.0, 0.0, 0.0])
    sizes = [deviation_size(TIME, shaken + white(k), 0.98 * NOISE) for k in range(50)]
    assert all((own.fast > 0.0) == seen for own in sizes)
    if seen:  # the two low-passes share a thirtieth of it
        rms = np.median([own.rms for own in sizes])
        assert rms == pytest.approx(amplitude / np.sqrt(2.0), rel=0.07)


def test_the_size_of_what_is_fast_is_told_without_the_noise_in_its_band():
    """20 um rms at 30 Hz under as much noise a coordinate, in the mean over 20 measurements.

    A filter of order 4 passes 1 / (1 + (f / f_c)^8): of 30 Hz what is below a quarter of the rate,
    50 Hz, and above 15 Hz.
    """
    shaken = 2e-5 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 30.0 * TIME)[:, None]
    sizes = [deviation_size(TIME, shaken * [0.6, 0.0, 0.8] + white(k), NOISE) for k in range(20)]
    passed = (1.0 - 1.0 / (1.0 + 2.0**8)) / (1.0 + 0.6**8)
    square = np.mean([own.fast**2 for own in sizes])
    assert square == pytest.approx((2e-5 * passed) ** 2, rel=0.03)

"""What repeats is learned, what does not is averaged, and a worse run is taken back."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from coupling.identification.next.deviation_size import deviation_size
from coupling.identification.next.learning_filter import passed
from coupling.identification.next.options import FrameAccuracy, NextOptions
from coupling.identification.next.path_learning import (
    PathCorrection,
    is_worse,
    learn_path,
    learning_gain,
    learning_step,
)
from coupling.path.discrepancy import Discrepancy
from coupling.results.next_result import DeviationSize, LearningStep

TIME = np.linspace(0.0, 20.0, 4001)  # [s]
NOISE = 2e-5  # [m]
MODEL = SimpleNamespace(x=np.zeros(1), highest_cutoff=5.0)


@dataclass
class Runs:
    """Runs of a model whose tool is on the desired path, and of a robot that is not."""

    unmodelled_part: list[np.ndarray]
    deviation: list[np.ndarray] = field(default_factory=list)
    runs: list[SimpleNamespace] = field(init=False)

    def __post_init__(self) -> None:
        pose = np.zeros((1, len(TIME), 7))
        pose[..., 6] = 1.0
        desired = SimpleNamespace(time=TIME, position=pose[..., :3])
        seen = SimpleNamespace(time=TIME)
        self.runs = [
            SimpleNamespace(
                measured=seen,
                noise=NOISE,
                desired=desired,
                deviation=off,
                source=SimpleNamespace(discrepancy=None),
            )
            for off in self.deviation or self.unmodelled_part
        ]

    def unmodelled(self, number: int, x: np.ndarray) -> np.ndarray:
        return np.hstack([self.unmodelled_part[number], np.zeros((len(TIME), 3))])


def wave(frequency: float, size: float = 1e-4) -> np.ndarray:
    return size * np.sin(2.0 * np.pi * frequency * TIME)[:, None] * np.array([1.0, -0.5, 0.2])


def white(seed: int) -> np.ndarray:
    return NOISE * np.random.default_rng(seed).standard_normal((len(TIME), 3))


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(values**2, axis=1))))


def at_samples(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(TIME, time, column) for column in values[:, :3].T])


def sizes_of(rms_values: list[float], doubt: float = 0.0) -> list[DeviationSize]:
    return [DeviationSize(value, value, value, value, doubt) for value in rms_values]


def step_after(rms_values: list[float]) -> LearningStep:
    return learning_step(sizes_of(rms_values), NextOptions())


def learned(history: Runs, cutoff: float = 2.0) -> PathCorrection:
    return learn_path(history, MODEL, cutoff, NextOptions(FrameAccuracy(5e-5, 5e-5)))


def applied_by(correction: PathCorrection) -> Discrepancy:
    columns = [np.interp(TIME, correction.time, column) for column in correction.deviation.T]
    return Discrepancy(TIME, np.zeros((len(TIME), 3)), np.column_stack(columns))


def test_a_first_run_gives_the_slow_part():
    """A wave of 0.3 Hz is identified below the noise on it, but for what the filter takes off."""
    correction = learned(Runs([wave(0.3) + white(1)]))
    expected = passed(np.array([0.3]), 2.0) * wave(0.3)
    off = at_samples(correction.time, correction.deviation) - expected
    inner = (TIME > 1.0) & (TIME < 19.0)
    assert rms(off[inner]) < 0.2 * np.sqrt(3.0) * NOISE
    assert correction.cutoff == 2.0


def test_no_cutoff_is_higher_than_that_at_which_learning_converges():
    assert learned(Runs([white(1)]), 8.0).cutoff == 5.0


@pytest.mark.parametrize("response", [0.6, 1.0, 1.5])
def test_a_robot_that_answers_by_another_factor_is_learned_from_run_to_run(response):
    """Of a wave |1 - R| is left after each run, and the model's own path is never corrected twice."""
    applied, remaining, runs = None, [], []
    for k in range(6):
        correction = np.zeros((len(TIME), 3)) if applied is None else applied.at(TIME)[:, :3]
        deviation = wave(0.4) - response * correction
        remaining.append(rms(deviation))
        runs.append((deviation + white(k), applied))
        robot = Runs(
            [d + (0.0 if c is None else c.at(TIME)[:, :3]) for d, c in runs], [d for d, _ in runs]
        )
        for run, (_, used) in zip(robot.runs, runs, strict=True):
            run.source.discrepancy = used
        applied = applied_by(learned(robot))
    assert remaining[1] == pytest.approx(abs(1.0 - response) * remaining[0], abs=8e-6)
    assert remaining[-1] < 0.15 * remaining[0]


def test_what_does_not_repeat_is_averaged_where_the_deviation_no_longer_shrinks():
    """Gains are halved down to a quarter, and grow again where another run shrinks it."""
    still = np.array([[16.0, 4.0, 4.1, 4.2, 4.3, 4.4]])
    gains = [float(learning_gain(still[:, :count], 0.0)[1][0]) for count in range(1, 7)]
    assert gains == [1.0, 1.0, 0.5, 0.25, 0.25, 0.25]
    assert learning_gain(np.append(still, [[1.0]], axis=1), 0.0)[1] == 0.5


def test_the_cutoff_doubles_after_every_run_that_is_not_worse():
    """From 1.5 up to 3 Hz, and never where one is asked for."""
    assert step_after([8e-4, 2e-4, 9e-4]).cutoff == 1.5
    runs = [8e-4, 2e-4, 5e-5, 4.9e-5]
    assert [step_after(runs[:count]).cutoff for count in (1, 2, 3, 4)] == [1.5, 3.0, 3.0, 3.0]
    assert learning_step(sizes_of(runs), NextOptions(cutoff=0.7)).cutoff == 0.7


def bump(time: float, size: float) -> np.ndarray:
    return size * np.exp(-(((TIME - time) / 0.5) ** 2))[:, None] * np.array([1.0, 0.0, 0.0])


def test_what_is_worse_at_one_place_is_taken_back_there_and_learned_elsewhere():
    """0.2 mm of one run at 5 s are not learned; a wave that repeats from 10 s on is as without.

    The constant of the whole path, its median, differs by less than a micrometre."""
    late = np.where(TIME > 10.0, 1.0, 0.0)[:, None] * wave(0.5, 3e-5)
    runs = [wave(0.5) + white(1), late + white(2), late + bump(5.0, 2e-4) + white(3)]
    corrections = []
    for last in (runs[2], runs[2] - bump(5.0, 2e-4)):
        correction = learned(Runs([*runs[:2], last]))
        corrections.append(at_samples(correction.time, correction.deviation))
    with_bump, without = corrections
    assert np.abs(with_bump).max() < 5e-5
    np.testing.assert_allclose(with_bump[TIME > 9.0], without[TIME > 9.0], atol=1e-6)
    assert rms((with_bump - late)[(TIME > 11.0) & (TIME < 19.0)]) < 1e-5


def test_a_path_that_has_moved_as_a_whole_is_corrected_at_once():
    """0.3 mm since the last run, as after a change of tool, are no reason to go back anywhere."""
    shift = np.array([3e-4, 0.0, 0.0])
    runs = [wave(0.5) + white(1), white(2), white(3) + shift]
    moved = learned(Runs(runs))
    correction = at_samples(moved.time, moved.deviation)
    np.testing.assert_allclose(correction.mean(axis=0), shift, atol=1e-6)
    assert np.abs(correction - shift).max() < NOISE
    sizes = [deviation_size(TIME, run, NOISE) for run in runs]
    assert not learning_step(sizes, NextOptions(FrameAccuracy(5e-5, 5e-5))).worse


def test_a_place_that_stays_worse_is_learned_anew():
    """A robot that has changed by three times the rms: three runs go back, the fourth does not."""
    base = [
        int(learning_gain(np.array([[9.0, 1.0] + [9.0] * later]), 0.0)[0][0]) for later in range(6)
    ]
    assert base == [1, 1, 1, 1, 5, 6]


def test_around_a_worse_place_of_a_worse_run_the_best_command_comes_again():
    """Two places on both sides of it; behind them, and where the run is not worse, learning goes on."""
    squares = np.tile([9.0, 1.0, 0.4], (9, 1))
    squares[4, 2] = 8.0
    base, gain = learning_gain(squares, 0.0, reach=2)
    assert base.tolist() == [2, 2, 1, 1, 1, 1, 1, 2, 2]
    assert gain.tolist() == [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0]
    base, gain = learning_gain(squares, 0.0)
    assert base.tolist() == [2, 2, 2, 2, 1, 2, 2, 2, 2]
    assert gain.tolist() == [1.0, 1.0, 1.0, 1.0, 0.5, 1.0, 1.0, 1.0, 1.0]


def test_a_run_within_the_repeatability_of_the_best_is_gone_on_from():
    squares = np.array([[4e-10, 1e-11, 9e-11]])
    bases = [int(learning_gain(squares, random**2)[0][0]) for random in (0.0, 1e-5)]
    assert bases == [1, 2]


def test_a_worse_run_is_said_to_be_one():
    assert [step_after(runs).worse for runs in ([4e-4, 4e-5], [4e-4, 4e-5, 9e-5])] == [False, True]
    assert step_after([4e-4, 4e-5, 9e-5]).base == 1
    assert step_after([3e-5, 9e-5]).base == 0


@pytest.mark.parametrize(
    ("best", "last", "worse", "doubt"),
    [(4.0, 4.2, False, 0.0), (4.0, 6.0, True, 0.0), (4.0, 6.0, False, 6.0), (3.0, 9.0, True, 0.0)],
)
def test_a_run_is_worse_beyond_the_chance_of_its_noise(best, last, worse, doubt):
    sizes = sizes_of([best, last], doubt)
    assert is_worse(sizes[1], sizes[0], NextOptions(repeatability=0.0)) == worse


def test_a_run_that_is_worse_within_the_repeatability_is_not_taken_back():
    """6 um after 4 um is worse, but not where 3 um rms are new in every run."""
    best, last = sizes_of([4e-6, 6e-6])
    judged = [is_worse(last, best, NextOptions(repeatability=rp)) for rp in (0.0, 6.2e-6)]
    assert judged == [True, False]


def test_the_rms_from_run_to_run_is_that_of_a_robot_with_that_repeatability():
    """ISO 9283: poses of normal spread are a mean and three standard deviations within RP."""
    distance = np.linalg.norm(np.random.default_rng(1).standard_normal((200_000, 3)), axis=1)
    stated = float(distance.mean() + 3.0 * distance.std())
    expected = float(np.sqrt(np.mean(distance**2)))
    assert NextOptions(repeatability=stated).random == pytest.approx(expected, rel=0.07)


@pytest.mark.parametrize(("amplitude", "seen"), [(0.0, False), (4e-5, True)])
def test_what_is_faster_than_noise_would_be_is_part_of_a_size(amplitude, seen):
    """Gears that strike at 25 Hz count; noise that is estimated 2 % too low does not, 50 times of 50."""
    shaken = amplitude * np.sin(2.0 * np.pi * 25.0 * TIME)[:, None] * np.array([1.0, 0.0, 0.0])
    sizes = [deviation_size(TIME, shaken + white(k), 0.98 * NOISE) for k in range(50)]
    assert all((own.fast > 0.0) == seen for own in sizes)
    if seen:  # the two low-passes share a thirtieth of it
        median = np.median([own.rms for own in sizes])
        assert median == pytest.approx(amplitude / np.sqrt(2.0), rel=0.07)


def test_the_size_of_what_is_fast_is_told_without_the_noise_in_its_band():
    """20 um rms at 30 Hz under as much noise a coordinate, in the mean over 20 measurements.

    A Gaussian passes 2^-(f / f_c)^2 of a power: of 30 Hz what is below a quarter of the rate, 50 Hz,
    and above 15 Hz.
    """
    shaken = 2e-5 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 30.0 * TIME)[:, None]
    sizes = [deviation_size(TIME, shaken * [0.6, 0.0, 0.8] + white(k), NOISE) for k in range(20)]
    passed = 0.5 ** (0.6**2) - 0.5 ** (2.0**2)
    square = np.mean([size.fast**2 for size in sizes])
    assert square == pytest.approx((2e-5) ** 2 * passed, rel=0.05)

"""What repeats is learned, what does not is averaged, and a worse run is taken back."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from coupling.identification.next import command
from coupling.identification.next.deviation_size import deviation_size
from coupling.identification.next.learning_filter import passed
from coupling.identification.next.options import NextOptions
from coupling.identification.next.path_learning import (
    is_repeated,
    is_worse,
    learn_path,
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


def step_after(rms_values: list[float], repeats: bool = True, is_cautious: bool = False):
    flags = [True] + [repeats] * (len(rms_values) - 1)
    return learning_step(sizes_of(rms_values), flags, is_cautious, NextOptions())


def test_a_first_run_gives_the_slow_part():
    """A wave of 0.3 Hz is identified below the noise on it, but for what the filter takes off."""
    correction = learn_path(
        Runs([wave(0.3) + white(1)]), MODEL, LearningStep(0, 0, False, 1.0, 2.0)
    )
    off = at_samples(correction.time, correction.deviation) - passed(np.array([0.3]), 2.0) * wave(
        0.3
    )
    inner = (TIME > 1.0) & (TIME < 19.0)
    assert rms(off[inner]) < 0.2 * np.sqrt(3.0) * NOISE
    assert correction.cutoff == 2.0


def test_no_cutoff_is_higher_than_that_at_which_learning_converges():
    step = LearningStep(0, 0, False, 1.0, 8.0)
    assert learn_path(Runs([white(1)]), MODEL, step).cutoff == 5.0


@pytest.mark.parametrize("response", [0.6, 1.0, 1.5])
def test_a_robot_that_answers_by_another_factor_is_learned_from_run_to_run(response):
    """Of a wave |1 - R| is left after each run, and the model's own path is never corrected twice."""
    position = np.zeros((len(TIME), 3))
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
        next_correction = learn_path(robot, MODEL, step_after(remaining))
        applied = Discrepancy(
            TIME,
            position,
            np.column_stack(
                [
                    np.interp(TIME, next_correction.time, column)
                    for column in next_correction.deviation.T
                ]
            ),
        )
    assert remaining[1] == pytest.approx(abs(1.0 - response) * remaining[0], abs=8e-6)
    assert remaining[-1] < 0.15 * remaining[0]


def test_what_does_not_repeat_is_averaged_from_where_the_deviation_no_longer_shrinks():
    runs = [4e-4, 4e-5, 4.1e-5, 3.9e-5]
    assert step_after(runs[:2], repeats=False).gain == 1.0
    gains = [step_after(runs[:count], repeats=False).gain for count in (3, 4)]
    np.testing.assert_allclose(gains, [1.0 / 2.0, 1.0 / 3.0])
    assert step_after(runs).gain == 1.0


def test_the_cutoff_grows_when_a_run_confirms_it():
    """Twice as high after a run that leaves much less, up to 3 Hz; lower where backlash is unknown."""
    runs = [8e-4, 2e-4, 5e-5, 4.9e-5]
    cutoffs = [step_after(runs[:count]).cutoff for count in (1, 2, 3, 4)]
    np.testing.assert_allclose(np.divide(cutoffs, cutoffs[0]), [1.0, 2.0, 2.0, 2.0])
    assert step_after(runs[:1], is_cautious=True).cutoff < 0.5 * cutoffs[0]


@pytest.mark.parametrize(("changed", "repeated"), [(0.0, True), (1e-4, False)])
def test_what_differs_from_run_to_run_is_distinguished_from_what_repeats(changed, repeated):
    """Two runs with the same slow wave, and with another one that is as large."""
    deviations = [wave(0.4) + white(1), wave(0.4) + white(2)]
    other = changed * np.cos(2.0 * np.pi * 0.7 * TIME)[:, None] * np.array([1.0, 1.0, 1.0])
    history = Runs([deviations[0], deviations[1] + other], [deviations[0], deviations[1]])
    assert is_repeated(history, 1, MODEL.x) == repeated
    assert is_repeated(Runs([white(1)]), 0, MODEL.x)


def test_a_worse_run_is_taken_back_and_the_next_step_is_smaller_each_time():
    """After 400, 40 um a correction leaves 90, twice: from the 40 um, with half, then a quarter."""
    runs = [4e-4, 4e-5, 9e-5, 9e-5]
    good, bad, worst = (step_after(runs[:count]) for count in (2, 3, 4))
    assert (good.base, bad.base, worst.base) == (1, 1, 1)
    assert (good.worse, bad.worse, worst.worse) == (False, True, True)
    np.testing.assert_allclose([bad.gain, worst.gain], [0.5, 0.25])
    np.testing.assert_allclose([bad.cutoff, worst.cutoff], [good.cutoff / 2.0, good.cutoff / 4.0])


def test_a_first_command_that_is_worse_than_none_goes_back_to_that():
    step = step_after([3e-5, 9e-5])
    assert (step.base, step.worse) == (0, True)


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


@pytest.mark.parametrize(
    ("runs", "repeated", "learned"),
    [(1, True, True), (2, True, False), (2, False, True), (3, False, False)],
)
def test_parameters_are_learned_again_where_the_second_run_is_not_as_the_model(
    monkeypatch, runs, repeated, learned
):
    monkeypatch.setattr(command, "is_repeated", lambda *_: repeated)
    history = SimpleNamespace(runs=[None] * runs)
    history.aligned_with = lambda x: history
    assert command._is_to_learn(history, np.zeros(1)) == learned

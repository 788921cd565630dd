"""Noise in forces is taken off without delay, and no more is taken off than noise."""

import json
import tomllib
from dataclasses import dataclass, replace

import numpy as np
import pytest
import tomlkit
from places import CASES

from coupling.case.file import load_case
from coupling.errors import CaseError
from coupling.events import unwatched
from coupling.files.csv_table import write_table
from coupling.path.deviation import measure
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.linear import interpolate_rows
from coupling.path.low_pass import low_pass, noise_share
from coupling.process import ProcessResponse
from coupling.process.base import ProcessRequest
from coupling.process.noise import NoiseRemoval, noise_level
from coupling.process.noise_filter import AdaptiveLowPass, LowPass, own_frequency
from coupling.run import repeated_evaluation
from coupling.run.execute import run_compensation
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.run.folder import write_run
from coupling.store import EvaluatedProcess

TIME = np.linspace(0.0, 60.0, 3001)  # 20 ms
FASTEST = 25.0  # [Hz]
LEVEL = 15.0  # [N]


def noise(seed: int = 1, columns: int = 1) -> np.ndarray:
    return LEVEL * np.random.default_rng(seed).standard_normal((len(TIME), columns))


@pytest.mark.parametrize("cutoff", [1.0, 3.0, 8.0])
def test_the_share_of_noise_that_is_let_through_is_that_of_the_band(cutoff):
    left = low_pass(TIME, noise(columns=20), cutoff)[200:-200]
    share = np.mean(left**2) / LEVEL**2
    assert share == pytest.approx(noise_share(cutoff, FASTEST), rel=0.1)


def test_a_motions_own_frequency_is_that_of_a_sine_and_of_its_starts():
    time = np.linspace(0.0, 4.0, 2001)
    pose = np.zeros((len(time), 7))
    pose[:, 1], pose[:, 6] = 0.05 * np.sin(2.0 * np.pi * 0.7 * time), 1.0
    assert own_frequency(ToolPath(time, pose)) == pytest.approx(0.7, rel=1e-3)
    cone = load_case(CASES / "cone.toml")
    # Speed rises by 30 u^2 (1 - u)^2 over 0.2 s, at most 15/8 of its mean rate.
    assert own_frequency(cone.motion.path) == pytest.approx(1.875 / (0.2 * 2 * np.pi), rel=1e-2)


def test_a_force_without_noise_is_not_changed():
    force = np.clip(100.0 * (TIME - 20.0), 0.0, 390.0)[:, None]
    found = AdaptiveLowPass(1.5).smoothed(TIME, force, noise_level(TIME, force))
    np.testing.assert_array_equal(found, force)


def test_corners_are_kept_that_one_cutoff_takes_off_and_noise_goes_elsewhere():
    """390 N that are gone within 50 ms, as where a tool leaves its sheet, under noise of 15 N."""
    force = np.interp(TIME, [0.0, 5.0, 5.4, 40.0, 40.05, 60.0], [0, 0, 390, 390, 0, 0])[:, None]
    significant = force + noise()
    level = noise_level(TIME, significant)
    adaptive, single = (
        own.smoothed(TIME, significant, level) - force
        for own in (AdaptiveLowPass(1.5), LowPass(1.5))
    )
    assert level[0] == pytest.approx(LEVEL, rel=0.1)
    assert np.abs(single).max() > 150.0
    assert np.abs(adaptive).max() < 0.5 * np.abs(single).max()
    quiet = (TIME > 8.0) & (TIME < 38.0)
    expected = LEVEL * np.sqrt(noise_share(1.5, FASTEST))
    assert adaptive[quiet].std() < 1.6 * expected


def test_a_filter_has_no_delay():
    """A triangle comes out symmetric about its own middle."""
    triangle = np.maximum(100.0 - 20.0 * np.abs(TIME - 30.0), 0.0)[:, None]
    for own in (LowPass(0.5), AdaptiveLowPass(0.5)):
        found = own.smoothed(TIME, triangle, np.array([LEVEL]))
        np.testing.assert_allclose(found, found[::-1], atol=1e-6)


def test_jumps_stay_and_what_is_between_them_is_smoothed():
    """Contact that begins with 200 N at once: the rows before and behind it do not mix."""
    rows = np.sort(np.append(TIME, 30.0))
    force = np.where(np.arange(len(rows)) <= np.searchsorted(rows, 30.0), 0.0, 200.0)
    wrench = np.zeros((1, len(rows), 6))
    wrench[0, :, 2] = force + LEVEL * np.random.default_rng(2).standard_normal(len(rows))
    found = LowPass(1.0).of(WrenchHistory(rows, wrench), np.full((1, 6), LEVEL))
    np.testing.assert_array_equal(found.jumps, [30.0])
    jump = (found.behind - found.before)[0, np.searchsorted(TIME, 30.0), 2]
    assert jump == pytest.approx(200.0, abs=4 * LEVEL * np.sqrt(noise_share(1.0, FASTEST)))
    assert np.abs(found.wrench[0, :, 2] - force).max() < 20.0


@dataclass(frozen=True)
class Answers:
    answer: ProcessResponse
    identity: str = "own"

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        return self.answer


def _smoothed(process: Answers, *noise_removal: object) -> EvaluatedProcess:
    return EvaluatedProcess(process, noise_removal=NoiseRemoval(*noise_removal))


def test_what_beats_is_left_alone_and_what_does_not_is_named():
    wrench = np.zeros((1, len(TIME), 6))
    wrench[0, :, :3] = 100.0 + noise(columns=3)
    history = WrenchHistory(TIME, wrench)
    path = ToolPath(TIME, np.tile([0.0, 0, 0, 0, 0, 0, 1], (len(TIME), 1)))
    beating = _smoothed(Answers(ProcessResponse(history, period=1e-3)), LowPass(1.0))
    assert np.array_equal(beating.evaluate(path).wrench.wrench, wrench)
    assert beating.noise_removal.noise is None
    quiet = _smoothed(Answers(ProcessResponse(history)), LowPass(1.0))
    left = quiet.evaluate(path).wrench.force[0, 200:-200].std()
    assert left == pytest.approx(LEVEL * np.sqrt(noise_share(1.0, FASTEST)), rel=0.2)
    assert quiet.identity == "own"
    assert quiet.noise_removal.noise is not None
    assert quiet.noise_removal.noise.force == pytest.approx(LEVEL, rel=0.1)
    assert "low-passed at 1 Hz" in quiet.noise_removal.noise.sentence
    loud = _smoothed(Answers(ProcessResponse(history)), None)
    assert np.array_equal(loud.evaluate(path).wrench.wrench, wrench)
    assert loud.noise_removal.noise is not None
    assert "not filtered" in loud.noise_removal.noise.sentence


def uneven(seed: int) -> ProcessResponse:
    """Return 300 N with a level of unevenness that is as large as noise would be."""
    wrench = np.zeros((1, len(TIME), 6))
    wrench[0, :, 2] = 300.0 + noise(seed)[:, 0]
    return ProcessResponse(WrenchHistory(TIME, wrench))


STANDING = ToolPath(TIME, np.tile([0.0, 0, 0, 0, 0, 0, 1], (len(TIME), 1)))


def test_what_two_answers_to_one_path_agree_on_is_not_touched():
    """Nodes of a mesh that come into contact one by one: uneven, and what the path asks for."""
    process = _smoothed(Answers(uneven(1)), AdaptiveLowPass(1.0), lambda first: uneven(1))
    assert process.evaluate(STANDING).wrench.wrench.tolist() == uneven(1).wrench.wrench.tolist()
    assert process.noise_removal.noise is not None
    assert process.noise_removal.noise.remarks == ()
    assert process.noise_removal.noise.force == 0.0
    assert process.noise_removal.repeatability is not None
    assert process.noise_removal.repeatability.identical


def test_what_two_answers_differ_by_is_noise():
    asked: list[ToolPath] = []

    def second_answer(first: ProcessRequest) -> ProcessResponse:
        asked.append(first.path)
        return uneven(2)

    process = _smoothed(Answers(uneven(1)), AdaptiveLowPass(1.0), second_answer)
    record = _smoothed(Answers(uneven(1)), AdaptiveLowPass(1.0))
    for _ in range(3):
        answer = process.evaluate(STANDING)
    assert asked == [STANDING]
    np.testing.assert_array_equal(answer.wrench.wrench, record.evaluate(STANDING).wrench.wrench)
    assert process.noise_removal.noise is not None
    assert process.noise_removal.noise.force == pytest.approx(LEVEL, rel=0.1)
    assert "have noise of about" in process.noise_removal.noise.remarks[0]


def test_a_small_difference_is_no_reason_to_filter():
    """As between two runs of a solver with several threads: 1e-4 N of 300 N."""
    second = uneven(1)
    second.wrench.wrench[0, :, 2] += 1e-4 * np.random.default_rng(3).standard_normal(len(TIME))
    process = _smoothed(Answers(uneven(1)), AdaptiveLowPass(1.0), lambda first: second)
    assert process.evaluate(STANDING).wrench.wrench.tolist() == uneven(1).wrench.wrench.tolist()


def test_without_a_second_answer_nothing_is_taken_off_and_the_key_is_named():
    process = _smoothed(Answers(uneven(1)), AdaptiveLowPass(1.0), lambda first: None)
    assert process.evaluate(STANDING).wrench.wrench.tolist() == uneven(1).wrench.wrench.tolist()
    assert process.noise_removal.noise is not None
    (said,) = process.noise_removal.noise.remarks
    assert "not known without a second evaluation" in said
    assert "Give cutoff_Hz" in said
    assert not process.noise_removal.noise.significant


def test_even_forces_cost_no_second_answer():
    wrench = np.zeros((1, len(TIME), 6))
    wrench[0, :, 2] = 300.0 * np.sin(TIME)
    even = ProcessResponse(WrenchHistory(TIME, wrench))

    def refuse(first: ProcessRequest) -> ProcessResponse:
        raise AssertionError("asked again")

    _smoothed(Answers(even), AdaptiveLowPass(1.0), refuse).evaluate(STANDING)


@pytest.mark.parametrize(
    ("seconds", "cutoff", "is_asked"), [(1.0, None, True), (61.0, None, False), (1.0, 2.0, False)]
)
def test_a_program_is_evaluated_again_where_that_is_cheap_and_no_cutoff_is_given(
    seconds, cutoff, is_asked, monkeypatch
):
    case = load_case(CASES / "external_template.toml")
    table = case.process_table.model_copy(update={"cutoff_Hz": cutoff})
    asked: list[float] = []

    def anew(case, longest, watch):
        asked.append(longest)
        return EvaluatedProcess(Answers(uneven(1)))

    monkeypatch.setattr(repeated_evaluation, "_anew", anew)
    removal = repeated_evaluation.noise_removal(replace(case, process_table=table), unwatched)
    assert removal is not None
    removal.smoothed(ProcessRequest(STANDING, uneven(1), seconds))
    assert asked == [120.0] * is_asked


def measured(folder, level: float, **keys: object):
    """The cone's case, cut short, with a record of its force in place of the law."""
    tables = tomllib.loads((CASES / "cone.toml").read_text())
    tables["tool_path"] |= {"depth_m": 0.0005}
    tables["robot"]["description"] = "fanuc_r2000ic"
    file = folder / "clean.toml"
    file.write_text(tomlkit.dumps(tables))
    clean = load_case(file)
    force = clean.process.evaluate(clean.desired).wrench
    drawn = np.random.default_rng(1).standard_normal(force.force[0].shape)
    rows = np.column_stack([force.time, force.force[0] + level * drawn])
    write_table(folder / "record.csv", ("time", "fx", "fy", "fz"), rows)
    tables["process"] = {"model": "measured", "file": "record.csv", "frame": "base"} | keys
    file = folder / "measured.toml"
    file.write_text(tomlkit.dumps(tables))
    return load_case(file), force


def left_under(case, run, force: WrenchHistory):
    found = run.correction
    with FmuPool(case.fmu) as fmus:
        cell, _ = cell_of(case.robots, fmus)
        path = cell.simulate(found.joints, force.refined(found.desired.time), "dynamic")
    return measure(path, found.desired)


def test_a_noisy_record_is_named_and_its_cost_told(tmp_path):
    """Of the same order as it is under the force without noise; less than without a filter."""
    case, force = measured(tmp_path, LEVEL)
    run = run_compensation(case)
    (remark,) = [own for own in run.remarks if "noise" in own]
    assert "1.49 Hz" in remark
    told = next(own for own in run.robustness if own.name == "noise").deviation
    really = left_under(case, run, force)
    assert 1.0 / 3.0 < told.rms_less_constant / really.rms_less_constant < 3.0
    loud, _ = measured(tmp_path, LEVEL, cutoff_Hz="none")
    as_it_comes = left_under(loud, run_compensation(loud), force)
    assert really.rms_less_constant < 0.8 * as_it_comes.rms_less_constant
    folder = tmp_path / "out"
    folder.mkdir()
    write_run(folder, case, run)
    noise_told = json.loads((folder / "result.json").read_text())["noise"]
    # The loudest of three axes, from 447 samples.
    assert noise_told["level_N"] == pytest.approx(LEVEL, rel=0.25)
    assert noise_told["adaptive"] is True


def test_a_record_without_noise_loses_nothing(tmp_path):
    case, force = measured(tmp_path, 0.0)
    run = run_compensation(case)
    assert not any("noise" in own for own in run.remarks)
    assert "noise" not in [own.name for own in run.robustness]
    assert left_under(case, run, force).maximum < 2e-6


def test_a_record_with_many_rows_is_not_aliased(tmp_path):
    """A hum of 60 Hz every millisecond: every 20 ms it would come as one of 10 Hz."""
    case, force = measured(tmp_path, 0.0)
    time = np.arange(0.0, case.desired.time[-1] + 1e-3, 1e-3)
    hum = 40.0 * np.sin(2.0 * np.pi * 60.0 * time)
    rows = np.column_stack([time, interpolate_rows(time, force.time, force.force[0])])
    write_table(
        tmp_path / "record.csv", ("time", "fx", "fy", "fz"), rows + [[0, *[h] * 3] for h in hum]
    )
    case = load_case(tmp_path / "measured.toml")
    found = case.process.evaluate(case.desired).wrench.force[0]
    expected = force.at(case.desired.time)[0, :, :3]
    still = (case.desired.time > 1.5) & (case.desired.time < 6.0)
    assert np.abs(found - expected)[still].max() < 2.0


def test_the_key_is_checked_and_changes_no_answer_of_a_program(tmp_path):
    with pytest.raises(CaseError, match="cutoff_Hz"):
        measured(tmp_path, 0.0, cutoff_Hz=-1.0)
    case = load_case(CASES / "external_template.toml")
    table, path = case.process_table, case.motion.path
    others = [table.model_copy(update={"cutoff_Hz": own}) for own in (2.0, "none", None)]
    kinds = [own.low_pass(path) for own in others]
    assert kinds[0] == LowPass(2.0)
    assert kinds[1] is None
    assert kinds[2] == AdaptiveLowPass(own_frequency(path))
    assert len({own.identity(case.task) for own in others}) == 1
    law = load_case(CASES / "cone.toml").process_table
    assert not hasattr(law, "cutoff_Hz")

"""First screens of next, place, study and stability: what will I get, is it enough, what now?"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from first_screens import GLOSSARY, printed, words_of

from coupling.path.deviation import Deviation
from coupling.place.folder import StoredPlacement
from coupling.report.modes_report import modes_answer
from coupling.report.next_report import next_answer, next_summary, refused_answer
from coupling.report.place_report import place_answer
from coupling.report.stability_report import stability_answer, stability_report
from coupling.report.study_report import study_answer
from coupling.results.cut_result import CutStability
from coupling.results.expected_deviation import ExpectedDeviation
from coupling.results.forecast import RunForecast
from coupling.results.modes_result import ModeResult, ModesResult, PlaceModesResult
from coupling.results.next_result import DeviationSize, LearningStep, NextResult, NextRunResult
from coupling.results.placement_result import PlacementResult, SettingResult
from coupling.results.section import Answer
from coupling.results.stability_result import (
    ChartResult,
    FeedChartResult,
    PartChartResult,
    StabilityPoint,
    StabilityResult,
)
from coupling.results.study_result import (
    InfluenceResult,
    ShareResult,
    StudyCommandResult,
    StudyResult,
    StudySource,
    UncertainResult,
)
from coupling.study.findings import StoredStudy

NEXT = ("next", "results/a run", "m.csv", "results/2", "measured.csv", "-o", "out")
MM = 1e-3


def forecast(maximum: float) -> RunForecast:
    return RunForecast(
        rms=maximum / 4,
        low=maximum / 5,
        high=maximum / 3,
        maximum=maximum,
        absolute=True,
        before=3e-4,
    )


def next_screen(expected: float | None, worse: bool = False, tolerance: float | None = None):
    """Return the first screen after a run that left 0.9 mm, of which 0.1 to 0.2 were expected."""
    last = NextRunResult(
        run="results/2",
        measured="m.csv",
        rows=1000,
        from_s=0.0,
        to_s=1.0,
        frame_shift_m=(0.0, 0.0, 0.0),
        frame_turn_rad=(0.0, 0.0, 0.0),
        clock_s=0.0,
        time=[0.0],
        tip_m=(0.0, 0.0, 0.0),
        noise_m=1e-5,
        left_out=0,
        size_m=DeviationSize(9e-4, 3e-4, 8e-4, 2e-4),
        forecast=forecast(6e-4),
        distance_m=[0.0],
    )
    result = NextResult.model_construct(
        absolute=True,
        tolerance_m=tolerance,
        sentences=("",),
        runs=(last,),
        step=LearningStep(0, worse, 1.0),
        parameters_refused="the run excites nothing",
        forecast=None if expected is None else forecast(expected),
    )
    return result, next_answer(result, "results/3", "kuka-kr210-l150", NEXT)


def setting(exposure: float, cost: float, **changed: object) -> SettingResult:
    values = {
        "file": "placed_1.toml",
        "setting": {"x_m": 1.25, "yaw_deg": 30.0},
        "admitted": True,
        "cost_m": cost,
        "moved_m": 4e-4,
        "exposure_m": exposure,
        "expected": {"maximum": 1.5 * exposure, "is_whole": True},
        "compliance_m_N": 1e-6,
        "conditioning": 0.1,
        "limit_margin_rad": math.inf,
        "rate_share": 0.1,
        "gears": (),
    }
    return SettingResult.model_validate({**values, **changed})


def place_screen(
    best: SettingResult, present: SettingResult | None, tolerance: float | None
) -> Answer:
    figures = PlacementResult.model_construct(
        best=(best,),
        present=present,
        tolerance_m=tolerance,
        free=("x", "yaw"),
        forced=True,
    )
    return place_answer(StoredPlacement(Path("results/cone_placed"), figures, ()))


def study_screen(
    share: float,
    tolerance: float | None,
    *,
    converged: bool = True,
    failed: int = 0,
    chosen: bool = False,
) -> Answer:
    """Return the first screen of a study of 100 robots, `share` of which stay below 0.2 mm."""
    deviations = np.where(np.arange(100) < round(100 * share), 1e-4, 4e-4)[: 100 - failed]
    size = Deviation(*[1e-5] * 8)
    influence = InfluenceResult(
        maximum=ShareResult(share=0.6, rank_correlation=0.9),
        rms=ShareResult(share=0.5, rank_correlation=0.9),
    )
    figures = StudyResult.model_construct(
        samples=100,
        coverage=0.95,
        source=StudySource(case="a case.toml", robot="kuka_kr300", run="results/run"),
        tolerance_m=tolerance,
        failed={str(k): "beyond its limits" for k in range(failed)},
        command=StudyCommandResult(converged=converged, reason="stopped", deviation_m=size),
        quantiles_m={"maximum": {"0.95": float(np.quantile(deviations, 0.95))}},
        chosen=chosen,
        expected=ExpectedDeviation(
            maximum=3e-4 if chosen else float(np.quantile(deviations, 0.95)), is_whole=True
        ),
        parameters=(
            UncertainResult(
                name="backlash_factor[4]",
                distribution="uniform",
                range=(0.0, 1.0),
                influence=influence,
            ),
        ),
    )
    empty = np.empty(0)
    return study_answer(
        StoredStudy(Path("study"), figures, (), empty, {"maximum": deviations}, empty, {})
    )


def stability_result(stable: bool, moved: float, tolerance: float | None) -> StabilityResult:
    point = StabilityPoint(
        time=1.0,
        posture_deg=(0.0,),
        feed_deg=0.0,
        rpm=3000.0,
        depth_m=5e-4 if stable else 2e-3,
        stable=stable,
        growth_1_s=-1.0 if stable else 1.0,
        frequency_Hz=43.1,
        border="Hopf",
        limit_m=1.65e-3,
        zero_order_m=1.6e-3,
        unloaded_joints=(),
        moved_m=moved,
    )
    return StabilityResult(
        case="slot",
        case_file="my cases/slot.toml",
        robot="",
        tolerance_m=tolerance,
        sentence="",
        tool_modes=0,
        deepest_m=0.1,
        points=(point,),
        worst=0,
        joints=(1.0,),
        tool_share=0.0,
        stable_rpm=((3300.0, 3500.0),),
        version="0",
    )


def stability_screen(stable: bool, moved: float, tolerance: float | None) -> Answer:
    return stability_answer(stability_result(stable, moved, tolerance))


def modes_screen(softest: float | None, in_case: bool = True):
    swing = ModeResult(
        frequency_Hz=8.26,
        damping_ratio=0.021,
        tcp_direction=(0.0, 1.0, 0.0),
        energy_by_joint=(0.7, 0.3),
    )
    place = PlaceModesResult(
        time_s=1.0 if in_case else None,
        posture_deg=(-10.0, -1e-9),
        force_N=(0.0, 0.0, 0.0),
        unloaded_joints=() if softest else (1,),
        compliance_m_N=None,
        softest_m_N=softest,
        softest_direction=None,
        dynamic_m_N=9e-6,
        dynamic_Hz=8.3,
        modes=(swing,),
    )
    result = ModesResult(
        name="slot",
        source="my cases/slot.toml",
        robot="arm",
        torque_curve="linear",
        loads="its own weight",
        places=(place,),
        computed=(),
        version="0",
    )
    return modes_answer(result)


CASES = {
    "modes: of a case": (
        modes_screen(4.6e-7),
        None,
        "100 N move the tool by up to 46.0 um",
        "modes",
    ),
    "modes: of a robot": (modes_screen(4.6e-7, False), None, "100 N move", "modes"),
    "modes: free gears": (modes_screen(None), None, "Gears of joints 1 are free", "modes"),
    "next: good": (next_screen(1e-4, tolerance=2e-4)[1], True, "GOOD ENOUGH: expect", "export"),
    "next: more than allowed": (next_screen(3e-4, tolerance=2e-4)[1], False, "NOT GOOD", "export"),
    "next: nothing stated": (
        next_screen(3e-4)[1],
        None,
        "Expect the tool within at most about",
        "export",
    ),
    "next: worse": (next_screen(1e-4, worse=True)[1], False, "WORSE THAN BEFORE", "export"),
    "next: not computed": (next_screen(None)[1], None, "Measured: 0.900 mm", "compensate"),
    "place: better": (
        place_screen(setting(1e-4, 1.0), setting(3e-4, 2.0), 2e-4),
        True,
        "BETTER",
        "",
    ),
    "place: as it is": (
        place_screen(setting(1e-4, 2.0), setting(1e-4, 2.0), 2e-4),
        True,
        "LEAVE",
        "",
    ),
    "place: not stated": (place_screen(setting(1e-4, 1.0), None, None), None, "PLACE FOUND", ""),
    "place: not enough": (place_screen(setting(3e-4, 1.0), None, 2e-4), False, "NOT GOOD", ""),
    "place: none": (
        place_screen(setting(1e-4, 1.0, admitted=False), None, 2e-4),
        False,
        "NO PLACE",
        "",
    ),
    "study: good": (study_screen(0.99, 2e-4), True, "GOOD ENOUGH: expect", "export"),
    "study: not enough": (study_screen(0.7, 2e-4), False, "NOT GOOD ENOUGH: expect", "identify"),
    "study: chosen": (
        study_screen(0.99, 2e-4, chosen=True),
        False,
        "NOT GOOD ENOUGH: of the robots that differ in backlash alone",
        "identify",
    ),
    "study: not stated": (study_screen(0.99, None), None, "Expect the tool within", ""),
    "study: not finished": (
        study_screen(0.99, 2e-4, converged=False),
        False,
        "NOT FINISHED",
        "check",
    ),
    "study: some fail": (
        study_screen(0.99, 2e-4, failed=3),
        False,
        "NOT GOOD ENOUGH: 3 of 100",
        "identify",
    ),
    "cut: good": (stability_screen(True, 1e-4, 2e-4), True, "This cut will not", "compensate"),
    "cut: soft": (stability_screen(True, 3e-4, 2e-4), None, "This cut will not", "compensate"),
    "cut: not stated": (stability_screen(True, 3e-4, None), True, "This cut will not", ""),
    "cut: chatters": (stability_screen(False, 1e-4, 2e-4), False, "This cut will chatter", ""),
}


@pytest.mark.parametrize("name", CASES)
def test_a_first_screen_answers_three_questions_without_a_glossary(name):
    answer, good, begins, first = CASES[name]
    assert answer.good is good
    assert answer.sentence.startswith(begins)
    assert len(answer.figures) == 3
    assert answer.steps
    if first:
        commands = [step.command for step in answer.steps if step.command]
        assert commands[0].split()[1] == first
    assert not GLOSSARY.search(words_of(answer)), words_of(answer)


@pytest.mark.parametrize("name", CASES)
def test_the_terminal_has_the_order_of_the_page_in_a_few_lines(name):
    """Verdict, reason, figures, steps."""
    answer = CASES[name][0]
    lines = printed(answer)
    assert lines[0] == answer.sentence
    assert lines[-len(answer.steps) - 1].startswith(f"{answer.figures[0].label}: ")
    assert lines[-1].endswith(answer.steps[-1].command)
    assert len(lines) <= 9


def test_doubts_about_a_measurement_are_told_at_the_top_alone():
    doubt = "CHECK THE FRAME"
    result, _ = next_screen(1e-4)
    told = result.model_copy(update={"warnings": (doubt,), "sentences": ("Next: path.", doubt)})
    assert next_summary(told, None)[0].parts[-1] == "Next: path."


def test_a_next_command_that_is_expected_to_do_no_better_is_not_offered():
    """0.3 mm on average were measured, 0.9 mm at most; 0.25 or 0.35 mm on average are expected."""
    for expected, is_better in ((1e-3, True), (1.4e-3, False)):
        _, answer = next_screen(expected, tolerance=2e-3)
        assert answer.good is True
        assert next_screen(expected, tolerance=8e-4)[1].good is False
        assert answer.sentence.startswith("NO BETTER IS EXPECTED") is not is_better
        assert any("export" in step.command for step in answer.steps) is is_better
        assert ("Keep the program of results/2." in answer.steps[0].words) is not is_better


def test_the_next_run_s_command_names_all_that_was_measured():
    _, answer = next_screen(1e-4)
    assert answer.steps[-1].command == (
        "elastic-robot next 'results/a run' m.csv results/2 measured.csv -o out"
    )
    assert "The last run left more than was expected: 0.300 mm on average" in answer.reason
    result, _ = next_screen(None)
    refused = refused_answer(result, [*NEXT, "--move", "path"])
    assert (refused.good, refused.reason) == (False, "The run excites nothing.")
    assert refused.sentence.startswith("NO NEXT COMMAND: backlash, stiffness and damping")
    assert refused.steps[0].command.endswith("--move path")


def test_a_place_where_the_cut_chatters_is_none():
    cut = CutStability(
        sentence="The cut chatters",
        stable=False,
        time_s=None,
        rpm=1.0,
        depth_m=1.0,
        limit_m=1.0,
        frequency_Hz=1.0,
        growth_1_s=1.0,
    )
    answer = place_screen(setting(1e-4, 1.0, stability=cut.model_dump()), None, 2e-4)
    assert answer.good is False
    assert "x 1.25 m, yaw 30 deg. The cut chatters" in answer.reason


def test_a_cut_whose_limit_was_not_met_is_not_said_to_have_none():
    """It is looked for down to 0.1 m; a picture over the speed would be empty."""
    result = stability_result(True, 1e-4, None)
    (point,) = result.points
    none = (None, None)
    chart = ChartResult(
        rpm=(1e4, 8e4),
        limit_m=none,
        frequency_Hz=none,
        zero_order_m=none,
        robot_alone_m=none,
    )
    far = {"points": (point.model_copy(update={"limit_m": np.inf}),), "chart": chart}
    report = stability_report(result.model_copy(update=far))
    assert report.answer.figures[0].value == "> 100 mm"
    sections = {section.title: section for section in report.sections()}
    assert not sections["Over the speed"].figures
    assert sections["Over the speed"].parts[0] == (
        "Limit at all speeds from 10000 to 80000 1/min: none up to 100 mm."
    )


def test_a_cut_without_a_limit_has_no_empty_pictures():
    """Over the feed and the part, as far as there is one."""
    result = stability_result(True, 1e-4, None)
    for limit, names in ((None, {"part"}), (1e-3, {"feed", "part"})):
        part = PartChartResult(x_m=(0.0,), y_m=(0.0,), limit_m=((limit,),), least_m=((1e-3,),))
        charts = {
            "over_feed": FeedChartResult(feed_deg=(0.0,), limit_m=(limit,)),
            "over_part": part,
        }
        sections = stability_report(result.model_copy(update=charts)).sections()
        drawn = {section.name: len(section.figures) for section in sections if section.figures}
        assert set(drawn) == names
        assert drawn["part"] == (1 if limit is None else 2)


def test_the_share_of_robots_that_keep_the_tolerance_counts_those_that_fail():
    figures = study_screen(0.9, 2e-4, failed=5).figures
    assert (figures[2].value, figures[2].label) == ("90 %", "Keep your tolerance")
    assert study_screen(1.0, 2e-4, failed=5).figures[2].value == "95 %"

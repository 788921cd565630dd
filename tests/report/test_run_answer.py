"""First screens: what to expect, whether it is good enough, and what to do now."""

from __future__ import annotations

from dataclasses import replace

import pytest
from first_screens import GLOSSARY, words_of
from line_case import line_case
from outlooks import deviation, outlook
from reported import compensated

from coupling.programs.languages import LANGUAGES
from coupling.report.document import document
from coupling.report.run_answer import run_answer
from coupling.report.run_steps import RunContext
from coupling.report.verdict import verdict
from coupling.results.cut_result import CutStability
from coupling.results.iteration_result import CORRECTIONS, QUASISTATIC_VALIDATION
from coupling.results.outlook import (
    DeviationInterval,
    DrawnDeviation,
    DrawnFrom,
    DrawnReplays,
    WorstReplay,
)
from coupling.results.repeatability import Repeatability
from coupling.results.replay import Replay
from coupling.results.run_result import RunResult
from coupling.results.section import Answer, NextStep
from coupling.run.stored_run import read_run

pytestmark = pytest.mark.usefixtures("few_drawn_robots")

INTERVAL = {"low": 1e-5, "less_constant_low": 1e-5}


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> RunResult:
    """Figures of a run that has converged."""
    folder = tmp_path_factory.mktemp("answer")
    return read_run(compensated(folder, line_case(folder, "native"))[2]).figures


def answered(figures: RunResult, tolerance: float | None) -> Answer:
    robots = {"forming": "icme2008", "support": "other.toml"}
    context = RunContext("results/line", "line.toml", robots, tolerance)
    return run_answer(figures, context)


def drawn(high: float, is_whole: bool = True) -> DrawnDeviation:
    """Robots drawn from stated ranges, which leave up to `high` [m]."""
    return DrawnDeviation(
        samples=64,
        high=high,
        less_constant_high=high,
        drawn=("81 to 119 % of the force",),
        missing=(),
        is_whole=is_whole,
        **INTERVAL,
    )


def expecting(figures: RunResult, high: float, is_whole: bool = True) -> RunResult:
    found = outlook(("backlash -20 %", 1e-5, 1e-5))
    return figures.model_copy(
        update={"outlook": found.model_copy(update={"expected": drawn(high, is_whole)})}
    )


def test_the_real_robot_s_figure_is_judged_by_the_tolerance(finished):
    """Between 0.25 and 0.35 mm the verdict on 0.3 mm changes; nothing else of the run does."""
    run = expecting(finished, 3e-4)
    good, bad, unknown = (answered(run, tolerance) for tolerance in (3.5e-4, 2.5e-4, None))
    assert (good.good, bad.good, unknown.good) == (True, False, None)
    assert good.sentence == (
        "GOOD ENOUGH: expect the tool within 0.300 mm of its path on the real robot; your tolerance is"
        " 0.350 mm."
    )
    assert bad.sentence.startswith("NOT GOOD ENOUGH: expect the tool within 0.300 mm")
    assert "tolerance_mm" in unknown.steps[0].words
    assert [figure.value for figure in good.figures][1] == "0.300 mm"
    assert [step.command.split()[1] for step in good.steps] == ["export", "next"]
    assert bad.steps[0].command.split()[1] == "identify"


def test_before_and_after_are_of_the_same_robots(finished):
    """Softer robots than the file's leave more corrected than it does uncorrected: 5 of 7.5 mm."""
    outlook_of_soft = expecting(finished, 5e-3).outlook
    soft = outlook_of_soft.expected.model_copy(update={"uncorrected_high": 7.5e-3})
    run = finished.model_copy(
        update={"outlook": outlook_of_soft.model_copy(update={"expected": soft})}
    )
    assert 1e-5 < run.deviation_before_m.maximum < 5e-3
    before, after, _ = answered(run, 3.5e-4).figures
    assert (before.value, after.value) == ("about 7.50 mm", "5.00 mm")
    assert before.note.startswith("uncorrected, on the real robot; ")
    stiff = answered(expecting(finished, 1e-5), 3.5e-4)
    assert stiff.figures[0].note == "uncorrected, with this robot file"


@pytest.mark.parametrize(
    ("name", "language"),
    [
        ("abb-irb7600-500-255", "rapid"),
        ("IRB 6700", "rapid"),
        ("fanuc-r2000ic", "fanuc"),
        ("kuka-kr210-l150", "krl"),
        ("ur10", "csv"),
        ("icme2008-example", "krl"),
    ],
)
def test_a_program_is_written_in_the_language_of_the_robot_s_controller(finished, name, language):
    robots = (finished.robots[0].model_copy(update={"title": name}),)
    run = expecting(finished, 1e-4).model_copy(update={"robots": robots})
    steps = answered(run, 1e-3).steps
    assert steps[0].command == f"elastic-robot export results/line --to {language}"
    assert language in LANGUAGES


def test_a_robot_file_without_ranges_promises_nothing(finished):
    run = expecting(finished, 1e-4, is_whole=False)
    answer = answered(run, 2e-4)
    assert answer.good is None
    assert answer.sentence.startswith("NOT CERTAIN: expect at least 0.100 mm on the real robot")
    assert answered(run, 5e-5).good is False


def test_usual_values_of_what_a_file_leaves_out_count(finished):
    completed = DeviationInterval(samples=16, high=7e-4, less_constant_high=6e-4, **INTERVAL)
    expected = drawn(8e-5, is_whole=False).model_copy(
        update={"with_left_out": completed, "left_out_m": {"servos": 3.8e-4, "friction": 4.4e-4}}
    )
    found = outlook(("backlash -20 %", 1e-5, 1e-5)).model_copy(update={"expected": expected})
    answer = answered(finished.model_copy(update={"outlook": found}), 2e-4)
    assert "expect the tool within 0.700 mm" in answer.sentence
    assert "friction alone 0.440 mm" in answer.reason


def test_what_is_worse_than_nothing_is_never_to_be_sent(finished):
    for replays, begins, told, before in (
        (
            ("force +5 %", 5e-3, 4e-3),
            "WORSE THAN NOTHING is possible",
            "leave 5.00 mm, uncorrected 1.70 mm",
            "uncorrected, with this robot file",
        ),
        (
            ("damping -20 %", 1e-3, 9e-4),
            "TOUCHING OFF ALONE DOES BETTER",
            "off by 0.400 mm uncorrected and by 0.900 mm under this command",
            "uncorrected, with this robot file; 0.400 mm after a shift of the part",
        ),
    ):
        answer = answered(finished.model_copy(update={"outlook": outlook(replays)}), 1e-2)
        assert answer.good is False
        assert answer.sentence.startswith(begins)
        assert told in answer.sentence
        assert answer.figures[0].note == before
        assert not any("export" in step.command for step in answer.steps)


def test_the_figure_expected_is_never_below_its_cause(finished):
    """The largest cause alone is named, be it a number, the stated ranges, or what a file leaves out."""
    for high, servos, named in (
        (9e-4, 4e-4, "81 to 119 % of the force alone up to 0.900 mm"),
        (3e-4, 9.7e-4, "servos alone 0.970 mm"),
    ):
        expected = drawn(high).model_copy(update={"left_out_m": {"servos": servos}})
        found = outlook(("backlash -20 %", 1e-5, 1e-5)).model_copy(update={"expected": expected})
        answer = answered(finished.model_copy(update={"outlook": found}), 2e-3)
        assert named in answer.reason
        assert answer.figures[1].value == named.split(" ")[-2] + " mm"


def test_a_command_expected_to_leave_more_than_none_is_not_offered(finished):
    """Though none of the small errors alone makes it worse."""
    answer = answered(finished.model_copy(update={"outlook": with_servos(3e-3, None)}), 1.0)
    assert (answer.good, answer.sentence[:18]) == (False, "WORSE THAN NOTHING")
    assert not any("export" in step.command for step in answer.steps)


def test_a_robot_that_is_off_by_more_without_the_command_makes_it_no_worse(finished):
    """The model is off by 1.7 mm uncorrected, the robot by 4 mm, and by 3 mm under the command."""
    figures = finished.model_copy(update={"outlook": with_servos(3e-3, 4e-3)})
    answer = answered(figures, None)
    assert answer.sentence.startswith("About 3.00 mm may remain on the real robot until it is")
    assert (
        "uncorrected most such robots would be off by more, though the file says" in answer.sentence
    )
    assert any("export" in step.command for step in answer.steps)


def test_where_a_shift_of_the_part_does_better_it_is_the_verdict_and_the_step(finished):
    """With what its file leaves out the robot is off by 0.3 mm uncorrected and shifted, 0.6 under it."""
    usual = tuple(
        Replay(name="all", deviation=deviation(6e-4, 6e-4), uncorrected=deviation(1e-3, 3e-4))
        for _ in range(16)
    )
    stated = Replay(name="drawn", deviation=deviation(1e-4, 1e-4))
    replays = DrawnReplays(DrawnFrom(), (stated,), (), usual)
    found = WorstReplay.among(deviation(1.7e-3, 4e-4), [stated], replays)
    enough = answered(finished.model_copy(update={"outlook": found}), 1e-3)
    assert enough.good
    assert "Touching the part off, without a correction, leaves less." in enough.reason
    answer = answered(finished.model_copy(update={"outlook": found}), 5e-4)
    assert answer.good is False
    assert answer.sentence.startswith("TOUCHING OFF ALONE DOES BETTER")
    assert "0.300 mm uncorrected and by 0.600 mm under this command" in answer.sentence
    assert "0.600 mm after such a shift" in answer.figures[1].note
    commands = [step.command.split()[1] for step in answer.steps]
    assert commands[0] == "couple"
    assert "touch_off = true in [part] of line.toml" in answer.steps[0].words
    assert commands[-2:] == ["export", "next"]
    assert answer.steps[-2].words.startswith("Or learn the robot from a part made under this")
    box = verdict(finished.model_copy(update={"outlook": found}), "measured")
    assert box.good is False
    assert box.parts[0].startswith("A shift of the part alone does better")


def test_robots_on_which_a_command_is_worse_are_told_though_most_gain(finished):
    stated = tuple(
        Replay(
            name="drawn", deviation=deviation(left, 0.0), uncorrected=deviation(uncorrected, 0.0)
        )
        for left, uncorrected in 12 * [(2e-4, 1e-3)] + 4 * [(5e-4, 4e-4)]
    )
    found = WorstReplay.among(
        deviation(1.7e-3, 4e-4), stated[:1], DrawnReplays(DrawnFrom(), stated)
    )
    answer = answered(finished.model_copy(update={"outlook": found}), 1e-3)
    assert "it leaves more than no correction: 0.500 mm for 0.400 mm." in answer.reason
    assert any("export" in step.command for step in answer.steps)


def with_servos(left: float, uncorrected: float | None) -> WorstReplay:
    """Return what is expected of a robot whose file leaves out servos that leave so much [m]."""
    before = None if uncorrected is None else deviation(uncorrected, uncorrected)
    servos = Replay(name="servos", deviation=deviation(left, 0.0), uncorrected=before)
    stated = Replay(name="drawn", deviation=deviation(1e-4, 1e-4))
    drawn_replays = DrawnReplays(DrawnFrom(), (stated,), (servos,))
    return WorstReplay.among(deviation(1.7e-3, 4e-4), [stated], drawn_replays)


def test_each_robot_of_a_cell_is_to_be_measured_by_its_file(finished):
    first, *_ = finished.robots
    gears = tuple(
        finished.gears[0].model_copy(
            update={
                "robot": name,
                "joint": joint,
                "reversals": 3,
                "backlash_error": 1e-4,
                "margin": -1.0,
            }
        )
        for name, joint in (("forming", 2), ("support", 5))
    )
    second = first.model_copy(update={"name": "support"})
    run = expecting(finished, 3e-4).model_copy(update={"robots": (first, second), "gears": gears})
    plans = [step for step in answered(run, 1e-4).steps if "--plan" in step.command]
    assert [step.command.split("--plan ")[1] for step in plans] == [
        "--robot icme2008 -o plan_forming.csv",
        "--robot other.toml -o plan_support.csv",
    ]
    assert "the forming robot, the gear of joint 2 first" in plans[0].words
    assert "the support robot, the gear of joint 5 first" in plans[1].words


@pytest.mark.parametrize("kind", ["compensate", "couple"])
def test_a_cell_is_told_of_no_command_that_is_for_one_robot(finished, kind):
    run = expecting(finished, 3e-4).model_copy(update={"robots": finished.robots * 2, "kind": kind})
    commands = [step.command.split()[1] for step in answered(run, 1e-4).steps]
    assert not {"place", "next"} & set(commands)
    assert commands


def test_a_run_that_has_not_converged_is_never_good(finished):
    run = expecting(finished, 1e-6).model_copy(update={"converged": False, "reason": "stopped"})
    answer = answered(run, 1.0)
    assert answer.good is False
    assert answer.sentence.startswith("NOT FINISHED")
    assert answer.figures[1].value == "not known"
    assert not any("export" in step.command for step in answer.steps)


def test_mirroring_that_takes_more_steps_than_it_may_is_told_to_take_more(finished):
    reason = f"not converged within 1 {CORRECTIONS}"
    run = finished.model_copy(update={"converged": False, "outcome": "exhausted", "reason": reason})
    step = answered(run, 1e-9).steps[0]
    assert "max_passes in [compensation] of line.toml" in step.words
    assert step.command == "elastic-robot compensate line.toml -o results/line --overwrite"


def test_an_iteration_that_came_near_enough_is_told_to_ask_for_less(finished):
    """It leaves a hundredth of what is allowed, or a tenth."""
    after = finished.deviation_after_m.maximum
    run = finished.model_copy(update={"converged": False, "outcome": "stagnated"})
    near, far = answered(run, 100.0 * after), answered(run, 10.0 * after)
    assert "tolerance_m = " in near.steps[0].words
    assert near.steps[0].command == (
        "elastic-robot compensate line.toml -o results/line --overwrite"
    )
    assert (near.good, far.good) == (False, False)
    assert "do not send it" in far.sentence


def test_a_command_of_the_moving_robot_is_not_condemned_by_a_robot_without_inertia(finished):
    reason = f"649 um remain after 3 inverses; {QUASISTATIC_VALIDATION}"
    run = finished.model_copy(update={"converged": False, "outcome": "exhausted", "reason": reason})
    answer = answered(run, 1e-9)
    assert answer.good is False
    assert answer.sentence.startswith("NOT FINISHED")
    assert "robot without inertia" in answer.sentence
    assert 'mode = "dynamic"' in answer.steps[0].words
    assert 'method = "mirror"' in answer.steps[1].words


@pytest.mark.parametrize("kind", ["compensate", "couple"])
def test_a_cut_is_never_good_without_its_stability(finished, kind):
    """Its limit stands on the first screen; one that chatters is never to be run, whatever it leaves."""
    cut = CutStability(
        sentence="The cut is stable, limit 1.65 mm at 3000 1/min",
        stable=True,
        time_s=0.5,
        rpm=3000.0,
        depth_m=5e-4,
        limit_m=1.65e-3,
        frequency_Hz=43.0,
        growth_1_s=-2.0,
    )
    figures = finished.model_copy(update={"stability": cut, "kind": kind})
    assert answered(figures, 1.0).reason.endswith(f"{cut.sentence}.")
    chattering = cut.model_copy(
        update={
            "sentence": "The cut chatters at 43.1 Hz from depth 1.66 mm",
            "stable": False,
            "alternative": "2 mm at 3414 1/min",
        }
    )
    answer = answered(figures.model_copy(update={"stability": chattering}), 1.0)
    assert answer.good is False
    assert answer.sentence == "This cut will chatter: do not run it."
    assert answer.reason == f"{chattering.sentence}. Stable would be {chattering.alternative}."


def test_a_first_screen_needs_no_glossary(finished):
    """Five cases, three of which are bad."""
    bad = finished.model_copy(update={"outlook": outlook(("force +5 %", 5e-3, 4e-3))})
    cases = (
        (finished, None),
        (expecting(finished, 3e-4), 3.5e-4),
        (expecting(finished, 3e-4), 2.5e-4),
        (bad, 1e-3),
        (finished.model_copy(update={"converged": False, "reason": "it was stopped"}), 1e-3),
    )
    for figures, tolerance in cases:
        answer = answered(figures, tolerance)
        assert len(answer.figures) == 3
        assert answer.steps
        assert not GLOSSARY.search(words_of(answer)), words_of(answer)


def test_commands_can_be_copied_from_the_page_whatever_the_names():
    """A folder with blanks and quotes is one word of a command; what is told is no HTML."""
    step = NextStep.by("Draw it anew:", "report", "results/it's a cone")
    assert step.command == "elastic-robot report 'results/it'\"'\"'s a cone'"
    page = document("", [], replace(Answer("<b>", steps=()), reason="&"))
    assert "&lt;b&gt;" in page


@pytest.mark.parametrize("kind", ["couple", "compensate"])
def test_a_process_that_answers_differently_is_named_with_its_remedy(finished, kind):
    repeated = Repeatability(largest_N=14.2, rms_N=4.3, peak_N=182.0)
    figures = finished.model_copy(
        update={
            "kind": kind,
            "converged": False,
            "outcome": "stagnated",
            "repeatability": repeated,
            "deviation_after_m": deviation(2e-4, 1e-4),
            "reason": f"{repeated.sentence()}; the path still changes by up to 54 um",
        }
    )
    answer = answered(figures, 3e-4)
    assert "NOT FINISHED" in answer.sentence
    assert "different forces, up to 14.2 N apart of 182 N" in answer.reason
    (step,) = answer.steps
    assert step.command == "elastic-robot check line.toml --evaluate"
    assert "repeatable" in step.words
    other = figures.model_copy(update={"reason": "the process failed in evaluation 3"})
    assert "different forces" not in answered(other, 3e-4).reason

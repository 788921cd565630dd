"""What to expect of a command on a real robot, beside what the uncorrected one leaves."""

import re
from dataclasses import replace
from io import StringIO

import pytest
from line_case import line_case
from outlooks import deviation, outlook
from rich.console import Console

from coupling.cli import runs
from coupling.path.deviation import Deviation
from coupling.report.document import document
from coupling.report.verdict import verdict
from coupling.results.outlook import DrawnDeviation, DrawnFrom, DrawnReplays, WorstReplay
from coupling.results.replay import Replay, Worsening
from coupling.results.run_result import RobotResult, RunResult
from coupling.run.execute import run_compensation
from coupling.run.expected_robots import confirm_ranks
from coupling.run.folder import write_run
from coupling.run.robustness import ROBUSTNESS
from coupling.run.stored_run import read_run
from coupling.run_to_folder import FinishedRun

pytestmark = pytest.mark.usefixtures("few_drawn_robots")


def figures(**told: object) -> RunResult:
    """Return the figures that a verdict needs, and others."""
    robot = RobotResult.model_construct(
        title="robot", description="a robot", torque_curve="backlash"
    )
    return RunResult.model_construct(
        kind="compensate",
        converged=True,
        reason="converged with one inverse of the moving robot",
        robots=(robot,),
        deviation_before_m=deviation(1.7e-3, 4e-4),
        deviation_after_m=deviation(1e-6, 1e-6),
        mode="dynamic",
        robustness=(),
        gears=(),
        **told,
    )


def test_the_worst_replay_of_all_is_told_whatever_differs():
    found = outlook(("backlash -20 %", 1.6e-4, 1.5e-4), ("stiffness +2 %", 3e-4, 1e-5))
    assert (found.worst, found.deviation, found.less_constant) == ("stiffness +2 %", 3e-4, 1.5e-4)
    assert found.gains
    assert found.sentence.startswith("Sensitivity to 2 % of stiffness, 5 % of force and the like")
    assert "up to 0.300 mm (stiffness +2 %)" in found.sentence


def test_a_command_that_only_takes_the_sag_off_and_shakes_is_worse_than_none():
    """1.2 mm are less than 1.7 mm, but less a constant 0.9 mm are more than 0.4 mm."""
    assert not outlook(("damping -20 %", 1.2e-3, 9e-4)).gains
    assert not outlook(("damping -20 %", 1.8e-3, 1e-4)).gains


def drawn(*pairs: tuple[float, float]) -> tuple[Replay, ...]:
    """Return replays that leave so much under the command, and under the uncorrected one [m]."""
    return tuple(
        Replay(name="drawn", deviation=deviation(after, 0.0), uncorrected=deviation(before, 0.0))
        for after, before in pairs
    )


def test_a_command_is_compared_with_none_on_the_same_robot():
    """A robot three times as soft leaves 2 of 3 mm, which is better; one a third as soft 0.7 of 0.3."""
    before, replays = deviation(1e-3, 1e-3), [Replay(name="none", deviation=deviation(0.0, 0.0))]
    soft, stiff = drawn((2e-3, 3e-3)), drawn((0.7e-3, 0.3e-3))
    assert WorstReplay.among(before, replays, DrawnReplays(DrawnFrom(), 16 * soft)).gains
    found = WorstReplay.among(before, replays, DrawnReplays(DrawnFrom(), 12 * soft + 4 * stiff))
    assert found.gains
    assert (found.may_be_worse.deviation, found.may_be_worse.uncorrected) == (0.7e-3, 0.3e-3)
    found = WorstReplay.among(before, replays, DrawnReplays(DrawnFrom(), 7 * soft + 9 * stiff))
    assert not found.gains
    assert (found.worse.deviation, found.worse.uncorrected) == (0.7e-3, 0.3e-3)
    assert (
        "on the same robot (drawn) it leaves 0.700 mm, the uncorrected one 0.300 mm"
        in found.sentence
    )
    few = DrawnReplays(DrawnFrom(), 63 * soft + stiff)
    assert WorstReplay.among(before, replays, few).may_be_worse is None, "one of 64 is not expected"


def superposed(count: int, uncorrected: float) -> list[Replay]:
    """Return replays that leave 2 mm, and uncorrected so much by superposition [m]."""
    after, before = deviation(2e-3, 2e-3), deviation(uncorrected, uncorrected)
    return [Replay(name="drawn", deviation=after, uncorrected=before) for _ in range(count)]


def test_the_robots_that_decide_are_simulated_where_superposition_is_near():
    """Two of 16 are worse off in truth, which superposition does not tell: as many as count."""
    replays, simulated = superposed(12, 9e-3) + superposed(4, 2.2e-3), []

    def simulate(number: int) -> Deviation:
        simulated.append(number)
        return deviation(1.7e-3, 1.7e-3) if number > 13 else deviation(2.3e-3, 2.3e-3)

    before = deviation(1e-3, 1e-3)
    assert Worsening.worst((), [replays], before, False, 0.95) is None
    confirm_ranks(replays, simulate)
    assert set(simulated) <= {12, 13, 14, 15}
    found = Worsening.worst((), [replays], before, False, 0.95)
    assert (found.deviation, found.uncorrected) == (2e-3, 1.7e-3)


def test_robots_that_are_surely_better_off_are_not_simulated():
    replays = superposed(16, 9e-3)
    confirm_ranks(replays, lambda number: pytest.fail(f"{number} is simulated"))
    assert replays == superposed(16, 9e-3)


def test_usual_values_of_what_a_file_leaves_out_count_all_at_once():
    """One of them alone is no robot; less a constant they call for a shift of the part."""
    before, replays = deviation(1e-3, 4e-4), [Replay(name="none", deviation=deviation(0.0, 0.0))]
    alone = drawn((2e-3, 1e-3))
    both = tuple(
        Replay(name="all", deviation=deviation(5e-4, 5e-4), uncorrected=deviation(9e-4, 3e-4))
        for _ in range(16)
    )
    found = WorstReplay.among(before, replays, DrawnReplays(DrawnFrom(), both, alone, both))
    assert found.worse.is_shifted, "by robots that its file states"
    usual = DrawnReplays(DrawnFrom(), 16 * drawn((1e-4, 9e-4)), alone, both)
    found = WorstReplay.among(before, replays, usual)
    assert found.worse is None
    assert not found.gains
    assert (found.shift_alone.deviation, found.shift_alone.uncorrected) == (5e-4, 3e-4)
    without = DrawnReplays(DrawnFrom(), 16 * drawn((1e-4, 9e-4)), alone)
    assert not WorstReplay.among(before, replays, without).gains


def test_what_is_worse_than_none_is_said_first_and_in_the_box_of_a_failure():
    bad, good = outlook(("force +5 %", 2e-3, 3e-4)), outlook(("force +5 %", 1e-4, 9e-5))
    box = document("", [verdict(figures(outlook=bad), "measured")])
    assert '<div class="verdict no"><p>This command may be WORSE THAN NONE' in box
    assert box.index("WORSE THAN NONE") < box.index("Converged")
    box = document("", [verdict(figures(outlook=good), "measured")])
    assert '<div class="verdict yes"><p>Converged' in box
    assert "Sensitivity to 2 % of stiffness" in box


def test_a_command_that_a_shift_of_the_part_would_beat_is_called_so_in_the_result_too():
    """Its first screen says TOUCHING OFF ALONE DOES BETTER: 0.9 mm less a constant, uncorrected 0.4."""
    shaken = outlook(("damping -20 %", 1e-3, 9e-4))
    assert shaken.sentence.startswith(
        "A shift of the part alone does better: less a constant (damping -20 %) this command leaves"
        " 0.900 mm, the uncorrected one 0.400 mm."
    )
    assert "WORSE" not in shaken.sentence


def test_drawn_robots_are_expected_and_their_sensitivity_stands_beside():
    """Of 1 to 100 um the middle nine tenths are 5.5 to 95.5 um."""
    drawn = [
        Replay(name="drawn", deviation=deviation(1e-6 * um, 0.5e-6 * um)) for um in range(1, 101)
    ]
    basis = DrawnFrom(
        ("the stated stiffness of 6 gears", "84 to 100 % of the force"), ("backlash",), True
    )
    replays = [Replay(name="stiffness +2 %", deviation=deviation(7e-6, 1e-6))]
    found = WorstReplay.among(deviation(1.7e-3, 4e-4), replays, DrawnReplays(basis, tuple(drawn)))
    assert found.gains
    assert found.sentence.startswith(
        "Expected deviation on a real robot: 5.50 um to 95.5 um, 2.75 um to 47.7 um less a constant"
        " (90 % of the robots, by 100 of them, drawn from the stated stiffness of 6 gears and 84 to"
        " 100 % of the force). Not in it: backlash. Sensitivity to one parameter: up to 7.00 um"
    )
    assert DrawnDeviation.among(DrawnReplays(basis)) is None
    few = DrawnDeviation.among(DrawnReplays(basis, tuple(drawn[:8])))
    assert (few.low, few.high, round(few.share, 2)) == (1e-6, 8e-6, 0.88)
    assert few.uncorrected_high is None
    double = tuple(replay.beside(deviation(2 * replay.deviation.maximum, 0.0)) for replay in drawn)
    assert DrawnDeviation.among(DrawnReplays(basis, double)).uncorrected_high == pytest.approx(
        191e-6
    )


def test_a_figure_without_the_stiffness_of_gears_is_not_called_that_of_a_real_robot():
    drawn = tuple(Replay(name="drawn", deviation=deviation(1e-6 * um, 0.0)) for um in range(1, 101))
    basis = DrawnFrom(("84 to 100 % of the force",), ("the stiffness of 6 gears",))
    sentence = DrawnDeviation.among(DrawnReplays(basis, drawn)).sentence
    assert sentence.startswith(
        "Deviation on robots drawn in part, not what a real robot leaves: 5.50 um to 95.5 um"
    )
    assert sentence.endswith("Not in it: the stiffness of 6 gears.")


def test_the_first_figure_has_what_the_file_leaves_out():
    stated = tuple(
        Replay(name="drawn", deviation=deviation(1e-6 * um, 0.0)) for um in range(1, 101)
    )
    usual = tuple(
        Replay(name="drawn", deviation=deviation(1e-6 * um, 0.0)) for um in range(201, 301)
    )
    servos = (Replay(name="servos", deviation=deviation(1.5e-4, 0.0)),)
    basis = DrawnFrom(("the stated stiffness of 6 gears",), (), True)
    expected = DrawnDeviation.among(DrawnReplays(basis, stated, servos, usual))
    assert (round(expected.low, 9), round(expected.high, 9)) == (5.5e-6, 9.55e-5)
    assert expected.left_out_m == {"servos": 1.5e-4}
    assert expected.sentence.startswith("Expected deviation on a real robot: 0.206 mm to 0.295 mm")
    assert "by its stated ranges alone 5.50 um to 95.5 um" in expected.sentence
    assert expected.sentence.endswith("Each usual value alone, on the model: servos 0.150 mm.")
    again = DrawnDeviation.model_validate_json(expected.model_dump_json())
    assert again == expected


def test_the_terminal_begins_with_it_in_its_colour(tmp_path, monkeypatch):
    """At most fifteen lines, of which the last is the folder."""
    case = line_case(tmp_path, "native")
    run = run_compensation(case)
    shaken = Replay(name="shaken", deviation=deviation(5.0, 5.0))
    for replays, first in (
        (run.finding_of(ROBUSTNESS), "Of "),
        ((*run.finding_of(ROBUSTNESS), shaken), "WORSE THAN NOTHING is possible"),
    ):
        said = Console(
            record=True, file=StringIO(), width=500, force_terminal=True, highlight=False
        )
        found = replace(run, findings={**run.findings, ROBUSTNESS.name: replays})
        write_run(tmp_path, case, found)
        done = FinishedRun(found, read_run(tmp_path))
        monkeypatch.setattr(runs, "console", said)
        runs.print_run(done, tmp_path)
        text = said.export_text(styles=True)
        assert ("\x1b[33m" in text) is first.startswith("WORSE")
        lines = re.sub(r"\x1b\[[0-9;]*m", "", text).strip().splitlines()
        assert lines[0].startswith(first)
        assert lines[-1].startswith("Result: ")
        assert len(lines) <= 15


def test_nothing_is_expected_where_nothing_was_replayed():
    assert WorstReplay.among(deviation(1e-3, 1e-4), ()) is None
    assert "expect" not in str(verdict(figures(), "measured"))

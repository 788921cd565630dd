"""What a run tells whoever watches: one function hears everything."""

import itertools
from collections import Counter

import pytest
from places import LINE_CASE

from coupling.case.file import load_case
from coupling.events import Event, Progress
from coupling.run.execute import Run, RunBegins, run_compensation
from coupling.solve.correction import CorrectionIteration
from coupling.solve.fixed_point import Evaluated

pytestmark = pytest.mark.usefixtures("drawn_robots")


@pytest.fixture(scope="module")
def watched() -> tuple[Run, list[Event]]:
    told: list[Event] = []
    case = load_case(LINE_CASE, watch=told.append)
    return run_compensation(case, told.append), told


def test_every_evaluation_and_pass_is_told_in_its_order(watched):
    run, told = watched
    passes = [event for event in told if isinstance(event, CorrectionIteration)]
    assert passes == list(run.correction.iterations)
    evaluations = [event.evaluation for event in told if isinstance(event, Evaluated)]
    assert evaluations == [e for entry in passes for e in entry.evaluations]
    assert isinstance(told[0], RunBegins)
    ends = [k for k, event in enumerate(told) if isinstance(event, CorrectionIteration)]
    for entry, first, last in zip(passes, [0, *ends], ends, strict=False):
        between = [event for event in told[first:last] if isinstance(event, Evaluated)]
        assert len(between) == len(entry.evaluations)


def test_simulations_count_their_steps_up_to_the_end(watched):
    """Each one ends with all steps done, and says which robot it simulates."""
    run, told = watched
    works = [event for event in told if isinstance(event, Progress)]
    works = [work for work in works if work.what.startswith("simulating the")]
    steps = len(run.desired.time) - 1
    assert {work.total for work in works} == {steps, 2 * steps}  # once at half the samples
    whats = [what for what, _ in itertools.groupby(work.what for work in works)]
    expected = [
        "simulating the quasistatic robot",
        "simulating the dynamic robot",
        *(f"simulating the dynamic robot with {replay.name}" for replay in run.robustness[:-1]),
        "simulating the quasistatic robot",  # what samples cost, in the mode of the case
    ]
    # Between them robots with the usual values of what the file does not state.
    usual = [what for what in whats if what not in expected]
    assert all(what.startswith("simulating the dynamic robot with ") for what in usual)
    assert [what for what in whats if what not in usual] == expected
    assert run.robustness[-1].name == "sampling"
    finished = Counter(work.what for work in works if work.done == work.total)
    replays = [finished.pop(what) for what in expected[2:-1]]
    assert set(replays) <= {1, 2}, "a robot may be simulated without the correction as well"
    # Two unloaded and two in dynamic mode, before and after; one for each evaluation (the validation
    # among them), and one at half the samples.
    others = sum(count for what, count in finished.items() if what not in usual)
    assert others == run.correction.evaluations + 4 + 1


def test_planning_counts_the_samples(watched):
    run, told = watched
    works = [event for event in told if isinstance(event, Progress) and "planning" in event.what]
    assert {work.total for work in works} == {len(run.desired.time)}
    finished = sum(work.done == work.total for work in works)
    # Each commands another path; what gears go through is told of the desired one.
    assert finished == len(run.correction.iterations) + 1

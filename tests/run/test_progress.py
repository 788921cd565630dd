"""What is seen of a run while it goes on, and what a user who stops it is told."""

import io

import numpy as np
import pytest
from rich.console import Console

from coupling.cli import main
from coupling.events import Progress
from coupling.run import console as module
from coupling.run.console import RemainingTime, RunView


def test_a_run_without_a_terminal_says_now_and_then_how_far_it_is(monkeypatch, capsys):
    """On standard error, of work that takes long alone; on standard output nothing but the result."""
    clock = iter([0.0, 30.0, 45.0, 60.0, 61.0])
    monkeypatch.setattr(module.time, "monotonic", lambda: next(clock))
    out = io.StringIO()
    with RunView(Console(file=out)) as view:
        for done in (0, 1, 2, 3):
            view.watch(Progress("simulating", done, 4))
        view.watch(Progress("writing", 0, 1))
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "simulating: 1 of 4 steps, for 30 s",
        "simulating: 3 of 4 steps, for 60 s, about 15 s more",
    ]
    assert out.getvalue() == ""


def test_a_stage_that_is_repeated_is_estimated_by_its_present_pass(monkeypatch, capsys):
    """A first step at once after 40 s of others tells nothing of what is ahead."""
    clock = iter([0.0, 19.0, 41.0, 53.0, 65.0])
    monkeypatch.setattr(module.time, "monotonic", lambda: next(clock))
    with RunView(Console(file=io.StringIO())) as view:
        for done in (1, 4, 1, 2, 3):
            view.watch(Progress("simulating", done, 4))
    assert capsys.readouterr().err.splitlines() == [
        "simulating: 1 of 4 steps, for 41 s",
        "simulating: 3 of 4 steps, for 65 s, about 12 s more",
    ]


def test_a_slow_start_is_no_estimate(monkeypatch, capsys):
    """A process that loads for 20 s goes on with 400 steps a second: 71 s remain, not 129."""
    clock = iter([0.0, 20.0, 22.0, 24.0, 43.0])
    monkeypatch.setattr(module.time, "monotonic", lambda: next(clock))
    with RunView(Console(file=io.StringIO())) as view:
        for done in (0, 200, 1000, 1800, 9400):
            view.watch(Progress("simulating", done, 37680))
    assert capsys.readouterr().err.splitlines() == [
        "simulating: 1000 of 37680 steps, for 22 s",
        "simulating: 9400 of 37680 steps, for 43 s, about 71 s more",
    ]


def test_time_is_told_right_once_the_speed_has_been_steady_for_as_long_as_it_was_not():
    """Whatever the first 10 s are like, by work that then takes 100 steps a second."""
    rng = np.random.default_rng(5)
    for _ in range(50):
        start, slow = rng.uniform(0.0, 60.0), rng.uniform(0.01, 1.0)
        instants = np.arange(0.0, 99.0, 0.5)
        done = np.cumsum(np.where(instants < 10.0, 50.0 * slow, 50.0)).astype(int)
        work, told = RemainingTime(), []
        for instant, steps in zip(instants, done, strict=True):
            work.report(start + instant, steps)
            ahead = work.ahead(10_000)
            if ahead is not None and instant > 21.0:
                told.append(100.0 * ahead / (10_000 - steps))
        assert len(told) > 100
        np.testing.assert_allclose(told, 1.0, rtol=1e-9)


def test_who_stops_a_command_is_told_how_it_goes_on(tmp_path, monkeypatch, capsys):
    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("coupling.case.file.load_case", stopped)
    with pytest.raises(SystemExit) as end:
        main(["check", str(tmp_path / "a case.toml")])
    assert end.value.code == 130
    said = capsys.readouterr().err.splitlines()
    assert said[0] == "stopped; nothing was written"
    assert said[1] == f"to go on, or to begin anew: elastic-robot check '{tmp_path}/a case.toml'"

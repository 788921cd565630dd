"""What is seen of a run while it goes on, and what a user who stops it is told."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from coupling.cli import main
from coupling.events import Progress
from coupling.run import console as module
from coupling.run.console import RunView


def test_a_run_without_a_terminal_says_now_and_then_how_far_it_is(monkeypatch, capsys):
    """On standard error, of work that takes long alone; on standard output nothing but the result."""
    clock = iter([0.0, 30.0, 35.0, 60.0, 61.0])
    monkeypatch.setattr(module.time, "monotonic", lambda: next(clock))
    out = io.StringIO()
    with RunView(Console(file=out)) as view:
        for done in (0, 1, 2, 3):
            view.watch(Progress("simulating", done, 4))
        view.watch(Progress("writing", 0, 1))
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "simulating: 1 of 4 steps, for 30 s, about 90 s more",
        "simulating: 3 of 4 steps, for 60 s, about 20 s more",
    ]
    assert out.getvalue() == ""


def test_a_stage_that_is_repeated_is_estimated_by_its_present_pass(monkeypatch, capsys):
    """A first step at once after 40 s of others tells nothing of what is ahead."""
    clock = iter([0.0, 19.0, 41.0, 65.0])
    monkeypatch.setattr(module.time, "monotonic", lambda: next(clock))
    with RunView(Console(file=io.StringIO())) as view:
        for done in (1, 4, 1, 2):
            view.watch(Progress("simulating", done, 4))
    assert capsys.readouterr().err.splitlines() == [
        "simulating: 1 of 4 steps, for 41 s",
        "simulating: 2 of 4 steps, for 65 s, about 24 s more",
    ]


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

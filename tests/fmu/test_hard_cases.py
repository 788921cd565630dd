"""What no master should be able to break."""

from __future__ import annotations

import re

SAID = {
    "force": r"needs more than \d+ tries of a step at \S+ m/s, under 1e\+12 N, 0 N m, drives of 0 rad/s"
    r"|bends deflection\[\d+\] beyond 3.14 rad, under 1e\+12 N, 0 N m, drives of 0 rad/s",
    "enormous force": r"0 s into a step of .*, needs steps below \S+ s, under 1e\+300 N",
    "moment": r"under 0 N, 1e\+14 N m",
    "acceleration": r"drives of \S+e\+1\d rad/s and \S*e\+12 rad/s2: one of these is too large",
    "enormous acceleration": r"and \S*e\+300 rad/s2: one of these is too large",
    "rate": r"drives of 1e\+09 rad/s and 0 rad/s2",
    "spring": r"a spring of 1e\+12 N/m",
    "enormous spring": r"a spring of 1e\+300 N/m",
    "long step": r"step size: expected at most 3600 s at a time, got 1e\+09 s|got 1000000000 s",
}


def _sections(said: str) -> list[tuple[str, str]]:
    return re.findall(r"^## (.*)\n((?:(?!## ).*\n)*)", said, re.MULTILINE)


def test_absurd_values_are_refused_in_time_and_leave_no_trace(example_fmu, run_host):
    """The same twice: with backlash, and linear."""
    sections = _sections(run_host("hard_cases", example_fmu, "absurd"))
    dynamic, quasistatic = sections[:-3], sections[-3:]
    assert {name for name, _ in dynamic} == set(SAID)
    for name, text in dynamic:
        assert re.search(SAID[name], text), text
    for _, text in quasistatic:
        assert "no static equilibrium found at q = " in text
    assert not any("Warning" in text for _, text in sections)


def test_a_run_that_starts_late_is_that_from_zero(example_fmu, run_host):
    said = run_host("hard_cases", example_fmu, "late")
    assert "step start: expected the last step's end, 1000000000.0 s, got" in said

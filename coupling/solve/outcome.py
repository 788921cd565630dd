"""Outcomes of an iteration."""

from __future__ import annotations

from enum import StrEnum


class Outcome(StrEnum):
    """Verdict on a coupling or a correction; the reason in plain words stands beside it."""

    CONVERGED = "converged"
    DIVERGED = "diverged"
    LIMIT_CYCLE = "limit cycle"
    STAGNATED = "stagnated"
    EXHAUSTED = "exhausted"
    PROCESS_FAILED = "process failed"
    ROBOT_FAILED = "robot failed"
    CHATTERS = "chatters"

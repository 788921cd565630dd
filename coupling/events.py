"""Events of a run, for whoever watches it: one function that takes every event."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


class Event:
    """Base of all events; the solvers' own events are defined beside them."""


@dataclass(frozen=True)
class Progress(Event):
    """How far work that takes longer than a second is.

    Attributes:
        what: Work being done, for people.
        done, total: Steps, in whatever unit the work counts.
    """

    what: str
    done: int
    total: int


@dataclass(frozen=True)
class ProcessMessage(Event):
    """A line that a process says while it works.

    Attributes:
        line: Without its end.
    """

    line: str


@dataclass(frozen=True)
class WarningEvent(Event):
    """Something that the user should know and that does not end the run.

    Attributes:
        text: A sentence.
    """

    text: str


Watch = Callable[[Event], None]


def unwatched(event: Event) -> None:
    """Let an event pass."""

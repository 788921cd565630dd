"""Calls that are allowed in each state: the table of FMI 2.0, section 4.2.4.

`native/fmi/lifecycle.c` is the same in C.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from elastic_robot.errors import LifeCycleError


class Phase(IntEnum):
    """States of an instance between two calls; steps are done when their call returns."""

    INSTANTIATED = 0
    INITIALISING = 1
    RUNNING = 2
    TERMINATED = 3


_BEFORE = frozenset({Phase.INSTANTIATED, Phase.INITIALISING})
_ALIVE = _BEFORE | {Phase.RUNNING}
_ALWAYS = frozenset(Phase)
_ENDED = "expected a reset or an earlier state after the simulation's termination, got another call"


@dataclass(frozen=True)
class Call:
    """Calls that have the same rights.

    Attributes:
        phases: States in which they are allowed.
        refusal: Sentence elsewhere, but for the terminated instance.
    """

    phases: frozenset[Phase]
    refusal: str = ""

    def require(self, phase: Phase) -> None:
        """Raise a LifeCycleError where the calls may not be made.

        Example:
            >>> SET_FIXED.require(Phase.INITIALISING)
            >>> SET_FIXED.require(Phase.RUNNING)
            Traceback (most recent call last):
            elastic_robot.errors.LifeCycleError: strings are fixed; set them before initialisation ends
        """
        if phase not in self.phases:
            raise LifeCycleError(_ENDED if phase is Phase.TERMINATED else self.refusal)


SETUP = Call(
    frozenset({Phase.INSTANTIATED}),
    "expected the experiment's setup before initialisation is entered, got it after",
)
ENTER = Call(
    frozenset({Phase.INSTANTIATED}),
    "expected a reset before initialisation is entered again, got none",
)
EXIT = Call(
    frozenset({Phase.INITIALISING}),
    "expected initialisation to be entered before its end, and to end once, got its end",
)
STEP = Call(
    frozenset({Phase.RUNNING}), "expected initialisation's end before a step, got the step first"
)
TERMINATE = Call(
    frozenset({Phase.RUNNING}),
    "expected initialisation's end before termination, got the termination first",
)
SET = Call(_ALIVE)
SET_FIXED = Call(_BEFORE, "strings are fixed; set them before initialisation ends")
GET = Call(
    _ALWAYS - {Phase.INSTANTIATED},
    "expected initialisation to be entered before values are read, got it after",
)
RESULT = Call(
    frozenset({Phase.RUNNING, Phase.TERMINATED}),
    "expected initialisation's end before a step is asked about, got it after",
)
ANY = Call(_ALWAYS)

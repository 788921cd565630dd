"""The exceptions of this package; a run that does not converge is a result, not an exception."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

# What of a long message is shown: enough to know it, and its end, where the remedy stands.
_LONGEST_LINE, _LINE_HEAD, _LINE_TAIL = 1200, 500, 300
_MOST_LINES, _HEAD_LINES, _TAIL_LINES = 200, 100, 50
# Characters that steer a terminal, and those that turn the direction of what follows.
_Error = TypeVar("_Error", bound=Exception)
_STEERING = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


class CouplingError(Exception):
    """Base of every error this package raises for a user's mistake or an impossible request."""

    def __str__(self) -> str:
        return shortened(super().__str__())


class CaseError(CouplingError):
    """A case file or a file that it names is unreadable, incomplete or contradictory."""


class PlanningError(CouplingError):
    """The robot cannot follow a tool path: out of reach, beyond a limit or singular."""


class HostError(CouplingError):
    """The process that a robot's FMU runs in has ended: killed, or crashed by the FMU."""


class SimulationError(CouplingError):
    """The FMU could not be loaded or refused a step."""


class ProcessError(CouplingError):
    """A process has no answer: it cannot follow the path, or its program or FMU failed."""


class ResultError(CouplingError):
    """A run folder cannot be read or written."""


class StudyError(CouplingError):
    """A study cannot be begun, continued or distributed."""


class StoreError(CouplingError):
    """The store of evaluations cannot be read or written."""


class IdentifyError(CouplingError):
    """Measurements cannot be read, or nothing can be identified from them."""


class LearnError(CouplingError):
    """A measured run cannot be read, does not belong to its run, or tells nothing."""


class ProgramError(CouplingError):
    """A robot program cannot be read, or its language or robot does not allow what it should say."""


class StabilityError(CouplingError):
    """The modes of a robot or the stability of a cut cannot be computed or kept."""


class BuildError(CouplingError):
    """An FMU cannot be written."""


class HysteresisError(CouplingError):
    """A command does not know the hysteresis of gears."""


# So many words are shown of those that are known.
_MOST_WORDS = 40
# Shortest part of a word that may be meant for the whole.
_SHORTEST_PART = 3


def one_of(choices: Iterable[str], got: object, also: str = "", kind: str = "") -> str:
    """Return the part of a message that says which words are known, and which one is meant.

    Args:
        choices: The words.
        got: Word that stands there instead.
        also: Text after the words, such as another possibility.
        kind: Text before what stands there.

    Example:
        >>> one_of(["mirror", "inverse"], "miror")
        "expected one of mirror, inverse, got 'miror': did you mean 'mirror'?"
        >>> one_of(["kuka_kr210", "ur10"], "kr210")
        "expected one of kuka_kr210, ur10, got 'kr210': did you mean 'kuka_kr210'?"
        >>> one_of(["mass"], "tool", kind="key ")
        "expected mass, got key 'tool'"
    """
    words = list(choices)
    within = [word for word in words if len(str(got)) >= _SHORTEST_PART and str(got) in word]
    close = within or difflib.get_close_matches(str(got), words, n=1)
    hint = f": did you mean {close[0]!r}?" if close else ""
    shown = words if len(words) <= _MOST_WORDS else [*words[:_MOST_WORDS], f".. ({len(words)})"]
    listing = ("one of " if len(words) > 1 else "") + ", ".join(shown)
    return f"expected {listing}{also}, got {kind}{got!r}{hint}"


@contextmanager
def locate_errors(
    place: str, caught: type[Exception], raised: type[Exception] | None = None
) -> Iterator[None]:
    """Begin what errors of a class say with a place; raise another class of error where it is given.

    Example:
        >>> with locate_errors("joint 2: stiffness", ValueError, CaseError):
        ...     float("stiff")
        Traceback (most recent call last):
        coupling.errors.CaseError: joint 2: stiffness: could not convert string to float: 'stiff'
    """
    try:
        yield
    except caught as cause:
        raise (raised or caught)(f"{place}: {cause}") from cause


def cause_of(error: BaseException, kind: type[_Error]) -> _Error | None:
    """Return the first error of a class among an error and its causes; None where there is none."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, kind):
        cause = cause.__cause__
    return cause


def sentence(words: str) -> str:
    """Return the words of an error or a warning with a full stop, unless they ask.

    Example:
        >>> sentence("got 40"), sentence("got 4000: are they in mm?")
        ('got 40.', 'got 4000: are they in mm?')
    """
    return words if words.endswith("?") else f"{words}."


def shortened(words: str) -> str:
    """Return a message without the middle of what it quotes at length.

    Example:
        >>> shortened("expected a word, got " + 10_000_000 * "a")[495:535]
        'aaaaa[... 9999221 characters ...]aaaaaaa'
    """
    if len(words) <= _LONGEST_LINE:
        return words
    lines = words.split("\n")
    if len(lines) > _MOST_LINES:
        skipped = len(lines) - _HEAD_LINES - _TAIL_LINES
        lines = [*lines[:_HEAD_LINES], f"[... {skipped} lines ...]", *lines[-_TAIL_LINES:]]
    return "\n".join(map(_shortened_line, lines))


def _shortened_line(line: str) -> str:
    if len(line) <= _LONGEST_LINE:
        return line
    skipped = len(line) - _LINE_HEAD - _LINE_TAIL
    return f"{line[:_LINE_HEAD]}[... {skipped} characters ...]{line[-_LINE_TAIL:]}"


def without_steering(words: str) -> str:
    r"""Return a text whose characters that would steer a terminal are written out.

    Example:
        >>> print(without_steering("\x1b[2Jformed\tin 3 s"))
        \x1b[2Jformed	in 3 s
    """
    return _STEERING.sub(lambda match: ascii(match[0])[1:-1], words)


def reason_of(cause: Exception) -> str:
    """Return why a file cannot be read or written.

    Example:
        >>> try: "Ä".encode("latin-1").decode()
        ... except ValueError as cause: print(reason_of(cause))
        expected text in UTF-8, got the byte 0xc4 at 0: save it in that encoding
    """
    if isinstance(cause, UnicodeDecodeError):
        byte = cause.object[cause.start]
        return (
            f"expected text in UTF-8, got the byte {byte:#04x} at {cause.start}: save it in that"
            " encoding"
        )
    return getattr(cause, "strerror", None) or str(cause)

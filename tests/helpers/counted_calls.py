"""Work that grows in proportion, by calls of functions: a measure that no busy machine changes."""

import sys
from collections.abc import Callable


def require_proportional(work: Callable[[int], object]) -> None:
    """Require that a piece of work for twice as many things takes twice as many calls more."""
    few, some, many = (_calls(work, count) for count in (200, 400, 800))
    assert many - some < 1.01 * 2.0 * (some - few)


def _calls(work: Callable[[int], object], size: int) -> int:
    """Return the number of calls of Python and C functions in a piece of work of a size."""
    count = 0

    def note(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(note)
    try:
        work(size)
    finally:
        sys.setprofile(None)
    return count

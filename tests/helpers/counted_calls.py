"""How often functions are called: a measure of work that no busy machine changes."""

from __future__ import annotations

import sys
from collections.abc import Callable


def counted_calls(work: Callable[[], object]) -> int:
    """Return the number of calls of Python and C functions in a piece of work."""
    count = 0

    def note(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count

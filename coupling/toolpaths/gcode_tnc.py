"""DIN/ISO programs of HEIDENHAIN's controls, some of whose G-words differ from those of others."""

from __future__ import annotations

import re
from collections.abc import Sequence

_HEADING = re.compile(r"%\s*\S+\s+G7[01]\s*\*")
_BLANK = frozenset((30.0, 31.0))
_REFUSED_CYCLES = {28.0: "a mirror", 54.0: "a shift of the coordinates"}


def begins_tnc_program(line: str) -> bool:
    """Return whether a first line is that of such a program.

    Example:
        >>> begins_tnc_program("%PART G71 *"), begins_tnc_program("%100")
        (True, False)
    """
    return _HEADING.match(line) is not None


def is_blank(g: Sequence[float]) -> bool:
    """Return whether a line's G-words make it a corner of the blank.

    Raises:
        ValueError: If they mean what others take for words without effect, or increments: those are of
            centres as well, which otherwise are places.
    """
    if not _BLANK.isdisjoint(g):
        return True
    for value, name in _REFUSED_CYCLES.items():
        if value in g:
            raise ValueError(f"expected no G{value:g}, got {name}: take it out in the CAM system")
    if 91.0 in g:
        raise ValueError("expected G90, got G91, increments of places and centres: write places")
    return False

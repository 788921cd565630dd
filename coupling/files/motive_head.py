"""Titles of the columns that OptiTrack's Motive exports, whose head has them in several lines."""

from __future__ import annotations

from collections.abc import Sequence

# Beginning of the first line, and the word for the bodies that are solved from their markers.
_FIRST, _BODY = "Format Version", "Rigid Body"
# Columns before those of bodies and markers: number of the frame and time.
_CLOCK = 2


def is_motive(line: str) -> bool:
    """Return whether a file's first line is that of such an export."""
    return line.startswith(_FIRST)


def motive_titles(head: Sequence[Sequence[str]], count: int) -> list[str]:
    """Return the titles of columns, with units in brackets.

    The position of a body, or of a marker where there is no body, is called position; the quaternion of
    the only body qx to qw.

    Args:
        head: Cells of the lines above the numbers, the last of which has the axes.
        count: Number of columns.

    Example:
        >>> head = [["Format Version", "1.23", "Length Units", "Millimeters"], ["", "Type", "Marker"],
        ...         ["", "Name", "Tip"], ["", "", "Position"], ["Frame", "Time (Seconds)", "X"]]
        >>> motive_titles(head, 3)
        ['Frame', 'Time (Seconds)', 'Tip position X [Millimeters]']
    """
    first, *lines = ([*line, *[""] * (count - len(line))] for line in head)
    facts = dict(zip(first[::2], first[1::2], strict=False))
    rows = {line[1]: line for line in lines if not line[0]}
    kinds, names, measured = (rows.get(key, [""] * count) for key in ("Type", "Name", ""))
    bodies = {name for kind, name in zip(kinds, names, strict=True) if kind == _BODY}
    turn = "1" if facts.get("Rotation Type") == "Quaternion" else "deg"
    titles = list(lines[-1][:_CLOCK])
    for k in range(_CLOCK, count):
        axis = lines[-1][k]
        if measured[k] == "Position":
            named = names[k] if bodies and kinds[k] != _BODY else f"{names[k]} position"
            titles.append(f"{named} {axis} [{facts.get('Length Units', '')}]")
        elif measured[k] == "Rotation":
            is_alone = turn == "1" and kinds[k] == _BODY and len(bodies) == 1
            named = f"q{axis.lower()}" if is_alone else f"{names[k]} rotation {axis}"
            titles.append(f"{named} [{turn}]")
        else:
            titles.append(f"{names[k]} {measured[k]} {axis}")
    return titles

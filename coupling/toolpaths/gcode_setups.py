"""Tools and offsets that a G-code program changes on the way: its moves are not those of one tool."""

from __future__ import annotations

from coupling.toolpaths.gcode_words import Block

_TOOL_CHANGE, _END_OF_SUBPROGRAM = 6.0, 17.0
# A printer's words to store a place and to return there; of mills they are modes.
_STORED_PLACES = (60.0, 61.0)
# Words of printers alone: heaters, fans, and how filament is counted.
_OF_PRINTERS = frozenset((82.0, 83.0, 104.0, 106.0, 107.0, 109.0, 140.0, 190.0, 486.0))
_MOST_OFFSETS = 48  # of FADAL's controls


class Setups:
    """The tool in the spindle while a program is read, and words E: a printer's, or FADAL's offsets."""

    def __init__(self) -> None:
        self._selected, self._mounted, self._change_line = "", "tool", 0
        # The tool of the cuts so far.
        self._cutting: str | None = None
        self._is_printer = False
        self._offsets: dict[float, int] = {}

    def take(self, block: Block, has_moved: bool) -> str:
        """Take the words of a line; return what ended the program before its last line, or nothing.

        Args:
            block: The line.
            has_moved: Whether the tool has moved in the part.

        Raises:
            ValueError: If it is a printer's return to a place that it stored.
        """
        self._selected = block.tool or self._selected
        if _TOOL_CHANGE in block.m:
            self._change_line = block.line
            # Without a name it is another one each time.
            self._mounted = (
                f"tool {self._selected}" if self._selected else f"another tool in line {block.line}"
            )
        self._is_printer = self._is_printer or not _OF_PRINTERS.isdisjoint(block.m)
        if (number := block.values.get("E")) is not None and 187.0 not in block.g:
            if number.is_integer() and 0 <= number <= _MOST_OFFSETS:
                self._offsets.setdefault(number, block.line)
            else:
                self._is_printer = True
        for value in _STORED_PLACES:
            if value in block.g and (self._is_printer or self._offsets):
                raise ValueError(
                    f"expected no G{value:g} of a printer, got a place that it stores or returns to:"
                    " write the place"
                )
        is_end = _END_OF_SUBPROGRAM in block.m and not (self._is_printer or self._offsets)
        return "M17, the end of a sub-program," if is_end and has_moved else ""

    def require_single_tool(self) -> None:
        """Take a cut, and refuse one by another tool than those before.

        Raises:
            ValueError: If the tool was changed behind some.
        """
        self._cutting = self._cutting or self._mounted
        if self._cutting != self._mounted:
            change = self._mounted.partition(" in line")[0]
            raise ValueError(
                f"expected one tool for all moves, got a cut behind the change to {change} in line"
                f" {self._change_line}: give each tool its own file"
            )

    def require_single_offset(self) -> None:
        """Refuse words E that select several offsets.

        Raises:
            ValueError: If there are, with the line of the second.
        """
        if len(self._offsets) > 1 and not self._is_printer:
            (first, _), (second, line), *_ = self._offsets.items()
            raise ValueError(
                f"line {line}: expected one offset, got E{second:g} behind E{first:g}, which select"
                " offsets of FADAL's controls: give each its own file, or M83 if it is a printer's"
            )

"""Numbers that another page tells, read from the tables that its own runs have written."""

from __future__ import annotations

import re
from dataclasses import dataclass

from docs.scripts import page

_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class PageTable:
    """A table between the marks of a part of a page.

    Attributes:
        where: Page and part, for messages.
        lines: Its cells, the head's first.
    """

    where: str
    lines: tuple[tuple[str, ...], ...]

    @classmethod
    def of(cls, name: str, part: str) -> PageTable:
        """Read the first table of a part of docs/<name>.md.

        Raises:
            ValueError: If there is none.
        """
        where = f"docs/{name}.md, part {part!r}"
        text = (page.DOCS / f"{name}.md").read_text(encoding="utf-8")
        found = re.search(f"<!-- {part} -->\n(.*?)<!-- end of {part} -->", text, re.DOTALL)
        first = re.search(r"(?:^\|.*\|\n)+", found[1] if found else "", re.MULTILINE)
        if first is None:
            raise ValueError(f"{where}: expected a table, got none")
        head, _, *rows = first[0].splitlines()
        cells = (line.strip("|").split("|") for line in (head, *rows))
        return cls(where, tuple(tuple(cell.strip(" *") for cell in line) for line in cells))

    def cell(self, row: str, column: str) -> str:
        """Return a cell by how its row's first cell begins and by its column's head.

        Raises:
            ValueError: If row or column is not there.
        """
        head, *rows = self.lines
        line = next((cells for cells in rows if cells[0].startswith(row)), None)
        if line is None:
            names = ", ".join(cells[0] for cells in rows)
            raise ValueError(f"{self.where}: expected a row {row!r}, got {names}")
        if column not in head:
            raise ValueError(f"{self.where}: expected a column {column!r}, got {', '.join(head)}")
        return line[head.index(column)]

    def number(self, row: str, column: str) -> float:
        """Return the first number of a cell.

        Raises:
            ValueError: If row or column is not there, or its cell without a number.
        """
        cell = self.cell(row, column)
        found = _NUMBER.search(cell)
        if found is None:
            raise ValueError(
                f"{self.where}: expected a number in {row!r}, {column!r}, got {cell!r}"
            )
        return float(found[0])

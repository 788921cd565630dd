"""Pages that are written by runs: a template filled, or parts between marks, with tables."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from docs.scripts.pictures import NoBrowserError

DOCS = Path(__file__).parents[1]


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a Markdown table, without a line's end after its last line."""
    lines = [_line(head), *(_line(row) for row in rows)]
    return "\n".join([lines[0], "|" + "---|" * len(tuple(head)), *lines[1:]])


def _line(cells: Iterable[str]) -> str:
    return "|" + "".join(f" {cell} |" if cell else " |" for cell in cells)


def fill(page: str, **values: object) -> None:
    """Write docs/<page>.md: its template with these values in it."""
    template = (DOCS / "scripts" / f"{page}.md.in").read_text(encoding="utf-8")
    _write(DOCS / f"{page}.md", template.format(**values))


def replace(page: str, part: str, text: str) -> None:
    """Replace what stands between the two marks of a part of docs/<page>.md, nothing at first."""
    file = DOCS / f"{page}.md"
    marked = re.compile(f"(?<=<!-- {part} -->\n)(.*\n)?(?=<!-- end of {part} -->)", re.DOTALL)
    old = file.read_text(encoding="utf-8")
    assert marked.search(old), f"{file}: expected a pair of marks of {part!r}, got none"
    _write(file, marked.sub(lambda _: f"{text}\n", old, count=1))


def replace_parts(page: str, parts: Mapping[str, Callable[[], str]], names: Sequence[str]) -> None:
    """Make parts of docs/<page>.md anew, all of them unless some are named."""
    unknown = [name for name in names if name not in parts]
    if unknown:
        sys.exit(f"expected parts out of {', '.join(parts)}, got {', '.join(unknown)}")
    for name in names or parts:
        replace(page, name, parts[name]())


def _write(file: Path, text: str) -> None:
    file.write_text(text, encoding="utf-8")
    print(f"{file}: written")


def finish(write: Callable[[], None]) -> int:
    """Write a page, and return the exit status."""
    try:
        write()
    except NoBrowserError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0

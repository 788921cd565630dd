"""Sections on the terminal: sentences in lines as long as they are, tables in columns."""

from __future__ import annotations

from collections.abc import Iterable

from rich import table
from rich.console import Console
from rich.text import Text

from coupling.results.section import Note, Section, Table


def print_sections(console: Console, sections: Iterable[Section]) -> None:
    """Print sections; notes are for pages."""
    for section in sections:
        if section.title:
            console.print(Text(f"\n{section.title}"), style="bold")
        for part in section.parts:
            match part:
                case str():
                    console.print(Text(part), style="yellow" if section.good is False else None)
                case Table():
                    console.print(_columns(part))
                case Note():
                    pass


def _columns(content: Table) -> table.Table:
    shown = table.Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    above = [part for name, count in content.groups for part in (name, *[""] * (count - 1))]
    for k, name in enumerate(content.columns):
        words = k == 0 or content.kind == "words" or not name
        head = f"{above[k]}\n{name}" if above else name
        shown.add_column(Text(head), justify="left" if words else "right")
    for row in content.rows:
        shown.add_row(*map(Text, row))
    return shown

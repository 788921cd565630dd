"""Sections on the terminal: sentences in lines as long as they are, tables in columns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich import table
from rich.console import Console
from rich.text import Text

from coupling.report.result_report import ResultReport
from coupling.results.section import Answer, Card, Note, Part, Section, Table

# Warnings and remarks that are printed beside a first screen.
_WARNINGS = 3
_COLOURS = {True: "green", False: "yellow", None: None}


def _print_answer(console: Console, answer: Answer) -> None:
    """Print a first screen: a line each for verdict, reason, figures and what to do next."""
    console.print(Text(answer.sentence), style=_COLOURS[answer.good])
    if answer.reason:
        console.print(Text(answer.reason))
    figures = "; ".join(f"{figure.label}: {figure.value}" for figure in answer.figures)
    console.print(Text(f"{figures}."))
    for step in answer.steps:
        console.print(Text(f"  {step.words} {step.command}".rstrip()))


def print_report(console: Console, report: ResultReport, is_verbose: bool) -> None:
    """Print what is told of a result, in the order of its page: at most fifteen lines unless verbose.

    Args:
        console: Console to print on.
        report: First screen, sections and warnings.
        is_verbose: Whether all is printed that the page says in words and tables.
    """
    _print_answer(console, report.answer)
    if is_verbose:
        print_sections(console, report.content)
    else:
        _print_warnings(console, [part for section in report.warnings for part in section.parts])


def _print_warnings(console: Console, texts: Sequence[Part]) -> None:
    """Print the first of warnings and remarks, and how many more there are."""
    for text in texts[:_WARNINGS]:
        console.print(Text(str(text)), style="yellow")
    if len(texts) > _WARNINGS:
        console.print(
            f"Warnings and remarks beside these: {len(texts) - _WARNINGS}; see the page, or -v"
        )


def print_sections(console: Console, sections: Iterable[Section]) -> None:
    """Print sections; notes, cards and pictures are for pages."""
    for section in sections:
        if section.title and not all(isinstance(part, Note | Card) for part in section.parts):
            console.print(Text(f"\n{section.title}"), style="bold")
        for part in section.parts:
            match part:
                case str():
                    console.print(Text(part), style="yellow" if section.good is False else None)
                case Table():
                    console.print(_columns(part))
                case Note() | Card():
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

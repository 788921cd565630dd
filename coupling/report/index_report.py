"""All results in a folder on one page: a picture and a verdict each."""

from __future__ import annotations

import html
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from coupling.errors import CouplingError, ResultError
from coupling.files.atomic_folder import UNFINISHED
from coupling.files.written_files import REPORT
from coupling.report.document import document
from coupling.report.report_file import name_path, write_page
from coupling.report.result_report import ResultReport
from coupling.report.stored_result import figures_file, read_result, report_of
from coupling.results.section import Answer, Card, KeyFigure, NextStep, Note, Section
from coupling.run.stored_run import StoredRun

INDEX = "index.html"
# Folders in each other that are looked into.
_DEPTH = 3
# Runs that are overlaid at most.
_OVERLAID = 4
# How a page begins that a command has written, within so many characters.
_MARK, _HEAD = '<meta name="generator" content="elastic-robot">', 2000
_GOES_ON = "a command is at work there, or was stopped; given again, it goes on from what is kept."


@dataclass(frozen=True)
class IndexedResult:
    """A result in a folder.

    Attributes:
        folder: Its folder.
        changed: Time of the last change [s since 1970].
        report: First screen and sections; None where it cannot be read.
        picture: Picture as SVG; empty for none.
        is_run: Whether it is a run, which can be compared with others.
        trouble: Reason why it cannot be read.
    """

    folder: Path
    changed: float
    report: ResultReport | None = None
    picture: str = ""
    is_run: bool = False
    trouble: str = ""


def write_index(folder: Path, file: Path | None = None) -> Path:
    """Write the page of all results in a folder.

    Args:
        file: File to write; index.html in the folder unless given.

    Returns:
        The file.

    Raises:
        ResultError: If no result is in it, or the page cannot be written.
    """
    entries = entries_of(folder)
    if not entries:
        raise ResultError(
            f"{folder}: expected a result or a folder of results, got none: name a run folder, a study,"
            " a placement, or the folder that they are in"
        )
    target = file or folder / INDEX
    write_page(target, index_page(folder.resolve().name, entries, target.parent), ResultError)
    return target


def entries_of(folder: Path) -> list[IndexedResult]:
    """Return the results in a folder and in folders of it: the last changed first, damaged ones last."""
    return sorted(
        _entries(folder, _DEPTH), key=lambda entry: (entry.report is None, -entry.changed)
    )


def _entries(folder: Path, depth: int) -> Iterator[IndexedResult]:
    places = sorted(place for place in folder.iterdir() if place.is_dir())
    for place in places:
        if place.name.endswith(UNFINISHED) or place.is_symlink():
            continue
        if (figures := figures_file(place)) is not None:
            yield _entry(place, figures)
        elif depth > 1:
            yield from _entries(place, depth - 1)


def _entry(place: Path, figures: Path) -> IndexedResult:
    changed = figures.stat().st_mtime
    try:
        result = read_result(place)
        report = report_of(result)
        return IndexedResult(
            place, changed, report, report.thumbnail, isinstance(result, StoredRun)
        )
    except CouplingError as error:
        return IndexedResult(place, changed, trouble=str(error))


def index_answer(folder: str, entries: Sequence[IndexedResult]) -> Answer:
    """Return the first screen of all results in a folder."""
    verdicts = [None if entry.report is None else entry.report.answer.good for entry in entries]
    good, bad = verdicts.count(True), verdicts.count(False)
    steps = [NextStep("Open the page of a result below.")]
    if last := _last_runs(entries):
        compare = ("compare", *(name_path(entry.folder) for entry in last))
        steps.append(NextStep.by("Overlay runs of one case, here its last ones:", *compare))
    return Answer(
        sentence=f"{good} of {len(entries)} results in {folder} are good enough.",
        good=(bad == 0 and good == len(entries)) or (None if bad == 0 else False),
        figures=(
            KeyFigure("Good", str(good), "within the tolerance, or without chatter"),
            KeyFigure("Not good", str(bad), "not within it, not finished, or worse than nothing"),
            KeyFigure("Open", str(len(entries) - good - bad), "no tolerance is stated, or damaged"),
        ),
        steps=steps,
    )


def _last_runs(entries: Sequence[IndexedResult]) -> list[IndexedResult]:
    """Return the last runs of the case that was run last, of those that were run twice."""
    runs: dict[tuple[str, str], list[IndexedResult]] = {}
    for entry in entries:
        if entry.is_run and entry.report is not None:
            runs.setdefault((entry.report.case, entry.report.kind), []).append(entry)
    return next((alike[_OVERLAID - 1 :: -1] for alike in runs.values() if len(alike) > 1), [])


def index_page(folder: str, entries: Sequence[IndexedResult], beside: Path) -> str:
    """Return the page as one self-contained HTML text.

    Args:
        folder: Name of the folder.
        beside: Folder of the page, from which links lead.
    """
    cards = [
        Card(
            title=_title(entry),
            target=_link(entry.folder / REPORT, beside),
            answer=entry.report.answer
            if entry.report
            else Answer(f"Cannot be read: {entry.trouble}"),
            picture=entry.picture,
        )
        for entry in entries
    ]
    sections = [Section("", cards)]
    if links := [Note(title, _link(page, beside)) for title, page in _other_pages(beside, _DEPTH)]:
        sections.append(Section("Other pages", links))
    if names := [str(place.relative_to(beside)) for place in beside.glob(f"*{UNFINISHED}")]:
        sections.append(Section("Not finished", [f"{', '.join(sorted(names))}: {_GOES_ON}"]))
    return document(folder, sections, index_answer(folder, entries))


def _title(entry: IndexedResult) -> str:
    """Return folder, case and command of a result; the case once where the folder is called like it."""
    place, report = name_path(entry.folder), entry.report
    if report is None:
        return f"{place}: damaged"
    case = "" if report.case == entry.folder.name else f"{report.case}, "
    return f"{place}: {case}{report.kind}"


def _other_pages(folder: Path, depth: int) -> Iterator[tuple[str, Path]]:
    """Yield title and file of pages of commands that write no folder, such as identify and check."""
    for place in sorted(folder.iterdir()):
        if place.is_dir() and not place.is_symlink() and depth > 1:
            yield from _other_pages(place, depth - 1)
        elif place.suffix == ".html" and place.name not in (REPORT, INDEX) and place.is_file():
            with suppress(OSError), place.open(encoding="utf-8", errors="replace") as stream:
                head = stream.read(_HEAD)
                title = re.search("<title>(.*?)</title>", head, re.DOTALL)
                if _MARK in head and title is not None:
                    yield html.unescape(title[1]), place


def _link(page: Path, beside: Path) -> str:
    """Return where a page is from a folder, as a link; empty where it is not there."""
    return quote(Path(os.path.relpath(page, beside)).as_posix()) if page.is_file() else ""

"""Content of reports, written once: sections of plain text, which terminal and page show."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from coupling.results.base import Shown
from coupling.results.scene import Scene

if TYPE_CHECKING:  # heavy, and only pages draw
    import plotly.graph_objects as go


# Micrometres of a metre, in which lengths are shown.
UM = 1e6

# Language in which a robot's controller is programmed, by what the robot's name begins with.  A UR takes
# the angles of its joints on its controller's cycle; the robot of no maker is shown KUKA's.
_LANGUAGES = {"abb": "rapid", "irb": "rapid", "fanuc": "fanuc", "ur": "csv"}


@dataclass(frozen=True)
class Note:
    """Paragraph for pages alone: how to read what is shown, or what else there is.

    Attributes:
        target: Page that it leads to; empty for none.
        as_it_stands: Whether it is the text of a file, line by line.
    """

    text: str
    target: str = ""
    as_it_stands: bool = False


@dataclass(frozen=True)
class Table:
    """Rows below a header.

    Attributes:
        kind: "words" for a table of text, whose columns begin at the left; "dense" for one that is
            to be seen whole on a narrow screen.
        groups: Cells above the header, each over so many columns.
    """

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    kind: str = ""
    groups: Sequence[tuple[str, int]] = ()


@dataclass(frozen=True)
class NextStep:
    """What to do next."""

    words: str
    command: str = ""

    @classmethod
    def by(cls, purpose: str, *words: str) -> NextStep:
        """Return a step that a command of elastic-robot takes.

        Example:
            >>> NextStep.by("Draw it anew:", "report", "results/my cone").command
            "elastic-robot report 'results/my cone'"
        """
        return cls(purpose, shlex.join(["elastic-robot", *words]))

    @classmethod
    def export(cls, purpose: str, run: str, robot: str) -> NextStep:
        """Return the step that writes a run's command as a program of its robot, by the robot's name.

        Example:
            >>> NextStep.export("Write the robot program:", "results/cone", "fanuc-r2000ic").command
            'elastic-robot export results/cone --to fanuc'
        """
        makers = (maker for maker in _LANGUAGES if robot.lower().startswith(maker))
        language = _LANGUAGES.get(next(makers, ""), "krl")
        return cls.by(purpose, "export", run, "--to", language)


@dataclass(frozen=True)
class KeyFigure:
    """One of the few figures that answer a question."""

    label: str
    value: str
    note: str = ""


@dataclass(frozen=True)
class Answer(Shown):
    """First screen of a result: what to expect, whether that is good enough, and what to do now.

    Attributes:
        sentence: Expectation for the real robot, beside what is allowed.
        good: Whether it is good enough; None where nothing says so.
        scene: Picture in space; None where nothing moves.
        picture: Picture as SVG, above that in space; empty for none.
    """

    sentence: str
    reason: str = ""
    good: bool | None = None
    figures: Sequence[KeyFigure] = ()
    steps: Sequence[NextStep] = ()
    scene: Scene | None = None
    picture: str = ""


@dataclass(frozen=True)
class Card:
    """A result among others, for pages: its picture, its verdict and its figures.

    Attributes:
        target: Page that it leads to; empty for none.
        picture: Picture as SVG; empty for none.
    """

    title: str
    target: str
    answer: Answer
    picture: str = ""


Part = str | Table | Note | Card


@dataclass(frozen=True)
class Section:
    """Part of the report of a result.

    Attributes:
        name: Name of its figures in a page.
        figures: Figures that a page draws below, side by side.
        good: Whether it is good news; None for what judges nothing.
        scene: Picture in space that a page shows above its figures.
    """

    title: str
    parts: Sequence[Part]
    name: str = ""
    figures: Sequence[go.Figure] = ()
    good: bool | None = None
    scene: Scene | None = None


def warned(warnings: Iterable[str], remarks: Iterable[str] = ()) -> list[Section]:
    """Return the sections of warnings and of remarks; none where there are none."""
    sections = [
        Section("", [f"Warning: {text}" for text in warnings], good=False),
        Section("", [f"Remark: {text}" for text in remarks]),
    ]
    return [section for section in sections if section.parts]

"""What is told of a result: the same on the terminal, on its page, in an index and in a notebook."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from coupling.errors import ResultError
from coupling.files.written_files import REPORT
from coupling.report.document import document
from coupling.report.report_file import write_page
from coupling.report.static_scene import stills
from coupling.results.scene import Scene
from coupling.results.section import Answer, Section

# Pieces of a path in the picture of an index.
_PIECES = 500


def _nothing_in_space() -> Scene | None:
    return None


@dataclass(frozen=True)
class ResultReport:
    """First screen and sections of a result; what takes long to draw is made when it is asked for.

    Attributes:
        kind: Command that made the result.
        case: Name of its case.
        answer: First screen, without what is seen in space where that is in `scene`.
        sections: Function that returns the sections of the page, whose text the terminal has with `-v`.
        warnings: Sections that stand below the first screen.
        scene: Function that returns what is seen in space.
        outline: Function that returns what of it an index shows.
        parts: Reports of its parts by their folders in the result's.
    """

    kind: str
    case: str
    answer: Answer
    sections: Callable[[], Sequence[Section]]
    warnings: Sequence[Section] = ()
    scene: Callable[[], Scene | None] = _nothing_in_space
    outline: Callable[[], Scene | None] = _nothing_in_space
    parts: Mapping[str, ResultReport] = field(default_factory=dict)

    @property
    def first_screen(self) -> Answer:
        """The first screen with what is seen in space."""
        return replace(self.answer, scene=self.answer.scene or self.scene())

    @property
    def thumbnail(self) -> str:
        """Its picture in an index, SVG; empty for none."""
        scene = self.outline() or self.answer.scene
        return self.answer.picture if scene is None else next(iter(stills(scene, _PIECES)), "")

    @cached_property
    def content(self) -> Sequence[Section]:
        """What stands below the first screen: warnings and sections."""
        return [*self.warnings, *self.sections()]

    @property
    def page(self) -> str:
        """Its page as one self-contained HTML text."""
        return document(f"{self.case}: {self.kind}", self.content, self.first_screen)

    def before(self, other: ResultReport) -> ResultReport:
        """Return it with what else the terminal says of another result behind it."""
        return replace(
            self,
            sections=lambda: [*self.sections(), *other.sections()],
            warnings=[*self.warnings, *other.warnings],
        )

    def write(self, folder: Path, file: Path | None = None) -> Path:
        """Write its page, and those of its parts; return the file.

        Args:
            folder: Folder of the result.
            file: File to write; report.html in the folder unless given.

        Raises:
            ResultError: If a page cannot be written.
        """
        for name, part in self.parts.items():
            part.write(folder / name)
        target = file or folder / REPORT
        write_page(target, self.page, ResultError)
        return target

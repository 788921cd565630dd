"""The source of the site: the pages that are written, those that are generated, and what they link to.

Pages link to each other, and to files of the project, as they do on a code host.  Here pages from
elsewhere come into one folder, and files that are linked into `files/`; links follow them.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from docs.scripts.page import DOCS
from docs.site.generated import PAGES, python_pages

_ROOT = DOCS.parent
_LINK = re.compile(r"(?<=\]\()(?![a-z]+:)([^)\s#]+)(?=[)#])")
_SECTION = re.compile(r"^\*\*(.+)\*\*$")
_ENTRY = re.compile(r"^- \[[^\]]*\]\((\w+\.md)\)")


@dataclass
class Source:
    """Pages that are put together in a folder.

    Attributes:
        folder: Where they are put.
        pages: Pages on their way there: files of the project, and their places in it.
    """

    folder: Path
    pages: dict[Path, str] = field(default_factory=dict)

    def write(self, place: str, text: str, page: Path) -> None:
        """Write a page with its links, which are those of a page of the project."""
        target = self.folder / place
        target.parent.mkdir(parents=True, exist_ok=True)

        def follow(link: re.Match[str]) -> str:
            linked = Path(os.path.normpath(page.parent / link[1]))
            if not linked.is_file():
                return link[1]
            there = PurePosixPath(self._place(linked))
            return os.path.relpath(there, PurePosixPath(place).parent).replace(os.sep, "/")

        target.write_text(_LINK.sub(follow, text), encoding="utf-8")

    def _place(self, linked: Path) -> str:
        """Return where a file of the project is, which is put there unless it is a page."""
        if linked in self.pages:
            return self.pages[linked]
        name = linked.relative_to(_ROOT).as_posix()
        place = name if linked.suffix == ".md" else f"files/{name}"
        self.pages[linked] = place
        if linked.suffix == ".md":
            self.write(place, f"---\norphan: true\n---\n{linked.read_text('utf-8')}", linked)
        else:
            (self.folder / place).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(linked, self.folder / place)
        return place


def sections(index: str) -> dict[str, list[str]]:
    """Return the pages that the index lists, by the section in which it does."""
    found: dict[str, list[str]] = {}
    for line in index.splitlines():
        if begun := _SECTION.match(line):
            found[begun[1]] = []
        elif entry := _ENTRY.match(line):
            found[list(found)[-1]].append(entry[1])
    return found


def write_source(folder: Path, python: bool = True) -> None:
    """Write the source of the site.

    Args:
        folder: Where, which is replaced.
        python: With the pages of the Python modules, which take the most time.
    """
    shutil.rmtree(folder, ignore_errors=True)
    source = Source(folder, {page: page.name for page in DOCS.glob("*.md")})
    about = {_ROOT / "CHANGELOG.md": "changelog.md", _ROOT / "CONTRIBUTING.md": "contributing.md"}
    source.pages |= about
    made = {place: text() for pages in PAGES.values() for place, text in pages.items()}
    modules = python_pages() if python else {}
    for page, place in list(source.pages.items()):
        text = page.read_text(encoding="utf-8")
        if place == "index.md":
            text = _index(text, list(modules), list(about.values()))
        source.write(place, text, page)
    for place, text in made.items():
        source.write(place, text, DOCS / place)
    for place, text in modules.items():
        (folder / place).parent.mkdir(exist_ok=True)
        (folder / place).write_text(text, encoding="utf-8")
    shutil.copytree(DOCS / "figures", folder / "figures", dirs_exist_ok=True)


def _index(text: str, modules: Sequence[str], about: Sequence[str]) -> str:
    """Return the index with the site's sections, those of the page and of what is generated."""
    listed: Mapping[str, list[str]] = sections(text)
    every = {name: [*listed.get(name, []), *PAGES.get(name, ())] for name in [*listed, *PAGES]}
    every |= {"Python": [*modules], "Project": [*about]}
    trees = [
        "\n".join(["```{toctree}", ":hidden:", f":caption: {name}", "", *pages, "```"])
        for name, pages in every.items()
        if pages
    ]
    return "\n\n".join([text, *trees])

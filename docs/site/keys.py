"""Pages with every key of case and robot files: types from the schemas, meaning from the pages.

The meaning of a key stands once, in a row of a table of docs/case_file.md, robot_file.md, export.md,
place.md, milling.md or study.md.  A key without one is an error, so that neither can go without the
other.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

from pydantic.fields import FieldInfo

from coupling.case.file import CaseFile
from coupling.files.robot_schema import RobotFile, UrdfRobotFile
from coupling.files.toml_file import Schema
from coupling.process import PROCESSES
from coupling.solve import METHODS
from coupling.toolpaths import TOOL_PATHS
from docs.scripts.page import DOCS, table
from docs.site.key_types import default_text, type_text

# Tables of a case whose keys depend on one of them, by its value.
_VARIANTS: dict[str, tuple[str, Mapping[str, type[Schema]]]] = {
    "tool_path": ("kind", TOOL_PATHS),
    "process": ("model", PROCESSES),
    "compensation": ("method", METHODS),
}


@dataclass(frozen=True)
class Row:
    """A row of a page's table of keys.

    Attributes:
        table: Name of the table, "" for the top of the file.
        variants: For which kinds of it, such as "cone, pyramid" or "all but csv"; "" for all.
        keys: Names of the keys.
        meaning: What they mean, in Markdown.
        default: Their defaults, in words.
    """

    table: str
    variants: str
    keys: tuple[str, ...]
    meaning: str
    default: str

    def says(self, table: str, variant: str, key: str) -> bool:
        """Return whether it tells of a key of a table, of one of its variants."""
        but = self.variants.removeprefix("all but ")
        fits = variant != but if but != self.variants else variant in self.variants.split(", ")
        return self.table == table and key in self.keys and (self.variants in ("", "all") or fits)

    def default_of(self, key: str) -> str:
        """Return what it says of the default of one of its keys."""
        parts = self.default.split(", ")
        return parts[self.keys.index(key)] if len(parts) == len(self.keys) else self.default


@dataclass(frozen=True)
class Section:
    """Keys of a file that stand together.

    Attributes:
        title: Heading.
        schema: The keys.
        told: Each of them with the row that tells of it.
    """

    title: str
    schema: type[Schema]
    told: dict[str, Row]


def rows(page: str) -> list[list[Row]]:
    """Return the rows of every table of keys in docs/<page>.md, table by table."""
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8").replace("](#", f"]({page}.md#")
    tables = re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)
    found = [list(_rows([_cells(line) for line in lines.splitlines()])) for lines in tables]
    return [keys for keys in found if keys]


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def _rows(lines: Sequence[Sequence[str]]) -> Iterator[Row]:
    head, _, *body = lines
    column = next((k for k, cell in enumerate(head) if re.match(r"key\b", cell)), None)
    if column is None:
        return
    named, variants = re.search(r"\[([\w.]+)\]", head[column]), ""
    name = named[1] if named else ""
    for cells in body:
        label = cells[0] if column else ""
        if begun := re.search(r"\[([\w.]+)\]", label):
            name, variants = begun[1], ""
        elif label:
            variants = label
        if keys := tuple(re.findall(r"`(\w+)`", cells[column])):
            yield Row(name, variants, keys, cells[column + 1], cells[-1])


def _schemas_in(annotation: Any) -> list[type[Schema]]:
    """Return the schema inside list[Schema], Schema | None and the like, if there is one."""
    if isinstance(annotation, type) and issubclass(annotation, Schema):
        return [annotation]
    return [schema for part in get_args(annotation) for schema in _schemas_in(part)]


class _Reader:
    """Finds the rows of a file's keys; raises ValueError where there is none."""

    def __init__(self, page: str, told: Iterable[Row]) -> None:
        self.page = page
        self.told = list(told)

    def row(self, table: str, variant: str, key: str) -> Row | None:
        # The second robot of a plant is described as the first.
        tables = (table, "plant") if table == "plant.support" else (table,)
        every = (row for name in tables for row in self.told if row.says(name, variant, key))
        return next(every, None)

    def sections(self, schema: type[Schema], table: str, variant: str = "") -> Iterator[Section]:
        """Yield a table's keys, and then the tables inside it."""
        told: dict[str, Row] = {}
        inner: list[tuple[str, FieldInfo]] = []
        for key, field in schema.model_fields.items():
            if row := self.row(table, variant, key):
                told[key] = row
            elif _schemas_in(field.annotation) or key in _VARIANTS or key == "sources":
                inner.append((key, field))
            else:
                raise ValueError(
                    f"docs/{self.page}.md: expected a row for the key {key!r} of"
                    f" [{table}] {variant}, got none"
                )
        if told:
            yield Section(_title(table, variant), schema, told)
        for key, field in inner:
            name = f"{table}.{key}" if table else key
            if key in _VARIANTS:
                for kind, keys in _VARIANTS[key][1].items():
                    yield from self.sections(keys, name, kind)
            for within in _schemas_in(field.annotation):
                yield from self.sections(within, name)


def _title(table: str, variant: str) -> str:
    if not table:
        return "Top of the file"
    if variant:
        return f'`[{table}]`, {_VARIANTS[table][0]} = "{variant}"'
    return f"`[[{table}]]`" if table == "joint" else f"`[{table}]`"


def case_rows() -> list[Row]:
    """Return what the pages tell of the keys of a case."""
    pages = ("case_file", "place", "study", "milling")
    return [row for page in pages for part in rows(page) for row in part]


def case_sections() -> list[Section]:
    """Return all keys of a case file."""
    return list(_Reader("case_file", case_rows()).sections(CaseFile, ""))


def robot_sections() -> tuple[list[Section], list[Section]]:
    """Return all keys of a robot file, and of one on top of a URDF, which says what is different."""
    *parts, urdf = rows("robot_file")
    whole = [row for part in (*parts, *rows("export")) for row in part]
    both = _Reader("robot_file", [*urdf, *whole])
    alone = _Reader("robot_file", whole)
    return list(alone.sections(RobotFile, "")), list(both.sections(UrdfRobotFile, ""))


def section_text(section: Section, level: str = "##") -> str:
    """Return a section of a page: a table with a row for each key."""
    whole = section.schema.model_json_schema()
    lines = [
        (
            f"`{key}`",
            type_text(whole["properties"][key], whole),
            default_text(section.schema.model_fields[key]) or row.default_of(key),
            row.meaning,
        )
        for key, row in section.told.items()
    ]
    return f"{level} {section.title}\n\n" + table(("key", "type", "default", "meaning"), lines)


def case_page() -> str:
    """Return the page of a case's keys."""
    return "\n\n".join(
        [
            "# All keys of a case file",
            "Types, ranges and defaults as they are checked, table by table.",
            *map(section_text, case_sections()),
        ]
    )


def robot_page() -> str:
    """Return the page of a robot file's keys."""
    alone, urdf = robot_sections()
    return "\n\n".join(
        [
            "# All keys of a robot file",
            "Types, ranges and defaults as they are checked, table by table;"
            " [`[sources]`](robot_file.md#shipped-robots-and-where-numbers-come-from) names places.",
            "## The whole robot",
            *(section_text(section, "###") for section in alone),
            "## On top of a URDF",
            *(section_text(section, "###") for section in urdf),
        ]
    )

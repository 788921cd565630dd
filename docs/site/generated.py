"""Pages of the site that nobody writes: keys, commands, variables, Python modules, the gallery."""

from __future__ import annotations

import ast
import pkgutil
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import typer
from typer.cli import get_docs_for_click

import coupling
import elastic_robot
from coupling.cli import app
from coupling.files.robot_file import load_robot, shipped_robots
from coupling.fmu_export.exchange_blocks import all_blocks
from coupling.fmu_export.grouping import scalars
from coupling.fmu_export.index_html import variable_rows
from coupling.run.usual_ranges import EXPECTED
from docs.scripts.page import DOCS, table
from docs.site.keys import case_page, robot_page

_ROOT = DOCS.parent
_PICTURE = re.compile(r"!\[([^\]]*)\]\((?:docs/)?(figures/[^)]+)\)")


def commands_page() -> str:
    """Return the page of the commands, from what `--help` says."""
    command = typer.main.get_command(app)
    context = typer.Context(command, info_name="elastic-robot")
    text = get_docs_for_click(obj=command, ctx=context, name="elastic-robot", title="The commands")
    return text.replace("```console\n$ ", "```\n")


def variables_page() -> str:
    """Return the page of the FMU's variables, those of the example robot."""
    described = all_blocks(load_robot(shipped_robots()["icme2008"]))
    lines = [
        tuple(_cell(f"`{cell}`" if k == 0 else cell) for k, cell in enumerate(row))
        for row in variable_rows(described, scalars(described))
    ]
    head = ("name", "causality", "variability", "unit", "start", "meaning")
    return "\n\n".join(
        [
            "# All variables of the FMU",
            "Those of the example robot `icme2008`; another robot's differ in number and start"
            " values. [The FMU](fmu.md) tells how they are used, and which are arrays in FMI 3.0.",
            table(head, lines),
        ]
    )


def _cell(text: str) -> str:
    return text.replace("|", r"\|")


def usual_ranges_page() -> str:
    """Return the page of the usual ranges of numbers in case and robot files."""
    rows = [
        (
            f"`{key}`",
            f"{usual.low:g} to {usual.high:g} {usual.unit}".rstrip() + ", or 0" * usual.or_none,
            _cell(usual.why),
        )
        for key, usual in EXPECTED.items()
    ]
    return "\n\n".join(
        [
            "# Usual ranges",
            "What [a remark](case_file.md#what-is-usual) of `check`, `robots`, a run and its report goes"
            " by, by the place of the key in a case or robot file; the last rows follow from several"
            " keys and from the response of the process.",
            table(("value", "usual", "for"), rows),
        ]
    )


def gallery_page() -> str:
    """Return the page of all pictures, each with the page that explains it, and of the examples."""
    found = dict(_pictures())
    lost = sorted(file.name for file in DOCS.glob("figures/*") if file.name not in found)
    if lost:
        raise ValueError(f"docs/figures: expected every picture on a page, got {', '.join(lost)}")
    return "\n\n".join(
        [
            "# Gallery",
            "Every picture is made by the script of its page: `make docs` runs all of them.",
            *found.values(),
            "## Examples",
            "Scripts that read from top to bottom; each runs as it stands.",
            *(f"- [`{file}`](../{file}): {_title(file)}" for file in _examples()),
        ]
    )


def _pictures() -> Iterator[tuple[str, str]]:
    for page in [_ROOT / "README.md", *sorted(DOCS.glob("*.md"))]:
        text = page.read_text(encoding="utf-8")
        place = page.name if page.parent == DOCS else "index.md"
        heading = re.search(r"^# (.+)$", text, re.MULTILINE)
        assert heading, f"{page}: expected a title, got none"
        for says, file in _PICTURE.findall(text):
            yield (
                Path(file).name,
                f"## {says}\n\n[![{says}]({file})]({place})\n\n[{heading[1]}]({place})",
            )


def _examples() -> Iterator[str]:
    for suffix in ("*.py", "cases/*.toml"):
        for file in sorted((_ROOT / "examples").glob(suffix)):
            yield file.relative_to(_ROOT).as_posix()


def _title(name: str) -> str:
    """Return the first sentence of a script's docstring, or of a case file's comment."""
    text = (_ROOT / name).read_text(encoding="utf-8")
    if name.endswith(".py"):
        said = ast.get_docstring(ast.parse(text)) or ""
    else:
        said = " ".join(line.strip("# ") for line in re.findall(r"\A(?:#.*\n)+", text))
    return re.split(r"(?<=[.:;])\s", " ".join(said.split()), maxsplit=1)[0].rstrip(":;")


def python_pages() -> dict[str, str]:
    """Return the pages of the Python packages, by name: every public module with its docstrings."""
    return {
        f"python/{name}.md": _package_page(name, modules)
        for package in (elastic_robot, coupling)
        for name, modules in _packages(package).items()
    }


def _packages(package: ModuleType) -> dict[str, list[str]]:
    """Return the public modules of a package and of those within it, by package."""
    found: dict[str, list[str]] = {package.__name__: []}
    for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        parent, _, last = info.name.rpartition(".")
        if last.startswith("_") or info.name.startswith("coupling.cli"):
            continue
        if info.ispkg:
            found[info.name] = []
        else:
            found[parent].append(info.name)
    return found


def _package_page(name: str, modules: list[str]) -> str:
    title = name if name.startswith("elastic_robot") else f"elastic_robot.{name}"
    parts = [f"# {title}", _automodule(name, members=False)]
    for module in modules:
        parts += [f"## {module.rpartition('.')[2]}", _automodule(module, members=True)]
    return "\n\n".join(parts)


def _automodule(name: str, members: bool) -> str:
    options = "\n   :members:\n   :member-order: bysource" if members else ""
    return f"```{{eval-rst}}\n.. automodule:: {name}{options}\n```"


# By section of the index, in the order in which they follow what is written there.
PAGES: dict[str, dict[str, Callable[[], str]]] = {
    "Reference": {
        "case_keys.md": case_page,
        "robot_keys.md": robot_page,
        "usual_ranges.md": usual_ranges_page,
        "variables.md": variables_page,
        "commands.md": commands_page,
    },
    "Gallery": {"gallery.md": gallery_page},
}

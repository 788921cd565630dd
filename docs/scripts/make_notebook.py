"""Write the notebooks of examples/ from pages, the tutorial and its like: make notebook."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

from docs.scripts.page import finish

_ROOT = Path(__file__).parents[2]
_BLOCK = re.compile(r"^```(?P<language>\w+)(?: (?P<file>\S+))?\n(?P<text>.*?)^```$", re.M | re.S)


def notebook(page: str) -> dict[str, Any]:
    """Return a page as a notebook: its commands for the shell, its files written by their cells."""
    cells, end = [], 0
    for number, block in enumerate(_BLOCK.finditer(page)):
        cells.append(_cell("markdown", f"text-{number}", page[end : block.start()].strip()))
        text = block["text"].rstrip("\n")
        if block["language"] == "python":
            source = text
        elif block["file"]:
            source = f"%%writefile {block['file']}\n{text}"
        else:
            source = "\n".join(f"!{line}" for line in text.splitlines())
        cells.append(_cell("code", f"code-{number}", source))
        end = block.end()
    cells.append(_cell("markdown", "text-end", page[end:].strip()))
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}


def _cell(kind: str, name: str, source: str) -> dict[str, Any]:
    # Links of the page are seen from its own folder.
    text = re.sub(r"\]\((?=\w+\.md)", "](../docs/", source) if kind == "markdown" else source
    text = text.replace("](../examples/", "](")
    cell = {"cell_type": kind, "id": name, "metadata": {}, "source": text.splitlines(keepends=True)}
    return cell if kind == "markdown" else {**cell, "execution_count": None, "outputs": []}


# Pages by the notebooks that they make.
SOURCES = {
    "tutorial": _ROOT / "docs" / "tutorial.md",
    **{
        name: Path(__file__).parent / "notebooks" / f"{name}.md"
        for name in ("identify", "next", "milling")
    },
}


def write() -> None:
    """Write the notebooks."""
    for name, page in SOURCES.items():
        book = notebook(page.read_text(encoding="utf-8"))
        file = _ROOT / "examples" / f"{name}.ipynb"
        file.write_text(json.dumps(book, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(finish(write))

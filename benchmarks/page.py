"""The tables of a run as Markdown, written between two marks of a page."""

from __future__ import annotations

import platform
from importlib.metadata import version
from pathlib import Path

from benchmarks.goals import default
from benchmarks.task import EARLY, Row

_BEGIN = "<!-- from here to the end mark: written by make performance -->"
_END = "<!-- end of the written part -->"


def write_tables(page: Path, tables: dict[str, list[Row]], end: float) -> None:
    """Replace what stands between the marks of a page.

    Raises:
        ValueError: If the page has no such marks.
    """
    text = page.read_text(encoding="utf-8")
    if text.count(_BEGIN) != 1 or text.count(_END) != 1:
        raise ValueError(
            f"{page}: expected the lines {_BEGIN!r} and {_END!r} once each, got"
            f" {text.count(_BEGIN)} and {text.count(_END)}"
        )
    before, rest = text.split(_BEGIN)
    after = rest.split(_END)[1]
    page.write_text(
        f"{before}{_BEGIN}\n\n{_markdown(tables, end)}\n{_END}{after}", encoding="utf-8"
    )


def _markdown(tables: dict[str, list[Row]], end: float) -> str:
    versions = ", ".join(f"{name} {version(name)}" for name in ("pin", "mujoco", "scipy", "numpy"))
    parts = [f"{platform.machine()}, Python {platform.python_version()}, {versions}.\n"]
    for curve, rows in tables.items():
        base = default(rows).spent
        parts.append(f"Torque curve `{curve}`:\n")
        parts.append(
            f"| solver | time [s] | TCP error, {end:g} s [m] | up to {EARLY:g} s [m] | time ratio |"
        )
        parts.append("|---|---|---|---|---|")
        parts += [
            f"| {row.name} | {row.spent:.2f} | {row.whole:.1e} | {row.early:.1e}"
            f" | {row.spent / base:.2f} |"
            for row in rows
        ]
        parts.append("")
    return "\n".join(parts)

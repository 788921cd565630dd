"""Licences of what an FMU has in it, and the icon."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path

ICON = Path(__file__).parent / "model.png"


def licenses(**distributions: str) -> dict[str, bytes]:
    """Return the licences of installed distributions as an FMU's content, by the names of the files.

    This project's own is always among them.
    """
    entries = {}
    for name, distribution in {"license": "elastic-robot-fmu", **distributions}.items():
        text = metadata.distribution(distribution).read_text("licenses/LICENSE")
        assert text is not None, distribution
        entries[f"documentation/licenses/{name}.txt"] = text.encode()
    return entries

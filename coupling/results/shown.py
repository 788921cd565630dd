"""Objects that a notebook shows as HTML; how each of them looks is told where reports are made."""

from __future__ import annotations

from functools import singledispatch


@singledispatch
def html_of(shown: object) -> str | None:
    """Return an object as HTML; None where nothing tells how it looks.

    The module `report.notebook` tells it of results.
    """
    return None


class Shown:
    """Base of what a notebook shows as HTML."""

    def _repr_html_(self) -> str | None:
        return html_of(self)

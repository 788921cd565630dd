"""What the command line prints through: text as it stands, in lines as long as they are."""

from __future__ import annotations

from rich.console import Console


def _console(stderr: bool) -> Console:
    return Console(stderr=stderr, markup=False, emoji=False, highlight=False, soft_wrap=True)


console, errors = _console(stderr=False), _console(stderr=True)

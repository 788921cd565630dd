"""What the command line prints through: text as it stands, in lines as long as they are."""

from __future__ import annotations

import sys

from rich.console import Console

# Columns of what is no terminal, a file or another program: its tables are not folded.
_WIDE = 240


def _console(stderr: bool) -> Console:
    width = None if (sys.stderr if stderr else sys.stdout).isatty() else _WIDE
    return Console(
        stderr=stderr, markup=False, emoji=False, highlight=False, soft_wrap=True, width=width
    )


console, errors = _console(stderr=False), _console(stderr=True)

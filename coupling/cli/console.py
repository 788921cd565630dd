"""What the command line prints through: text as it stands, in lines as long as they are."""

from __future__ import annotations

import sys
from contextlib import suppress

from rich.console import Console

# Columns of what is no terminal, a file or another program: its tables are not folded.
_WIDE = 240


class _LastingConsole(Console):
    """A console whose reader may go, such as `head`: the command still writes its files."""

    def on_broken_pipe(self) -> None:
        """Print nothing more."""
        with suppress(SystemExit):
            super().on_broken_pipe()


def _console(stderr: bool) -> Console:
    width = None if (sys.stderr if stderr else sys.stdout).isatty() else _WIDE
    return _LastingConsole(
        stderr=stderr, markup=False, emoji=False, highlight=False, soft_wrap=True, width=width
    )


console, errors = _console(stderr=False), _console(stderr=True)

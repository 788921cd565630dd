"""What the command line prints through: text as it stands, in lines as long as they are."""

from __future__ import annotations

import sys
from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from coupling.errors import shortened, without_steering

# Columns of what is no terminal, a file or another program: its tables are not folded.
_WIDE = 240


class _PlainConsole(Console):
    """A console that nobody's text can steer: programs, files and names may hold any characters."""

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Yield the segments of a renderable; control sequences are those of Rich alone."""
        for segment in super().render(renderable, options):
            text = segment.text
            if not segment.control and not text.isprintable():
                text = without_steering(text)
            yield segment._replace(text=text if segment.control else shortened(text))


def _console(stderr: bool) -> Console:
    stream = sys.stderr if stderr else sys.stdout
    width = None if stream is not None and stream.isatty() else _WIDE
    return _PlainConsole(
        stderr=stderr, markup=False, emoji=False, highlight=False, soft_wrap=True, width=width
    )


console, errors = _console(stderr=False), _console(stderr=True)

"""Texts with a few places damaged."""

from collections.abc import Callable, Iterator
from contextlib import suppress

import numpy as np

from coupling.errors import ProgramError

_LETTERS = list("[]{}(),;:=\\\"'\n 0189.eE-+xXPLM\x00é")


def damaged(text: str, count: int, seed: int = 18) -> Iterator[str]:
    """Yield copies of a text in which letters are left out, doubled or replaced anywhere."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        letters = list(text)
        for _ in range(rng.integers(1, 4)):
            k = int(rng.integers(len(letters)))
            letters[k : k + int(rng.integers(3))] = rng.choice(_LETTERS, rng.integers(3)).tolist()
        yield "".join(letters)


def read_or_refused(
    read: Callable[[str], object], text: str, count: int = 300, seed: int = 18
) -> None:
    """Require that every damaged copy of a text is read, or refused with a ProgramError."""
    for copy in damaged(text, count, seed):
        with suppress(ProgramError):
            read(copy)

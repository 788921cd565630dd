"""Texts with a few places damaged."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

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

"""Sentences on a file that a tool path was read from."""

from __future__ import annotations

from collections.abc import Mapping


def format_counts(words: Mapping[str, int]) -> str:
    """Return words with how often each stands there, where that is more than once.

    Example:
        >>> format_counts({"WAIT": 1, "M3": 2})
        'WAIT, M3 (2)'
    """
    return ", ".join(f"{word} ({count})" if count > 1 else word for word, count in words.items())

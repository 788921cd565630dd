"""Compiled loops on all cores: they let go of Python's lock."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

COUNT = os.cpu_count() or 1
_POOL = ThreadPoolExecutor(COUNT, thread_name_prefix="sheet")


def in_threads(compute: Callable[[slice], None], size: int, step: int = 1) -> None:
    """Call a function once for each core, with its share of 0..size; shares begin at multiples of step.

    Example:
        >>> done = set()
        >>> in_threads(lambda share: done.update(range(10)[share]), 10)
        >>> len(done)
        10
    """
    steps = -(-size // step)
    bounds = [min(steps * k // COUNT * step, size) for k in range(COUNT + 1)]
    shares = [slice(first, last) for first, last in pairwise(bounds)]
    list(_POOL.map(compute, [share for share in shares if share.start < share.stop]))

"""Compiled loops on all cores: they let go of Python's lock."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

COUNT = os.cpu_count() or 1


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(COUNT, thread_name_prefix="sheet")


# Threads do not live on in a process that is forked: it starts its own.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)


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
    list(_pool().map(compute, [share for share in shares if share.start < share.stop]))

"""Compiled loops on all cores: they let go of Python's lock."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import cache
from itertools import pairwise
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

COUNT = os.cpu_count() or 1
# Shares of a loop for each core.
_SHARES = 3


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(COUNT, thread_name_prefix="sheet")


# Threads do not live on in a process that is forked: it starts its own.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)


def in_threads(compute: Callable[[slice], None], size: int, step: int = 1) -> None:
    """Call a function for shares of 0..size, on all cores; shares begin at multiples of step.

    There are some more shares than cores, so that one that takes long keeps no other core waiting.

    Example:
        >>> done = set()
        >>> in_threads(lambda share: done.update(range(10)[share]), 10)
        >>> len(done)
        10
    """
    steps, count = -(-size // step), COUNT * _SHARES if COUNT > 1 else 1
    bounds = [min(steps * k // count * step, size) for k in range(count + 1)]
    shares = deque(slice(first, last) for first, last in pairwise(bounds) if first < last)

    def work() -> None:
        while True:
            try:
                share = shares.popleft()
            except IndexError:
                return
            compute(share)

    others = [_pool().submit(work) for _ in range(min(COUNT, len(shares)) - 1)]
    try:
        work()
    finally:
        # One that has not begun would find nothing left.
        running = [other for other in others if not other.cancel()]
        wait(running)
    for other in running:
        other.result()


def in_background(compute: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> Future[R]:
    """Call a function while others go on, on a core that waits.

    Example:
        >>> in_background(sum, [1, 2]).result()
        3
    """
    return _pool().submit(compute, *args, **kwargs)

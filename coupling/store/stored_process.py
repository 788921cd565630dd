"""A process whose answers are kept."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from coupling.errors import StoreError
from coupling.events import Event, WarningEvent, Watch, unwatched
from coupling.path.histories import ToolPath
from coupling.process.base import Process, ProcessResponse, ProcessWrapper
from coupling.store.entry import EntryInfo, as_stored, evaluation_key, size_of
from coupling.store.store import Store


@dataclass(frozen=True)
class StoredAnswer(Event):
    """A process has answered, or the store has in its place.

    Attributes:
        key: Key of the answer; empty where the process has no identity.
        origin: "computed", or "store".
        seconds: Time that it took [s].
    """

    key: str
    origin: Literal["computed", "store"]
    seconds: float


_CHANGED = (
    "a file that the process's answers depend on has changed since the run began: the result is used,"
    " but not kept (a file that the program writes to cannot be a word of its command)"
)


class StoredProcess(ProcessWrapper):
    """A process that answers from a store where it can, and whose answers are kept before they are used.

    Room for an answer is taken before it is computed, so that a full disk is found first.  An answer
    that cannot be kept all the same is used, and kept as soon as there is room.

    Args:
        process: The process; without an identity it is evaluated every time.
        store: The store; None: every answer is computed.
        watch: Function called with every answer.
        name: Name of the process, for people.
        identify: Function that finds the identity of the process anew; where that is another one after
            an evaluation, as a file of the process has changed, its answer is not kept.
    """

    def __init__(
        self,
        process: Process,
        store: Store | None,
        watch: Watch = unwatched,
        name: str = "",
        identify: Callable[[], str] | None = None,
    ) -> None:
        self.process, self._store, self._watch = process, store, watch
        self._identify = identify or (lambda: process.identity)
        self._name = name or type(process).__name__
        self._pending: dict[str, tuple[ProcessResponse, EntryInfo]] = {}

    @property
    def not_stored(self) -> int:
        """Number of answers that could not be kept so far."""
        return len(self._pending)

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the process's answer to a path, computed only where it is not kept.

        Raises:
            ProcessError: If the process has no answer.
            StoreError: If the store cannot be read, or has no room for another answer.
        """
        self.settle()
        start, key = time.perf_counter(), evaluation_key(self.identity, path)
        response = None if self._store is None or not key else self._kept(self._store, key, path)
        origin: Literal["computed", "store"] = "computed" if response is None else "store"
        if response is None:
            if self._store is None or not key:
                response = as_stored(self.process.evaluate(path))
            else:
                response, origin = self._claimed(self._store, key, path)
        self._watch(StoredAnswer(key, origin, time.perf_counter() - start))
        return response

    def seconds(self, path: ToolPath) -> float:
        """Return the time that the kept answer to a path took [s]; 0 where none is kept."""
        key = evaluation_key(self.identity, path)
        if self._store is None or not key:
            return 0.0
        about = self._pending[key][1] if key in self._pending else self._store.about(key)
        return 0.0 if about is None else about.seconds

    def settle(self) -> None:
        """Try again to keep what could not be kept."""
        if self._store is None:
            return
        for key, (response, about) in list(self._pending.items()):
            try:
                self._store.write(self._store.room(key, 0), response, about)
            except StoreError:
                continue
            del self._pending[key]

    def _kept(self, store: Store, key: str, path: ToolPath) -> ProcessResponse | None:
        return self._pending[key][0] if key in self._pending else store.read(key, path)

    def _claimed(
        self, store: Store, key: str, path: ToolPath
    ) -> tuple[ProcessResponse, Literal["computed", "store"]]:
        """Return the answer, computed by this process or by another one that was quicker."""
        with store.claimed(key, path) as response:
            if response is not None:
                return response, "store"
            file = store.room(key, size_of(path))
            start = time.perf_counter()
            try:
                response = as_stored(self.process.evaluate(path))
                changed = self._identify() != self.identity
            except BaseException:
                file.discard()
                raise
            if changed:
                file.discard()
                self._watch(WarningEvent(_CHANGED))
                return response, "computed"
            tools, samples = path.pose.shape[:2]
            seconds = time.perf_counter() - start
            host, now = platform.node(), time.time()
            about = EntryInfo(key, self._name, samples, tools, seconds, host, now)
            try:
                store.write(file, response, about)
            except StoreError as cause:
                self._pending[key] = response, about
                self._watch(
                    WarningEvent(f"{cause}; the result is used, and stored as soon as possible")
                )
            return response, "computed"

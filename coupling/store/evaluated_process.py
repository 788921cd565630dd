"""A process as commands evaluate it: checked, tried again, kept, remembered and without noise."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from typing import Literal

from coupling.errors import ProcessError, StoreError
from coupling.events import WarningEvent, Watch, unwatched
from coupling.path.histories import ToolPath
from coupling.process.base import (
    MarchedProcess,
    Process,
    ProcessRequest,
    ProcessResponse,
    marched,
)
from coupling.process.noise import NoiseRemoval
from coupling.process.validation import evaluate_validated
from coupling.results.run_state import StoredAnswer
from coupling.store.entry import EntryInfo, as_stored, evaluation_key, size_of
from coupling.store.store import Store

_CHANGED = (
    "a file that the process's answers depend on has changed since the run began: the result is used,"
    " but not kept (a file that the program writes to cannot be a word of its command)"
)


class EvaluatedProcess:
    """A process as commands evaluate it.

    Its answers are checked, tried again where they fail, taken from a store where it has them and kept
    there before they are used, remembered, and rid of their noise.

    Room for an answer is taken before it is computed, so that a full disk is found first.  An answer
    that cannot be kept all the same is used, and kept as soon as there is room.

    Args:
        process: The process; without an identity it is evaluated every time.
        tries: Tries of one evaluation at most, >= 1: a licence may be taken, a node lost.
        identify: Function that finds the identity of the process anew; where that is another one after
            an evaluation, as a file of the process has changed, its answer is not kept.

    Attributes:
        last: Last evaluation, its answer with its noise; None before the first.
    """

    def __init__(
        self,
        process: Process,
        store: Store | None = None,
        watch: Watch = unwatched,
        name: str = "",
        tries: int = 1,
        identify: Callable[[], str] | None = None,
        noise_removal: NoiseRemoval | None = None,
    ) -> None:
        self._process, self._store, self._watch = process, store, watch
        self._name, self._tries = name or type(process).__name__, tries
        self._identify = identify or (lambda: process.identity)
        self.noise_removal = noise_removal
        self._pending: dict[str, tuple[ProcessResponse, EntryInfo]] = {}
        self.last: ProcessRequest | None = None

    @property
    def identity(self) -> str:
        """Key of the answers, that of the process."""
        return self._process.identity

    @property
    def not_stored(self) -> int:
        """Number of answers that could not be kept so far."""
        return len(self._pending)

    @property
    def marched(self) -> MarchedProcess | None:
        """The process, marching in time, where it is coupled so: what it answers then is not kept."""
        return marched(self._process)

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the process's answer to a path, computed only where it is not kept.

        Raises:
            ProcessError: If the process has no answer.
            StoreError: If the store cannot be read, or has no room for another answer.
        """
        self.settle()
        start, key = time.perf_counter(), evaluation_key(self.identity, path)
        store = self._store if key else None
        response = None if store is None else self._stored_response(store, key, path)
        origin: Literal["computed", "store"] = "computed" if response is None else "store"
        if response is None:
            if store is None:
                response = as_stored(self.computed(path))
            else:
                response, origin = self._compute_claimed(store, key, path)
        seconds = time.perf_counter() - start
        self._watch(StoredAnswer(key=key, origin=origin, seconds=seconds))
        self.last = ProcessRequest(path, response, max(seconds, self._stored_seconds(store, key)))
        return response if self.noise_removal is None else self.noise_removal.smoothed(self.last)

    def computed(self, path: ToolPath) -> ProcessResponse:
        """Return the process's answer to a path, whatever is kept, of the first try that has one.

        Raises:
            ProcessError: Of the last try, with the number of tries, if all of them fail.
        """
        for number in range(1, self._tries):
            try:
                return evaluate_validated(self._process, path, self._name)
            except ProcessError as cause:
                self._watch(
                    WarningEvent(f"try {number} of {self._tries} failed, the next begins: {cause}")
                )
        try:
            return evaluate_validated(self._process, path, self._name)
        except ProcessError as cause:
            if self._tries == 1:
                raise
            raise ProcessError(f"all {self._tries} tries failed, the last one: {cause}") from cause

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

    def _stored_seconds(self, store: Store | None, key: str) -> float:
        """Return the time that computing a kept answer took [s]; 0 where none is kept."""
        if store is None:
            return 0.0
        about = self._pending[key][1] if key in self._pending else store.about(key)
        return 0.0 if about is None else about.seconds

    def _stored_response(self, store: Store, key: str, path: ToolPath) -> ProcessResponse | None:
        return self._pending[key][0] if key in self._pending else store.read(key, path)

    def _compute_claimed(
        self, store: Store, key: str, path: ToolPath
    ) -> tuple[ProcessResponse, Literal["computed", "store"]]:
        """Return the answer, computed by this process or by another one that was quicker."""
        with store.claimed(key, path) as response:
            if response is not None:
                return response, "store"
            file = store.room(key, size_of(path))
            start = time.perf_counter()
            try:
                response = as_stored(self.computed(path))
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

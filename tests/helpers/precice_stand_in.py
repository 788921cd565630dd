"""preCICE's calls as the robot and its partner make them: two participants in threads of one process.

Serial-implicit coupling of one vertex, with the numbers of a configuration file of preCICE: window, end,
convergence, and IQN-ILS within a window where there is an acceleration.  It is no preCICE: values are
linear over a window, and a new window begins with the last one's end.
"""

from __future__ import annotations

import threading
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

_couplings: dict[str, _Coupling] = {}
_lock = threading.Lock()


class _Coupling:
    """What both participants share."""

    def __init__(self, text: str) -> None:
        text = text.replace("coupling-scheme:", "coupling-scheme-").replace("acceleration:", "")
        for prefix in ("data", "mapping", "m2n"):
            text = text.replace(f"<{prefix}:", f"<{prefix}-")
        root = ElementTree.fromstring(text)
        scheme = root.find("coupling-scheme-serial-implicit")
        assert scheme is not None

        def number(tag: str, attribute: str = "value") -> float:
            return float(scheme.find(tag).get(attribute))

        self.window, self.end = number("time-window-size"), number("max-time")
        self.most = int(number("max-iterations"))
        self.limit = number("absolute-convergence-measure", "limit")
        self.measured = scheme.find("absolute-convergence-measure").get("data")
        accelerated = scheme.find("IQN-ILS/data")
        self.accelerated = None if accelerated is None else accelerated.get("name")
        self.relaxation = 0.1
        names = [data.get("name") for data in root if data.tag.startswith("data-")]
        self.start = {name: np.zeros(3) for name in names}
        self.now = {name: np.zeros(3) for name in names}
        self.before = np.full(3, np.inf)  # the measured data in the iteration before
        self.tried: list[tuple[np.ndarray, np.ndarray]] = []
        self.time, self.iteration, self.repeats = 0.0, 0, False
        self.turns = {0: threading.Semaphore(0), 1: threading.Semaphore(0)}

    def conclude(self, answers: dict[str, np.ndarray]) -> None:
        """Take the second participant's answers, and end or repeat the window."""
        self.iteration += 1
        change = np.linalg.norm(self.now[self.measured] - self.before)
        self.before = self.now[self.measured]
        self.repeats = bool(change > self.limit) and self.iteration < self.most
        if self.repeats and self.accelerated:
            answers = {**answers, self.accelerated: self._improved(answers[self.accelerated])}
        self.now |= answers
        if not self.repeats:
            self.time += self.window
            self.start = dict(self.now)
            self.iteration, self.tried = 0, []

    def _improved(self, answer: np.ndarray) -> np.ndarray:
        given = self.now[self.accelerated]
        self.tried.append((answer - given, answer))
        if len(self.tried) == 1:
            return given + self.relaxation * (answer - given)
        residuals, answers = (np.array(column) for column in zip(*self.tried, strict=True))
        weights, *_ = np.linalg.lstsq(np.diff(residuals, axis=0).T, -residuals[-1], rcond=1e-9)
        return answer + weights @ np.diff(answers, axis=0)


class Participant:
    """One of the two, in its own thread; the robot is the first."""

    def __init__(self, name: str, configuration: str, rank: int, size: int) -> None:
        assert (rank, size) == (0, 1)
        self._second = int(name != "Robot")
        with _lock:
            self._shared = _couplings.setdefault(
                configuration,
                _Coupling(Path(configuration).read_text(encoding="utf-8")),
            )
        self._written: dict[str, np.ndarray] = {}
        self._configuration = configuration

    def set_mesh_vertices(self, mesh: str, places: np.ndarray) -> list[int]:
        return list(range(len(places)))

    def requires_initial_data(self) -> bool:
        return not self._second

    def initialize(self) -> None:
        shared = self._shared
        if self._second:
            shared.turns[1].acquire()
        else:
            shared.start |= self._written
            shared.now |= self._written

    def is_coupling_ongoing(self) -> bool:
        return self._shared.time < self._shared.end - 1e-9

    def get_max_time_step_size(self) -> float:
        return self._shared.window

    def requires_writing_checkpoint(self) -> bool:
        return self._shared.iteration == 0

    def requires_reading_checkpoint(self) -> bool:
        return self._shared.repeats

    def read_data(self, mesh: str, data: str, vertices: list[int], at: float) -> np.ndarray:
        shared, share = self._shared, at / self._shared.window
        return ((1.0 - share) * shared.start[data] + share * shared.now[data])[None]

    def write_data(self, mesh: str, data: str, vertices: list[int], values: np.ndarray) -> None:
        assert values.shape == (1, 3)
        self._written[data] = np.array(values[0], dtype=float)

    def advance(self, size: float) -> None:
        shared = self._shared
        assert size == shared.window
        if self._second:
            shared.conclude(self._written)
            shared.turns[0].release()
            if self.is_coupling_ongoing():
                shared.turns[1].acquire()
        else:
            shared.now |= self._written
            shared.turns[1].release()
            shared.turns[0].acquire()

    def finalize(self) -> None:
        with _lock:
            _couplings.pop(self._configuration, None)

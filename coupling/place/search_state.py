"""What a search has reached, kept beside its folder: the same command goes on from there."""

from __future__ import annotations

import pickle
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

import numpy as np

import elastic_robot
from coupling.errors import ResultError
from coupling.files.atomic_file import AtomicFile
from coupling.files.written_files import claim_file
from coupling.place.coarse_screen import CoarseScreen
from coupling.place.objective import PlaceObjective
from coupling.place.placing import Placing
from coupling.place.search import FoundSettings
from coupling.results.base import ResultFile

STATE = "search.json"


class _Stored(ResultFile):
    """The best settings after a stage of a search.

    Attributes:
        key: Hash of all that the search depends on.
        stage: Stage that is complete.
        places: Numbers of the places of the path that were looked at.
    """

    what = "the state of a search"

    key: str
    stage: str
    settings: tuple[tuple[float, ...], ...]
    looked_at: int
    refused: dict[str, int]
    places: tuple[int, ...]


class SearchState:
    """The file of a search that goes on, or begins anew where it is of another search or damaged.

    Args:
        folder: Folder that the file stands in; None: nothing is kept.
        placing: The case to be placed.
    """

    def __init__(self, folder: Path | None, placing: Placing) -> None:
        self._file = None if folder is None else folder / STATE
        case = placing.case
        content = pickle.dumps(
            (
                elastic_robot.__version__,
                case.resolved,
                placing.robot,
                placing.stations,
                placing.goal,
            )
        )
        self._key, self.stage = sha256(content).hexdigest(), ""

    def read(self, stage: str, screen: CoarseScreen, goal: PlaceObjective) -> FoundSettings | None:
        """Return the best settings after a stage; None where it is not known to be complete."""
        if self._file is None:
            return None
        try:
            stored = _Stored.read(self._file, ResultError)
        except ResultError:
            return None
        if (stored.key, stored.stage) != (self._key, stage):
            return None
        screen.add_places(np.array(stored.places, dtype=int))
        settings = np.array(stored.settings, dtype=float)
        figures = screen.confirmed(settings)
        self.stage = stage
        return FoundSettings(
            settings, figures, goal.cost(figures), stored.looked_at, dict(stored.refused)
        )

    def write(self, stage: str, screen: CoarseScreen, best: FoundSettings) -> None:
        """Keep the best settings after a stage; a full disk keeps none and ends nothing."""
        if self._file is None or len(best.settings) == 0:
            return
        stored = _Stored(
            key=self._key,
            stage=stage,
            settings=tuple(tuple(setting) for setting in best.settings.tolist()),
            looked_at=best.looked_at,
            refused=best.refused,
            places=tuple(screen.places.tolist()),
        )
        with suppress(OSError):
            AtomicFile(claim_file(self._file)).write([stored.text().encode()])
            self.stage = stage

    @property
    def in_words(self) -> str:
        """What the same command does after an interrupt."""
        if not self.stage:
            return "the search was on its way, and begins anew"
        return f"the search is kept up to {self.stage}: the same command goes on from there"

    def forget(self) -> None:
        """Remove the file: the search is at its end."""
        if self._file is not None:
            self._file.unlink(missing_ok=True)

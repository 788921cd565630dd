"""Folders of finished studies read back, for their report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.errors import StudyError
from coupling.files.csv_table import read_table
from coupling.results.shown import Shown
from coupling.results.study_result import StudyResult
from coupling.study.evaluate import BAND_COLUMNS, MEASURES
from coupling.study.folder import BANDS, FIGURES, SAMPLES


@dataclass(frozen=True)
class StoredStudy(Shown):
    """A finished study.

    Attributes:
        points: Values of the parameters, in their units, (n, k).
        measures: Deviations of the samples by name [m], (n,).
        time: Beginnings of the parts of the path [s], (m,).
        band: Columns of bands.csv by name [m], (m,).
    """

    folder: Path
    figures: StudyResult
    names: tuple[str, ...]
    points: np.ndarray
    measures: dict[str, np.ndarray]
    time: np.ndarray
    band: dict[str, np.ndarray]


def read_study(folder: Path) -> StoredStudy:
    """Read the folder of a finished study.

    Raises:
        StudyError: If a file is missing or broken.
    """
    figures = StudyResult.read(folder / FIGURES, StudyError, "name the folder of a finished study")
    names = tuple(entry.name for entry in figures.parameters)
    table = read_table(folder / SAMPLES, (*names, *MEASURES), StudyError)
    time, *band = read_table(folder / BANDS, BAND_COLUMNS, StudyError).T
    return StoredStudy(
        folder,
        figures,
        names,
        table[:, : len(names)],
        dict(zip(MEASURES, table[:, len(names) :].T, strict=True)),
        time,
        dict(zip(BAND_COLUMNS[1:], band, strict=True)),
    )

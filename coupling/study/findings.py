"""What the samples of a study say: its tables and figures, written when the last is done, and read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.errors import StudyError, reason_of
from coupling.files.atomic_file import AtomicFile
from coupling.files.csv_table import read_table
from coupling.results.base import Shown
from coupling.results.outlook import EXPECTED_SHARE
from coupling.results.study_result import (
    InfluenceResult,
    StudyCommandResult,
    StudyResult,
    StudySample,
    UncertainResult,
)
from coupling.run.figures import versions
from coupling.study.conduct import Study
from coupling.study.folder import BANDS, FIGURES, SAMPLES, write_whole_table
from coupling.study.robot_pool import PARTS
from coupling.study.statistics import (
    DeviationBand,
    influences,
    parts_of_path,
    quantile,
    samples_for,
)

MEASURES = (
    "maximum",
    "rms",
    "normal_maximum",
    "tangential_maximum",
    "maximum_less_constant",
    "rms_less_constant",
)
BAND_COLUMNS = ("time", "low", "median", "high", "everywhere")


def write_findings(study: Study, samples: Sequence[StudySample]) -> None:
    """Write samples.csv, bands.csv and study.json into a study's folder.

    Raises:
        StudyError: If too few robots could be simulated for the band, or a file cannot be written.
    """
    good = [sample for sample in samples if sample.deviation is not None]
    least = samples_for(study.table.coverage)
    if len(good) < least:
        failure = next(sample.failure for sample in samples if sample.deviation is None)
        raise StudyError(
            f"{study.folder}: expected at least {least} robots that can be simulated, got {len(good)}"
            f" of {len(samples)}: {failure}"
        )
    numbers = [sample.number for sample in good]
    points = study.points[numbers]
    figures = {name: np.array([getattr(s.deviation, name) for s in good]) for name in MEASURES}
    when = np.array([s.deviation.time_of_maximum for s in good if s.deviation is not None])
    distance = np.array([sample.distance for sample in good])
    band = DeviationBand.of(distance, study.table.coverage)
    time = study.run.first.desired.time
    first = parts_of_path(time, PARTS)
    try:
        write_whole_table(
            study.folder / SAMPLES,
            ("sample", *study.work.parameters.names, *MEASURES, "time_of_maximum"),
            np.column_stack([numbers, points, *figures.values(), when]),
        )
        write_whole_table(
            study.folder / BANDS,
            BAND_COLUMNS,
            np.column_stack([time[first], band.low, band.median, band.high, band.everywhere]),
        )
        study_figures = _figures(study, samples, points, figures)
        AtomicFile(study.folder / FIGURES).write([study_figures.text().encode()])
    except OSError as cause:
        raise StudyError(
            f"{study.folder}: cannot be written: {reason_of(cause)}: make room, and the same"
            " command goes on"
        ) from cause


def _figures(
    study: Study, samples: Sequence[StudySample], points: np.ndarray, figures: dict[str, np.ndarray]
) -> StudyResult:
    table, run = study.table, study.run.figures
    tail = 0.5 * (1.0 - table.coverage)
    shares = sorted({tail, 0.5, table.coverage, 1.0 - tail, EXPECTED_SHARE})
    model = run.shares_m.dynamic_after
    assert model is not None  # a study is one of a compensation
    return StudyResult(
        case=study.case,
        source=study.source,
        tolerance_m=study.tolerance,
        kind="study",
        samples=len(samples),
        design=table.design,
        seed=table.seed,
        coverage=table.coverage,
        wrench="model" if study.work.process is None else "coupled",
        process_evaluations=sum(sample.evaluations for sample in samples),
        not_coupled=tuple(s.number for s in samples if not s.converged),
        failed={str(sample.number): sample.failure for sample in samples if sample.failure},
        command=StudyCommandResult(converged=run.converged, reason=run.reason, deviation_m=model),
        quantiles_m={
            name: {f"{share:g}": float(quantile(values, share)) for share in shares}
            for name, values in figures.items()
        },
        chosen=bool(study.table.spreads()),
        expected=run.expected_deviation(
            None if study.table.spreads() else float(quantile(figures["maximum"], EXPECTED_SHARE))
        ),
        parameters=_parameters(study, points, figures),
        silent=study.work.parameters.silent,
        fmu_fingerprint=run.fmu_fingerprint,
        versions=versions(),
    )


def _parameters(
    study: Study, points: np.ndarray, figures: dict[str, np.ndarray]
) -> tuple[UncertainResult, ...]:
    """Return the uncertain parameters and the significance of each."""
    from scipy.stats import rankdata

    # Ranks are uniform, whatever distribution the values have.
    uniform = (rankdata(points, axis=0) - 0.5) / len(points)
    maximum, rms = (influences(uniform, figures[name]) for name in ("maximum", "rms"))
    return tuple(
        UncertainResult(
            name=entry.name,
            distribution=entry.in_words(),
            range=entry.range,
            influence=InfluenceResult(
                maximum=None if maximum is None else maximum[k], rms=None if rms is None else rms[k]
            ),
        )
        for k, entry in enumerate(study.work.parameters.entries)
    )


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

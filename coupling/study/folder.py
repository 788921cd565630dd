"""The folder of a study: what is studied, its points, samples as they come, and what they say.

A line of samples is the CRC-32 of its text, a blank, and the sample as JSON.  It is on the disk before
the next one begins, so that only the last line can be torn: that is cut off, and its sample simulated
anew, as is that of a line which was damaged later.
"""

from __future__ import annotations

import errno
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from coupling.errors import StudyError, one_of, reason_of
from coupling.files.atomic_file import AtomicFile, write_atomically, writing
from coupling.files.atomic_folder import (
    FolderKind,
    exclusively,
    replaced_name,
    require_free,
    unfinished_name,
)
from coupling.files.csv_table import read_header, read_table, write_table
from coupling.files.toml_file import load_toml
from coupling.files.written_files import (
    REPORT,
    begin_folder,
    claim,
    is_of_kind,
    remove_written,
)
from coupling.results.study_result import StudySample
from coupling.run.uncertain_parameters import GROWS, UncertainParameters, draw_samples

IDENTITY, POINTS, ROWS = "study.toml", "points.csv", "rows.jsonl"
SAMPLES, BANDS, FIGURES = "samples.csv", "bands.csv", "study.json"
RUN = "run"
# Kind of the folder; its files, and what a killed command leaves beside the run.
_FOLDER_KIND = "study"
_FILES = (IDENTITY, POINTS, ROWS, SAMPLES, BANDS, FIGURES, REPORT, f".{RUN}.lock")
_FOLDERS = (RUN, unfinished_name(Path(RUN)).name, replaced_name(Path(RUN)).name)
STUDY_FOLDER = FolderKind(
    _FOLDER_KIND, "a study", StudyError, lambda folder: is_of_kind(folder, _FOLDER_KIND)
)


@contextmanager
def lock_folder(folder: Path, overwrite: bool) -> Iterator[Path]:
    """Give the folder of a study to this program alone, made where there is none.

    Args:
        overwrite: Whether a study that is there goes first.

    Raises:
        StudyError: If another study works there, it holds something else, or it cannot be written.
    """
    with (
        exclusively(folder, StudyError, lambda: "another study works in it"),
        writing(folder, StudyError),
    ):
        require_free(folder, STUDY_FOLDER, overwrite=True)  # else it is gone on with
        begin_folder(folder, _FOLDER_KIND)
        if overwrite:
            remove_written(folder)
            begin_folder(folder, _FOLDER_KIND)
        claim(folder, (*_FILES, *(f"{name}/" for name in _FOLDERS)))
        yield folder


def write_whole_table(file: Path, columns: tuple[str, ...], values: np.ndarray) -> None:
    """Write a table, columns of any unit, (rows, columns), as a whole file."""
    text = StringIO()
    write_table(text, columns, values)
    AtomicFile(file).write([text.getvalue().encode()])


def require_same(folder: Path, identity: Mapping[str, Any]) -> bool:
    """Return whether a study of this identity was begun in a folder."""
    file = folder / IDENTITY
    if not file.exists():
        return False
    stored, requested = load_toml(file, StudyError), tomllib.loads(tomlkit.dumps(dict(identity)))
    other = different(stored, requested)
    if other:
        raise StudyError(
            f"{folder}: holds a study that differs in {in_short(other)}: give the command that began"
            " it, name another folder, or add --overwrite to start anew"
        )
    return True


def in_short(names: Sequence[str]) -> str:
    """Return the first names of a list, and how many more there are.

    Example:
        >>> in_short(["a", "b", "c", "d", "e"])
        'a, b, c and 2 more'
    """
    more = len(names) - 3
    return ", ".join(names[:3]) + (f" and {more} more" if more > 0 else "")


def different(first: Mapping[str, Any], second: Mapping[str, Any], above: str = "") -> list[str]:
    """Return the keys at which two tables differ, with those of the tables around them.

    Example:
        >>> different({"a": 1, "b": {"c": 2}}, {"a": 1, "b": {"c": 3}, "d": 4})
        ['b.c', 'd']
    """
    names = []
    for key in [*first, *(key for key in second if key not in first)]:
        value, other = first.get(key), second.get(key)
        if isinstance(value, Mapping) and isinstance(other, Mapping):
            names += different(value, other, f"{above}{key}.")
        elif value != other:
            names.append(f"{above}{key}")
    return names


def begin(
    folder: Path, identity: Mapping[str, Any], points: np.ndarray, names: UncertainParameters
) -> None:
    """Begin a study of points, in their units, (n, k), without what one that never began has left."""
    (folder / ROWS).unlink(missing_ok=True)
    write_points(folder, points, names)
    write_atomically(folder / IDENTITY, tomlkit.dumps(dict(identity)), StudyError)


def write_points(folder: Path, points: np.ndarray, parameters: UncertainParameters) -> None:
    """Write the values of all samples' parameters, in their units, (n, k)."""
    table = np.column_stack([np.arange(len(points)), points])
    write_whole_table(folder / POINTS, ("sample", *parameters.names), table)


def read_points(folder: Path) -> tuple[tuple[str, ...], np.ndarray]:
    """Return the names of the parameters and their values in all samples, in their units, (n, k)."""
    _, *names = read_header(folder / POINTS, StudyError)
    return tuple(names), read_table(folder / POINTS, ("sample", *names), StudyError)[:, 1:]


def points_of(
    folder: Path, design: str, count: int, seed: int, parameters: UncertainParameters
) -> np.ndarray:
    """Return the values, (count, k), in their units, of a begun study's samples, maybe more now.

    Raises:
        StudyError: If there are fewer points and the design cannot grow, or they cannot be read.
    """
    _, stored = read_points(folder)
    if len(stored) >= count:
        return stored[:count]
    assert design in GROWS, one_of(GROWS, design)
    points = draw_samples(design, count, seed, parameters)
    if not np.array_equal(points[: len(stored)], stored):
        raise StudyError(
            f"{folder / POINTS}: expected the first of {count} points of this SciPy, got others: go on"
            " with the SciPy that began the study, or start anew with --overwrite"
        )
    write_points(folder, points, parameters)
    return points


class SampleTable:
    """The table of finished samples, open for more; a context manager that closes it.

    Args:
        file: Its file; made where there is none.  What is torn at its end is cut off.

    Raises:
        StudyError: If the file cannot be read or written.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        try:
            text = file.read_bytes() if file.exists() else b""
            lines = text.splitlines(keepends=True)
            whole = len(text) - (0 if text.endswith(b"\n") or not lines else len(lines.pop()))
            # Unbuffered: what could not be written is not tried again when the file is closed.
            self._stream = file.open("ab", buffering=0)
            self._stream.truncate(whole)
        except OSError as cause:
            raise StudyError(f"{file}: cannot be opened: {reason_of(cause)}") from cause
        self.samples: dict[int, StudySample] = {}
        for line in lines:
            with suppress(ValueError):  # of a damaged line: its sample is missing
                sample = StudySample.of_line(line)
                self.samples[sample.number] = sample

    def __enter__(self) -> SampleTable:
        return self

    def __exit__(self, *error: object) -> None:
        self._stream.close()

    def has(self, number: int) -> bool:
        """Return whether a sample is there; one that failed is worth another try."""
        return number in self.samples and not self.samples[number].failure

    def add(self, sample: StudySample) -> None:
        """Write a sample to the disk."""
        line = sample.line()
        try:
            written = self._stream.write(line)
            if written != len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            os.fsync(self._stream.fileno())
        except OSError as cause:
            raise StudyError(
                f"{self._file}: cannot be written: {reason_of(cause)}: make room, and the same"
                f" command continues with the {len(self.samples)} samples that are kept"
            ) from cause
        self.samples[sample.number] = sample

"""Frequency responses of a hammer test: force and motion over time, blow by blow.

A CSV file has the columns `time_s`, `hit` (a number, the same in all rows of one blow and what follows
it), forces `fx_N`, `fy_N`, `fz_N` and motions `ax_m_s2` (accelerations) or `x_m` (displacements) of
the TCP in base axes, those that were recorded.  With the spectra F and X of all blows the responses are
those with the least errors of the motion, known as H1:

    H = X F^H (F F^H)^-1
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from coupling.errors import StabilityError
from coupling.files.csv_table import read_header, read_table
from coupling.modes.measured_response import MeasuredResponse, read_responses

_TIME, _HIT = "time_s", "hit"
_FORCE = re.compile(r"f([xyz])_N")
_MOTION = re.compile(r"a([xyz])_m_s2|([xyz])_m")
# Force spectra count from their largest value down to this part of it: 20 dB.
_EXCITED = 0.1
# Periods of the lowest frequency in a record: a line beside zero is mostly drift.
_PERIODS = 3.0
# A motion that has not fallen to this part of its largest value was cut off.
_DECAYED = 0.05
# Last part of a record, in which it is looked at.
_TAIL = 0.1
# Unequal steps of time [1].
_UNEVEN = 1e-3


def is_hammer_test(file: Path) -> bool:
    """Return whether a file is that of a hammer test, by its columns."""
    if file.suffix.lower() != ".csv":
        return False
    return {_TIME, _HIT} <= set(read_header(file, StabilityError))


def read_measured(file: Path) -> tuple[MeasuredResponse, ...]:
    """Return the frequency responses of a file, or those of its hammer test."""
    return read_hammer_test(file) if is_hammer_test(file) else read_responses(file)


def read_hammer_test(file: Path) -> tuple[MeasuredResponse, ...]:
    """Return the dynamic compliances that a hammer test has measured.

    Raises:
        StabilityError: If it cannot be read, or was recorded so that no response follows.
    """
    forces, motions = _columns(file)
    table = read_table(file, [_TIME, _HIT, *forces, *motions], StabilityError)
    spectra = [
        _spectrum(table[table[:, 1] == hit], len(forces), f"{file}: hit {hit:g}")
        for hit in np.unique(table[:, 1])
    ]
    lines = min(len(frequency) for frequency, _ in spectra)
    step = spectra[0][0][0]
    if any(abs(frequency[0] / step - 1.0) > _UNEVEN for frequency, _ in spectra):
        raise StabilityError(
            f"{file}: expected records of equal length, got hits of other lengths than the first: cut"
            " them to the shortest"
        )
    frequency = spectra[0][0][:lines]
    values = np.stack([columns[:lines] for _, columns in spectra], axis=2)
    force, motion = values[:, : len(forces)], values[:, len(forces) :]
    if force.shape[2] < len(forces) or np.any(np.ptp(np.abs(force), axis=(0, 2)) == 0.0):
        raise StabilityError(
            f"{file}: expected at least one hit along each of {', '.join(forces)}, got"
            f" {force.shape[2]} hits: leave out the columns of forces that were not exerted"
        )
    size = np.linalg.norm(force, axis=2).min(axis=1)
    chosen = (frequency > _PERIODS * frequency[0]) & (size > _EXCITED * size.max())
    frequency, force, motion = frequency[chosen], force[chosen], motion[chosen]
    if len(frequency) < 2:
        raise StabilityError(
            f"{file}: expected records of more than {_PERIODS:.0f} periods, got"
            f" {1.0 / step:.3g} s each: record longer"
        )
    adjoint = force.conj().swapaxes(1, 2)
    compliance = (motion @ adjoint) @ np.linalg.inv(force @ adjoint)
    responses = []
    for row, motion_name in enumerate(motions):
        derived = 2 if motion_name.startswith("a") else 0
        for column, pushed in enumerate(forces):
            value = compliance[:, row, column] / (2j * np.pi * frequency) ** derived
            responses.append(MeasuredResponse(_axis(motion_name) + _axis(pushed), frequency, value))
    return tuple(responses)


def _columns(file: Path) -> tuple[list[str], list[str]]:
    """Return the columns of forces and of motions of a file."""
    header = read_header(file, StabilityError)
    forces = [name for name in header if _FORCE.fullmatch(name)]
    motions = [name for name in header if _MOTION.fullmatch(name)]
    others = [name for name in header if name not in {_TIME, _HIT, *forces, *motions}]
    if others or not forces or not motions:
        raise StabilityError(
            f"{file}: expected the columns {_TIME}, {_HIT}, forces such as fx_N and motions such as"
            f" ax_m_s2 or x_m, got {', '.join(header)}: rename them, or leave others out"
        )
    axes = [_axis(name) for name in motions]
    if len(set(axes)) < len(axes):
        raise StabilityError(
            f"{file}: expected one motion along each axis, got {', '.join(motions)}: leave one out"
        )
    return forces, motions


def _axis(column: str) -> str:
    """Return the axis of a column: fx_N, ax_m_s2 and x_m are of x."""
    return column[1] if column[0] in "fa" else column[0]


def _spectrum(rows: np.ndarray, forces: int, where: str) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies above zero [Hz], (n,), and the spectra of forces and motions, (n, columns).

    Args:
        rows: Rows of a hit: time [s], its number, forces [N] and motions [m/s^2 or m].
    """
    steps = np.diff(rows[:, 0])
    if len(rows) < 3 or steps.min() <= 0.0 or np.ptp(steps) > _UNEVEN * steps.mean():
        raise StabilityError(
            f"{where}: expected {_TIME} to rise in equal steps, got {len(rows)} rows that do not"
        )
    signals = rows[:, 2:] - rows[0, 2:]
    blow = np.abs(signals[:, :forces]).max(axis=1)
    free = np.abs(signals[np.flatnonzero(blow >= _EXCITED * blow.max())[-1] + 1 :, forces:])
    tail = free[-max(int(_TAIL * len(free)), 1) :]
    if not len(free) or np.any(tail.max(axis=0) > _DECAYED * free.max(axis=0)):
        raise StabilityError(
            f"{where}: expected a record until the motion has died out, to {_DECAYED:.0%} of its largest"
            " value behind the blow, got more at the end: record longer"
        )
    frequency = np.fft.rfftfreq(len(rows), steps.mean())
    return frequency[1:], np.fft.rfft(signals, axis=0)[1:]

"""measurements.csv -> arrays: static deflections, one row each, and their order in loading loops."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from coupling.errors import IdentifyError
from coupling.files.measured_table import MeasuredTable

FORCE, MOMENT = ("fx", "fy", "fz"), ("mx", "my", "mz")
SHIFT, TURN = ("dx", "dy", "dz"), ("drx", "dry", "drz")
LOAD_POINT = ("load.x", "load.y", "load.z")
MEASURED_POINT = ("point.x", "point.y", "point.z")
LOOP = "loop"


@dataclass(frozen=True)
class Measurements:
    """Measured static deflections, k of them.

    Attributes:
        names: Name of each row.
        q: Drive angles [rad], (k, n).
        wrench: Change of the load on the robot at the load point between the two states compared, base
            axes [N, N m], (k, 6).
        deflection: Change of the measured point's position [m] and, where r = 6, of its orientation
            [rad, rotation vector], base axes, (k, r).
        load_point: Point at which the load acts, in the TCP's frame [m], (k, 3).
        measured_point: Point that was measured, in the TCP's frame [m], (k, 3).
        deflection_deviation: Standard deviations of the deflection [m, rad], (k, r); nan without.
        wrench_deviation: Standard deviations of the load [N, N m], (k, 6); nan without.
        remarks: Sentences on what is odd about the file.
        loop: Number of the loading loop of each row, whose rows follow each other in the order in which
            their loads were applied, (k,); None where each row was loaded from rest.
    """

    names: tuple[str, ...]
    q: np.ndarray
    wrench: np.ndarray
    deflection: np.ndarray
    load_point: np.ndarray
    measured_point: np.ndarray
    deflection_deviation: np.ndarray
    wrench_deviation: np.ndarray
    remarks: tuple[str, ...] = ()
    loop: np.ndarray | None = None

    @property
    def count(self) -> int:
        """Number of rows k."""
        return len(self.names)

    @property
    def rows(self) -> int:
        """Numbers measured in each row: 3, or 6 with rotations."""
        return self.deflection.shape[1]

    @property
    def sequences(self) -> list[np.ndarray]:
        """Indices of rows whose loads were applied one after the other, (rows,) of each loop or row."""
        if self.loop is None:
            return list(np.arange(self.count)[:, None])
        numbers, first = np.unique(self.loop, return_index=True)
        return [np.flatnonzero(self.loop == n) for n in numbers[np.argsort(first)]]

    def at_rows(self, rows: np.ndarray) -> Measurements:
        """Return some of the rows, by their indices, (rows,)."""
        columns = {
            key: part[rows] for key, part in vars(self).items() if isinstance(part, np.ndarray)
        }
        return replace(self, names=tuple(self.names[k] for k in rows.tolist()), **columns)

    @classmethod
    def of(
        cls,
        q: np.ndarray,
        wrench: np.ndarray,
        deflection: np.ndarray,
        load_point: np.ndarray | None = None,
        measured_point: np.ndarray | None = None,
    ) -> Measurements:
        """Return measurements without names and deviations; points at the TCP unless given.

        Args:
            q: Drive angles [rad], (k, n).
            wrench: Change of the load, base axes [N, N m], (k, 6).
            deflection: Change of the measured point's place [m, rad], base axes, (k, r).
            load_point, measured_point: Points in the TCP's frame [m], (k, 3).
        """
        count, at_tcp = len(q), np.zeros((len(q), 3))
        return cls(
            tuple(f"row {k + 1}" for k in range(count)),
            q,
            wrench,
            deflection,
            at_tcp if load_point is None else load_point,
            at_tcp if measured_point is None else measured_point,
            np.full(deflection.shape, np.nan),
            np.full((count, 6), np.nan),
        )


def read_measurements(path: Path, joints: int) -> Measurements:
    """Read measurements (columns: docs/identify.md).

    Args:
        path: CSV file; lines that begin with # are comments, other columns are ignored.
        joints: Number of the robot's joints n.

    Raises:
        IdentifyError: With file, line, column, what was expected and what was got.
    """
    table = MeasuredTable.read(path, IdentifyError)
    header, lines = table.header, table.lines
    angles = tuple(f"q{i + 1}" for i in range(joints))
    table.require((*angles, *FORCE, *SHIFT))
    for group in (MOMENT, TURN, LOAD_POINT, MEASURED_POINT):
        table.require_whole(group)
    measured = SHIFT + TURN if table.has(TURN) else SHIFT
    load = FORCE + MOMENT if table.has(MOMENT) else FORCE
    wrench = np.zeros((len(lines), 6))
    wrench[:, : len(load)] = table.of(load)
    deviations = np.full((len(lines), 6), np.nan)
    deviations[:, : len(load)] = table.deviations(load)
    return Measurements(
        table.names(),
        table.of(angles),
        wrench,
        table.of(measured),
        table.of(LOAD_POINT) if table.has(LOAD_POINT) else np.zeros((len(lines), 3)),
        table.of(MEASURED_POINT) if table.has(MEASURED_POINT) else np.zeros((len(lines), 3)),
        table.deviations(measured),
        deviations,
        _remarks(header, joints),
        loops_of(table, (*angles, *LOAD_POINT) if table.has(LOAD_POINT) else angles),
    )


def _remarks(header: list[str], joints: int) -> tuple[str, ...]:
    more = [name for name in header if re.fullmatch(r"q\d+", name) and int(name[1:]) > joints]
    if not more:
        return ()
    return (f"columns {', '.join(more)} are not used: the robot has {joints} joints",)


def loops_of(table: MeasuredTable, constant: Sequence[str]) -> np.ndarray | None:
    """Return the number of each row's loop, (k,); None without the column.

    Args:
        constant: Columns that stay as they are within a loop: drives, and where the load acts.

    Raises:
        IdentifyError: With line, if a number is none, or rows are no loops.
    """
    if not table.has((LOOP,)):
        return None
    numbers = table.of((LOOP,))[:, 0]
    uneven = np.flatnonzero(numbers != np.round(numbers))
    if len(uneven):
        raise table.row_error(LOOP, int(uneven[0]), "the whole number of a loop")
    starts = np.flatnonzero(np.append(True, np.diff(numbers) != 0.0))
    states = table.of(constant)
    for start, end in zip(starts, [*starts[1:], len(numbers)], strict=True):
        if numbers[start] in numbers[:start]:
            raise table.row_error(
                LOOP, int(start), "the rows of a loop one after the other, as they were loaded"
            )
        if end - start < 2:
            raise table.row_error(
                LOOP, int(start), "two rows or more of each loop, the way and back"
            )
        changed = np.argwhere(np.any(states[start:end] != states[start], axis=0))
        if len(changed):
            name, column = constant[int(changed[0, 0])], int(changed[0, 0])
            row = int(start + np.argmax(states[start:end, column] != states[start, column]))
            raise table.row_error(
                name, row, f"as in the first row of its loop, {states[start, column]:.6g}"
            )
    if len(starts) < 2:
        raise table.row_error(LOOP, 0, "two loops or more, as each is predicted by the others")
    return numbers.astype(int)


@dataclass(frozen=True)
class MeasurementNoise:
    """Standard deviations of every number measured.

    Attributes:
        deflection: Deviations of deflections [m] and [rad], (k, r).
        wrench: Deviations of loads [N, N m], (k, 6).
        is_known: Whether those of the deflection were given; else they are estimated from residuals, one
            for positions and one for rotations.
    """

    deflection: np.ndarray
    wrench: np.ndarray
    is_known: bool

    def estimated(self, residual: np.ndarray) -> MeasurementNoise:
        """Return the noise, deviations not given taken from residuals [m, rad], (k, r)."""
        if self.is_known:
            return self
        deflection = np.ones_like(residual)
        if residual.shape[1] == 6:
            # Only their ratio counts: no more rotations than positions, and neither without noise.
            position, rotation = (
                np.sqrt(np.mean(part**2)) for part in (residual[:, :3], residual[:, 3:])
            )
            if position > 0.0 and rotation > 0.0:
                deflection[:, 3:] = rotation / position
        return replace(self, deflection=deflection)


def noise_of(
    measured: Measurements,
    position: float | None = None,
    rotation: float | None = None,
    force: float | None = None,
    moment: float | None = None,
) -> MeasurementNoise:
    """Return the noise of measurements: their own columns, else one number for all rows.

    Args:
        position, rotation, force, moment: Standard deviations [m, rad, N, N m], or None.

    Raises:
        IdentifyError: If some are given and others that are needed beside them are not, or one of a
            deflection is zero.
    """
    common = np.repeat([_or_nan(position), _or_nan(rotation)], 3)[: measured.rows]
    stated = measured.deflection_deviation
    deflection = np.where(np.isfinite(stated), stated, common)
    wrench = np.where(
        np.isfinite(measured.wrench_deviation),
        measured.wrench_deviation,
        np.repeat([_or_nan(force), _or_nan(moment)], 3),
    )
    wrench = np.where(np.isfinite(wrench), wrench, 0.0)
    is_given = np.isfinite(deflection)
    if not is_given.any():
        if wrench.any():
            raise IdentifyError(
                "standard deviations: expected those of the deflections (--sd-m, or columns sd.dx .."
                " sd.dz) beside those of the loads, got none"
            )
        return MeasurementNoise(np.ones_like(deflection), wrench, is_known=False)
    if not is_given.all():
        raise IdentifyError(
            "standard deviations: expected one of every number measured, got none of some: give"
            " --sd-m (and --sd-rad for rotations) for all that have no column"
        )
    if not np.all(deflection > 0.0):
        raise IdentifyError("standard deviations: expected numbers > 0 of deflections, got 0")
    return MeasurementNoise(deflection, wrench, is_known=True)


def whitening(noise: MeasurementNoise, by_wrench: np.ndarray) -> np.ndarray:
    """Return W_i with W_i S_i W_i^T = 1, S_i = diag(sd_d^2) + D_i diag(sd_w^2) D_i^T, (k, r, r).

    It takes deflections in [m] and [rad] to whitened ones [1].

    Args:
        noise: Standard deviations sd_d and sd_w.
        by_wrench: D, derivative of the deflections by the loads [m/N, rad/(N m), ..], (k, r, 6).
    """
    # In standard deviations of the deflection, so that metres and radians do not mix.
    scaled = by_wrench * noise.wrench[:, None, :] / noise.deflection[:, :, None]
    covariance = np.eye(scaled.shape[1]) + scaled @ scaled.swapaxes(1, 2)
    root = np.linalg.cholesky(covariance)
    return np.linalg.inv(root) / noise.deflection[:, None, :]


def rms(errors: np.ndarray) -> float:
    """Return the root mean square over all components of positions [m], of (k, r)."""
    return float(np.sqrt(np.mean(errors[:, :3] ** 2)))


def _or_nan(value: float | None) -> float:
    return np.nan if value is None else value

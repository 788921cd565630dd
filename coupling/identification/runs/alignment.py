"""A measured run on the clock and in the frame of its run, nearly: the fit does the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coupling.errors import LearnError
from coupling.identification.runs.lost_target import require_steady, rows_of_target
from coupling.identification.runs.measurement import Measurement, SimulatedPath
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath

# How far a clock may be off [s], and how finely that is looked for.
_OFF, _FINE = 2.0, 0.02
# Samples that are compared for it.
_COMPARED = 400
# Shortest measured run that is worth a fit [s], and smallest extent of its path [m].
_SHORTEST, _SMALLEST = 2.0, 1e-3
# What a measuring frame that is said to be the robot's may be off [m], and what a run of this command
# may be off behind that, which on a small part is less: another path there is off by as much as it is
# large.
_FRAME_OFF, _LEFT, _LEFT_OF_PATH = 0.05, 0.01, 0.5
# Offset of a clock that is named where it leaves too little of the run [s].
_CLOCK_TOLD = 0.1
# What a clock may gain over a run [s], where that explains half of what is off at least.
_GAINED, _EXPLAINED = 0.008, 0.5
# What orientations of the measured run may be off [rad].
_TURNED = 0.02
# Smallest extent of the path across its longest from which a frame is found, as a part.
_PLANE = 0.02
# Rows that are slower [s], over so many times the run's duration, have times in other units.
_SLOW, _LONG = 0.5, 20.0


def aligned(
    measured: Measurement, model: ToolPath, own_frame: bool, offset: float | None = None
) -> Measurement:
    """Return what was measured during the run, on the command's clock and in the robot's base frame.

    Rows that a device wrote while it had lost its target are left out.

    Args:
        model: Path of the model's tool under the command.
        own_frame: Whether the measuring frame lies anywhere; else it is the base frame, nearly.
        offset: Time to add to the measurement's clock [s]; None: that of `clock_offset`.

    Raises:
        LearnError: If it is no measured run of this command, too little of one, or not of the tool all
            along.
    """
    _require_length_unit(measured, model)
    _require_seconds(measured, model)
    path = SimulatedPath(model)
    offset = clock_offset(measured, model) if offset is None else offset
    measured = replace(measured, time=measured.time + offset, clock=measured.clock + offset)
    inside = (measured.time >= model.time[0]) & (measured.time <= model.time[-1])
    measured = measured.at_rows(np.flatnonzero(inside))
    covered = float(np.ptp(measured.time)) if len(measured.time) else 0.0
    if covered < _SHORTEST:
        shifted = (
            f", as its positions fit the run best with the clock shifted by {offset:.3g} s: was it"
            " measured under another command, or with the tool at rest?"
        )
        raise LearnError(
            f"{measured.name}: expected at least {_SHORTEST:g} s of the run, which lasts from"
            f" {model.time[0]:.6g} to {model.time[-1]:.6g} s, got {covered:.3g} s of it"
            f"{shifted if abs(offset) > _CLOCK_TOLD else ''}"
        )
    measured = measured.at_rows(
        rows_of_target(measured.name, measured.position, path.position(measured.time))
    )
    if np.ptp(measured.time) < _SHORTEST:
        raise LearnError(
            f"{measured.name}: expected at least {_SHORTEST:g} s of a moving tool, got"
            f" {np.ptp(measured.time):.3g} s, as all other positions repeat the previous one: was the"
            " tool at rest, or has the device lost its target?"
        )
    there = path.position(measured.time)
    if np.ptp(there, axis=0).max() < _SMALLEST:
        raise LearnError(
            f"{measured.name}: expected a moving tool, got a part of the run in which it is at rest"
        )
    if own_frame:
        measured = _turned_back(measured, there)
        _require_same_pace(measured, path)
    else:
        _require_same_pace(measured, path)
        _require_base_frame(measured, there)
    residual = _spread(measured.position - there)
    most = min(_LEFT, max(_SMALLEST, _LEFT_OF_PATH * _spread(there)))
    if residual > most:
        raise LearnError(
            f"{measured.name}: expected a path within about {1e3 * most:.2g} mm of the run's, got"
            f" {1e3 * residual:.3g} mm rms: was it measured under another command, on a clock that"
            " differs by seconds, or in other axes (--own-frame)?"
        )
    require_steady(measured.name, measured.time, measured.position - there)
    return _mounted(measured, path)


def _require_seconds(measured: Measurement, model: ToolPath) -> None:
    """Refuse slow rows over many times the duration of the run: other units of time."""
    step, lasts = float(np.median(np.diff(measured.time))), float(np.ptp(model.time))
    if step > _SLOW and np.ptp(measured.time) > _LONG * lasts:
        raise LearnError(
            f"{measured.name}: expected times in s, of a run that lasts {lasts:.4g} s, got"
            f" {np.ptp(measured.time):.4g} s with a row each {step:.3g} s: are they in ms (--unit ms)?"
        )


def _spread(position: np.ndarray) -> float:
    """Return the rms distance of points from their mean [m]."""
    return float(np.sqrt(np.mean(np.sum((position - position.mean(axis=0)) ** 2, axis=1))))


def _mounted(measured: Measurement, path: SimulatedPath) -> Measurement:
    """Return the measurement with orientations of the tool, not of the probe that is mounted on it.

    Raises:
        LearnError: If orientations do not turn as the tool does.
    """
    if measured.rotation is None:
        return measured
    there = path.rotation(measured.time)
    on_tool = there.inv() * measured.rotation
    turn_from_tool = measured.rotation * on_tool.mean().inv()
    residual = float(np.sqrt(np.mean((turn_from_tool * there.inv()).magnitude() ** 2)))
    if residual > _TURNED:
        raise LearnError(
            f"{measured.name}: expected the tool's orientations to {1e3 * _TURNED:g} mrad, but for a"
            f" constant rotation of the probe on the tool, got a difference of {1e3 * residual:.3g} mrad"
            " rms: omit qx, qy, qz, qw, or give them in the frame of x, y, z"
        )
    return replace(measured, rotation=turn_from_tool)


def _require_length_unit(measured: Measurement, model: ToolPath) -> None:
    """Refuse a path that has the size of the run's in another unit."""
    sizes = [
        float(np.linalg.norm(np.ptp(points, axis=0)))
        for points in (measured.position, model.position[0])
    ]
    far = [float(np.abs(points).max()) for points in (measured.position, model.position[0])]
    for ratio in (sizes[0] / max(sizes[1], 1e-12), far[0] / max(far[1], 1e-12)):
        if 300.0 < ratio < 3000.0:
            raise LearnError(
                f"{measured.name}: expected x, y, z in m, got numbers about {ratio:.0f} times those of"
                " the run: are they in mm?"
            )


def clock_offset(measured: Measurement, model: ToolPath) -> float:
    """Return what brings the clock of a measurement nearly to the run's [s].

    Args:
        model: Path of the model's tool under the command.
    """
    path = SimulatedPath(model)
    rows = np.unique(np.linspace(0, len(measured.time) - 1, _COMPARED).astype(int))
    time, position = measured.time[rows], measured.position[rows]
    near = np.arange(-_OFF, _OFF + 0.5 * _FINE, _FINE)
    same = float(model.time[0] - measured.time[0])
    best, least = 0.0, np.inf
    # Clocks alike, or both from the start of what they tell; a small difference is preferred.
    for offset in np.concatenate([near[np.argsort(np.abs(near))], same + near]).tolist():
        inside = (time + offset >= model.time[0]) & (time + offset <= model.time[-1])
        if np.count_nonzero(inside) < 0.5 * len(rows):
            continue
        there = path.position(time[inside] + offset)
        residual = _shape_difference(position[inside], there)
        if residual < 0.98 * least:
            best, least = offset, residual
    return best


def _shape_difference(position: np.ndarray, there: np.ndarray) -> float:
    """Return the rms distance of two paths, one moved and turned onto the other [m]."""
    centred, other = position - position.mean(axis=0), there - there.mean(axis=0)
    singular = np.linalg.svd(centred.T @ other, compute_uv=False)
    squares = np.sum(centred**2) + np.sum(other**2) - 2.0 * np.sum(singular)
    return float(np.sqrt(max(squares, 0.0) / len(centred)))


def _turned_back(measured: Measurement, there: np.ndarray) -> Measurement:
    """Return a path of any frame, moved and turned onto the model's."""
    extents = np.linalg.svd(there - there.mean(axis=0), compute_uv=False)
    if extents[1] < _PLANE * extents[0]:
        raise LearnError(
            f"{measured.name}: expected a path that is not a line, to determine the measuring frame,"
            " got a line: measure in the robot's base frame"
        )
    base_from_device = Frame.fitted(measured.position, there)
    return replace(
        measured.transformed(base_from_device), device_from_base=base_from_device.inverse()
    )


def _require_same_pace(measured: Measurement, path: SimulatedPath) -> None:
    """Refuse a clock that runs faster or slower than the command's, or a command that did."""
    time = measured.time - measured.time.mean()
    rate = path.position(measured.time, 1)
    off, late, slow = (
        (column - column.mean(axis=0)).ravel()
        for column in (measured.position - path.position(measured.time), rate, rate * time[:, None])
    )
    columns = np.stack([late, slow], axis=1)
    residuals = []
    for fitted in (columns[:, :1], columns):
        solution = np.linalg.lstsq(fitted, off, rcond=None)[0]
        residuals.append(float(np.linalg.norm(off - fitted @ solution)))
    pace = float(solution[1])
    if abs(pace) * np.ptp(time) > _GAINED and residuals[1] < _EXPLAINED * residuals[0]:
        raise LearnError(
            f"{measured.name}: expected the speed of the command, got a run that is"
            f" {100.0 * abs(pace):.2g} % {'faster' if pace > 0.0 else 'slower'}, by"
            f" {1e3 * abs(pace) * np.ptp(time):.2g} ms at its end: does the device's clock run at"
            " another rate, or was the robot's speed overridden?"
        )


def _require_base_frame(measured: Measurement, there: np.ndarray) -> None:
    off = measured.position.mean(axis=0) - there.mean(axis=0)
    if np.linalg.norm(off) > _FRAME_OFF:
        x, y, z = off.tolist()
        raise LearnError(
            f"{measured.name}: expected positions of the TCP in the robot's base frame, got a mean"
            f" difference of {x:.3g}, {y:.3g}, {z:.3g} m: give --own-frame if the pose of the measuring"
            " frame is unknown"
        )

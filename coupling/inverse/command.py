"""The best command of a drive on the controller's rows."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_banded

from coupling.inverse.fit import Drive, Fit, end_conditions
from coupling.inverse.gear_drive import GearDrive, GearTask
from coupling.inverse.limited import DriveLimits, keep_within
from coupling.inverse.rigid_drive import RigidDrive
from coupling.inverse.rows import Rows
from coupling.inverse.spline import UniformSpline


def gear_command(task: GearTask, rows: Rows, limits: DriveLimits) -> UniformSpline:
    """Return the angle q of an elastic joint's drive, one column.

    Raises:
        PlanningError: If the path itself asks for more than the limits allow.
    """
    exact = RigidDrive.of(task.link, rows)
    nodes = rows.start + rows.cycle / exact.layout.parts * np.arange(exact.layout.nodes)
    twist = np.interp(nodes, task.time, task.twist)
    drive = GearDrive.of(task, rows)
    return _command(drive, rows, exact.link - twist, limits)


def rigid_command(link: UniformSpline, rows: Rows, limits: DriveLimits) -> UniformSpline:
    """Return the angle q of a rigid joint's drive, one column; errors as in `gear_command`."""
    drive = RigidDrive.of(link, rows)
    return _command(drive, rows, drive.link, limits)


def _command(drive: Drive, rows: Rows, exact: np.ndarray, limits: DriveLimits) -> UniformSpline:
    fit = Fit.whole(drive, end_conditions(rows, float(exact[0])))
    start = _through(exact[:: drive.layout.parts], rows)
    coefficients, misses = fit.solve(start, np.zeros(drive.layout.nodes), fit.band_step)
    coefficients, misses = keep_within(fit, rows, limits, coefficients, misses)
    return UniformSpline(rows.start, rows.cycle, coefficients[:, None], rows.degree)


def _through(values: np.ndarray, rows: Rows) -> np.ndarray:
    """Return coefficients of a spline through the rows, at rest at both ends: a first guess."""
    from coupling.inverse.spline import stencil

    k, n = rows.degree, rows.count
    size = n + k
    outer = (k - 1) // 2
    at = [stencil(np.zeros(1), k, order)[0][:k] for order in range(outer + 1)]
    band = np.zeros((2 * k + 1, size))
    right = np.zeros(size)

    def put(row: int, first: int, weights: np.ndarray) -> None:
        for j, w in enumerate(weights):
            band[k + row - (first + j), first + j] = w

    for order in range(1, outer + 1):
        put(order - 1, 0, at[order])
        put(size - order, n, at[order])
    i = np.arange(n + 1)
    for j, w in enumerate(at[0]):
        band[k + outer - j, i + j] = w
    right[outer : outer + n + 1] = values
    return solve_banded((k, k), band, right)

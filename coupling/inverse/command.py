"""The best command of a drive on the controller's rows."""

from __future__ import annotations

import numpy as np

from coupling.inverse.drive_limits import DriveLimits, NoCommandError
from coupling.inverse.fit import SplineFit, end_conditions
from coupling.inverse.gear_drive import GearDrive, GearTask
from coupling.inverse.limited_fit import keep_within
from coupling.inverse.rows import CommandRows
from coupling.inverse.rows_fit import RowsFit, dense_chunks, dense_times
from coupling.inverse.spline import UniformSpline
from elastic_robot.kinematic_errors import NO_ERRORS, KinematicErrors


def gear_command(task: GearTask, rows: CommandRows, limits: DriveLimits) -> UniformSpline:
    """Return the command of an elastic joint under which its link moves best as wanted.

    It starts where the link is in equilibrium, u(q) = phi - e0, and minimises the miss of the link as
    the scalar robot of its gear (`GearDrive`) moves under it, not the distance from the exact drive:
    between its rows a command cannot follow that, but what it gives too much in one place it can take
    back in the next before the link has moved.

    Args:
        task: Loads of the gear.
        rows: Rows of the controller; `task.link` covers them.
        limits: Kept at all times, between rows as well.

    Returns:
        Angle q of the drive [rad], one column, of the rows' degree: at 5 its rows of angle, rate and
        acceleration give it back, at 3 its rows of angles.

    Raises:
        PlanningError: If the path itself passes a limit; with joint, time, value and limit.
    """
    drive = GearDrive.of(task, rows)
    times = np.linspace(rows.start, rows.end, drive.layout.nodes)
    output = drive.link[::4] - np.interp(times, task.time, task.wind_up)
    exact = task.errors.motor_angle(output[:, None])[:, 0]
    limits.require_reach(times, exact)
    fit = SplineFit.whole(drive, end_conditions(rows, float(exact[0])))
    still = range(1, (rows.degree + 1) // 2)
    values = exact[:: drive.layout.parts, None]
    start = UniformSpline.through(rows.start, rows.cycle, values, rows.degree, (still, still))
    coefficients, misses = fit.solve(start.coefficients[:, 0], np.zeros(drive.layout.nodes))
    try:
        coefficients, misses = keep_within(fit, limits, coefficients, misses)
    except NoCommandError as error:
        raise limits.lost(task.link, rows) from error
    limits.require_followed(task.link, rows, misses)
    return UniformSpline(rows.start, rows.cycle, coefficients[:, None], rows.degree)


def rigid_command(
    link: UniformSpline, rows: CommandRows, limits: DriveLimits, errors: KinematicErrors = NO_ERRORS
) -> UniformSpline:
    """Return the command of a rigid joint that is nearest to its link; the rest as in `gear_command`."""
    motor = np.empty(len(dense_times(rows)))
    for here, times in dense_chunks(rows):
        inside = np.clip(times, link.start, link.end)
        motor[here] = errors.motor_angle(link.at(inside))[:, 0]
        limits.require_reach(times, motor[here])
    both = np.clip([rows.start, rows.end], link.start, link.end)
    at_ends = np.stack([link.at(both, order) for order in range(3)])
    begins, ends = (tuple(column.tolist()) for column in errors.at_motor(at_ends)[..., 0].T)
    if rows.degree == 3:
        begins, ends = (begins[0], 0.0), ()  # at rest at its ends, whatever its path is
    fit = RowsFit(None, rows, motor, begins, ends[1:])
    try:
        coefficients = fit.best(limits)
    except NoCommandError as error:
        raise limits.lost(link, rows) from error
    limits.require_followed(link, rows, fit.missed(coefficients))
    return UniformSpline(rows.start, rows.cycle, coefficients[:, None], rows.degree)

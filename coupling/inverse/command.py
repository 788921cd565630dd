"""The best command of a drive on the controller's rows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_banded

from coupling.inverse.fit import DriveEquations, SplineFit, end_conditions
from coupling.inverse.gear_drive import GearDrive, GearTask, wanted_bend
from coupling.inverse.limited import NoCommandError, keep_within
from coupling.inverse.limits import DriveLimits
from coupling.inverse.rows import CommandRows, Layout
from coupling.inverse.spline import UniformSpline, stencil
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
    exact = RigidDrive.of(task.link, rows).link
    times = np.linspace(rows.start, rows.end, len(exact))
    output = exact - np.interp(times, task.time, task.wind_up)
    exact = task.errors.motor_angle(output[:, None])[:, 0]
    return _command(GearDrive.of(task, rows), task.link, rows, exact, limits)


def rigid_command(
    link: UniformSpline, rows: CommandRows, limits: DriveLimits, errors: KinematicErrors = NO_ERRORS
) -> UniformSpline:
    """Return the command of a rigid joint that is nearest to its link; the rest as in `gear_command`."""
    drive = replace(RigidDrive.of(link, rows), errors=errors)
    exact = errors.motor_angle(drive.link[:, None])[:, 0]
    return _command(drive, link, rows, exact, limits)


def _command(
    drive: DriveEquations,
    link: UniformSpline,
    rows: CommandRows,
    exact: np.ndarray,
    limits: DriveLimits,
) -> UniformSpline:
    """Return the best command; `exact` is the drive's motion without rows at the nodes [rad]."""
    limits.require_reach(np.linspace(rows.start, rows.end, len(exact)), exact)
    fit = SplineFit.whole(drive, end_conditions(rows, float(exact[0])))
    start = _through(exact[:: drive.layout.parts], rows)
    coefficients, misses = fit.solve(start, np.zeros(drive.layout.nodes), SplineFit.band_step)
    try:
        coefficients, misses = keep_within(fit, limits, coefficients, misses)
    except NoCommandError as error:
        raise limits.lost(link, rows) from error
    limits.require_followed(link, rows, misses)
    return UniformSpline(rows.start, rows.cycle, coefficients[:, None], rows.degree)


def _through(values: np.ndarray, rows: CommandRows) -> np.ndarray:
    """Return the coefficients of the spline through values at the rows, at rest at both ends."""
    degree, still = rows.degree, (rows.degree - 1) // 2
    weights = [stencil(np.zeros(1), degree, order)[0][:degree] for order in range(still + 1)]
    size = rows.count + degree
    band, right = np.zeros((2 * degree + 1, size)), np.zeros(size)
    right[still : size - still] = values
    columns = np.arange(rows.count + 1)
    for j, weight in enumerate(weights[0]):
        band[degree + still - j, columns + j] = weight
        for order in range(1, still + 1):
            band[degree + order - 1 - j, j] = weights[order][j]
            band[2 * degree - order - j, rows.count + j] = weights[order][j]
    coefficients: np.ndarray = solve_banded((degree, degree), band, right)
    return coefficients


@dataclass(frozen=True)
class RigidDrive:
    """The link of a rigid joint, which misses its motion by  delta = u(q) - phi  at the nodes.

    Attributes:
        layout: Order of the unknowns.
        cycle: Distance of the rows [s].
        first: Whether the path begins here.
        link: phi at the nodes [rad], (nodes,).
        bend: phi'' where the coefficients of the command's acceleration stand [rad/s^2], (n,).
        errors: Kinematic error of the joint.
    """

    layout: Layout
    cycle: float
    first: bool
    link: np.ndarray
    bend: np.ndarray
    errors: KinematicErrors = NO_ERRORS

    @classmethod
    def of(cls, link: UniformSpline, rows: CommandRows) -> RigidDrive:
        """Return the drive of a rigid joint along all rows."""
        layout = Layout.of(rows)
        nodes = rows.start + rows.cycle / layout.parts * np.arange(layout.nodes)
        return cls(layout, rows.cycle, True, link.at(nodes)[:, 0], wanted_bend(link, rows))

    def along(self, coefficients: np.ndarray, misses: np.ndarray) -> RigidDrive:
        """Return the drive as it is."""
        del coefficients, misses
        return self

    def part(self, begin: int, end: int) -> RigidDrive:
        """Return the drive along the intervals begin to end of the rows."""
        parts, degree = self.layout.parts, self.layout.degree
        return replace(
            self,
            layout=replace(self.layout, count=end - begin),
            first=self.first and begin == 0,
            link=self.link[begin * parts : end * parts + 1],
            bend=self.bend[begin : end + degree - 2],
        )

    @property
    def _value(self) -> np.ndarray:
        """Weights of an interval's coefficients at the ends of its steps, (parts, degree + 1)."""
        parts = self.layout.parts
        return stencil(np.arange(1, parts + 1) / parts, self.layout.degree, 0)

    def defects(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return delta - u(q) + phi at the ends of the steps [rad], (n, parts)."""
        wanted = (misses + self.link)[1:].reshape(-1, self.layout.parts)
        defects: np.ndarray = wanted - self.errors.output_angle(self._drive(coefficients))[..., 0]
        return defects

    def _drive(self, coefficients: np.ndarray) -> np.ndarray:
        """Return q at the ends of the steps [rad], (n, parts, 1)."""
        local = np.lib.stride_tricks.sliding_window_view(coefficients, self.layout.degree + 1)
        drive: np.ndarray = (local @ self._value.T)[..., None]
        return drive

    def gradient(self, coefficients: np.ndarray, misses: np.ndarray) -> np.ndarray:
        """Return the derivatives of `defects` by the unknowns of their blocks, (n, parts, width)."""
        layout = self.layout
        rows = np.zeros((layout.count, layout.parts, layout.width))
        rise = self.errors.slope(self._drive(coefficients))
        rows[:, :, layout.block_coefficient[1:]] = -rise * self._value
        steps = np.arange(layout.parts)
        rows[:, steps, layout.block_miss[steps + 2]] = 1.0
        return rows

"""The equation of motion as a residual, and its derivatives with respect to all it depends on.

    r = M(theta) theta'' + h(theta, theta') - J(theta)^T w + S(x) + H(s) + d x'        rows of x

with the force K (a - p) of a spring at the TCP in the wrench w, and the torque H of the elements of the
gears' hysteresis (`hysteresis.py`).

`docs/derivatives.md` has the formulas and where they come from.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg.lapack import dposv

from elastic_robot.chain import Chain
from elastic_robot.dynamics import Dynamics
from elastic_robot.hysteresis import NO_HYSTERESIS, HeldHysteresis
from elastic_robot.parameter_names import ByParameter, parameter_names
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import Branch, TorqueCurve


@dataclass(frozen=True)
class OperatingPoint:
    """One state, or k states at once, at which the equation of motion is evaluated.

    Attributes:
        drives: q, q', q'' of the drives at their gears' outputs [rad, rad/s, rad/s^2], (3, n) or
            (3, k, n).
        motion: x, x', x'' [rad, rad/s, rad/s^2], (3, m) or (3, k, m).
        acting: Loads on the tool, in the one state, in all or in each of them.
        region: Number of each coordinate's branch of the torque curve, `TorqueCurve.region`, (m,).
        hysteresis: What the elements of the gears add in each state.
    """

    drives: np.ndarray
    motion: np.ndarray
    acting: ToolLoad
    region: np.ndarray
    hysteresis: HeldHysteresis = NO_HYSTERESIS


@dataclass(frozen=True)
class ResidualDerivatives:
    """Derivatives of the residual; of k states, every array has k as its first axis.

    Attributes:
        x, rate, acceleration: Derivatives by x, x', x'' [N m/rad, N m s/rad, kg m^2], (m, m) each.
        drive, drive_rate, drive_acceleration: By q, q', q'' [N m/rad, N m s/rad, kg m^2], (m, n) each;
            at the gears' outputs, or after `by_motors` of the motors.
        wrench: Derivative by the wrench [m, 1], (m, 6).
        anchor: Derivative by the anchor of the spring at the TCP [N], (m, 3).
        spring: Derivative by its stiffness, entries xx xy xz yy yz zz [m^2], (m, 6).
        parameters: Derivatives by every parameter [N m per its unit], (m, p).
    """

    x: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    drive: np.ndarray
    drive_rate: np.ndarray
    drive_acceleration: np.ndarray
    wrench: np.ndarray
    anchor: np.ndarray
    spring: np.ndarray
    parameters: ByParameter

    def by_motors(self, output_by_motor: np.ndarray) -> ResidualDerivatives:
        """Return them by the motors, with `KinematicErrors.gradient` in its units, (3 n, 3 n)."""
        at_output = np.concatenate([self.drive, self.drive_rate, self.drive_acceleration], axis=-1)
        by = np.split(at_output @ output_by_motor, 3, axis=-1)
        return replace(self, drive=by[0], drive_rate=by[1], drive_acceleration=by[2])


def residual(
    dynamics: Dynamics, curve: TorqueCurve, damping: np.ndarray, point: OperatingPoint
) -> np.ndarray:
    """Return r [N m], (m,) or (k, m).

    Args:
        dynamics: Forces of the robot.
        curve: Torque curve S.
        damping: d [N m s/rad], (m,).
        point: State, drives and wrench to evaluate at.
    """
    x, rate, _ = point.motion
    theta, theta_rate, theta_acceleration = _states(dynamics.chain, point)
    loads = dynamics.loads(theta, theta_rate, theta_acceleration, point.acting)
    gear_torque: np.ndarray = curve.in_region(point.region).torque(x) + damping * rate
    return gear_torque + point.hysteresis.torque + loads.reshape(x.shape)


def residual_derivatives(
    dynamics: Dynamics, curve: TorqueCurve, damping: np.ndarray, point: OperatingPoint
) -> ResidualDerivatives:
    """Return the derivatives of `residual` [N m per unit], (m, ..); the arguments are the same.

    A state on the edge of a backlash has the derivatives of the branch that `point.region` names; the
    elements of hysteresis stick or slip as they do there.
    """
    chain, branch = dynamics.chain, curve.in_region(point.region)
    theta, theta_rate, theta_acceleration = _states(chain, point)
    loads = dynamics.load_derivatives(theta, theta_rate, theta_acceleration, point.acting)
    x, rate, _ = point.motion
    leading = x.shape[:-1]

    def columns(matrix: np.ndarray, index: np.ndarray) -> np.ndarray:
        return matrix[..., index].reshape(*leading, chain.elastic_count, len(index))

    by_x = columns(loads.angle, chain.elastic)
    by_rate = columns(loads.rate, chain.elastic)
    diagonal = np.arange(chain.elastic_count)
    by_x[..., diagonal, diagonal] += branch.slope(x) + point.hysteresis.slope
    by_rate[..., diagonal, diagonal] += damping
    return ResidualDerivatives(
        x=by_x,
        rate=by_rate,
        acceleration=columns(loads.acceleration, chain.elastic),
        drive=columns(loads.angle, chain.drive),
        drive_rate=columns(loads.rate, chain.drive),
        drive_acceleration=columns(loads.acceleration, chain.drive),
        wrench=columns(loads.wrench, np.arange(6)),
        anchor=columns(loads.anchor, np.arange(3)),
        spring=columns(loads.spring, np.arange(6)),
        parameters=by_parameter(
            chain, branch, x, rate, columns(loads.gravity, np.arange(3)), point.hysteresis
        ),
    )


def by_parameter(
    chain: Chain,
    curve: Branch,
    x: np.ndarray,
    rate: np.ndarray,
    of_gravity: np.ndarray,
    hysteresis: HeldHysteresis,
) -> ByParameter:
    """Return the columns of the parameters: a spring's or damper's own only act on its coordinate.

    Args:
        curve: Torque curve, or a branch of it.
        x, rate: Elastic coordinates and their rates [rad, rad/s], (..., m).
        of_gravity: Columns of gravity [kg m], (..., m, 3).
        hysteresis: What the elements of the gears add.
    """
    names, m, torsions = parameter_names(chain), chain.elastic_count, chain.torsions
    values, rows = np.zeros((*x.shape, len(names))), np.arange(m)
    values[..., :3] = of_gravity
    values[..., rows, 3 + rows] = curve.stiffness_gradient(x)
    values[..., rows, 3 + m + rows] = rate
    values[..., torsions, 3 + 2 * m + np.arange(len(torsions))] = curve.backlash_gradient(x)[
        ..., torsions
    ]
    gears = chain.elements.gears
    by_slip_torque = np.broadcast_to(hysteresis.gradient, x.shape)[..., gears]
    values[..., gears, len(names) - len(gears) + np.arange(len(gears))] = by_slip_torque
    return ByParameter(names, values)


def free_acceleration(
    dynamics: Dynamics,
    drives: np.ndarray,
    x: np.ndarray,
    rate: np.ndarray,
    acting: ToolLoad,
    gear_torque: np.ndarray,
) -> np.ndarray:
    """Return the x'' [rad/s^2] of one state that makes its residual zero, (m,).

    Args:
        dynamics: Forces of the robot.
        drives: q, q', q'' of the drives, behind their gears' errors [rad, rad/s, rad/s^2], (3, n).
        x, rate: Elastic coordinates and their rates [rad, rad/s], (m,).
        acting: Loads on the tool.
        gear_torque: S + H + d x' [N m], (m,).
    """
    motion = np.array([x, rate, np.zeros(len(x))])
    theta, theta_rate, of_drives = dynamics.chain.theta(drives, motion)
    torque = gear_torque + dynamics.loads(theta, theta_rate, of_drives, acting)
    if len(x) == 0:  # which LAPACK refuses
        return torque
    # The mass matrix is positive definite; of numbers beyond all bounds there is no acceleration.
    _, acceleration, failed = dposv(dynamics.mass_matrix(theta), -torque)
    return np.full(len(x), np.nan) if failed else acceleration


def _states(chain: Chain, point: OperatingPoint) -> np.ndarray:
    """Return theta, theta', theta'' of all states, (3, k, angles)."""
    return chain.theta(point.drives, point.motion).reshape(3, -1, chain.model.nv)

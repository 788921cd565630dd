"""The robot linearised at a state: state space, dynamic compliance of the TCP, modes.

    M dx'' + D dx' + K dx = F u        dy = C (dx, dx') + D u

with the derivatives of the residual as M, D and K (docs/derivatives.md).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import ParameterError
from elastic_robot.kinematics import tcp_jacobian, tcp_velocity_gradient
from elastic_robot.residual import OperatingPoint, residual_derivatives
from elastic_robot.torque_curves import TorqueCurve

OUTPUTS = tuple(f"tcp.{kind}{axis}" for kind in ("", "r", "v", "w") for axis in "xyz")


@dataclass(frozen=True)
class Modes:
    """Eigenvalues of a linearised robot and the motion that belongs to each.

    One entry of each conjugate pair, with the imaginary part >= 0; slowest first.

    Attributes:
        eigenvalue: Eigenvalues [1/s], complex, (k,).
        shape: Elastic coordinates [rad], the largest scaled to 1, complex, (m, k).
        tcp: Displacement [m] and small rotation [rad] of the TCP in that motion, complex, (6, k).
    """

    eigenvalue: np.ndarray
    shape: np.ndarray
    tcp: np.ndarray

    @property
    def frequency(self) -> np.ndarray:
        """Eigenfrequency |lambda| / (2 pi), as without damping [Hz], (k,); nan where nothing swings."""
        swings = self.eigenvalue.imag > 0.0
        return np.where(swings, np.abs(self.eigenvalue) / (2.0 * np.pi), np.nan)

    @property
    def damping_ratio(self) -> np.ndarray:
        """Damping ratio -Re(lambda) / |lambda| [1], (k,); nan where lambda is 0."""
        size = np.abs(self.eigenvalue)
        ratio = np.full(size.shape, np.nan)
        return np.divide(-self.eigenvalue.real, size, out=ratio, where=size > 0.0)


@dataclass(frozen=True)
class Linearisation:
    """The robot for small changes of motion, drives and wrench around a state.

    A robot that moves or falls in that state is linearised as if it stayed there: the matrices hold
    for times in which they change little.

    Attributes:
        elastic: Names of the elastic coordinates, m of them.
        mass, damping, stiffness: M [kg m^2], D [N m s/rad], K [N m/rad], (m, m).
        forcing: Matrix F, columns as `inputs`, (m, 6 + 3 n).
        output: Matrix C, rows as `outputs`, (12, 2 m).
        feedthrough: Matrix D of the state space, (12, 6 + 3 n).
    """

    elastic: tuple[str, ...]
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    forcing: np.ndarray
    output: np.ndarray
    feedthrough: np.ndarray

    def by_motors(self, output_by_motor: np.ndarray) -> Linearisation:
        """Return it by the motors, with `KinematicErrors.gradient` in its units, (3 n, 3 n)."""

        def by_motors_alone(columns: np.ndarray) -> np.ndarray:
            return np.hstack([columns[:, :6], columns[:, 6:] @ output_by_motor])

        return replace(
            self,
            forcing=by_motors_alone(self.forcing),
            feedthrough=by_motors_alone(self.feedthrough),
        )

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs u, as in the FMU: wrench [N, N m], q, q', q'' [rad, ..].

        The three of a drive are inputs of their own; who moves a drive must give all three.
        """
        drives = range(1, 1 + (self.forcing.shape[1] - 6) // 3)
        return (
            *(f"{kind}.{axis}" for kind in ("force", "moment") for axis in "xyz"),
            *(f"{kind}[{i}]" for kind in ("q_cmd", "qd_cmd", "qdd_cmd") for i in drives),
        )

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs y of the TCP, base axes.

        Displacement [m] and small rotation [rad] from the pose at the state; change of the
        velocity [m/s] and of the angular velocity [rad/s].
        """
        return OUTPUTS

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states: x, then x'."""
        return (*self.elastic, *(f"{name}.rate" for name in self.elastic))

    @cached_property
    def state_space(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Matrices A (2 m, 2 m), B, C, D of z' = A z + B u, y = C z + D u, as for `scipy.signal`."""
        m = len(self.mass)
        solved = np.linalg.solve(self.mass, np.hstack([self.stiffness, self.damping, self.forcing]))
        a = np.vstack([np.eye(m, 2 * m, k=m), -solved[:, : 2 * m]])
        b = np.vstack([np.zeros_like(self.forcing), solved[:, 2 * m :]])
        return a, b, self.output, self.feedthrough

    @cached_property
    def modes(self) -> Modes:
        """Eigenvalues, eigenfrequencies, damping ratios and shapes.

        A gear inside its backlash has no spring: its eigenvalue is zero up to rounding, unless gravity
        holds it.
        """
        m = len(self.mass)
        values, vectors = np.linalg.eig(self.state_space[0])
        chosen = np.flatnonzero(values.imag >= 0.0)
        chosen = chosen[np.argsort(np.abs(values[chosen]), kind="stable")]
        shape = vectors[:m, chosen].astype(complex)
        for column in shape.T:
            column /= column[np.argmax(np.abs(column))]
        return Modes(values[chosen], shape, self.output[:6, :m] @ shape)

    def dynamic_compliance(self, frequency: np.ndarray) -> np.ndarray:
        """Return the frequency response of the TCP to the wrench, J (K + i w D - w^2 M)^-1 J^T.

        Args:
            frequency: Frequencies [Hz], (k,).

        Returns:
            Complex: displacement [m] and rotation [rad] per N and per N m, (k, 6, 6).

        Raises:
            ParameterError: If the robot is free to move at a frequency (0 Hz with a gear in its
                backlash).
        """
        m, omega = len(self.mass), 2.0 * np.pi * np.asarray(frequency, dtype=float)[:, None, None]
        impedance = self.stiffness + 1j * omega * self.damping - omega**2 * self.mass
        try:
            motion = np.linalg.solve(impedance, self.forcing[None, :, :6])
        except np.linalg.LinAlgError as cause:
            raise ParameterError(
                "frequencies: expected numbers > 0 where a gear is inside its backlash, got one at"
                " which the"
                " dynamic compliance is infinite"
            ) from cause
        return self.output[:6, :m] @ motion


def linearise(
    dynamics: Dynamics, curve: TorqueCurve, damping: np.ndarray, point: OperatingPoint
) -> Linearisation:
    """Linearise the equation of motion and the TCP's pose and velocity at one state.

    Args:
        dynamics: Forces of the robot.
        curve: Torque curve S.
        damping: d [N m s/rad], (m,).
        point: The state, with the x'' of the equation of motion (`free_acceleration`).
    """
    chain = dynamics.chain
    by = residual_derivatives(dynamics, curve, damping, point)
    theta, rate, _ = chain.theta(point.drives, point.motion)
    jacobian = tcp_jacobian(chain, dynamics.data, theta)
    gradient = tcp_velocity_gradient(jacobian, rate)
    elastic, drive, none = jacobian[:, chain.elastic], jacobian[:, chain.drive], np.zeros((6, 6))
    without_elastic, without_drive = np.zeros_like(elastic), np.zeros_like(drive)
    return Linearisation(
        elastic=chain.elastic_names,
        mass=by.acceleration,
        damping=by.rate,
        stiffness=by.x,
        forcing=-np.hstack([by.wrench, by.drive, by.drive_rate, by.drive_acceleration]),
        output=np.block([[elastic, without_elastic], [gradient[:, chain.elastic], elastic]]),
        feedthrough=np.block(
            [
                [none, drive, without_drive, without_drive],
                [none, gradient[:, chain.drive], drive, without_drive],
            ]
        ),
    )

"""How MuJoCo's integrators are told a prescribed motion: one class each, with its best signal.

An actuator of the robot follows a signal in time: the angle at which a gear is free of torque, or
the acceleration of a rigid joint.  Controls are held over a step, so what a step sees of the signal
depends on the integrator.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from elastic_robot.trajectory import Drives


@dataclass(frozen=True)
class DriveSamples:
    """Motion of the drives at the ends of equal steps.

    Attributes:
        step: [s].
        q, qd, qdd: Angles [rad] and derivatives, (steps + 1, joints).
    """

    step: float
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray

    @classmethod
    def of_drives(cls, drives: Drives, times: np.ndarray, parts: int) -> DriveSamples:
        """Return the motion at equally spaced times and at parts - 1 points between them."""
        count = parts * (len(times) - 1) + 1
        fine = np.linspace(times[0], times[-1], count)
        q, qd, qdd = drives.at(fine)
        return cls((times[-1] - times[0]) / (count - 1), q, qd, qdd)

    def of_joints(self, joints: list[int]) -> DriveSamples:
        """Return the motion of some joints."""
        return DriveSamples(self.step, self.q[:, joints], self.qd[:, joints], self.qdd[:, joints])


class Integrator(Protocol):
    """What an integrator needs to know of a prescribed motion."""

    @property
    def number(self) -> mujoco.mjtIntegrator:
        """MuJoCo's number of the integrator."""
        ...

    @property
    def dyntype(self) -> str:
        """MJCF: what becomes of a control, "none" or "integrator"."""
        ...

    def angle(self, samples: DriveSamples, lag: np.ndarray) -> np.ndarray:
        """Return the signal q + lag q' [rad], one row per step end; lag [s] of each joint."""
        ...

    def acceleration(self, samples: DriveSamples) -> np.ndarray:
        """Return the signal q'' [rad/s^2] that leads exactly through the angles q."""
        ...

    def present(self, data: mujoco.MjData) -> np.ndarray:
        """Return the place in MuJoCo's memory that holds the actuators' present signals."""
        ...

    def controls(self, samples: DriveSamples, signals: np.ndarray) -> np.ndarray:
        """Return the controls that lead along signals, one row per step."""
        ...


class RungeKutta4:
    """MuJoCo's RK4: a control is the rate of an actuator's state, which moves linearly over a step."""

    number = mujoco.mjtIntegrator.mjINT_RK4
    dyntype = "integrator"

    def angle(self, samples: DriveSamples, lag: np.ndarray) -> np.ndarray:
        """Return the polyline whose mean over every step is that of the curve q + lag q'.

        Simpson's rule, with which RK4 weighs the stages, sees a chord h^2/12 f'' beside the curve.
        Left uncorrected this is the largest error of all, of second order.
        """
        signal = samples.q + lag * samples.qd
        signal[1:-1] -= np.diff(signal, 2, axis=0) / 12.0
        return signal

    def acceleration(self, samples: DriveSamples) -> np.ndarray:
        """Return the second derivative, a polyline, of the cubic spline through the angles."""
        times = samples.step * np.arange(len(samples.q))
        ends = (2, samples.qdd[0]), (2, samples.qdd[-1])
        acceleration: np.ndarray = CubicSpline(times, samples.q, bc_type=ends)(times, 2)
        return acceleration

    def present(self, data: mujoco.MjData) -> np.ndarray:
        """Return the actuators' states."""
        return data.act

    def controls(self, samples: DriveSamples, signals: np.ndarray) -> np.ndarray:
        """Return the slopes of the polylines."""
        slopes: np.ndarray = np.diff(signals, axis=0) / samples.step
        return slopes


class ImplicitFast:
    """MuJoCo's implicitfast: forces at a step's start, dampers at its end, then the angles."""

    number = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    dyntype = "none"

    def angle(self, samples: DriveSamples, lag: np.ndarray) -> np.ndarray:
        """Return q + lag q' with the rate that the integrator itself will have in the step."""
        return samples.q + lag * self._rate(samples)

    def acceleration(self, samples: DriveSamples) -> np.ndarray:
        """Return the change of that rate per step."""
        return np.diff(self._rate(samples), axis=0, prepend=samples.qd[:1]) / samples.step

    def present(self, data: mujoco.MjData) -> np.ndarray:
        """Return the controls: the actuators have no states."""
        return data.ctrl

    def controls(self, samples: DriveSamples, signals: np.ndarray) -> np.ndarray:
        """Return the signals at the steps' beginnings."""
        del samples
        return signals[:-1]

    def _rate(self, samples: DriveSamples) -> np.ndarray:
        """Angle difference over each step [rad/s]; the last row is not used by any step."""
        return np.diff(samples.q, axis=0, append=samples.q[-1:]) / samples.step


INTEGRATORS: dict[str, Integrator] = {"RK4": RungeKutta4(), "implicitfast": ImplicitFast()}

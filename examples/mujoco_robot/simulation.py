"""The elastic robot simulated by MuJoCo along prescribed drives."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import rollout

from elastic_robot.description import Robot
from elastic_robot.trajectory import Drives
from examples.mujoco_robot.elastic_model import ElasticModel
from examples.mujoco_robot.integrators import INTEGRATORS, DriveSamples
from examples.mujoco_robot.multibody import tcp_pose
from examples.mujoco_robot.rest import settle

# Steps whose states are held in memory at once.
_STEPS_AT_ONCE = 20_000
_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS


@dataclass(frozen=True)
class Motion:
    """A simulated motion.

    Attributes:
        time: [s], (n,).
        pose: Of the TCP, x, y, z, qx, qy, qz, qw, (n, 7).
        deflection: Elastic coordinates x [rad], (n, m).
    """

    time: np.ndarray
    pose: np.ndarray
    deflection: np.ndarray


class MujocoSimulation:
    """One simulation with everything prepared; running it is all that costs time.

    Args:
        robot: Its description.
        torque_curve: "linear", "backlash" or "spline".
        drives: Motion of the drives.
        times: Where the motion is wanted, equally spaced [s], (n,).
        integrator: A name of `INTEGRATORS`.
        step: Time step [s]; the spacing of `times` is a multiple of it.
        wrench: At the TCP, base axes; row k acts over the time that ends at times[k], row 0 in the
            equilibrium at the start, (n, 6); None for none.
        undeflected: Start with x = 0 instead of in equilibrium.

    Raises:
        ValueError: If the times do not fit the step.
        RuntimeError: If there is no equilibrium.

    Example:
        >>> from elastic_robot.coupling.files.robot_file import find_robot, load_robot
        >>> from elastic_robot.trajectory import HeldCommand
        >>> rest = HeldCommand(0.0, np.zeros(6), np.zeros(6), np.zeros(6))
        >>> robot = load_robot(find_robot("icme2008"))
        >>> simulation = MujocoSimulation(robot, "linear", rest, np.array([0.0, 0.1, 0.2]))
        >>> height = simulation.motion(simulation.run()).pose[:, 2]
        >>> bool(np.ptp(height) < 1e-12 and abs(height[0] - 2.05) > 1e-3)  # at rest, bent down
        True
    """

    def __init__(
        self,
        robot: Robot,
        torque_curve: str,
        drives: Drives,
        times: np.ndarray,
        integrator: str = "RK4",
        step: float = 1e-3,
        wrench: np.ndarray | None = None,
        undeflected: bool = False,
    ) -> None:
        spacing = (times[-1] - times[0]) / (len(times) - 1)
        self._steps_per_sample = round(spacing / step)
        if not np.isclose(self._steps_per_sample * step, spacing, rtol=1e-9):
            raise ValueError(f"step: expected a fraction of {spacing} s, got {step} s")
        if wrench is None:
            wrench = np.zeros((len(times), 6))
        axes = np.flatnonzero(wrench.any(axis=0)).tolist()
        self._times = times
        self._elastic = ElasticModel(robot, torque_curve, INTEGRATORS[integrator], step, axes)
        model, data = self._elastic.model, self._elastic.data
        samples = DriveSamples.of_drives(drives, times, self._steps_per_sample)
        signals = self._elastic.signals(samples)
        steps = INTEGRATORS[integrator].controls(samples, signals)
        load = np.repeat(wrench[1:, axes], self._steps_per_sample, axis=0)
        self._controls = np.hstack([steps, load])
        self._q = samples.q[:: self._steps_per_sample]
        settle(self._elastic, self._q[0], wrench[0])
        if undeflected:
            data.qpos[:] = self._elastic.undeflected(self._q[0])
        data.qvel[self._elastic.hinge] = samples.qd[0]
        INTEGRATORS[integrator].present(data)[: signals.shape[1]] = signals[0]
        self._start = np.empty(mujoco.mj_stateSize(model, _STATE))
        mujoco.mj_getState(model, data, self._start, _STATE)

    def run(self) -> np.ndarray:
        """Return the angles of all hinges [rad], (n, angles)."""
        model, data, every = self._elastic.model, self._elastic.data, self._steps_per_sample
        chunk = every * max(1, _STEPS_AT_ONCE // every)
        angles = slice(1, 1 + model.nq)  # the state begins with the time
        state, rows = self._start, [self._start[None, angles]]
        with self._elastic.running(), rollout.Rollout(nthread=0) as roll:
            for first in range(0, len(self._controls), chunk):
                controls = self._controls[None, first : first + chunk]
                states = roll.rollout(model, [data], state[None], controls)[0][0]
                rows.append(states[every - 1 :: every, angles])
                state = states[-1]
        return np.vstack(rows)

    def motion(self, angles: np.ndarray) -> Motion:
        """Return tool poses and deflections of the angles that `run` found."""
        model, data = self._elastic.model, self._elastic.data
        poses = np.empty((len(angles), 7))
        for pose, row in zip(poses, angles, strict=True):
            data.qpos[:] = row
            mujoco.mj_kinematics(model, data)
            pose[:] = tcp_pose(data)
        deflection = (angles - self._elastic.undeflected(self._q))[:, self._elastic.elastic]
        return Motion(self._times, poses, deflection)

"""The solvers that are compared: the native FMU, SciPy's on the same equation, MuJoCo."""

from __future__ import annotations

import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

import fmpy
import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import cho_factor, cho_solve

from benchmarks.stopwatch import timed
from benchmarks.task import ROBOT, TRAJECTORY, Answer, Entry, Task
from coupling.fmu.job import SimulationJob
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.robot.fmu_signals import POSE_OUTPUTS, WRENCH_INPUTS
from elastic_robot.chain import build_chain
from elastic_robot.dynamics import Dynamics
from elastic_robot.kinematics import base_from_tool
from elastic_robot.parameters import Parameters
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TORQUE_CURVES
from examples.mujoco_robot import MujocoSimulation

_NO_LOAD = np.zeros(6)


def native_fmu(task: Task, period: float) -> Entry:
    """The native FMU through FMPy with communication steps of `period` seconds, wrench set, pose read.

    From its instantiation on: the trajectory is read by the FMU, from an uncompressed NPZ, as
    `coupling.robot.robot_fmu` writes it.
    """

    def solve() -> Answer:
        times = communication_points(task, period)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            with np.load(TRAJECTORY) as samples:
                np.savez(folder / "path.npz", **samples)
            trajectory = str(folder / "path.npz")
            settings = {"torque_curve": task.curve, "mode": "dynamic", "trajectory": trajectory}
            inputs, outputs = WRENCH_INPUTS[:6], POSE_OUTPUTS
            loads = np.zeros((len(times), len(inputs)))
            job = SimulationJob(settings, times, inputs, loads, outputs, len(outputs))
            fmu = build_fmu(ROBOT, folder / "Robot.fmu", BuildOptions("native"))
            fmpy.extract(str(fmu), unzipdir=str(folder / "fmu"))
            order, answer = folder / "job.pickle", folder / "answer.npz"
            order.write_bytes(pickle.dumps((folder / "fmu", job)))
            command = [sys.executable, "-m", "benchmarks.fmu_process", str(order), str(answer)]
            subprocess.run(command, check=True)
            with np.load(answer) as archive:
                return at_reference(task, period, float(archive["spent"]), archive["poses"])

    return Entry("native", f"native FMU through FMPy, steps of {1e3 * period:g} ms", solve)


def communication_points(task: Task, period: float) -> np.ndarray:
    """Return times from the task's start to its end [s]."""
    return np.arange(round((task.times[-1] - task.times[0]) / period) + 1) * period


def at_reference(task: Task, period: float, spent: float, poses: np.ndarray) -> Answer:
    """Return the answer at those communication points that are also the reference's."""
    times = communication_points(task, period)
    spacing = task.times[1] - task.times[0]
    common = np.flatnonzero(np.abs(times / spacing - np.round(times / spacing)) < 1e-6)
    return Answer(spent, times[common], poses[common, :3])


def scipy_solver(task: Task, method: str, tolerance: float) -> Entry:
    """A SciPy solver on x'' = M^-1 (-load - S - d x') as a first-order system."""
    chain, parameters = build_chain(ROBOT), Parameters.of(ROBOT)
    dynamics = Dynamics(chain, parameters.gravity)
    curve = TORQUE_CURVES[task.curve].build(parameters)
    m = chain.elastic_count

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        q, qd, qdd = (chain.theta(values) for values in task.drives.at(np.array([t])))
        theta, speed = q + y[:m] @ chain.selection, qd + y[m:] @ chain.selection
        torque = dynamics.loads(theta, speed, qdd, None)[0]
        torque += curve.torque(y[:m]) + parameters.damping * y[m:]
        return np.append(y[m:], cho_solve(cho_factor(dynamics.mass_matrix(theta[0])), -torque))

    def run() -> np.ndarray:
        times = task.times
        q = task.drives.at(times[:1])[0][0]
        start = np.append(equilibrium(dynamics, curve, q, ToolLoad(_NO_LOAD)), np.zeros(m))
        span = (times[0], times[-1])
        # rtol of angles of 1e-3 rad; atol a tenth of a permille of that.
        result = solve_ivp(
            rate, span, start, method, t_eval=times, rtol=tolerance, atol=1e-4 * tolerance
        )
        return result.y[:m].T

    def solve() -> Answer:
        spent, x = timed(run)
        return Answer(spent, task.times, _positions(task, task.times, x))

    return Entry("SciPy", f"SciPy {method}, rtol {tolerance:g}", solve)


def mujoco(task: Task, integrator: str, step: float) -> Entry:
    """MuJoCo with an integrator's name and a step [s]; model and controls are made beforehand."""

    def solve() -> Answer:
        simulation = MujocoSimulation(ROBOT, task.curve, task.drives, task.times, integrator, step)
        spent, angles = timed(simulation.run)
        return Answer(spent, task.times, simulation.motion(angles).pose[:, :3])

    return Entry("MuJoCo", f"MuJoCo {integrator}, {1e3 * step:g} ms", solve)


def _positions(task: Task, times: np.ndarray, x: np.ndarray) -> np.ndarray:
    """TCP positions [m] of deflections at times, (n, 3)."""
    chain = build_chain(ROBOT)
    data = chain.model.createData()
    theta = chain.theta(task.drives.at(times)[0], x)
    return np.array([base_from_tool(chain, data, row).translation.copy() for row in theta])

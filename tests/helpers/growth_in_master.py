"""A small master that exchanges pose and force: by what a deviation grows from step to step."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from coupling.fmu_export.step_limit import LinearisedPosture

# How far it pushes the tool once, the smaller one for what grows, between which
# distances a deviation counts [m], and its steps.
_PUSHES, _NEAR, _FAR, _MOST = (1e-8, 1e-4), 1e-8, 1e-3, 3000
_TCP, _FORCE = ("tcp.x", "tcp.y", "tcp.z"), ("force.x", "force.y", "force.z")


def growth_in_master(
    fmu: Path, drives: np.ndarray, posture: LinearisedPosture, step: float
) -> float:
    """Return by what deviations grow over a step of a master that exchanges pose and force.

    The robot rests at the surface of a bilateral wall; a push of one step disturbs it.

    Args:
        fmu: The robot's FMU.
        drives: Angles of its drives [rad].
        posture: The process's stiffness, of which the wall is made.
        step: Communication step [s].
    """
    for push in _PUSHES:
        apart = _deviations(fmu, drives, posture, step, push)
        if apart[-1] > _FAR:
            break
    joined = np.lib.stride_tricks.sliding_window_view(apart, 4).max(axis=1)  # it swings
    tail = joined[joined > _NEAR][len(joined[joined > _NEAR]) // 3 :]
    return float(np.exp(np.polyfit(np.arange(len(tail)), np.log(tail), 1)[0]))


def _deviations(
    fmu: Path, drives: np.ndarray, posture: LinearisedPosture, step: float, push: float
) -> np.ndarray:
    """Return how far the tool is from rest after every step [m]."""
    description = read_model_description(str(fmu))
    reference = {v.name: v.valueReference for v in description.modelVariables}
    tcp, force = ([reference[name] for name in names] for names in (_TCP, _FORCE))
    robot = FMU2Slave(
        guid=description.guid,
        unzipDirectory=extract(str(fmu)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="robot",
    )
    robot.instantiate()
    robot.setupExperiment(startTime=0.0, tolerance=1e-10)
    robot.setString([reference["torque_curve"]], ["linear"])
    robot.enterInitializationMode()
    names = [f"q_cmd[{i}]" for i in range(1, 1 + len(drives))]
    robot.setReal([reference[name] for name in names], drives.tolist())
    robot.exitInitializationMode()
    rest = np.array(robot.getReal(tcp))
    process, own = posture.stiffnesses
    answer = posture.stiffness @ np.full(3, push * own / process)
    seen, apart = rest, []
    for k in range(_MOST):
        robot.setReal(force, answer.tolist())
        robot.doStep(k * step, step)
        answer = posture.stiffness @ (rest - seen)
        seen = np.array(robot.getReal(tcp))
        apart.append(float(np.linalg.norm(seen - rest)))
        if apart[-1] > _FAR or (k > 50 and max(apart[-50:]) < _NEAR):
            break
    robot.freeInstance()
    return np.array(apart)

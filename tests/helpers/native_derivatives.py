"""Cases of directional derivatives, and what the native FMU says about them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fmpy.fmi2 import FMU2Slave
from native_fmu import NativeFmu
from random_robots import make_robot

from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import blocks

CURVES = ("linear", "backlash", "spline")
SEEDS = ("wrench", "q_cmd", "qd_cmd", "qdd_cmd", "all")


@dataclass(frozen=True)
class Case:
    """A communication step, or an equilibrium where its length is zero, and a seed of its inputs."""

    robot: Robot
    curve: str
    mode: str
    initial_state: str
    tolerance: float
    length: float
    before: np.ndarray
    inputs: np.ndarray
    seed: np.ndarray


def make_case(
    number: int, joints: int, curve: str, mode: str, length: float, seeds: str, tolerance=1e-12
) -> Case:
    """A random robot that a random load and motion set in from rest."""
    robot, rng = make_robot(number, joints), np.random.default_rng(number)
    n = joints
    size = np.concatenate([[1e3] * 3, [1e2] * 3, [1.5] * n, [0.5] * n, [2.0] * n])
    inputs = rng.normal(size=6 + 3 * n) * size
    before = inputs.copy()
    before[:6] = rng.normal(size=6) * size[:6]
    # Seeds that move the tool by similar amounts in a step of some milliseconds.
    each = np.concatenate([[1e2] * 3, [1e1] * 3, [1e-5] * n, [1e-2] * n, [1.0] * n])
    kinds = np.array(["wrench"] * 6 + ["q_cmd"] * n + ["qd_cmd"] * n + ["qdd_cmd"] * n)
    seed = rng.normal(size=6 + 3 * n) * each * ((kinds == seeds) | (seeds == "all"))
    state = "undeflected" if rng.random() < 0.25 else "equilibrium"
    return Case(robot, curve, mode, state, tolerance, length, before, inputs, seed)


@dataclass(frozen=True)
class Found:
    """What the FMU says: x before the step, outputs and their derivatives by block."""

    x: np.ndarray
    values: dict[str, np.ndarray]
    derivatives: dict[str, np.ndarray]


def instance_of(
    case: Case, folder: Path, trajectory: str = ""
) -> tuple[FMU2Slave, dict[str, list[int]]]:
    """An instance of the case's FMU, initialised; the value references of each block."""
    fmu = NativeFmu(build_fmu(case.robot, folder / "R.fmu", BuildOptions("native")), folder / "fmu")
    references = {
        name: fmu.of([v.name for v in block.variables])
        for name, block in blocks(case.robot).items()
    }
    slave = fmu.slave()
    slave.setupExperiment(startTime=0.0, tolerance=case.tolerance)
    texts = [trajectory, case.curve, case.mode, case.initial_state]
    slave.setString(references["strings"], texts)
    slave.enterInitializationMode()
    inputs = case.before if case.length > 0.0 else case.inputs
    slave.setReal(inputs_of(references), inputs.tolist())
    slave.exitInitializationMode()
    return slave, references


def inputs_of(references: dict[str, list[int]]) -> list[int]:
    """Value references of the inputs, in the order of Case.inputs."""
    return [k for name in ("wrench", "q_cmd", "qd_cmd", "qdd_cmd") for k in references[name]]


def through_fmu(case: Case, folder: Path) -> Found:
    """Run the case through its FMU."""
    slave, references = instance_of(case, folder)
    knowns = inputs_of(references)
    x = np.array(slave.getReal(references["deflection"]))
    if case.length > 0.0:
        slave.setReal(knowns, case.inputs.tolist())
        slave.doStep(0.0, case.length)
    outputs = [name for name, block in blocks(case.robot).items() if block.causality == "output"]
    names = [name for name in outputs if references[name]]
    asked = [reference for name in names for reference in references[name]]
    along_seed = slave.getDirectionalDerivative(asked, knowns, case.seed.tolist())
    values, derivatives = {}, {}
    for name in names:
        values[name] = np.array(slave.getReal(references[name]))
        derivatives[name] = np.array(along_seed[: len(references[name])])
        along_seed = along_seed[len(references[name]) :]
    slave.terminate()
    slave.freeInstance()
    return Found(x, values, derivatives)

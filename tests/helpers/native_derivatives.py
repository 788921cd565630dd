"""Cases of directional derivatives, and what the native FMU says about them."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from fmpy.fmi2 import FMU2Slave
from native_fmu import NativeFmu
from random_robots import make_robot

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.exchange_blocks import all_blocks
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.kinematics import base_from_tool

CURVES = ("linear", "backlash", "spline")
SEEDS = ("wrench", "q_cmd", "qd_cmd", "qdd_cmd", "all")
INPUTS = ("wrench", "q_cmd", "qd_cmd", "qdd_cmd", "anchor", "anchor_velocity", "anchor_stiffness")
# Those of the spring: the anchor, its velocity, the stiffness.
SPRING_INPUTS = 3 + 3 + 6
SPRING_SEEDS = ("anchor", "anchor_velocity", "anchor_stiffness", "all")


@dataclass(frozen=True)
class Case:
    """A communication step, or an equilibrium where its length is zero, and a seed of its inputs.

    Inputs in the order of the FMU: wrench, commands, anchor, its velocity, stiffness of its spring.
    """

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
    """A random robot that a random load and motion set in from rest; no spring holds its tool."""
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
    none = np.zeros(SPRING_INPUTS)
    vectors = (np.append(values, none) for values in (before, inputs, seed))
    return Case(robot, curve, mode, state, tolerance, length, *vectors)


def make_sprung_case(
    number: int, joints: int, curve: str, mode: str, length: float, seeds: str, tolerance=1e-12
) -> Case:
    """The same, its tool on a spring of 1 to 1e8 N/m in 1 to 3 directions; the anchor moves.

    In one of two steps the spring is there before; else it takes hold at the step's start.
    """
    case = make_case(number, joints, curve, mode, length, seeds, tolerance)
    rng, n = np.random.default_rng(number), joints
    tool = _rigid_tool(case.robot, case.inputs[6 : 6 + n])
    k = random_stiffness(rng)
    spring = np.concatenate([tool + 1e-4 * rng.normal(size=3), 0.3 * rng.normal(size=3), k])
    seed = np.concatenate([1e-5 * rng.normal(size=3), 1e-2 * rng.normal(size=3), 0.01 * k])
    seed[6:] *= rng.normal(size=6)
    kinds = np.array(["anchor"] * 3 + ["anchor_velocity"] * 3 + ["anchor_stiffness"] * 6)
    inputs, before, along = case.inputs.copy(), case.before.copy(), case.seed.copy()
    inputs[-SPRING_INPUTS:] = spring
    before[-SPRING_INPUTS:] = spring * (number % 2)
    along[-SPRING_INPUTS:] = seed * ((kinds == seeds) | (seeds == "all"))
    return replace(case, inputs=inputs, before=before, seed=along)


def random_stiffness(rng: np.random.Generator) -> np.ndarray:
    """A spring of 1 to 1e8 N/m in 1 to 3 random directions: xx, xy, xz, yy, yz, zz [N/m]."""
    sides = rng.normal(size=(3, rng.integers(1, 4)))
    return (10.0 ** rng.uniform(0.0, 8.0) * sides @ sides.T)[np.triu_indices(3)]


def _rigid_tool(robot: Robot, q: np.ndarray) -> np.ndarray:
    chain = build_chain(robot)
    theta = chain.theta(q)
    return base_from_tool(chain, chain.model.createData(), theta).translation.copy()


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
        for name, block in all_blocks(case.robot).items()
    }
    slave = fmu.slave()
    slave.setupExperiment(startTime=0.0)
    slave.setReal(references["tolerance"], [case.tolerance])
    texts = [trajectory, case.curve, case.mode, case.initial_state, "ideal"]
    slave.setString(references["strings"], texts)
    slave.enterInitializationMode()
    inputs = case.before if case.length > 0.0 else case.inputs
    slave.setReal(inputs_of(references), inputs.tolist())
    slave.exitInitializationMode()
    return slave, references


def inputs_of(references: dict[str, list[int]]) -> list[int]:
    """Value references of the inputs, in the order of Case.inputs."""
    return [k for name in INPUTS for k in references[name]]


def through_fmu(case: Case, folder: Path) -> Found:
    """Run the case through its FMU."""
    slave, references = instance_of(case, folder)
    knowns = inputs_of(references)
    x = np.array(slave.getReal(references["deflection"]))
    if case.length > 0.0:
        slave.setReal(knowns, case.inputs.tolist())
        slave.doStep(0.0, case.length)
    outputs = [
        name for name, block in all_blocks(case.robot).items() if block.causality == "output"
    ]
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

"""Loading loops of a robot with hysteresis, noise upon them, and what they tell: make identify."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from coupling.files.gear_table import sheet_elements
from coupling.files.robot_file import load_robot
from coupling.identification.intervals import intervals
from coupling.identification.loops.fit import loop_fitted
from coupling.identification.loops.identification import identify_loops
from coupling.identification.loops.parameters import LoopParameters
from coupling.identification.static.identification import IdentifyOptions
from coupling.identification.static.measurements import Measurements, noise_of
from docs.scripts.page import table
from elastic_robot.description import Robot
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

START = Path(__file__).parents[2] / "examples" / "identify" / "fanuc_start.toml"
SLIP_TORQUES = (200.0, 300.0, 150.0)  # [N m], of gears 1 to 3; the others have no hysteresis
# Up, down through zero and back: parts of the force [N].
TURNS, FORCE = (0.3, 0.65, 1.0, 0.6, 0.2, -0.2, -0.6, -1.0, -0.5, 0.0, 0.5, 1.0), 900.0
LOOPS, POSITION, REPETITIONS = 5, 2e-5, 20  # loops, standard deviation [m]


def loops() -> str:
    """Return what loops of a robot tell whose file has no hysteresis and other stiffnesses."""
    rng, true = np.random.default_rng(1), _true()
    exact = _measured(true, rng)
    factors = rng.uniform(0.7, 1.4, len(true.joints))
    start = replace(
        true,
        joints=tuple(
            replace(joint, stiffness=factor * joint.stiffness, hysteresis=())
            for joint, factor in zip(true.joints, factors, strict=True)
        ),
    )
    rows = _noisy(exact, rng)
    found = identify_loops(start, rows, IdentifyOptions(noise_of(rows, POSITION)))
    elasticity = found.fit.elasticity
    assert isinstance(elasticity, LoopParameters)
    inside = np.zeros(len(elasticity.names))
    known = np.array([_known(true, name) for name in elasticity.names])
    right = np.where(elasticity.is_compliance, 1.0 / known, known)
    for _ in range(REPETITIONS):
        rows = _noisy(exact, rng)
        fit = loop_fitted(elasticity, rows, "backlash", noise_of(rows, POSITION))
        sure = intervals(fit.problem, fit.weight, fit.values, known=True)
        inside += (sure.low <= right) & (right <= sure.high)
    numbers = table(
        ("parameter", "true", "fit", "95 % from", "to", f"inside, of {REPETITIONS}"),
        [
            (
                f"`{own.name}`",
                *(f"{n:.3g}" for n in (value, own.value, own.low, own.high)),
                f"{held:.0f}",
            )
            for own, value, held in zip(found.parameters, known, inside, strict=True)
        ],
    )
    errors = table(
        ("rms [mm]", *(f"loop {loop.number}" for loop in found.loops)),
        [
            (words, *(f"{1e3 * getattr(loop, key):.4f}" for loop in found.loops))
            for words, key in (
                ("fit", "fit"),
                ("loop left out", "left_out"),
                ("loop left out, without hysteresis", "without"),
            )
        ],
    )
    return f"{numbers}\n\n{errors}"


def _true() -> Robot:
    robot = load_robot(START)
    joints = list(robot.joints)
    for i, torque in enumerate(SLIP_TORQUES):
        stiffness = joints[i].stiffness
        assert stiffness is not None
        elements = sheet_elements(2.0 * torque / stiffness, stiffness)
        joints[i] = replace(joints[i], hysteresis=elements)
    return replace(robot, joints=tuple(joints))


def _known(robot: Robot, name: str) -> float:
    """Return a parameter of the true robot."""
    head, _, kind = name.rpartition(".")
    joint = robot.joints[int(head.removeprefix("joint[").removesuffix("]")) - 1]
    if kind == "hysteresis":
        return sum(stop.slip_torque for stop in joint.hysteresis)
    if kind == "slip_angle":
        return joint.hysteresis[-1].slip_angle
    assert joint.stiffness is not None
    return joint.stiffness


def _measured(robot: Robot, rng: np.random.Generator) -> Measurements:
    """Return loops in random postures, each with a force of its own direction."""
    q = rng.uniform(-1.2, 1.2, (LOOPS, len(robot.joints))).repeat(len(TURNS), axis=0)
    ways = rng.normal(size=(LOOPS, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    wrench = np.zeros((len(q), 6))
    wrench[:, :3] = FORCE * np.einsum("t,li->lti", TURNS, ways).reshape(-1, 3)
    moving, found = ElasticRobot(robot, "backlash", quasistatic=True), []
    for k in range(len(q)):
        drives = HeldCommand(0.0, q[k], 0.0 * q[k], 0.0 * q[k])
        if k % len(TURNS) == 0:
            moving.reset(0.0, drives, Load())
            start = moving.tcp()[:3].copy()
        moving.step(moving.time + 1.0, drives, Load(wrench[k]))
        found.append(moving.tcp()[:3] - start)
    rows = Measurements.of(q, wrench, np.array(found))
    return replace(rows, loop=np.arange(1, LOOPS + 1).repeat(len(TURNS)))


def _noisy(exact: Measurements, rng: np.random.Generator) -> Measurements:
    noise = POSITION * rng.normal(size=exact.deflection.shape)
    return replace(exact, deflection=exact.deflection + noise)

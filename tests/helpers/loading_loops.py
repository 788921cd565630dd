"""Loading loops of a robot that the package's robot steps through itself, one load after the other."""

from dataclasses import replace

import numpy as np

from coupling.identification.static.measurements import Measurements
from elastic_robot.description import Robot
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

# Up, down through zero, and back up: parts of the largest force.
TURNS = (0.3, 0.65, 1.0, 0.6, 0.2, -0.2, -0.6, -1.0, -0.5, 0.0, 0.5, 1.0)
RISING = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)


def loops(
    robot: Robot, count: int, seed: int, force: float, parts=TURNS, noise: float = 0.0
) -> Measurements:
    """Return loops in random postures and directions of the force [N], with noise [m]."""
    rng = np.random.default_rng(seed)
    q, wrench, deflection = [], [], []
    for _ in range(count):
        own = rng.uniform(-1.5, 1.5, len(robot.joints))
        way = rng.normal(size=3)
        loads = np.zeros((len(parts), 6))
        loads[:, :3] = force * np.outer(parts, way / np.linalg.norm(way))
        q.append(np.tile(own, (len(parts), 1)))
        wrench.append(loads)
        deflection.append(stepped(robot, own, loads))
    shift = np.vstack(deflection)
    rows = Measurements.of(
        np.vstack(q), np.vstack(wrench), shift + noise * rng.normal(size=shift.shape)
    )
    return replace(rows, loop=np.repeat(np.arange(1, count + 1), len(parts)))


def stepped(robot: Robot, q: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """Return the deflections under loads one after the other, from its own weight on [m], (k, 3)."""
    moving = ElasticRobot(robot, "backlash", quasistatic=True)
    drives = HeldCommand(0.0, q, 0.0 * q, 0.0 * q)
    moving.reset(0.0, drives, Load())
    start, found = moving.tcp()[:3].copy(), []
    for k, load in enumerate(loads, start=1):
        moving.step(float(k), drives, Load(load))
        found.append(moving.tcp()[:3] - start)
    return np.array(found)


def written(rows: Measurements) -> str:
    """Return the table of loops, with positions alone."""
    assert rows.loop is not None
    names = [f"q{i + 1}" for i in range(rows.q.shape[1])]
    lines = [",".join(["loop", *names, "fx", "fy", "fz", "dx", "dy", "dz"])]
    for k in range(rows.count):
        numbers = [*rows.q[k], *rows.wrench[k, :3], *rows.deflection[k]]
        lines.append(",".join([str(rows.loop[k]), *(repr(float(number)) for number in numbers)]))
    return "\n".join(lines) + "\n"

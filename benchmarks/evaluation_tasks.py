"""What is coupled in the benchmark of the evaluations: robots, processes and commands."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.case.case import Case, PlacedRobot
from coupling.path.controller import Controller, on_cycle
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.process import ElasticWall, Process, ProcessResponse
from coupling.robot.contract import SimulatedRobot
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.store import EvaluatedProcess, Store
from coupling.toolpaths.contours import Line
from docs.scripts.runs import CASES, example
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import Mode
from tests.helpers.spring_robot import SpringRobot, upright

GAINS = (0.1, 1.0, 5.0, 10.0)
SEED = 1
# Stiffness of the walls that a robot of springs meets [N/m].
_WALL = 1e6
# Share of the force that changes with the place, and the length on which it does [m].
_NOISE, _NOISE_LENGTH = 0.03, 1e-2
# Forces between which the elastic robot's compliance is taken [N]: its gears are then on a flank.
_PRESSING = (500.0, 600.0)
MODES: tuple[Mode, ...] = ("quasistatic", "dynamic")


@dataclass(frozen=True)
class CouplingTask:
    """A robot, or several, a command and a process that they are coupled with.

    Attributes:
        name: Shown in the tables.
        mode: Mode in which the robots are simulated.
        robot: Simulates them.
        process: States its stiffness.
        command: Motion of the drives.
        desired: Path at whose times the process is evaluated.
        gain: Largest stiffness of the process times compliance of the robot, where it is known.
        most: Evaluations at most.
        most_for_reference: Evaluations at most for a solution to compare with.
    """

    name: str
    mode: Mode
    robot: SimulatedRobot
    process: Process
    command: JointPath
    desired: ToolPath
    gain: float | None = None
    most: int = 40
    most_for_reference: int = 60


@dataclass(frozen=True)
class Withheld:
    """A process that does not state its stiffness.

    Attributes:
        process: The same, which does.
    """

    process: Process
    identity: str = ""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return its answer without stiffness."""
        return replace(self.process.evaluate(path), stiffness=None)


@dataclass(frozen=True)
class Noisy:
    """A process whose force depends on the place by chance, and is the same at the same place.

    Attributes:
        process: Without the noise; the stiffness that is stated is its own.
        phase: One for every sample [rad], (n,).
    """

    process: Process
    phase: np.ndarray
    identity: str = ""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the answer times 1 + 0.03 sin(2 pi (x + y + z) / 10 mm + phase)."""
        answer = self.process.evaluate(path)
        turns = path.position.sum(axis=-1) / _NOISE_LENGTH
        factor = 1.0 + _NOISE * np.sin(2.0 * np.pi * turns + self.phase)
        wrench = factor[..., None] * answer.wrench.wrench
        return replace(answer, wrench=WrenchHistory(path.time, wrench))


def _springs(name: str, gain: float, depth: float, process: Process | None = None) -> CouplingTask:
    """Return a task of a tool on springs, as oblique as the wall is, of given compliance.

    Args:
        name: Name of the task.
        gain: Compliance along the wall's normal over that of the wall.
        depth: Of the command in the wall in the mean [m]; it varies by 3 mm.
        process: In place of the wall.
    """
    wall = oblique_wall()
    root = np.random.default_rng(SEED).normal(size=(3, 3))
    compliance = root @ root.T + 0.1 * np.eye(3)
    compliance *= gain / (_WALL * (wall.normal @ compliance @ wall.normal))
    time = np.linspace(0.0, 1.0, 60)
    height = -depth - 3e-3 * np.sin(2.0 * np.pi * time)
    command = np.column_stack([0.1 * time, -0.05 * time, height])
    robot = SpringRobot(compliance)
    desired = ToolPath(time, upright(command))
    joints = JointPath(time, (command,))
    return CouplingTask(name, "quasistatic", robot, process or wall, joints, desired, gain)


def oblique_wall() -> ElasticWall:
    """Return the wall that tools on springs meet."""
    return ElasticWall(np.zeros(3), np.array([0.36, 0.48, 0.8]), _WALL)


def _on_springs(models: FmuPool) -> Iterator[CouplingTask]:
    for gain in GAINS:
        yield _springs(f"tool on springs, wall, gain {gain:g}", gain, 0.02)


def _lost(models: FmuPool) -> Iterator[CouplingTask]:
    for gain in GAINS:
        yield _springs(f"tool on springs, contact lost, gain {gain:g}", gain, 2e-3)


def _noise(models: FmuPool) -> Iterator[CouplingTask]:
    phase = np.random.default_rng(SEED).uniform(0.0, 2.0 * np.pi, 60)
    for gain in GAINS:
        noisy = Noisy(oblique_wall(), phase)
        yield _springs(f"tool on springs, 3 % noise, gain {gain:g}", gain, 5e-3, noisy)


# Lines of the commanded tool in the part frame [m], the wall being its x-y plane: always pressed, as
# gravity pulls the tool down, and onto the wall and off again.
PRESSED = [[-0.02, 0.0, -3e-4], [0.0, 0.0, -9e-4], [0.02, 0.0, -3e-4]]
ON_AND_OFF = [[-0.03, 0.0, 3e-3], [-0.02, 0.0, -3e-4], [0.02, 0.0, -3e-4], [0.03, 0.0, 3e-3]]


def on_a_wall(
    models: FmuPool,
    name: str,
    points: list[list[float]],
    gains: tuple[float, ...] = GAINS,
    sample: float = 0.004,
) -> Iterator[CouplingTask]:
    """Yield tasks of the example robot on walls, in both modes.

    The gain is that of its largest compliance along the wall's normal.

    Args:
        models: Simulates it.
        name: Name of the tasks.
        points: Corners of the commanded line.
        gains: One for each wall.
        sample: Period at which the process is evaluated [s]; a longer one tells less than what a
            moving robot does against a wall.
    """
    part = Frame(np.array([1.6, 0.0, 0.8]), Rotation.identity())
    desired = Line(kind="line", points_m=points, feed_m_s=0.02, sample_s=sample).path(part)
    normal = np.array([0.0, 0.0, 1.0])
    cell, _ = cell_of(example("cone").robots, models)
    command = on_cycle(cell.plan(desired), Controller())

    def height(force: float) -> np.ndarray:
        pressing = np.tile(force * normal, (len(desired.time), 1))
        loads = WrenchHistory.of_forces(desired.time, [pressing])
        return cell.simulate(command, loads, "quasistatic").position[0] @ normal

    weak, strong = (height(force) for force in _PRESSING)
    compliance = float((strong - weak).max()) / (_PRESSING[1] - _PRESSING[0])
    for gain in gains:
        wall = ElasticWall(part.position, normal, gain / compliance)
        for mode in MODES:
            yield CouplingTask(
                f"{name}, gain {gain:g}", mode, cell, wall, command, desired, gain, most=25
            )


def _robot_on_walls(models: FmuPool) -> Iterator[CouplingTask]:
    yield from on_a_wall(models, "robot, wall", PRESSED)


def _robot_off_walls(models: FmuPool) -> Iterator[CouplingTask]:
    yield from on_a_wall(models, "robot, contact lost", ON_AND_OFF)


def of_case(name: str, case: Case, models: FmuPool) -> Iterator[CouplingTask]:
    """Yield the tasks of a case, in both modes."""
    cell, _ = cell_of(case.robots, models)
    command = on_cycle(cell.plan(case.desired), case.controller)
    for mode in MODES:
        yield CouplingTask(name, mode, cell, case.process, command, case.desired, most=25)


def turned(case: Case) -> Case:
    """Return a case whose robot hangs on a wall: three of its gears then carry next to nothing."""
    return replace(case, robots=tuple(_on_a_wall(robot) for robot in case.robots))


def _on_a_wall(placed: PlacedRobot) -> PlacedRobot:
    return replace(placed, description=replace(placed.description, gravity=(0.0, -9.81, 0.0)))


def kuka_with_backlash() -> Case:
    """Return a small cone formed by the KUKA of the examples, with 0.1 mrad of backlash in its gears."""
    case = example(
        "cone",
        robot={
            "description": str(CASES.parent / "robots" / "kuka_kr210.toml"),
            "home_deg": [0.0, 17.2, 11.5, 0.0, 61.3, 0.0],
        },
        part={"position_m": [1.9, 0.0, 0.9]},
        tool_path={"radius_m": 0.04, "depth_m": 0.003, "step_down_m": 0.001},
    )
    (placed,) = case.robots
    return replace(case, robots=(replace(placed, description=_played(placed.description)),))


def _played(robot: Robot) -> Robot:
    joints = tuple(
        joint if joint.stiffness is None else replace(joint, backlash=1e-4)
        for joint in robot.joints
    )
    return replace(robot, joints=joints)


def hanging_cases() -> dict[str, Case]:
    """Return the cases whose gears hang in their backlash, by name."""
    small = {"radius_m": 0.04, "depth_m": 0.003, "step_down_m": 0.001}
    return {
        "KUKA with backlash, cone": kuka_with_backlash(),
        "robot on a wall, cone": turned(example("cone", tool_path=small)),
    }


def _hanging(models: FmuPool) -> Iterator[CouplingTask]:
    for name, case in hanging_cases().items():
        yield from of_case(name, case, models)


def _fem(name: str, models: FmuPool) -> Iterator[CouplingTask]:
    """Yield a sheet that is computed; evaluations take up to a minute and are kept in results/store."""
    for task in of_case(name, example(name), models):
        process = EvaluatedProcess(task.process, Store(Path("results", "store")))
        yield replace(task, process=process, most=40, most_for_reference=60)


TASKS: dict[str, Callable[[FmuPool], Iterator[CouplingTask]]] = {
    "springs": _on_springs,
    "lost": _lost,
    "noise": _noise,
    "walls": _robot_on_walls,
    "robot_lost": _robot_off_walls,
    "cone": lambda models: of_case("cone", example("cone"), models),
    "hanging": _hanging,
    "two_robots": lambda models: of_case("two robots", example("two_robots"), models),
}
# Only where they are named: they take long.
LONG: dict[str, Callable[[FmuPool], Iterator[CouplingTask]]] = {
    "cone_fem": lambda models: _fem("cone_fem", models),
    "two_robots_fem": lambda models: _fem("two_robots_fem", models),
}

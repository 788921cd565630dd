"""Write the table of docs/ssp.md on safe steps from real runs: make stable-steps."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import tomlkit
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.run.ssp import SspSystem
from coupling.run.step_limit import LinearisedPosture
from docs.scripts.masters import MasterError, run_system
from docs.scripts.page import finish, replace, table

ROBOTS = Path(__file__).parents[2] / "examples" / "robots"
STIFFNESSES = (1e4, 1e5, 1e6)  # [N/m]
STEPS = (0.001, 0.002, 0.005, 0.01, 0.02)  # [s]
# Of the small master: how far it pushes the tool once, the smaller one for what grows, between which
# distances a deviation counts [m], and its steps.
_PUSHES, _NEAR, _FAR, _MOST = (1e-8, 1e-4), 1e-8, 1e-3, 3000
_TCP, _FORCE = ("tcp.x", "tcp.y", "tcp.z"), ("force.x", "force.y", "force.z")


@dataclass(frozen=True)
class Cell:
    """A robot that presses a tool on a wall.

    Attributes:
        name: In the table.
        robot: Its description, a shipped name or a file.
        home: Where inverse kinematics starts [deg].
        place: Of the part [m].
    """

    name: str
    robot: str
    home: tuple[float, ...]
    place: tuple[float, float, float]

    def case(self, stiffness: float, scheme: str = "robin") -> Case:
        """Return the case: through the air onto the wall, 5 mm deep, 60 mm along it."""
        points = [[0.0, 0.0, 0.03], [0.0, 0.0, -0.005], [0.06, 0.0, -0.005]]
        data = {
            "robot": {
                "description": self.robot,
                "torque_curve": "linear",
                "home_deg": list(self.home),
            },
            "part": {"position_m": list(self.place)},
            "tool_path": {
                "kind": "line",
                "points_m": points,
                "feed_m_s": 0.05,
                "blend_s": 0.1,
                "sample_s": 0.02,
            },
            "process": {"model": "elastic-wall", "stiffness_N_m": stiffness},
            "coupling": {"scheme": scheme, "tolerance_m": 1e-8},
        }
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "press.toml")
            file.write_text(tomlkit.dumps(data), encoding="utf-8")
            return load_case(file)


UR10 = Cell(
    "UR10", str(ROBOTS / "ur10.toml"), (0.0, -57.0, 80.0, 67.0, -90.0, 0.0), (0.74, 0.164, 0.18)
)
CELLS = (
    UR10,
    Cell(
        "KUKA KR 210",
        str(ROBOTS / "kuka_kr210.toml"),
        (0.0, 17.0, 11.0, 0.0, 61.0, 0.0),
        (1.8, 0.0, 0.9),
    ),
    Cell("icme2008", "icme2008", (0.0, 10.0, 20.0, 0.0, 60.0, 0.0), (1.6, 0.1, 0.8)),
)


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


@cache
def _systems(cell: Cell) -> list[tuple[float, SspSystem]]:
    return [(k, SspSystem.of(cell.case(k), "force", step=STEPS[0])) for k in STIFFNESSES]


def force_rows() -> Iterator[list[str]]:
    """Yield, by robot and stiffness, safe steps and the largest force of every step in libcosim."""
    for cell in CELLS:
        for stiffness, forced in _systems(cell):
            sprung = SspSystem.of(forced.case)
            safe = (forced.limit.safe_step(False, 0.01), sprung.step)
            ends = [_largest(forced), _largest(sprung)]
            yield [
                cell.name,
                f"{stiffness:.0e}",
                *(f"{1e3 * step:g}" for step in safe),
                *(", ".join(pair) for pair in zip(*ends, strict=True)),
            ]


def pressed(folder: Path, system: SspSystem, step: float) -> np.ndarray | None:
    """Return the rows of a run in libcosim of a folder, as `run_system`; None where it stops."""
    stop = step * np.floor(system.case.desired.time[-1] / step + 1e-9)
    try:
        # A nanosecond short: the sum of libcosim's steps must not pass the command's end.
        return run_system("SSP-libcosimpy", folder, step, float(stop) - 1e-9)
    except MasterError:
        return None


def _largest(system: SspSystem) -> list[str]:
    """Return the largest force of a run with every step [N]; "stops" where the run does."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        system.write(Path(folder, "system.ssp"))
        for step in STEPS:
            rows = pressed(Path(folder), system, step)
            found.append("stops" if rows is None else f"{rows[:, 10].max():.3g}")
    return found


def write() -> None:
    """Write the table."""
    steps = [f"{1e3 * step:g} ms" for step in STEPS]
    head = ("robot", "process (N/m)", "safe, force (ms)", "safe, spring (ms)", *steps)
    replace("ssp", "forces", table(head, force_rows()))


if __name__ == "__main__":
    sys.exit(finish(write))

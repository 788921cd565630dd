"""Write the table of docs/fmu.md of masters whose tool touches a wall: make contact."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

from coupling.files.robot_file import load_robot, shipped_robots
from coupling.fmu_export.build import BuildOptions, build_fmu
from docs.scripts.page import finish, replace, table

STIFFNESSES = (1e5, 1e6, 1e7, 1e8, 1e9)  # of the wall [N/m]
STEP, LENGTH = 1e-3, 0.3  # [s]
WAY, PUSH = 1e-4, -300.0  # from the tool to the wall [m]; force from the start on [N]
RESTS = 1e-6  # the tool's distance from the reference at rest, in the last sixth of the run [m]
FINE = 10  # steps of the reference for one of the masters
POSTURE = (0.0, -0.3, 0.5, 0.0, 0.6, 0.0)
# Passes of Newton's method, and halvings until a passage is found.
MOST_PASSES, HALVINGS = 8, 10


class Tool:
    """The robot's tool above a wall, through the FMU; every call is counted.

    Args:
        folder: The FMU, unpacked.
        stiffness: Of the wall [N/m].
        tolerance: At the TCP [m].

    Attributes:
        calls: Calls of FMI functions behind initialisation.
    """

    def __init__(self, folder: Path, stiffness: float, tolerance: float = 1e-6) -> None:
        description = fmpy.read_model_description(str(folder))
        self.stiffness, self.time, self.calls = stiffness, 0.0, 0
        self._of = {v.name: v.valueReference for v in description.modelVariables}
        self._slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=str(folder),
            modelIdentifier="ElasticRobot",
            instanceName="tool",
        )
        self._slave.instantiate()
        self._slave.setupExperiment(startTime=0.0)
        self.set(tcp_tolerance=tolerance)
        self._slave.enterInitializationMode()
        self.set(**{f"q_cmd[{i}]": q for i, q in enumerate(POSTURE, start=1)})
        self._slave.exitInitializationMode()
        self.wall = self.height() - WAY
        self.set(**{"force.z": PUSH, "anchor.z": self.wall})
        self.calls = 0

    def set(self, **values: float) -> None:
        """Set variables by name."""
        self.calls += 1
        self._slave.setReal([self._of[name] for name in values], list(values.values()))

    def height(self) -> float:
        """Return the height of the tool [m], base axes."""
        self.calls += 1
        return float(self._slave.getReal([self._of["tcp.z"]])[0])

    def step(self, length: float) -> None:
        """Take a communication step [s]."""
        self.calls += 1
        self._slave.doStep(self.time, length)
        self.time += length

    def save(self) -> tuple[object, float]:
        """Return the state, to go back to."""
        self.calls += 1
        return self._slave.getFMUState(), self.time

    def restore(self, saved: tuple[object, float]) -> None:
        """Go back to a state."""
        self.calls += 1
        self._slave.setFMUState(saved[0])
        self.time = saved[1]

    def height_by_force(self) -> float:
        """Return the derivative of the height at the step's end by the force held over it [m/N]."""
        self.calls += 1
        by = self._slave.getDirectionalDerivative([self._of["tcp.z"]], [self._of["force.z"]], [1.0])
        return float(by[0])

    def free(self) -> None:
        """End the instance."""
        self._slave.freeInstance()


def force_held(tool: Tool, height: float) -> float:
    """The wall's force at the step's start, held over it."""
    tool.set(**{"force.z": PUSH + tool.stiffness * max(0.0, tool.wall - height)})
    tool.step(STEP)
    return tool.height()


def force_by_newton(tool: Tool, height: float) -> float:
    """The wall's force at the step's end, by Newton's method with the directional derivative."""
    saved, force = tool.save(), tool.stiffness * max(0.0, tool.wall - height)
    for _ in range(MOST_PASSES):
        tool.restore(saved)
        tool.set(**{"force.z": PUSH + force})
        tool.step(STEP)
        height = tool.height()
        left = force - tool.stiffness * max(0.0, tool.wall - height)
        if abs(left) < 1e-3:
            break
        pressing = height < tool.wall
        force -= left / (1.0 + pressing * tool.stiffness * tool.height_by_force())
        force = max(0.0, force)
    return height


def spring_switched(tool: Tool, height: float) -> float:
    """The contact spring, on where the tool is in the wall at the step's start."""
    tool.set(**{"anchor.kzz": tool.stiffness * (height < tool.wall)})
    tool.step(STEP)
    return tool.height()


def spring_switched_inside(tool: Tool, height: float) -> float:
    """The same, going back to where the tool passes the wall, by halved steps."""
    end = tool.time + STEP
    inside = height < tool.wall
    while end - tool.time > 1e-9:
        tool.set(**{"anchor.kzz": tool.stiffness * inside})
        saved, length = tool.save(), end - tool.time
        tool.step(length)
        height = tool.height()
        if (height < tool.wall) == inside:
            break
        good, bad = 0.0, length
        for _ in range(HALVINGS):
            tool.restore(saved)
            tool.step(0.5 * (good + bad))
            height = tool.height()
            if (height < tool.wall) == inside:
                good = 0.5 * (good + bad)
            else:
                bad = 0.5 * (good + bad)
        tool.restore(saved)
        tool.step(bad)
        height = tool.height()
        inside = not inside
    return height


def lifting_contact(tool: Tool, height: float) -> float:
    """The contact that lifts off."""
    del height
    tool.step(STEP)
    return tool.height()


Master = Callable[[Tool, float], float]
MASTERS: dict[str, Master] = {
    "force of the wall at the step's start": force_held,
    "force at its end, by Newton's method": force_by_newton,
    "contact spring, switched at communication points": spring_switched,
    "contact spring, switched where the tool passes": spring_switched_inside,
    "contact that lifts off": lifting_contact,
}


def run(folder: Path, stiffness: float, master: Master) -> tuple[np.ndarray, float]:
    """Return heights over the wall [m], as far as the run came, and calls a step."""
    tool = Tool(folder, stiffness)
    if master is lifting_contact:
        tool.set(**{"contact.stiffness": stiffness})
    heights = [tool.height() - tool.wall]
    tool.calls = 0
    try:
        for _ in range(round(LENGTH / STEP)):
            heights.append(master(tool, heights[-1] + tool.wall) - tool.wall)
    except FMICallException:
        pass  # the robot cannot follow: the heights end here
    steps = max(1, len(heights) - 1)
    calls = tool.calls / steps
    tool.free()
    return np.array(heights), calls


def reference(folder: Path, stiffness: float) -> tuple[np.ndarray, float]:
    """Return the heights [m] at the masters' points, exact to 1e-9 m, and the lowest of all [m]."""
    tool = Tool(folder, stiffness, tolerance=1e-9)
    tool.set(**{"contact.stiffness": stiffness})
    heights = [tool.height() - tool.wall]
    for _ in range(FINE * round(LENGTH / STEP)):
        tool.step(STEP / FINE)
        heights.append(tool.height() - tool.wall)
    tool.free()
    return np.array(heights[::FINE]), min(heights)


def _cells(heights: np.ndarray, calls: float, expected: np.ndarray) -> str:
    if len(heights) < len(expected):
        return f"no, refused after {1e3 * STEP * (len(heights) - 1):.0f} ms"
    error = np.abs(heights - expected)
    stable = error[-round(len(error) / 6) :].max() < RESTS
    deepest = max(0.0, -heights.min())
    wrong = f"{1e6 * error.max():.2g}" if error.max() > 1e-9 else "< 0.001"
    return f"{'yes' if stable else 'no'}, {1e6 * deepest:.3g}, {wrong}, {calls:.2g}"


def contact_table() -> str:
    """Return the rows as measured: masters by the stiffness of the wall."""
    rows: dict[str, list[str]] = {"penetration of the reference [um]": []}
    rows |= {name: [] for name in MASTERS}
    with tempfile.TemporaryDirectory() as name:
        robot = load_robot(shipped_robots()["icme2008"])
        file = build_fmu(robot, Path(name, "ElasticRobot.fmu"), BuildOptions("native"))
        folder = Path(name, "fmu")
        fmpy.extract(str(file), unzipdir=str(folder))
        for stiffness in STIFFNESSES:
            expected, lowest = reference(folder, stiffness)
            rows["penetration of the reference [um]"].append(f"{-1e6 * lowest:.3g}")
            for key, master in MASTERS.items():
                heights, calls = run(folder, stiffness, master)
                rows[key].append(_cells(heights, calls, expected))
                print(f"{stiffness:g} N/m, {key}: {rows[key][-1]}", flush=True)
    head = ("master, steps of 1 ms", *(f"{stiffness:.0e} N/m" for stiffness in STIFFNESSES))
    return table(head, ((key, *cells) for key, cells in rows.items()))


def write() -> None:
    """Write the table."""
    replace("fmu", "table of contacts", contact_table())


if __name__ == "__main__":
    sys.exit(finish(write))

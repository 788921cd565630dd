"""The robot as an FMU: simulations in a process of their own, as plain function calls."""

from __future__ import annotations

import os
import re
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from operator import is_not
from pathlib import Path

import numpy as np

from coupling.errors import HostError, SimulationError
from coupling.events import Progress, Watch, unwatched
from coupling.files.scratch import ScratchFolder
from coupling.fmu.job import FmuError, MarchJob, SimulationJob, StepWindow
from coupling.fmu.worker import WorkerEndedError, WorkerProcess, WorkerProcesses, unpack
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath, MotorHistory
from coupling.robot.contract import Advance
from coupling.robot.fmu_signals import (
    POSE_OUTPUTS,
    SPRING_INPUTS,
    WRENCH_INPUTS,
    UnpackedRobot,
    input_rows,
    rows_with_spring,
    save_trajectory,
)
from elastic_robot.description import Robot
from elastic_robot.fingerprint import fingerprint
from elastic_robot.fmi.interface import IDEAL, Mode
from elastic_robot.fmi.variables import POSE

# Kinds of a robot's FMU, and the one that is built unless another is asked for.
FMU_KINDS = ("native", "python")
DEFAULT_KIND = FMU_KINDS[0]
# Error allowed at the TCP over a path [m].  Where gears chatter along a command, the FMU's own 1e-6 is
# wrong by tens of micrometres.
_TOLERANCE = 1e-8
# PythonFMU's binary crashes on other characters in the path of the unpacked FMU.
_SAFE_PATH = re.compile(r"[A-Za-z0-9_./\\:~ -]*")
# Variable of an FMU with hysteresis.
_OF_HYSTERESIS = "elongation[1]"
# What the outputs tell of a motor.
_OF_MOTORS = ("torque", "angle", "rate")
# A path shorter than this many steps is not worth a second process, by kind of FMU.
_WORTH_SHARING = {"native": 100_000, "python": 1000}
# Commands whose files are kept: a command and the uncorrected one are simulated by turns.
_KEPT = 2


class RobotFmu:
    """A robot FMU, unpacked and loaded for simulations; a context manager that cleans up.

    A quasi-static robot without hysteresis has no memory: a long path is shared between two instances
    of the FMU that run side by side.

    Args:
        file: The FMU; one built with --arrays is for other masters.
        drive: "ideal", or "servo": in dynamic mode its motors follow the command as their servos do.
        processes: Processes that it shares with other native FMUs, of which one simulates at a time and
            which are closed together; None: its own.

    Attributes:
        parameters: Start values of the FMU's parameters that are not its own, by name.

    Raises:
        SimulationError: If the file is no robot FMU or cannot run here.
    """

    def __init__(
        self,
        file: Path,
        torque_curve: str = "backlash",
        watch: Watch = unwatched,
        drive: str = IDEAL,
        processes: WorkerProcesses | None = None,
    ) -> None:
        self.torque_curve = torque_curve
        self.drive = drive
        self.parameters: dict[str, float | str] = {
            "torque_curve": torque_curve,
            "tcp_tolerance": _TOLERANCE,
            "drive": drive,
        }
        self.file = file
        self._watch = watch
        self._folder = ScratchFolder()
        if not _SAFE_PATH.fullmatch(str(self._folder.path)):
            raise SimulationError(
                "the folder for temporary files: expected a path of plain letters, digits and -_., as"
                f" the FMU's binary cannot take others, got {str(self._folder.path)!r}: set TMPDIR"
            )
        with _simulation_errors(f"{file}: "):
            unpack(file, self._folder.path)
        self.fingerprint = fingerprint(Path(self._folder.path, "resources"))
        self._robot = UnpackedRobot(self._folder.path)
        self._processes = WorkerProcesses() if processes is None else processes
        self._saved: deque[tuple[Path, tuple[np.ndarray, ...]]] = deque()
        self._written = 0
        self._running(1)

    def __enter__(self) -> RobotFmu:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the processes and remove the unpacked files."""
        self._processes.end()
        self._folder.close()

    def simulate(
        self,
        command: JointPath,
        wrench: WrenchHistory,
        mode: Mode,
        robot: Robot | None = None,
        what: str = "",
    ) -> ToolPath:
        """Run a command under a wrench history and return the path that the TCP takes.

        Args:
            command: Motion of the drives, which covers the history's times.
            wrench: Wrench on the tool; the path is given at its instants.
            robot: Robot with other numbers than the FMU's; None: the FMU's.
            what: Remark on what is simulated, for who watches.

        Raises:
            SimulationError: If the FMU refuses a step, with its reason.
            HostError: If the FMU's process has ended.
        """
        return self._run(command, wrench, mode, robot=robot, what=what)[0]

    def march(
        self,
        command: JointPath,
        start: WrenchHistory,
        end: float,
        mode: Mode,
        robot: Robot | None = None,
    ) -> Advance:
        """Begin a simulation that goes on window by window, until the FMU begins another one.

        Args:
            start: Wrench on the tool in initialisation, at the start alone.
            end: Time up to which it may go on [s].
        """
        parameters = self._prepare(command, mode, robot)
        (process,) = self._running(1)
        time = np.array([start.time[0], end])
        names, rows = WRENCH_INPUTS + SPRING_INPUTS, rows_with_spring(start)[:1]
        job = MarchJob(parameters, time, names, rows, POSE_OUTPUTS, len(POSE))
        with _simulation_errors():
            process.send(job)
            window_start = window_end = process.receive(_unheard)[0]

        def advance(loads: WrenchHistory, is_repeat: bool) -> ToolPath:
            nonlocal window_start, window_end
            if not is_repeat:
                window_start = window_end
            window = StepWindow(loads.instants, rows_with_spring(loads)[1:], is_repeat)
            with _simulation_errors():
                process.send(window)
                poses = process.receive(_unheard)
            window_end = poses[-1]
            return ToolPath(loads.instants, np.vstack([window_start, poses]))

        return advance

    def deflected(
        self, command: JointPath, wrench: WrenchHistory, coordinates: int
    ) -> tuple[ToolPath, np.ndarray]:
        """Run a command in dynamic mode and return the TCP's path and how the joints give way on it.

        Args:
            coordinates: Number m of the robot's elastic coordinates.

        Returns:
            The path, and the elastic coordinates at its times [rad], (n, m).
        """
        names = [f"deflection[{i + 1}]" for i in range(coordinates)]
        return self._run(command, wrench, "dynamic", names)

    def with_motors(
        self,
        command: JointPath,
        wrench: WrenchHistory,
        joints: Sequence[int],
        robot: Robot | None = None,
        what: str = "",
    ) -> tuple[ToolPath, MotorHistory]:
        """Run a command in dynamic mode and return the TCP's path and what motors do on it.

        Args:
            joints: Joints that have the motors, from 0.
        """
        names = [f"motor_{name}[{i + 1}]" for name in _OF_MOTORS for i in joints]
        path, rows = self._run(command, wrench, "dynamic", names, robot, what)
        blocks = np.hsplit(rows, len(_OF_MOTORS))
        return path, MotorHistory(tuple(joints), wrench.instants, *blocks)

    def gears(
        self, command: JointPath, time: np.ndarray, coordinates: Sequence[int], robot: Robot
    ) -> np.ndarray:
        """Run a command without a wrench in dynamic mode and return what gears do.

        Args:
            time: Times [s], (n,).
            coordinates: Numbers of the gears' elastic coordinates, of every joint, from 0.

        Returns:
            Wind-ups [rad], then torques of the gears [N m], (n, 2 joints).
        """
        names = [f"deflection[{k + 1}]" for k in coordinates]
        names += [f"gear_torque[{i + 1}]" for i in range(len(coordinates))]
        return self._run(command, WrenchHistory.none(time), "dynamic", names, robot)[1]

    def _run(
        self,
        command: JointPath,
        wrench: WrenchHistory,
        mode: Mode,
        further: Sequence[str] = (),
        robot: Robot | None = None,
        what: str = "",
    ) -> tuple[ToolPath, np.ndarray]:
        """Return the TCP's path, and the values of further outputs on it, (n, further)."""
        parameters = self._prepare(command, mode, robot)
        instants = wrench.instants
        (first,) = self._running(1)
        remembers = mode == "dynamic" or _OF_HYSTERESIS in first.variables
        parts = _parts(len(instants), remembers, self._robot.kind)
        processes = self._running(len(parts))
        inputs = WRENCH_INPUTS if wrench.spring is None else WRENCH_INPUTS + SPRING_INPUTS
        outputs = (*POSE_OUTPUTS, *further)
        jobs = [
            SimulationJob(
                parameters, instants[part], inputs, input_rows(wrench, part), outputs, len(outputs)
            )
            for part in parts
        ]

        def progress(finished: int, total: int) -> None:
            work = f"simulating the {mode} robot{f' with {what}' if what else ''}"
            self._watch(Progress(work, len(parts) * finished, len(parts) * total))

        try:
            with _simulation_errors():
                for process, job in zip(processes, jobs, strict=True):
                    process.send(job)
                rows = np.vstack([process.receive(progress) for process in processes])
        except BaseException as error:
            # What others still answer would be taken for the next simulation's.
            if len(processes) > 1 or not isinstance(error, SimulationError):
                self._processes.end()
            raise
        return ToolPath(instants, rows[:, : len(POSE)]), rows[:, len(POSE) :]

    def _prepare(
        self, command: JointPath, mode: Mode, robot: Robot | None
    ) -> dict[str, float | str]:
        """Write what an instance reads when it is made, and return its parameters by name."""
        self._robot.describe(robot)
        return {"mode": mode, "trajectory": str(self._trajectory(command)), **self.parameters}

    def _trajectory(self, command: JointPath) -> Path:
        """Return the file of a command, which is written unless it is there."""
        # Of the same arrays: a cell makes its robots' paths anew for each simulation.
        arrays = (command.time, *command.q, *command.qd, *command.qdd)
        for file, saved in self._saved:
            if len(arrays) == len(saved) and not any(map(is_not, arrays, saved)):
                return file
        if len(self._saved) == _KEPT:
            self._saved.popleft()  # before its file is written over, which may fail
        file = Path(self._folder.path, f"trajectory_{self._written % _KEPT}.npz")
        save_trajectory(file, command)
        self._written += 1
        self._saved.append((file, arrays))
        return file

    def _running(self, count: int) -> list[WorkerProcess]:
        with _simulation_errors(f"{self.file}: "):
            return self._processes.running(self._folder.path, count)


def _unheard(finished: int, total: int) -> None:
    """Take no notice of the progress of a few steps."""


def _parts(samples: int, remembers: bool, kind: str) -> list[slice]:
    """Return the samples for each process; a robot with a memory has one."""
    if remembers or samples < _WORTH_SHARING[kind] or (os.cpu_count() or 1) < 2:
        return [slice(0, samples)]
    return [slice(0, samples // 2), slice(samples // 2, samples)]


@contextmanager
def _simulation_errors(where: str = "") -> Iterator[None]:
    """Turn an FMU's errors into those of a simulation."""
    try:
        yield
    except WorkerEndedError as cause:
        raise HostError(f"{where}{cause}") from cause
    except FmuError as cause:
        raise SimulationError(f"{where}{cause}") from cause

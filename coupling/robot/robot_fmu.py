"""The robot as an FMU: simulations in a process of their own, as plain function calls."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from operator import is_not
from pathlib import Path
from typing import BinaryIO

import numpy as np

from coupling.errors import HostError, SimulationError
from coupling.events import Progress, Watch, unwatched
from coupling.files.csv_table import STIFFNESS_COLUMNS
from coupling.files.scratch import ScratchFolder
from coupling.fmu.job import FmuError, MarchJob, SimulationJob, StepWindow
from coupling.fmu.worker import WorkerEndedError, WorkerProcess, unpack
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.path.motor_history import MotorHistory
from coupling.robot.unpacked_robot import UnpackedRobot
from elastic_robot.description import Robot
from elastic_robot.fingerprint import fingerprint
from elastic_robot.fmi.interface import IDEAL, Mode
from elastic_robot.fmi.variables import AXES, POSE

# Kinds of a robot's FMU, and the one that is built unless another is asked for.
FMU_KINDS = ("native", "python")
DEFAULT_KIND = FMU_KINDS[0]
# Error allowed at the TCP over a path [m].  Where gears chatter along a command, the FMU's own 1e-6 is
# wrong by tens of micrometres.
_TOLERANCE = 1e-8
# PythonFMU's binary crashes on other characters in the path of the unpacked FMU.
_SAFE_PATH = re.compile(r"[A-Za-z0-9_./\\:~ -]*")
# Variables of an FMU with hysteresis, as scalars and as an array.
_OF_HYSTERESIS = {"elongation", "elongation[1]"}
# Columns of a spring: anchor, its velocity and the stiffness.
_SPRING = 6 + len(STIFFNESS_COLUMNS)
# What the outputs tell of a motor.
_OF_MOTORS = ("torque", "angle", "rate")
# A path shorter than this many steps is not worth a second process.
_WORTH_SHARING = 1000


@dataclass(frozen=True)
class Signals:
    """Names of inputs and outputs.

    Attributes:
        wrench: Names of the wrench and of its rate.
        spring: Names of the contact spring: anchor, its velocity and the stiffness.
        pose: Names of the TCP's pose.
        deflection: Function that gives those of so many elastic coordinates.
        motors: Function that gives those of joints' motors, from 0: torques, angles, rates.
    """

    wrench: tuple[str, ...]
    spring: tuple[str, ...]
    pose: tuple[str, ...]
    deflection: Callable[[int], tuple[str, ...]]
    motors: Callable[[Sequence[int]], tuple[str, ...]]


SCALARS = Signals(
    tuple(
        f"{name}.{axis}"
        for name in ("force", "moment", "force_rate", "moment_rate")
        for axis in AXES
    ),
    tuple(f"anchor.{name}" for name in (*AXES, "vx", "vy", "vz", *STIFFNESS_COLUMNS)),
    tuple(f"tcp.{name}" for name in POSE),
    lambda count: tuple(f"deflection[{i + 1}]" for i in range(count)),
    lambda joints: tuple(f"motor_{name}[{i + 1}]" for name in _OF_MOTORS for i in joints),
)
# Of an FMU built with --arrays; what its motors do is not asked for.
ARRAYS = Signals(
    ("force", "moment", "force_rate", "moment_rate"),
    ("anchor.position", "anchor.velocity", "anchor.stiffness"),
    ("tcp.position", "tcp.orientation"),
    lambda count: ("deflection",) if count else (),
    lambda joints: (),
)


class RobotFmu:
    """A robot FMU, unpacked and loaded for simulations; a context manager that cleans up.

    A quasi-static robot without hysteresis has no memory: a long path is shared between two instances
    of the FMU that run side by side.

    Args:
        file: The FMU.
        torque_curve: "linear", "backlash" or "spline".
        watch: Function called with the progress of a simulation.
        drive: "ideal", or "servo": in dynamic mode its motors follow the command as their servos do.

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
        self._processes: list[WorkerProcess] = []
        self._saved: tuple[np.ndarray, ...] = ()
        self._started(1)

    def __enter__(self) -> RobotFmu:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the processes and remove the unpacked files."""
        self._end()
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
            mode: "dynamic" or "quasistatic".
            robot: Robot with other numbers than the FMU's; None: the FMU's.
            what: Remark on what is simulated, for who watches.

        Raises:
            SimulationError: If the FMU refuses a step, with its reason.
            HostError: If the FMU's process has ended.
        """
        rows = self._run(command, wrench, mode, robot=robot, what=what)
        return ToolPath(wrench.instants, rows)

    def march(
        self,
        command: JointPath,
        start: WrenchHistory,
        end: float,
        mode: Mode,
        robot: Robot | None = None,
    ) -> FmuMarch:
        """Begin a simulation that goes on window by window, until the FMU begins another one.

        Args:
            command: Motion of the drives.
            start: Wrench on the tool in initialisation, at the start alone.
            end: Time up to which it may go on [s].
            mode: "dynamic" or "quasistatic".
            robot: As for `simulate`.

        Raises:
            SimulationError, HostError: As `simulate`.
        """
        parameters = self._prepared(command, mode, robot)
        (process,) = self._started(1)
        signals = ARRAYS if "force" in process.variables else SCALARS
        time = np.array([start.time[0], end])
        names, rows = signals.wrench + signals.spring, _with_spring(start)[:1]
        job = MarchJob(parameters, time, names, rows, signals.pose, len(POSE))
        with _simulation_errors():
            process.send(job)
            return FmuMarch(process, process.receive(_unheard)[0])

    def deflected(
        self, command: JointPath, wrench: WrenchHistory, coordinates: int
    ) -> tuple[ToolPath, np.ndarray]:
        """Run a command in dynamic mode and return the TCP's path and how the joints give way on it.

        Args:
            command, wrench: As for `simulate`.
            coordinates: Number m of the robot's elastic coordinates.

        Returns:
            The path, and the elastic coordinates at its times [rad], (n, m).

        Raises:
            SimulationError, HostError: As `simulate`.
        """
        rows = self._run(
            command, wrench, "dynamic", lambda signals: signals.deflection(coordinates), coordinates
        )
        return ToolPath(wrench.instants, rows[:, : len(POSE)]), rows[:, len(POSE) :]

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
            command, wrench, robot, what: As for `simulate`.
            joints: Joints that have the motors, from 0.

        Raises:
            SimulationError, HostError: As `simulate`.
        """
        count = len(_OF_MOTORS) * len(joints)
        rows = self._run(
            command, wrench, "dynamic", lambda signals: signals.motors(joints), count, robot, what
        )
        path = ToolPath(wrench.instants, rows[:, : len(POSE)])
        blocks = np.hsplit(rows[:, len(POSE) :], len(_OF_MOTORS))
        return path, MotorHistory(tuple(joints), wrench.instants, *blocks)

    def gears(
        self, command: JointPath, time: np.ndarray, coordinates: Sequence[int], robot: Robot
    ) -> np.ndarray:
        """Run a command without a wrench in dynamic mode and return what gears do.

        Args:
            command: Motion of the drives.
            time: Times [s], (n,).
            coordinates: Numbers of the gears' elastic coordinates, of every joint, from 0.
            robot: As for `simulate`.

        Returns:
            Wind-ups [rad], then torques of the gears [N m], (n, 2 joints).

        Raises:
            SimulationError, HostError: As `simulate`.
        """
        names = [f"deflection[{k + 1}]" for k in coordinates]
        names += [f"gear_torque[{i + 1}]" for i in range(len(coordinates))]
        none = WrenchHistory.none(time)
        rows = self._run(command, none, "dynamic", lambda signals: tuple(names), len(names), robot)
        return rows[:, len(POSE) :]

    def _run(
        self,
        command: JointPath,
        wrench: WrenchHistory,
        mode: Mode,
        further: Callable[[Signals], tuple[str, ...]] = lambda signals: (),
        count: int = 0,
        robot: Robot | None = None,
        what: str = "",
    ) -> np.ndarray:
        """Return poses, and the values of so many further signals behind them, (n, 7 + count)."""
        parameters = self._prepared(command, mode, robot)
        instants = wrench.instants
        (first,) = self._started(1)
        remembers = mode == "dynamic" or not first.variables.isdisjoint(_OF_HYSTERESIS)
        parts = _parts(len(instants), remembers)
        processes = self._started(len(parts))
        signals = ARRAYS if "force" in processes[0].variables else SCALARS
        inputs = signals.wrench if wrench.spring is None else signals.wrench + signals.spring
        outputs, width = (*signals.pose, *further(signals)), len(POSE) + count
        jobs = [
            SimulationJob(parameters, instants[part], inputs, _inputs(wrench, part), outputs, width)
            for part in parts
        ]

        def progress(finished: int, total: int) -> None:
            work = f"simulating the {mode} robot{f' with {what}' if what else ''}"
            self._watch(Progress(work, len(parts) * finished, len(parts) * total))

        try:
            with _simulation_errors():
                for process, job in zip(processes, jobs, strict=True):
                    process.send(job)
                return np.vstack([process.receive(progress) for process in processes])
        except BaseException as error:
            # What others still answer would be taken for the next simulation's.
            if len(processes) > 1 or not isinstance(error, SimulationError):
                self._end()
            raise

    def _prepared(
        self, command: JointPath, mode: Mode, robot: Robot | None
    ) -> dict[str, float | str]:
        """Write what an instance reads when it is made, and return its parameters by name."""
        trajectory = Path(self._folder.path, "trajectory.npz")
        # Of the same arrays: a cell makes its robots' paths anew for each simulation.
        arrays = (command.time, *command.q, *command.qd, *command.qdd)
        if len(arrays) != len(self._saved) or any(map(is_not, arrays, self._saved)):
            save_trajectory(trajectory, command)
            self._saved = arrays
        self._robot.describe(robot)
        return {"mode": mode, "trajectory": str(trajectory), **self.parameters}

    def _started(self, count: int) -> list[WorkerProcess]:
        """Return as many processes."""
        while len(self._processes) < count:
            with _simulation_errors(f"{self.file}: "):
                self._processes.append(WorkerProcess(self._folder.path))
        return self._processes[:count]

    def _end(self) -> None:
        while self._processes:
            self._processes.pop().close()


class FmuMarch:
    """A simulation of a robot FMU that goes on window by window.

    Args:
        process: Process that runs the FMU.
        pose: Pose of the TCP at the start, (7,).
    """

    def __init__(self, process: WorkerProcess, pose: np.ndarray) -> None:
        self._process = process
        self._start = self._end = pose

    def advance(self, loads: WrenchHistory, again: bool) -> ToolPath:
        """Return the path of the TCP within a window.

        Args:
            loads: Wrench on the tool at the window's times, which begin where the last one ended.
            again: Whether the last window is taken back, and this one is in its place.

        Raises:
            SimulationError, HostError: As `RobotFmu.simulate`.
        """
        time = loads.instants
        if not again:
            self._start = self._end
        window = StepWindow(time, _with_spring(loads)[1:], again)
        with _simulation_errors():
            self._process.send(window)
            rows = self._process.receive(_unheard)
        self._end = rows[-1]
        return ToolPath(time, np.vstack([self._start, rows]))


def _unheard(finished: int, total: int) -> None:
    """Take no notice of the progress of a few steps."""


def save_trajectory(file: Path | BinaryIO, command: JointPath) -> None:
    """Write the motion of one robot as an NPZ that the FMU's `trajectory` reads."""
    columns = {"time": command.time, **command.columns}
    np.savez(file, columns=list(columns), data=np.column_stack(list(columns.values())))


def _inputs(wrench: WrenchHistory, part: slice) -> np.ndarray:
    """Return the inputs for some steps: wrench and rate, and anchor, velocity and stiffness of a spring.

    The first row is for initialisation.
    """
    (before,), (behind,) = wrench.before[:, part], wrench.behind[:, part]
    steps = np.diff(wrench.instants[part])[:, None]
    start, rate = before.copy(), np.zeros_like(before)
    start[1:], rate[1:] = behind[:-1], (before[1:] - behind[:-1]) / steps
    loads = np.hstack([start, rate])
    if wrench.spring is None:
        return loads
    (anchor,), (stiffness,) = wrench.spring.anchor[:, part], wrench.spring.entries[:, part]
    place, velocity = anchor.copy(), np.zeros_like(anchor)
    place[1:], velocity[1:] = anchor[:-1], np.diff(anchor, axis=0) / steps
    return np.hstack([loads, place, velocity, stiffness])


def _with_spring(wrench: WrenchHistory) -> np.ndarray:
    """Return the inputs for all steps, with those of a spring that does nothing where there is none."""
    rows = _inputs(wrench, slice(None))
    none = np.zeros((len(rows), 0 if wrench.spring is not None else _SPRING))
    return np.hstack([rows, none])


def _parts(samples: int, remembers: bool) -> list[slice]:
    """Return the samples for each process; a robot with a memory has one."""
    if remembers or samples < _WORTH_SHARING or (os.cpu_count() or 1) < 2:
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

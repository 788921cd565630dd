"""A measured run: what was commanded, what acted on it, and where its tool was measured."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from coupling.errors import LearnError
from coupling.files.measured_table import DEVIATION, MeasuredTable
from coupling.files.recorded_bag import is_bag
from coupling.identification.runs.motors import MeasuredMotors
from coupling.identification.runs.recorded_columns import (
    ColumnChoice,
    Understood,
    chosen_columns,
    read_recorded,
    require_positions,
)
from coupling.inverse.inversion import DesiredMotion
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.description import Robot

# How far behind the last sample a measured run is simulated, as its clock may be off [s].
_CLOCK = 0.3
_TIME, _POSITION, _ROTATION = ("time",), ("x", "y", "z"), ("qx", "qy", "qz", "qw")
# A quaternion is of length 1 to this.
_UNIT = 1e-2
# Fewest rows that can be a measured run.
_FEWEST = 20
# Simulations that are kept: those of one iteration of a fit.
_KEPT = 12


@dataclass(frozen=True)
class Measurement:
    """Positions, and orientations, that a measuring device has recorded, and what motors did then.

    Attributes:
        name: Name of the file.
        time: Times, rising [s], (n,).
        position: Positions of the TCP [m], (n, 3).
        rotation: Orientations of the tool, (n,), behind a turn on it that is the same all along; None
            where not measured.
        motors: Angles and torques of motors; None where not recorded.
        clock: Time that was added to those of the file [s].
        device_from_base: Frame of the robot's base in that of the file, where it lies anywhere.
        understood: Columns, units and gaps of the file; None of one that was computed.
    """

    name: str
    time: np.ndarray
    position: np.ndarray
    rotation: Rotation | None = None
    motors: MeasuredMotors | None = None
    clock: float = 0.0
    device_from_base: Frame | None = None
    understood: Understood | None = None

    def frame_offset(self, shift: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return shift [m] and turn [rad] of the file's frame, with what is left of them here, (3,)."""
        if self.device_from_base is None:
            return shift, turn
        frame = self.device_from_base
        return frame.position + shift, frame.rotation.as_rotvec() + turn

    def at_rows(self, rows: np.ndarray) -> Measurement:
        """Return its rows of given numbers, (k,)."""
        rotation = None if self.rotation is None else self.rotation[rows]
        motors = self.motors and self.motors.at_rows(rows)
        position = self.position[rows]
        return replace(
            self, time=self.time[rows], position=position, rotation=rotation, motors=motors
        )

    def transformed(self, frame: Frame) -> Measurement:
        """Return the same in another frame, in which `frame` is the present one."""
        rotation = None if self.rotation is None else frame.rotation * self.rotation
        return replace(self, position=frame.points(self.position), rotation=rotation)


@dataclass(frozen=True)
class MeasuredPath:
    """A measured run of a command, as far as it was measured.

    Attributes:
        command: Motion of the drives.
        wrench: Wrench on the tool, until the end of what was measured.
        desired: Desired path, at the same times.
        desired_motion: The same for the inverse, with the joint angles of the undeflected robot.
        measured: Measurement, in the robot's base frame as far as that is known, on the command's clock.
    """

    command: JointPath
    wrench: WrenchHistory
    desired: ToolPath
    desired_motion: DesiredMotion
    measured: Measurement
    _cache: deque[tuple[object, SimulatedPath]] = field(
        init=False, repr=False, compare=False, default_factory=lambda: deque(maxlen=_KEPT)
    )

    @property
    def coordinates(self) -> int:
        """Number of measured coordinates of the pose: 3, or 6 with orientations."""
        return 3 if self.measured.rotation is None else 6

    @cached_property
    def tool_rotation(self) -> RotationSpline | None:
        """Orientation that the path asks for at any time; None where orientations were not measured."""
        if self.measured.rotation is None:
            return None
        return RotationSpline(self.desired.time, self.desired.rotations[0])

    def until(self, seconds: float) -> MeasuredPath:
        """Return its first seconds."""
        measured = self.measured.at_rows(
            np.flatnonzero(self.measured.time <= self.measured.time[0] + seconds)
        )
        last = int(np.searchsorted(self.desired.time, measured.time[-1] + _CLOCK))
        count = min(last + 1, len(self.desired.time))
        desired = self.desired.at_rows(np.arange(count))
        wrench = self.wrench.until(float(desired.time[-1]))
        return replace(self, wrench=wrench, desired=desired, measured=measured)

    def simulated(self, fmu: RobotFmu, robot: Robot) -> SimulatedPath:
        """Return where the tool of a robot is, by the FMU of one with other numbers."""
        key = fmu.fingerprint, fmu.torque_curve, fmu.drive, robot
        for cached_robot, path in list(self._cache):
            if cached_robot == key:
                return path
        path = self._simulated(fmu, robot)
        self._cache.append((key, path))
        return path

    def _simulated(self, fmu: RobotFmu, robot: Robot) -> SimulatedPath:
        reference = None if self.tool_rotation is None else self.desired
        what, motors = "learned parameters", self.measured.motors
        if motors is None:
            path = fmu.simulate(self.command, self.wrench, "dynamic", robot, what)
            return SimulatedPath(path, reference)
        path, history = fmu.with_motors(self.command, self.wrench, motors.joints, robot, what)
        return SimulatedPath(path, reference, motors.of_history(history))


class SimulatedPath:
    """A simulated path between its samples.

    Args:
        path: The path of one tool.
        reference: Path at the same times from whose orientations its own count; None where they do
            not count.
        motors: Angles [rad] and torques [N m] of motors at the path's times, in c columns of
            `MeasuredMotors`, (n, c).

    Attributes:
        path: The path.
    """

    def __init__(
        self,
        path: ToolPath,
        reference: ToolPath | None = None,
        motors: np.ndarray | None = None,
    ) -> None:
        self.path, self._reference = path, reference
        self._of_motors = np.empty((len(path.time), 0)) if motors is None else motors
        self._position = CubicSpline(path.time, path.position[0])

    def position(self, time: np.ndarray, order: int = 0) -> np.ndarray:
        """Return positions [m] or their rates at times that may lie a little outside, (n, 3)."""
        values: np.ndarray = self._position(self._inside(time), order)
        return values

    def turn(self, time: np.ndarray) -> np.ndarray:
        """Return rotation vectors from the reference's orientations [rad], (n, 3); 0 without one."""
        if self._reference is None:
            return np.zeros((len(time), 3))
        values: np.ndarray = self._turn(self._inside(time))
        return values

    def motors(self, time: np.ndarray, order: int = 0) -> np.ndarray:
        """Return angles [rad] and torques [N m] of motors, or rates, as in `MeasuredMotors`, (n, c)."""
        values: np.ndarray = self._motors(self._inside(time), order)
        return values

    def pose(self, time: np.ndarray) -> np.ndarray:
        """Return positions [m], turns from the reference [rad], and what motors do, (n, 6 + c)."""
        return np.hstack([self.position(time), self.turn(time), self.motors(time)])

    def rotation(self, time: np.ndarray) -> Rotation:
        """Return rotations base_from_tool at times [s], (n,)."""
        return self._rotation(self._inside(time))

    @cached_property
    def _rotation(self) -> RotationSpline:
        return RotationSpline(self.path.time, self.path.rotations[0])

    @cached_property
    def _motors(self) -> CubicSpline:
        return CubicSpline(self.path.time, self._of_motors)

    @cached_property
    def _turn(self) -> CubicSpline:
        assert self._reference is not None
        turns = self.path.deviation_from(self._reference)[0, :, 3:]
        return CubicSpline(self.path.time, turns)

    def _inside(self, time: np.ndarray) -> np.ndarray:
        return np.clip(time, self.path.time[0], self.path.time[-1])


def read_measurement(path: Path, choice: ColumnChoice | None = None) -> Measurement:
    """Read where a tool was measured (columns: docs/next.md).

    Args:
        path: CSV file with the columns of the page, or the file of a device: a table of text, a trace of
            a controller, a bag of ROS.
        choice: Its columns and units, where they are named.

    Raises:
        LearnError: With file, line, column, what was expected and what was got.
    """
    if choice is None and _has_named_columns(path):
        return _read_named_columns(path)
    choice = choice or ColumnChoice()
    time, position, quaternion, understood = chosen_columns(read_recorded(path, choice), choice)
    if len(time) < _FEWEST:
        raise LearnError(f"{path}: expected at least {_FEWEST} rows, got {len(time)}")
    falls = np.flatnonzero(np.diff(time) <= 0.0)
    if len(falls):
        before, behind = time[falls[0] : falls[0] + 2]
        raise LearnError(
            f"{path}: time: expected more than {before:.9g} s, got {behind:.9g} s behind it"
        )
    if quaternion is not None and (off := _off_unit(quaternion)).max() > _UNIT:
        worst = ", ".join(f"{value:.6g}" for value in quaternion[off.argmax()])
        raise LearnError(f"{path}: expected quaternions qx, qy, qz, qw of length 1, got {worst}")
    rotation = None if quaternion is None else Rotation.from_quat(quaternion)
    return Measurement(path.name, time, position, rotation, understood=understood)


def _has_named_columns(path: Path) -> bool:
    """Return whether a file begins as one with the columns of the page, as far as it can be read."""
    try:
        with path.open(encoding="utf-8-sig") as stream:
            lines = (line for line in stream if line.strip() and not line.lstrip().startswith("#"))
            names = {name.strip() for name in next(lines, "").split(",")}
    except UnicodeDecodeError:
        return False
    except OSError:
        return not is_bag(path)  # to be refused as such
    return names >= {*_TIME, *_POSITION}


def _read_named_columns(path: Path) -> Measurement:
    table = MeasuredTable.read(path, LearnError)
    table.require((*_TIME, *_POSITION))
    table.require_whole(_ROTATION)
    time, position = table.of(_TIME)[:, 0], table.of(_POSITION)
    if len(time) < _FEWEST:
        raise LearnError(f"{path}: expected at least {_FEWEST} rows, got {len(time)}")
    falls = np.flatnonzero(np.diff(time) <= 0.0)
    if len(falls):
        raise table.row_error("time", int(falls[0]) + 1, f"more than {time[falls[0]]:.9g}")
    rotation = None
    if table.has(_ROTATION):
        quaternion = table.of(_ROTATION)
        off = _off_unit(quaternion)
        if off.max() > _UNIT:
            raise table.row_error("qx", int(np.argmax(off)), "a quaternion of length 1")
        rotation = Rotation.from_quat(quaternion)
    elif table.has(("w",)):
        require_positions(path, table.of((*_POSITION, "w")))
    motors, units = MeasuredMotors.read(table), dict.fromkeys(_POSITION, "m") | {"time": "s"}
    used = {*units, *_ROTATION, *(motors.names if motors else ())}
    others = [name for name in table.header if name.removeprefix(DEVIATION) not in used]
    left_out = [f"the columns {', '.join(others)}"] if others else []
    columns = [(name, name, unit) for name, unit in units.items()]
    understood = Understood.of(columns, time, left_out)
    return Measurement(path.name, time, position, rotation, motors, understood=understood)


def _off_unit(quaternion: np.ndarray) -> np.ndarray:
    off: np.ndarray = np.abs(np.linalg.norm(quaternion, axis=1) - 1.0)
    return off

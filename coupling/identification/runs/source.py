"""Run folders with what was measured on them -> measured runs to learn from."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, replace
from math import isclose
from pathlib import Path

import numpy as np

from coupling.case.file import load_case
from coupling.errors import CaseError, LearnError
from coupling.files.robot_file import find_robot
from coupling.files.toml_file import load_toml
from coupling.identification.runs.alignment import aligned
from coupling.identification.runs.measurement import MeasuredPath, Measurement
from coupling.identification.runs.parameters import learnable
from coupling.inverse.inversion import DesiredMotion
from coupling.path.controller import Controller
from coupling.path.discrepancy import Discrepancy
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.results.forecast import RunForecast
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.run.stored_run import StoredRobot, read_run
from elastic_robot.description import Joint, Robot
from elastic_robot.gear_parts import StopElement

# Longest step between the samples that the inverse is given [s]: those of a case are its process's, and
# a run folder has them in the controller's cycle.
_SAMPLES = 0.02
# How long behind the end of what was measured the links' motion is solved for [s].
_BEHIND = 1.0
# Relative difference of numbers that rounding explains: a few operations in double precision.
_ROUNDING = 1e-12
# Stiffness that gears have where it does not count [N m/rad]: no balancer rises by more.
_ANY = 1e30


@dataclass(frozen=True)
class MeasuredFile:
    """A run, and what was measured under its command.

    Attributes:
        folder: The run folder.
        measured: Measurement, in axes of the robot's base.
        robot: The robot that the command was computed for.
        file: Its file.
        torque_curve: Name of its gears' torque curve.
        drive: Kind of its drives, "ideal" or "servo".
        home: Joint angles near which paths start [rad], (joints,).
        world_from_base: Frame of its base in the world.
        controller: Controller that takes its command.
        stored: Content of the folder; desired path and wrench in axes of the robot's base.
        discrepancy: Assumed deviation of the tool beyond the model, in these axes; None: nothing.
        forecast: Deviation that was expected of the command; None where nothing was measured before.
        tolerance: Deviation that the part allows [m]; None where it is not stated.
    """

    folder: Path
    measured: Measurement
    robot: Robot
    file: Path
    torque_curve: str
    drive: str
    home: np.ndarray
    world_from_base: Frame
    controller: Controller
    stored: StoredRobot
    discrepancy: Discrepancy | None = None
    forecast: RunForecast | None = None
    tolerance: float | None = None

    def whole(self, own_frame: bool, model: ToolPath) -> MeasuredPath:
        """Return the measured run.

        Args:
            own_frame: Whether the measuring frame lies anywhere.
            model: Path of the model's tool under the command.

        Raises:
            LearnError: If what was measured is none of the run.
        """
        measured = aligned(self.measured, model, own_frame)
        time = self.stored.desired.time
        last = min(int(np.searchsorted(time, measured.time[-1] + _BEHIND)), len(time) - 1)
        desired, wrench = _until(self.stored.desired, self.stored.wrench, last)
        return MeasuredPath(
            self.stored.joints, wrench, desired, self._desired_motion(desired, wrench), measured
        )

    @property
    def desired_motion(self) -> DesiredMotion:
        """The whole run, for the inverse."""
        return self._desired_motion(self.stored.desired, self.stored.wrench)

    def _desired_motion(self, desired: ToolPath, wrench: WrenchHistory) -> DesiredMotion:
        every = max(1, round(_SAMPLES / float(np.median(np.diff(desired.time)))))
        rows = np.unique(np.append(np.arange(0, len(desired.time), every), len(desired.time) - 1))
        path = desired.at_rows(rows)
        loads = WrenchHistory(path.time, wrench.on(desired).at(path.time))
        rigid: JointPath = InverseKinematics(self.robot, self.home).plan(path)
        return DesiredMotion(path, rigid, loads)


def _until(path: ToolPath, wrench: WrenchHistory, last: int) -> tuple[ToolPath, WrenchHistory]:
    return path.at_rows(np.arange(last + 1)), wrench.until(float(path.time[last]))


def read_source(folder: Path, measured: Measurement) -> MeasuredFile:
    """Read the run that was measured.

    Raises:
        ResultError: If the folder cannot be read.
        LearnError: If it is the run of a cell.
    """
    run = read_run(folder)
    if run.gap is not None:
        raise LearnError(f"{folder}: expected the run of one robot, got that of a cell of two")
    file = folder / "case.toml"
    case = load_case(file)
    placed = case.robots[0]
    description = load_toml(file, CaseError)["robot"]["description"]
    at, stored = placed.world_from_base, run.first
    # All that follows is in axes of the robot's base.
    base_from_world = at.inverse()
    return MeasuredFile(
        folder,
        measured.transformed(base_from_world),
        placed.description,
        find_robot(description, folder),
        placed.torque_curve,
        placed.drive,
        placed.home,
        at,
        case.controller,
        replace(
            stored,
            desired=stored.desired.transformed(base_from_world),
            wrench=stored.wrench.transformed(base_from_world),
        ),
        placed.discrepancy and placed.discrepancy.transformed(base_from_world),
        run.figures.forecast,
        case.tolerance,
    )


def require_comparable(sources: Sequence[MeasuredFile]) -> None:
    """Refuse runs of robots that differ by more than what is learned, or of one without elasticity.

    Raises:
        LearnError: If one of them is another one's, or there is nothing to learn.
    """
    first = sources[0]
    if not learnable(first.robot, first.torque_curve, first.drive):
        raise LearnError(f"{first.file}: expected a robot with elastic joints, got a rigid one")
    for other in sources[1:]:
        if other.torque_curve != first.torque_curve:
            raise LearnError(
                f"{other.folder}: expected torque_curve = {first.torque_curve!r} as in {first.folder},"
                f" got {other.torque_curve!r}"
            )
        if other.drive != first.drive:
            raise LearnError(
                f"{other.folder}: expected drive = {first.drive!r} as in {first.folder}, got"
                f" {other.drive!r}"
            )
        if not _is_same_build(other.robot, first.robot):
            raise LearnError(
                f"{other.folder}: expected a robot that differs from that of {first.folder} in"
                " backlash, stiffness, damping, hysteresis and friction alone, got another one"
            )


def _is_same_build(a: Robot, b: Robot) -> bool:
    """Return whether two robots differ in nothing but what is learned, and by rounding.

    What a file keeps as shares, such as friction at rest, is computed anew from what was learned.
    """
    values, others = ([*_leaves(astuple(_build(robot)))] for robot in (a, b))
    return len(values) == len(others) and all(map(_agrees, values, others))


def _agrees(x: object, y: object) -> bool:
    if isinstance(x, float) and isinstance(y, float):
        return isclose(x, y, rel_tol=_ROUNDING)
    return x == y


def _leaves(value: object) -> Iterator[object]:
    """Yield what is in tuples in each other, and where each of them ends."""
    if not isinstance(value, tuple):
        yield value
        return
    for part in value:
        yield from _leaves(part)
    yield ()


def _build(robot: Robot) -> Robot:
    """Return all of a robot but what is learned."""
    joints = [
        replace(
            joint,
            limits=None,
            max_rate=None,
            max_acceleration=None,
            stiffness=None if joint.stiffness is None else _ANY,
            damping=0.0,
            backlash=0.0,
            tilt=tuple(replace(tilt, stiffness=1.0, damping=0.0) for tilt in joint.tilt),
            hysteresis=_shares(joint),
            drive=joint.drive and replace(joint.drive, friction=0.0),
        )
        for joint in robot.joints
    ]
    return replace(robot, name="", joints=tuple(joints))


def _shares(joint: Joint) -> tuple[StopElement, ...]:
    """Return a gear's elements with slip torques by what all of them have."""
    whole = sum(stop.slip_torque for stop in joint.hysteresis)
    return tuple(replace(stop, slip_torque=stop.slip_torque / whole) for stop in joint.hysteresis)

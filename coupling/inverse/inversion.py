"""The command that keeps the moving robot's tool on a path under a wrench."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from coupling.errors import PlanningError
from coupling.inverse.command import gear_command, rigid_command
from coupling.inverse.gear_drive import GearTask
from coupling.inverse.gear_elements import GearElements
from coupling.inverse.gears import (
    WindUp,
    damping_in_backlash,
    gears_of,
    rows_of,
    solve_wind_up,
)
from coupling.inverse.gears_at_rest import GearsAtRest
from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.link_model import LinkModel
from coupling.inverse.link_task import LinkMotion, LinkTask
from coupling.inverse.links import solve_links
from coupling.inverse.rows import CommandRows
from coupling.inverse.spline import UniformSpline
from coupling.path.controller import Controller
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import InterpolatedPath
from coupling.path.joint_path import JointPath
from coupling.results.gear_result import BacklashReversal
from elastic_robot.description import Robot
from elastic_robot.kinematic_errors import KinematicErrors
from elastic_robot.torque_curves import TORQUE_CURVES

# Times between two nodes at which the torque of the gears is evaluated.
_FINE = 4
# Nodes between two evaluations of the mass matrix.
_SELDOM = 25
# Times at which torques are computed at once.
_CHUNK = 10_000

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class DesiredMotion:
    """Desired motion of one robot, in its base frame.

    Attributes:
        path: Desired path of its tool.
        rigid: Joint angles of the undeflected robot along it, from its start to its end.
        wrench: Wrench on the tool, likewise.
    """

    path: ToolPath
    rigid: JointPath
    wrench: WrenchHistory


@dataclass(frozen=True)
class InverseSolution:
    """The inverse of one robot along a path.

    Attributes:
        command: Motion of the drives [rad], a column a joint.
        links: Motion of the links with the tool on its path.
        reversals: Passages of gears through their backlash, by joint and time.
        wrench: The wrench that the links were solved under, as a function of time.
    """

    command: UniformSpline
    links: LinkMotion
    reversals: tuple[BacklashReversal, ...]
    wrench: Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class _GearMotion:
    """Motion of the links and what it asks of the gears.

    Attributes:
        time: Evenly spaced times [s], (k,).
        torque: Torque of every gear there [N m], (k, gears).
        start: Wind-up of every gear at first [rad], (gears,).
        inertia_time, inertia: Times [s], (i,), and inertia of each gear there, while all else may yield
            [kg m^2], (i, gears).
    """

    time: np.ndarray
    torque: np.ndarray
    start: np.ndarray
    inertia_time: np.ndarray
    inertia: np.ndarray


class MovingRobot:
    """A robot whose motion is inverted.

    Args:
        robot: The robot.
        torque_curve: Name of its gears' torque curve.

    Attributes:
        elements: Elements of the hysteresis of each gear, (gears,).
    """

    def __init__(self, robot: Robot, torque_curve: str) -> None:
        self.robot, self.model, self.torque_curve = robot, LinkModel(robot), torque_curve
        self._curve_class = TORQUE_CURVES[torque_curve]
        self.curve = self._curve_class.build(self.model.parameters)
        self._gears = gears_of(self.model.parameters, self.model.chain)
        self._gear_curve = self._curve_class.build(self._gears)
        elements, torsions = self.model.chain.elements, self.model.chain.torsions.tolist()
        self.elements = tuple(GearElements.of(elements, self.model.parameters, k) for k in torsions)
        self._at_rest = GearsAtRest(
            robot, self.model, torque_curve, self.curve, self._gear_curve, self.elements
        )

    @property
    def backlash(self) -> np.ndarray:
        """Half width of the backlash of each gear [rad], (gears,): 0 where its curve has none."""
        tabled = [table is not None for table in self._gears.tables]
        curve = self._curve_class
        with_backlash = curve.has_backlash & ~(curve.takes_tables & np.array(tabled, dtype=bool))
        return np.where(with_backlash, self._gears.backlash, 0.0)

    @property
    def held_in_backlash(self) -> np.ndarray:
        """Torque up to which unloaded elements hold each gear in its backlash [N m], (gears,)."""
        pairs = zip(self.elements, self.backlash, strict=True)
        return np.array([gear.torque(np.minimum(gear.slip_angle, b)) for gear, b in pairs])

    @property
    def damping_in_backlash(self) -> np.ndarray:
        """Damping that turns the gears in their backlash [N m s/rad], (gears,)."""
        return damping_in_backlash(self._gear_curve, self._gears.damping)

    def invert(
        self,
        desired: DesiredMotion,
        controller: Controller,
        limits: JointLimits,
        progress: Progress,
    ) -> InverseSolution:
        """Return the command that keeps the tool on its path.

        Args:
            desired: Desired motion of the robot.
            controller: Controller that takes the command.
            limits: Limits of its drives.
            progress: Function called with what is being done, and how much of it is done.

        Raises:
            PlanningError: If the path asks for more than the drives can do, or is too short.
        """
        between = InterpolatedPath(desired.path)
        rows = self._rows(desired.path, controller, between.at_rest)
        task = LinkTask.of(between, desired.rigid, desired.wrench, rows.end)
        links = solve_links(
            self.model, task, progress=lambda done, total: progress("links", done, total)
        )
        smooth = task.wrench
        del task
        gears = partial(self._gear_motion, links.theta, smooth, desired.wrench)
        command, reversals = self._command(links.theta, gears, rows, limits, progress)
        return InverseSolution(command, links, reversals, smooth)

    def _gear_motion(
        self,
        theta: UniformSpline,
        smooth: Callable[[np.ndarray], np.ndarray],
        wrench: WrenchHistory,
    ) -> _GearMotion:
        time, first = fine_times(theta), theta.at(np.array([theta.start]))
        seldom = np.append(theta.nodes[:-1:_SELDOM], theta.end)
        return _GearMotion(
            time,
            self.torque(theta, time, smooth),
            self._at_rest.carrying(first, wrench.wrench[0, :1]),
            seldom,
            self.model.yielding_inertia(theta.at(seldom)),
        )

    def task(self, desired: DesiredMotion) -> LinkTask:
        """Return the desired motion of the links from the first time of a path to its last.

        Args:
            desired: Desired motion of the robot.
        """
        end = float(desired.path.time[-1])
        return LinkTask.of(InterpolatedPath(desired.path), desired.rigid, desired.wrench, end)

    def _rows(self, path: ToolPath, controller: Controller, rest: tuple[bool, bool]) -> CommandRows:
        start, end = float(path.time[0]), float(path.time[-1])
        count = len(controller.rows(start, end)) - 1
        degree = 5 if controller.interpolation == "quintic" else 3
        try:
            return CommandRows(start, controller.cycle, count, degree, rest)
        except ValueError as cause:
            raise PlanningError(f"a path of {end - start:.6g} s: {cause}") from cause

    def torque(
        self,
        theta: UniformSpline,
        time: np.ndarray,
        wrench: Callable[[np.ndarray], np.ndarray],
    ) -> np.ndarray:
        """Return the torque that every gear has to carry [N m], (k, gears), gear behind gear in memory.

        Args:
            theta: Motion of the links.
            time: Times [s], (k,).
            wrench: Function from times to wrenches on the robot at the TCP, (k, 6).
        """
        torque = np.empty((len(self.model.gears), len(time))).T
        for first in range(0, len(time), _CHUNK):
            chunk = time[first : first + _CHUNK]
            motion = [theta.at(chunk, order) for order in range(3)]
            load = self.model.desk.loads(motion[0], motion[1], motion[2], wrench(chunk))
            torque[first : first + _CHUNK] = -load[:, self.model.gears]
        return torque

    def wind_up(
        self, theta: UniformSpline, time: np.ndarray, torque: np.ndarray, wrench: WrenchHistory
    ) -> WindUp:
        """Return the wind-up of the gears; at first at rest under their static torque.

        Args:
            theta: Motion of the links.
            time: Evenly spaced [s], (k,).
            torque: Torque of every gear at these times [N m], (k, gears).
            wrench: Wrench on the tool.
        """
        return self.wind_up_after(self.at_rest(theta, time[:1], wrench), time, torque)

    def at_rest(self, theta: UniformSpline, time: np.ndarray, wrench: WrenchHistory) -> np.ndarray:
        """Return the wind-up of the gears at rest under their static torque [rad], (gears,).

        Args:
            theta: Motion of the links.
            time: When they are at rest [s], (1,).
            wrench: Wrench on the tool, which begins then.
        """
        return self._at_rest.carrying(theta.at(time), wrench.wrench[0, :1])

    def wind_up_from(self, static: np.ndarray, time: np.ndarray, torque: np.ndarray) -> WindUp:
        """Return the wind-up of the gears; at first that of gears by themselves at rest, from unloaded.

        Args:
            static: Torque of every gear at the first time, at rest [N m], (gears,).
            time: Evenly spaced [s], (k,).
            torque: Torque of every gear at these times [N m], (k, gears).
        """
        return self.wind_up_after(self._at_rest.alone(static), time, torque)

    def wind_up_after(self, start: np.ndarray, time: np.ndarray, torque: np.ndarray) -> WindUp:
        """Return the wind-up of the gears from that at the first time.

        Args:
            start: Wind-up at the first time [rad], (gears,).
            time: Evenly spaced [s], (k,).
            torque: Torque of every gear at these times [N m], (k, gears).
        """
        damping = self._gears.damping
        return solve_wind_up(time, torque, self._gear_curve, damping, start, self.elements)

    def _command(
        self,
        theta: UniformSpline,
        gears: Callable[[], _GearMotion],
        rows: CommandRows,
        limits: JointLimits,
        progress: Progress,
    ) -> tuple[UniformSpline, tuple[BacklashReversal, ...]]:
        """Return the drives' motion and the passages through backlash, joint by joint."""
        chain, reversals, motion = self.model.chain, list[BacklashReversal](), None
        columns = np.empty((rows.coefficients, chain.joint_count))
        gear_of = {int(joint): gear for gear, joint in enumerate(self.model.gear_joint)}
        # Rigid joints first: what the gears carry takes memory.
        for count, joint in enumerate(sorted(range(chain.joint_count), key=gear_of.__contains__)):
            index, errors = int(chain.drive[joint]), chain.kinematic_errors.of_joint(joint)
            link = UniformSpline(
                theta.start, theta.spacing, theta.coefficients[:, [index]], theta.degree
            )
            of_joint = limits.of_joint(joint)
            if joint not in gear_of:
                command = rigid_command(link, rows, of_joint, errors)
            else:
                motion = motion or gears()
                task, passages = self._gear_task(motion, gear_of[joint], link, errors)
                command = gear_command(task, rows, of_joint)
                reversals += passages
            columns[:, joint] = command.coefficients[:, 0]
            progress("drives", count + 1, chain.joint_count)
        return UniformSpline(rows.start, rows.cycle, columns, rows.degree), tuple(reversals)

    def _gear_task(
        self, motion: _GearMotion, gear: int, link: UniformSpline, errors: KinematicErrors
    ) -> tuple[GearTask, list[BacklashReversal]]:
        """Return what one gear has to carry, and when it crosses its backlash."""
        here, elements = slice(gear, gear + 1), self.elements[gear]
        parameters = rows_of(self._gears, np.array([gear]))
        curve, damping = self._curve_class.build(parameters), parameters.damping
        torque = motion.torque[:, here]
        wind_up = solve_wind_up(
            motion.time, torque, curve, damping, motion.start[here], (elements,)
        )
        task = GearTask(
            link,
            motion.time,
            torque[:, 0],
            wind_up.angle[:, 0],
            curve,
            float(damping[0]),
            motion.inertia_time,
            motion.inertia[:, gear],
            elements,
            errors,
        )
        number = {"joint": int(self.model.gear_joint[gear]) + 1}
        return task, [passage.model_copy(update=number) for passage in wind_up.reversals]


def fine_times(theta: UniformSpline) -> np.ndarray:
    """Return the times at which the gears of moving links are looked at [s], (n,)."""
    return np.linspace(theta.start, theta.end, _FINE * theta.intervals + 1)


def joint_path(command: UniformSpline) -> JointPath:
    """Return the rows of a command: with rates and accelerations for degree 5, else angles alone."""
    time = command.nodes
    values = [(command.at(time, order),) for order in range(3 if command.degree == 5 else 1)]
    return JointPath(time, *values)

"""The inverse of one moving robot, made sure of by simulating it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coupling.errors import PlanningError
from coupling.events import Progress, Watch
from coupling.inverse.inversion import DesiredMotion, InverseSolution, MovingRobot, joint_path
from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.polish import Polish
from coupling.inverse.polish_step import Observation, ObservedTimes, RobotResponse
from coupling.inverse.response import AlongMotion
from coupling.inverse.servo_command import RobotServos
from coupling.inverse.spline import UniformSpline
from coupling.path.controller import Controller
from coupling.path.interpolation import InterpolatedPath, SampledPath
from coupling.path.linear import interpolate_rows
from coupling.path.low_pass import low_pass
from coupling.robot.contract import InverseCommand
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.fmi.interface import IDEAL

# Longest distance of the times at which the simulated tool is watched [s].
_MAX_SAMPLE_DISTANCE = 0.004
# Cutoff [1/distance] and order of the filter before the tool is watched so seldom: of half the rate it
# leaves 6 %, of the rate 2e-4, of a quarter of the rate 95 %.
_CUTOFF, _ORDER = 0.36, 4


@dataclass(frozen=True)
class Inverter:
    """Inverts one robot.

    Attributes:
        simulations: Simulations at most for the polish of a command.
    """

    moving: MovingRobot
    simulated: RobotFmu
    simulations: int = 300
    drive: str = IDEAL

    def invert(
        self, desired: DesiredMotion, controller: Controller, goal: float, watch: Watch
    ) -> InverseCommand:
        """Return the command that keeps the tool on its path, in the base frame of the robot.

        Args:
            goal: Deviation of the simulated tool that needs no further improvement [m].
        """
        limits = JointLimits.of(self.moving.robot, controller.max_acceleration)

        def progress(what: str, finished: int, total: int) -> None:
            watch(Progress(f"inverting the moving robot: {what}", finished, total))

        solution = self.moving.invert(desired, controller, limits, progress)
        fine = SampledPath.of(desired.path).refined(_MAX_SAMPLE_DISTANCE).path
        loads = desired.wrench.refined(fine.time)
        coordinates = self.moving.model.chain.elastic_count
        start, end = float(fine.time[0]), float(fine.time[-1])
        watched = ObservedTimes(
            start, _MAX_SAMPLE_DISTANCE, int((end - start) / _MAX_SAMPLE_DISTANCE + 1e-9) + 1
        )
        times = watched.times(range(watched.count))
        is_finer = 1.5 * float(np.diff(fine.time).min()) < watched.spacing

        def slow_part(deviation: np.ndarray) -> np.ndarray:
            """Return a deviation at the watched times, without what is faster than these can tell.

            The ripple of teeth would look like a slow motion there, which a command then makes.
            """
            if is_finer:
                deviation = low_pass(fine.time, deviation, _CUTOFF / watched.spacing, _ORDER)
            return interpolate_rows(times, fine.time, deviation)

        at_rest = InterpolatedPath(desired.path).at_rest
        moving, as_commanded = self.moving, self._as_commanded(solution, limits, at_rest)

        zero = np.zeros((watched.count, coordinates))

        def response_to(motors: UniformSpline) -> RobotResponse:
            try:
                joints = joint_path(as_commanded(motors))
            except PlanningError:
                if motors is solution.command:
                    raise
                # A change that the servos cannot take is none that helps.
                return RobotResponse(np.full((watched.count, 6), np.inf), zero)
            path, deflection = self.simulated.deflected(joints, loads, coordinates)
            return RobotResponse(
                slow_part(path.deviation_from(fine)[0]),
                interpolate_rows(times, fine.time, deflection),
            )

        motion = AlongMotion(
            moving.model, moving.curve, solution.links.theta, solution.wrench, moving.elements
        )
        view = Observation(motion, limits, watched)
        command = as_commanded(
            Polish(view, response_to, goal, self.simulations).run(solution.command)
        )
        return InverseCommand(joint_path(command), solution.reversals)

    def _as_commanded(
        self, solution: InverseSolution, limits: JointLimits, ends_at_rest: tuple[bool, bool]
    ) -> Callable[[UniformSpline], UniformSpline]:
        """Return the function from the motors' motion to the command of their drives."""
        if self.drive == IDEAL:
            return lambda motors: motors
        return RobotServos(self.moving, solution, limits, ends_at_rest).command

"""The example robot on circles, and robots that differ from it in what is learned."""

from dataclasses import replace
from typing import Any

import numpy as np
from fixture_store import stored
from scipy.spatial.transform import Rotation
from tuned_fmu import simulate_tuned

from coupling.events import unwatched
from coupling.identification.runs.effect import ParameterEffect
from coupling.identification.runs.fit import ParameterFit, fit_runs
from coupling.identification.runs.measurement import MeasuredPath, Measurement
from coupling.identification.runs.parameters import learnable, prior_of
from coupling.identification.runs.problem import FitProblem
from coupling.inverse.inversion import DesiredMotion, MovingRobot
from coupling.path.controller import Controller
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import InterpolatedPath
from coupling.path.joint_path import JointPath
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.inverter import Inverter
from coupling.robot.parameters import apply_values, scaled_values
from coupling.run.fmu_pool import FmuPool
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import IDEAL

HOME = np.deg2rad([0.0, 10.0, 20.0, 0.0, 60.0, 0.0])
NOISE = 1e-5


def circles(robot: Robot, seconds: float = 9.0, turns: float = 2.0) -> DesiredMotion:
    """Horizontal circles from rest to rest, under a force that turns with them."""
    time = np.linspace(0.0, seconds, round(seconds / 0.02) + 1)
    part = time / seconds
    turn = 2.0 * np.pi * turns * (part - np.sin(2.0 * np.pi * part) / (2.0 * np.pi))
    position = np.stack(
        [1.6 + 0.05 * np.cos(turn), 0.05 * np.sin(turn), np.full(len(time), 0.8)], axis=1
    )
    turned = np.tile(Rotation.from_euler("y", 90.0, degrees=True).as_quat(), (len(time), 1))
    path = ToolPath(time, np.hstack([position, turned]))
    pressed = 4.0 * part * (1.0 - part) * 250.0
    force = pressed[:, None] * np.stack([-np.cos(turn), -np.sin(turn), np.ones(len(time))], axis=1)
    rigid = InverseKinematics(robot, HOME).plan(path)
    # It steps from sample to sample, which shakes what is to be learned.
    steps = np.hstack([force, np.zeros_like(force)])
    return DesiredMotion(path, rigid, WrenchHistory.of_means(time, steps))


def stored_fit(problem: FitProblem, start: np.ndarray) -> ParameterFit:
    """What is fitted to measured runs, from log factors to begin at."""
    fmu = (problem.fmu.fingerprint, problem.fmu.torque_curve, problem.fmu.drive)
    runs = [
        (own.command, own.wrench, own.desired, own.desired_motion, own.measured)
        for own in problem.runs
    ]
    inputs = (fmu, problem.parameters, runs)
    fit, weights = stored(_fit, inputs, start, using=(problem,))
    experiment = replace(fit.experiment, problem=replace(problem, **weights))
    return replace(fit, experiment=experiment)


def _fit(
    inputs: object, start: np.ndarray, problem: FitProblem
) -> tuple[ParameterFit, dict[str, Any]]:
    """Return a fit but for its problem, whose processes cannot be written, and the rows' weights."""
    fit = fit_runs(problem, start)
    weights = {key: getattr(fit.experiment.problem, key) for key in ("spectrum", "variance")}
    bare: Any = {"problem": None, "derivatives": ()}
    return replace(fit, experiment=replace(fit.experiment, **bare)), weights


class Robots:
    """The example robot, its command for the circles, and robots that differ from it."""

    def __init__(
        self,
        robot: Robot,
        models: FmuPool,
        seconds: float = 9.0,
        rate: float = 2.0 / 9.0,
        drive: str = IDEAL,
    ) -> None:
        self.robot, self.models, self.drive = robot, models, drive
        self.wanted = circles(robot, seconds, turns=rate * seconds)
        self.parameters = learnable(robot, "backlash", drive)
        self.none = np.zeros(len(self.parameters))
        self.fmu = models.of(robot, "backlash", drive).fmu
        self.time = np.arange(0.0, seconds + 1e-9, 0.004)
        (told,) = self.wanted.wrench.before
        rows = np.searchsorted(self.wanted.path.time, self.time).clip(max=len(told) - 1)
        self.wrench = WrenchHistory.of_means(self.time, told[rows])
        self.path = InterpolatedPath(self.wanted.path).at(self.time)
        self.desired = self.path.position[0]
        self.command = self.commanded(self.none)

    def described(self, x: np.ndarray) -> Robot:
        """The robot with log factors x."""
        return apply_values(self.robot, scaled_values(self.parameters, x))

    def commanded(self, x: np.ndarray) -> JointPath:
        """The command for the robot with log factors x."""
        robot = self.described(x)
        fmu = self.models.of(robot, "backlash", self.drive).fmu
        inverter = Inverter(MovingRobot(robot, "backlash"), fmu, drive=self.drive)
        return inverter.invert(self.wanted, Controller(), 1e-6, unwatched).joints

    def moved(self, x: np.ndarray, command: JointPath | None = None) -> np.ndarray:
        """Where the tool of the robot with log factors x is."""
        return self.taken(x, command).position[0]

    def taken(self, x: np.ndarray, command: JointPath | None = None) -> ToolPath:
        """Path of the tool of the robot with log factors x."""
        values = scaled_values(self.parameters, x)
        return simulate_tuned(self.fmu, command or self.command, self.wrench, "dynamic", values)

    def measured(self, where: np.ndarray, every: int = 1) -> MeasuredPath:
        """What is measured of where the tool is, every so many samples of 4 ms."""
        rows = np.arange(0, len(self.time), every)
        noise = NOISE * np.random.default_rng(4).standard_normal((len(rows), 3))
        seen = Measurement("measured.csv", self.time[rows], where[rows] + noise)
        return MeasuredPath(self.command, self.wrench, self.path, self.wanted, seen)

    def problem(self, one: MeasuredPath) -> FitProblem:
        """What is to be fitted to a run."""
        effect = ParameterEffect(self.robot, "backlash", self.parameters, one)
        return FitProblem((self.fmu,), self.parameters, (one,), (effect,))

    def drawn(self, seed: int, times: float) -> np.ndarray:
        """Log factors up to so many prior standard deviations off; dampers of tilts as they are."""
        drawn = [k for k, own in enumerate(self.parameters) if not own.vibrates]
        x = np.zeros(len(self.parameters))
        rng = np.random.default_rng(seed)
        x[drawn] = times * prior_of(self.parameters)[drawn] * rng.uniform(-1.0, 1.0, len(drawn))
        return x

    def factors(self, **kinds: float) -> np.ndarray:
        """Log factors of the parameters of all gears, by kind; tilts as they are."""
        return np.array(
            [0.0 if p.gear is None else np.log(kinds.get(p.kind, 1.0)) for p in self.parameters]
        )

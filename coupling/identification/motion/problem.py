"""Measured less predicted wind-up and motor torque of recordings.

    wind-up   d = q(t) - phi(t - lag) + slow error(q) + loop + a recording's offset and lines
    torque    tau = T(t) + J q'' + f(s/a, q') + friction after a rest + J_f r'' - K r'

phi = q + eps(q) + e, the loop follows dry friction, and r is what of the angles is faster than q,
their smoothed motion; e and T are the FMU's along q, f and s/a those of
`elastic_robot.gear_parts.Drive`.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from coupling.identification.motion.driven_fmu import DrivenFmu, GearMotion
from coupling.identification.motion.parameters import MotionParameter
from coupling.identification.motion.recording import Recording, SmoothedMotion
from coupling.identification.motion.sensors import (
    column,
    delayed,
    fitted_columns,
    torque_column,
    worn,
)
from coupling.inverse.servo import presliding
from coupling.robot.parameter_table import dry_friction
from coupling.robot.parameters import apply_values, with_joints
from elastic_robot.description import Robot
from elastic_robot.drive import Drive
from elastic_robot.kinematic_errors import KinematicErrors

# A stiffness may be so many times the start's: least of what the fit counts by.
_LEAST_INVERSE = 0.02
# Rows closer than this [s] count as one beside what is known before: what is left is so long correlated.
_CORRELATED = 0.2
# Rows at the start from which the friction's elongation there is estimated.
_FIRST = 25


@dataclass(frozen=True)
class SmoothedRecording:
    """A recording and the motion of its motors.

    Attributes:
        recording: The recording.
        motion: Smoothed motion of its motors.
        lines: Periods of each encoder's error in a turn of the link, by joint.
    """

    recording: Recording
    motion: SmoothedMotion
    lines: tuple[tuple[float, ...], ...]

    @classmethod
    def of(cls, recording: Recording, bandwidth: float) -> SmoothedRecording:
        """Return a recording whose motors are smoothed to a bandwidth [Hz]."""
        motion = SmoothedMotion.of(recording.motor, recording.step, bandwidth)
        return cls(recording, motion, ((),) * recording.motor.shape[1])

    @cached_property
    def fitted_basis(self) -> dict[int, np.ndarray]:
        """Orthonormal columns of a recording's own offset and lines, by joint [1], (n, c)."""
        return {
            i: np.linalg.qr(fitted_columns(self.recording, i, self.lines[i]))[0]
            for i in self.recording.with_link
        }

    def remove_fitted(self, values: np.ndarray, joint: int) -> np.ndarray:
        """Return wind-up [rad], (n,), less what offset and lines of the recording can take of it."""
        basis = self.fitted_basis[joint]
        return values - basis @ (basis.T @ values)


@dataclass(frozen=True)
class Predicted:
    """What is predicted of a recording, without what is fitted in it by itself.

    Attributes:
        wind_up: Motor less link [rad], (n, j); the sensors' lag, slow error and loop are in it.
        torque: Torques of the motors [N m], (n, j).
        unmodelled: Their part that the model has not [N m], (n, j).
        robot: The robot.
        gears: Motion of its gears by the FMU.
        part: Friction over its largest [1], (n, j).
        dry: Dry friction over that of the start's slipping motor [1], (n, j): more after a rest.
        shares: Shares of the wind-up [rad], (n, j) each: the gear's, the lag's, the loop's, the slow
            error's.
    """

    wind_up: np.ndarray
    torque: np.ndarray
    unmodelled: np.ndarray
    robot: Robot
    gears: GearMotion
    part: np.ndarray
    dry: np.ndarray
    shares: dict[str, np.ndarray]


@dataclass(frozen=True)
class MotionProblem:
    """Parameters and the recordings that they are fitted to.

    Attributes:
        fmu: The FMU.
        robot: The start.
        parameters: Parameters that are fitted, P of them.
        recordings: The recordings.
    """

    fmu: DrivenFmu
    robot: Robot
    parameters: tuple[MotionParameter, ...]
    recordings: tuple[SmoothedRecording, ...]

    @property
    def start(self) -> np.ndarray:
        """Values of the start, as the fit counts: parts of usual sizes [1], (P,)."""
        return np.array([p.inward(p.value) for p in self.parameters])

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest values, as the fit counts [1], (P,) each."""
        least = [
            _LEAST_INVERSE if p.inverse else -p.most if p.signed else 0.0 for p in self.parameters
        ]
        return np.array(least), np.array([p.most for p in self.parameters])

    @property
    def correlated(self) -> float:
        """Number of rows that count as one beside what is known before."""
        return max(_CORRELATED / self.recordings[0].recording.step, 1.0)

    @property
    def prior(self) -> np.ndarray:
        """Weights of squares of departures from the start [1], (P,); 0 if nothing is known."""
        return self.correlated / np.array([p.prior for p in self.parameters]) ** 2

    def only(self, chosen: np.ndarray) -> MotionProblem:
        """Return the problem of some of the parameters, by a mask, (P,)."""
        parameters = tuple(p for p, stays in zip(self.parameters, chosen, strict=True) if stays)
        return replace(self, parameters=parameters)

    def without(self, gone: np.ndarray) -> MotionProblem:
        """Return the problem with some of the parameters none, by a mask, (P,)."""
        none = {p.name: p.none for p, is_gone in zip(self.parameters, gone, strict=True) if is_gone}
        return replace(self.only(~gone), robot=apply_values(self.robot, none))

    def robot_at(self, x: np.ndarray) -> Robot:
        """Return the robot of values as the fit counts [1], (P,)."""
        return apply_values(self.robot, self._values(x, range(len(self.robot.joints))))

    def with_joint(self, here: Robot, x: np.ndarray, i: int) -> Robot:
        """Return a robot whose joint i, from 0, has values as the fit counts [1], (P,)."""
        bare = with_joints(here, {i: self.robot.joints[i]})  # a balancer is scaled from the start's
        return apply_values(bare, self._values(x, (i,)))

    def _values(self, x: np.ndarray, joints: Collection[int]) -> dict[str, float]:
        return {
            p.name: p.in_robot(value)
            for p, value in zip(self.parameters, x.tolist(), strict=True)
            if p.joint in joints and not p.sensor
        }

    def predicted(
        self,
        smoothed: SmoothedRecording,
        x: np.ndarray,
        loaded: Predicted | None = None,
        there: Predicted | None = None,
    ) -> Predicted:
        """Return the prediction of a recording by values as the fit counts [1], (P,).

        Args:
            loaded: A prediction whose friction, as it is loaded, and loops stay; None: those of x.
            there: A prediction by x with other friction; None: gears are simulated.

        Raises:
            SimulationError: If the solver cannot step there.
        """
        if there is None:
            robot = self.robot_at(x)
            gears = self.fmu.simulate(robot, smoothed.recording.time, smoothed.motion)
        else:
            robot, gears = there.robot, there.gears
        if loaded is None:
            part = friction_part(smoothed.recording, smoothed.motion, robot, gears)
            dry = self._dry(smoothed, robot, x, part)
        else:
            part, dry = loaded.part, loaded.dry
        torque = motor_torques(smoothed.motion, robot, gears, part)
        unmodelled = np.zeros_like(torque)
        links = KinematicErrors.of(robot).output_angle(smoothed.motion.q) + gears.wind_up
        shares = {"gear": smoothed.motion.q - links}
        for p, value in zip(self.parameters, x.tolist(), strict=True):
            if not p.sensor:
                continue
            i = p.joint
            if p.of_torque:
                by_one = torque_column(p, smoothed.motion, part[:, i], smoothed.recording.step)
                unmodelled[:, i] += p.size * value * by_one
                continue
            wind_up_part = p.size * value * column(p, smoothed.motion, dry[:, i])
            if p.sensor == "lag":
                wind_up_part = links[:, i] - delayed(
                    links[:, i], smoothed.recording.step, p.size * value
                )
            share = shares.setdefault(p.term.rpartition(" ")[0], np.zeros_like(links))
            share[:, i] += wind_up_part
        wind_up = np.sum(list(shares.values()), axis=0)
        return Predicted(wind_up, torque + unmodelled, unmodelled, robot, gears, part, dry, shares)

    def _dry(
        self, smoothed: SmoothedRecording, robot: Robot, x: np.ndarray, part: np.ndarray
    ) -> np.ndarray:
        # Friction is what torques say: in derivatives the loops' form stays.
        dry = np.zeros_like(part)
        for i, joint in enumerate(robot.joints):
            if joint.drive is not None:
                slipping = dry_friction(joint.drive)[0]
                dry[:, i] = slipping * part[:, i]
        for p, value in zip(self.parameters, x.tolist(), strict=True):
            if p.sensor == "rest":
                more = p.size * value * worn(smoothed.motion, p.joint)
                dry[:, p.joint] += more * part[:, p.joint]
        usual = [
            dry_friction(j.drive)[0] if j.drive is not None else 1.0 for j in self.robot.joints
        ]
        return dry / np.maximum(usual, 1.0)

    def residuals(
        self, smoothed: SmoothedRecording, predicted: Predicted
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return measured less predicted wind-up [rad] and torque [N m], (n, j) each.

        What is fitted in the recording by itself is taken off; nan where no link is measured.
        """
        recording = smoothed.recording
        wind_up = recording.wind_up - predicted.wind_up
        for i in recording.with_link:
            wind_up[:, i] = smoothed.remove_fitted(wind_up[:, i], i)
        return wind_up, recording.torque - predicted.torque


def rms(values: np.ndarray) -> np.ndarray:
    """Return the rms of columns (n, k), any unit, (k,); nan where one holds nan."""
    return np.sqrt(np.mean(values**2, axis=0))


def friction_part(
    recording: Recording, motion: SmoothedMotion, robot: Robot, gears: GearMotion
) -> np.ndarray:
    """Return motors' friction over its largest [1], (n, j), loaded at the start as torques there say."""
    felt = _felt(motion, robot, gears)
    part = np.zeros_like(felt)
    for i, joint in enumerate(robot.joints):
        drive = joint.drive
        if drive is None:
            continue
        started = 0.0
        if drive.friction > 0.0:
            needed = felt[:_FIRST, i] + drive.inertia * motion.qdd[:_FIRST, i]
            excess = np.mean(recording.torque[:_FIRST, i] - needed)
            started = float(np.clip(excess / drive.friction, -1.0, 1.0))
        part[:, i] = presliding(motion.q[:, i], drive.slip_angle, started)
    return part


def motor_torques(
    motion: SmoothedMotion, robot: Robot, gears: GearMotion, part: np.ndarray
) -> np.ndarray:
    """Return torques of motors [N m], (n, j), with a part of their friction [1], (n, j)."""
    torque = _felt(motion, robot, gears)
    for i, joint in enumerate(robot.joints):
        if joint.drive is not None:
            torque[:, i] += motor_losses(motion, i, joint.drive, gears.torque[:, i], part[:, i])
    return torque


def motor_losses(
    motion: SmoothedMotion, i: int, drive: Drive, gear_torque: np.ndarray, part: np.ndarray
) -> np.ndarray:
    """Return the torque of rotor and friction of joint i, from 0 [N m], (n,).

    Args:
        i: Index of the joint.
        gear_torque: Torque of its gear [N m], (n,).
        part: Its friction over its largest [1], (n,).
    """
    friction = drive.friction_torque(drive.friction, part, motion.qd[:, i], gear_torque)
    return drive.inertia * motion.qdd[:, i] + friction


def _felt(motion: SmoothedMotion, robot: Robot, gears: GearMotion) -> np.ndarray:
    """Return the gears' torques at their motors [N m], (n, j)."""
    return np.asarray(KinematicErrors.of(robot).slope(motion.q) * gears.torque)

"""Figures of thousands of settings: reach, stiffness under the process, torques of the gears."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from coupling.inverse.joint_limits import JointLimits
from coupling.inverse.reversals import backlash_error, margin
from coupling.place.gear_loops import GearLoops
from coupling.place.moved_path import MovedPath, Wave, bounding_waves, split, waves_of
from coupling.place.settings import ArmHome, CellLayout
from coupling.place.stations import Stations
from coupling.robot.batch.desk_poses import DeskPoses
from coupling.robot.batch.following import (
    FollowingRobot,
    angles_from_home,
    following,
    nearest_angles,
    solve_poses,
)
from coupling.robot.batch.redundancy import NearHome
from coupling.robot.batch.rigid_robot import RigidRobot
from coupling.robot.batch.vectors import combine_columns, cross, dot
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

# Settings computed at once: their arrays stay in the processor's cache.
_AT_ONCE = 2048
# Largest distance of a place from the one that it is solved from, by `Stations.poses` [m].
_MAX_PLACE_DISTANCE = 0.1
# Iterations from one place of a path to the next.
_ITERATIONS = 12


@dataclass(frozen=True)
class ScreenFigures:
    """Figures of n settings, each at the worst of the places looked at.

    Attributes:
        reached: Mask of settings in which the tool reaches all places, (n,).
        limit_margin: Distance of the joints from their limits [rad], (n,); infinite without limits.
        conditioning: Smallest conditioning, `FollowingRobot.conditioning` [1], (n,).
        rate_share: Largest rate of a joint over its limit [1], (n,); 0 without limits.
        deviation: Displacement of the TCP by the process's wrench [m], (n,).
        compliance: Compliance of the TCP in its softest direction [m/N], (n,).
        margin: Distance of the torque of each gear from zero, `reversals.margin`, or from what its
            elements hold in its backlash [N m], (n, g).
        swing: Range of each gear's torque [N m], (n, g).
        backlash_error: Error of the tool at rest by a backlash 20 % off [m], (n, g).
        hysteresis_error: The same by slip torques 30 % off, `GearLoops.hysteresis_error` [m], (n, g).
        motor_share: Largest torque of a motor over its limit [1], (n,); 0 without limits.
    """

    reached: np.ndarray
    limit_margin: np.ndarray
    conditioning: np.ndarray
    rate_share: np.ndarray
    deviation: np.ndarray
    compliance: np.ndarray
    margin: np.ndarray
    swing: np.ndarray
    backlash_error: np.ndarray
    hysteresis_error: np.ndarray
    motor_share: np.ndarray

    def __len__(self) -> int:
        return len(self.reached)

    def chosen(self, rows: np.ndarray) -> ScreenFigures:
        """Return the figures of the settings of these numbers, (k,)."""
        return ScreenFigures(*(getattr(self, field.name)[rows] for field in fields(self)))


def join_figures(parts: Sequence[ScreenFigures]) -> ScreenFigures:
    """Return the figures of settings one behind the other."""
    names = [field.name for field in fields(ScreenFigures)]
    return ScreenFigures(
        *(np.concatenate([getattr(part, name) for part in parts]) for name in names)
    )


@dataclass(frozen=True)
class Batch:
    """The robot at k places of a path in n settings; what is not reached is NaN.

    Attributes:
        q: Joint angles [rad], (k, joints, n).
        rate: Joint rates [rad/s], (k, joints, n).
        torque: Torque that the links need of the gears, with inertia [N m], (k, gears, n).
        lever: Displacement of the TCP by their wind-up [m/rad], (k, gears, n).
        deviation, compliance, conditioning, motor_share: As of `ScreenFigures` [m], [m/N], [1], [1],
            (k, n).
    """

    q: np.ndarray
    rate: np.ndarray
    torque: np.ndarray
    lever: np.ndarray
    deviation: np.ndarray
    compliance: np.ndarray
    conditioning: np.ndarray
    motor_share: np.ndarray

    @classmethod
    def unknown(cls, places: int, joints: int, gears: int, settings: int) -> Batch:
        """Return a batch of NaN."""
        rows = ((places, joints, settings),) * 2 + ((places, gears, settings),) * 2
        return cls(*(np.full(shape, np.nan) for shape in rows + ((places, settings),) * 4))

    def put(self, places: np.ndarray, settings: np.ndarray, values: Batch) -> None:
        """Write values at places (p,) in settings (s,), numbers of both; the values as (.., p s)."""
        at = places[:, None], settings[None]
        for field in fields(self):
            column, value = getattr(self, field.name), getattr(values, field.name)
            if column.ndim == 2:
                column[at] = value.reshape(len(places), -1)
            else:
                rows = value.reshape(len(value), len(places), len(settings))
                column[at[0], :, at[1]] = rows.transpose(1, 2, 0)

    def at_places(self, places: np.ndarray) -> Batch:
        """Return the robot at the places of these numbers, (p,)."""
        return Batch(*(getattr(self, field.name)[places] for field in fields(self)))

    def forget(self, settings: np.ndarray) -> None:
        """Set all values of the settings of these numbers, (s,), to NaN."""
        for field in fields(self):
            getattr(self, field.name)[..., settings] = np.nan


class Screen:
    """Computes figures of many settings of one robot with one path.

    Args:
        arm: Home posture from which the tool is led to the part.

    Attributes:
        gear_joint: Number of the joint of each gear, from 0, (gears,).
    """

    def __init__(
        self,
        robot: Robot,
        gears: GearLoops,
        arm: ArmHome,
        cell: CellLayout,
        stations: Stations,
    ) -> None:
        self.stations, self._cell, self._arm, self._gears = stations, cell, arm, gears
        self._robot, self._serial, self._desk = robot, RigidRobot(robot), DeskPoses.of(robot)
        chain, parameters = build_chain(robot), Parameters.of(robot)
        self._softness = 1.0 / parameters.stiffness
        self.gear_joint = chain.elastic_joint[chain.torsions]
        self._elastic = list(zip(chain.elastic_joint, chain.elastic_tilt, strict=True))
        self._limits = JointLimits.of(robot)
        self._errors = chain.kinematic_errors
        self._motors = [
            (gear, joint, drive, drive.torque_limit)
            for gear, joint in enumerate(self.gear_joint.tolist())
            if (drive := robot.joints[joint].drive) and drive.torque_limit is not None
        ]
        poses = stations.poses
        self._waves = waves_of(poses, _MAX_PLACE_DISTANCE)
        self._bounding = bounding_waves(poses, self._waves)
        self._gapless = (
            np.linalg.norm(np.diff(poses, axis=0), axis=1).max(initial=0.0) < _MAX_PLACE_DISTANCE
        )

    def figures(
        self, settings: np.ndarray, report: Callable[[int], None] = lambda completed: None
    ) -> ScreenFigures:
        """Return the figures of settings.

        Args:
            settings: By `NAMES` [m], [rad], (n, 9).
        """
        parts = []
        for start in range(0, len(settings), _AT_ONCE):
            chunk = settings[start : start + _AT_ONCE]
            parts.append(self.worst(self.batch(chunk)))
            report(start + len(chunk))
        return join_figures(parts)

    def bounds(
        self, settings: np.ndarray, report: Callable[[int], None] = lambda completed: None
    ) -> ScreenFigures:
        """Return the figures of settings at three of the places, none worse than at all of them.

        They take a quarter of the time, and tell which settings are worth looking at everywhere.

        Args:
            settings: By `NAMES` [m], [rad], (n, 9).
        """
        places = np.concatenate([group for group, _ in self._bounding])
        parts = []
        for start in range(0, len(settings), _AT_ONCE):
            chunk = settings[start : start + _AT_ONCE]
            parts.append(self._worst_of(self._batch(chunk, self._bounding).at_places(places)))
            report(start + len(chunk))
        return join_figures(parts)

    def batch(self, settings: np.ndarray) -> Batch:
        """Return the robot at all places in settings by `NAMES` [m], [rad], (n, 9)."""
        return self._batch(settings, self._waves)

    def _batch(self, settings: np.ndarray, waves: Sequence[Wave]) -> Batch:
        placed, count = self._cell.placed(settings), len(settings)
        batch = Batch.unknown(
            self.stations.count, len(self._robot.joints), len(self.gear_joint), count
        )
        moved_path = MovedPath(placed, self._cell.sphere_radius, self.stations)
        alive, homes = np.arange(count), self._arm.homes(settings)
        for places, before in split(waves, max(1, _AT_ONCE // count)):
            targets = moved_path.targets(places, alive)
            start_angles = homes[:, np.tile(alive, len(places))]
            near = NearHome(start_angles.T, self._limits) if self._arm.is_redundant else None
            if before is None and near is not None:
                q, came = nearest_angles(self._serial, targets, near)
            elif before is None:
                home = self._arm.angles
                q, came = angles_from_home(self._serial, targets, home, self._desk.solve)
            else:
                guess = batch.q[before][:, :, alive].swapaxes(0, 1).reshape(len(start_angles), -1)
                if near is None:
                    q, came = self._desk.solve(targets, guess, _ITERATIONS)
                else:
                    q, came = solve_poses(self._serial, targets, guess, _ITERATIONS, near=near)
            all_came = came.reshape(len(places), -1).all(axis=0)
            chosen, alive = np.tile(all_came, len(places)), alive[all_came]
            if len(alive) == 0:
                break
            shift, motion = targets.tcp_shift[:, chosen], moved_path.motion(places, alive)
            nearest = near and near.chosen(chosen)
            moving = following(self._serial, q[:, chosen], shift, motion, nearest)
            loads = moved_path.wrench(places, alive), moved_path.gravity(places, alive)
            batch.put(places, alive, self._load_batch(q[:, chosen], moving, *loads))
        batch.forget(np.setdiff1d(np.arange(count), alive))
        return batch

    def _load_batch(
        self, q: np.ndarray, moving: FollowingRobot, wrench: np.ndarray, gravity: np.ndarray
    ) -> Batch:
        """Return the batch of a robot in motion under loads, places times settings."""
        load = self._serial.load(moving.posture, moving.rate, moving.acceleration, gravity)
        axes, arms = self._elastic_axes(moving)
        push = [dot(a, wrench[:3]) + dot(z, wrench[3:]) for z, a in zip(axes, arms, strict=True)]
        gears = np.flatnonzero([tilt == 0 for _, tilt in self._elastic])
        deviation, compliance = self._given_way(arms, push)
        torque = np.stack(push)[gears] - load[self.gear_joint]
        return Batch(
            q=q,
            rate=moving.rate,
            torque=torque,
            lever=np.stack([np.sqrt(dot(arm, arm)) for arm in arms])[gears],
            deviation=deviation,
            compliance=compliance,
            conditioning=moving.conditioning,
            motor_share=self._motor_share(q, moving, torque),
        )

    def _motor_share(self, q: np.ndarray, moving: FollowingRobot, torque: np.ndarray) -> np.ndarray:
        """Return the largest torque of a motor over its limit [1], (n,).

        That of `coupling.inverse.servo`, eq. (1), with motors that move as the links do.
        """
        share = np.zeros(q.shape[1])
        if not self._motors:
            return share
        outputs = np.stack(
            [outputs_of_motion.T for outputs_of_motion in (q, moving.rate, moving.acceleration)]
        )
        motors = self._errors.at_motor(outputs)
        slope = self._errors.slope(motors[0])
        for gear, joint, drive, limit in self._motors:
            _, rate, acceleration = motors[..., joint]
            of_friction = drive.friction_torque(drive.friction, np.sign(rate), rate, torque[gear])
            needed = drive.inertia * acceleration - slope[:, joint] * torque[gear] + of_friction
            share = np.maximum(share, np.abs(needed) / limit)
        return share

    def _elastic_axes(self, now: FollowingRobot) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Return axes and levers of all elastic coordinates, (3, n) each."""
        axes, arms = [], []
        for joint, tilt in self._elastic:
            if tilt == 0:
                axes.append(now.posture.axis[joint])
                arms.append(now.posture.lever[joint])
            else:
                tilt_axis = self._robot.joints[joint].tilt[tilt - 1].axis
                axes.append(combine_columns(now.posture.body[joint], tilt_axis))
                arms.append(cross(axes[-1], now.posture.tip - now.posture.origin[joint]))
        return axes, arms

    def _given_way(
        self, arms: list[np.ndarray], push: list[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the TCP's displacement by torques [m], and its compliance [m/N], (n,) each."""
        lever = np.stack(arms)
        soft = self._softness[:, None, None] * lever
        displacement = np.einsum("mkn,mn->kn", soft, np.stack(push))
        compliance = _largest_eigenvalues(np.einsum("min,mjn->ijn", soft, lever))
        return np.sqrt(dot(displacement, displacement)), compliance

    def worst(self, batch: Batch) -> ScreenFigures:
        """Return the worst figures of settings over all places."""
        return self._worst_of(replace(batch, q=self._unwound(batch.q)))

    def _worst_of(self, batch: Batch) -> ScreenFigures:
        q, limits = batch.q, self._limits
        from_limits = np.minimum(q - limits.lower[:, None], limits.upper[:, None] - q)
        share = np.abs(batch.rate) / limits.rate[:, None]
        swing, lever = np.ptp(batch.torque, axis=0).T, batch.lever.max(axis=0).T
        return ScreenFigures(
            reached=np.isfinite(q[0, 0]),
            limit_margin=from_limits.min(axis=(0, 1)),
            conditioning=batch.conditioning.min(axis=0),
            rate_share=share.max(axis=(0, 1)),
            deviation=batch.deviation.max(axis=0),
            compliance=batch.compliance.max(axis=0),
            margin=margin(batch.torque).T - self._gears.held_torque,
            swing=swing,
            backlash_error=backlash_error(self._gears.backlash, lever),
            hysteresis_error=self._gears.hysteresis_error(swing, lever),
            motor_share=batch.motor_share.max(axis=0),
        )

    def _unwound(self, q: np.ndarray) -> np.ndarray:
        """Return joint angles along the path, (k, joints, n): a round adds 2 pi."""
        if not self._gapless:
            return q
        turns = np.cumsum(np.round(np.diff(q, axis=0) / (2.0 * np.pi)), axis=0)
        return np.concatenate([q[:1], q[1:] - 2.0 * np.pi * turns])


def _largest_eigenvalues(matrices: np.ndarray) -> np.ndarray:
    """Return the largest eigenvalues (n,) of symmetric matrices, any unit, (3, 3, n).

    The trigonometric roots of the characteristic polynomial, which take a tenth of LAPACK's time.
    """
    mean = np.trace(matrices) / 3.0
    rest = matrices - np.eye(3)[:, :, None] * mean
    size = np.sqrt(np.einsum("ijn,ijn->n", rest, rest) / 6.0)
    cosine = 0.5 * dot(rest[0], cross(rest[1], rest[2])) / np.maximum(size**3, 1e-300)
    largest: np.ndarray = mean + 2.0 * size * np.cos(np.arccos(np.clip(cosine, -1.0, 1.0)) / 3.0)
    return largest

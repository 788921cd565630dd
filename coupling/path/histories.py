"""What robot and process exchange: paths of tools and wrenches on them, on a time axis.

A cell's tools move at the same time: the first axis of poses and wrenches counts the tools, and one
robot is a cell of one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.contact_spring import ContactSpring
from coupling.path.frame import Frame, turned, turns_between
from coupling.path.linear import interpolate_rows
from coupling.path.time_axis import common_time, of_tools

_POSE, _WRENCH = 7, 6  # columns


def poses(position: np.ndarray, rotation: Rotation) -> np.ndarray:
    """Return positions [m], (n, 3), and rotations as poses with qw >= 0, (n, 7)."""
    quaternion = rotation.as_quat()
    quaternion *= np.where(quaternion[:, 3:] < 0.0, -1.0, 1.0)
    return np.hstack([position, quaternion])


@dataclass(frozen=True)
class ToolPath:
    """Poses of the TCPs over time, in the base frame of the first robot.

    Attributes:
        time: Rising times [s], (n,).
        pose: Position x, y, z [m] and quaternion qx, qy, qz, qw, (tools, n, 7), or (n, 7) of one tool.

    Raises:
        ValueError: If sizes do not agree, time does not rise or a value is not finite.

    Example:
        >>> time = np.array([0.0, 1.0])
        >>> path = ToolPath(time, np.array([[0, 0, 0, 0, 0, 0, 1.0], [1, 0, 0, 0, 0, 0, 1.0]]))
        >>> lifted = path.displaced(np.array([0, 0, 2e-3, 0, 0, 0]))
        >>> lifted.deviation_from(path)[0, :, 2]
        array([0.002, 0.002])
    """

    time: np.ndarray
    pose: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", of_tools(self.time, self.pose, _POSE, "tool path"))

    @classmethod
    def with_rotation(cls, time: np.ndarray, points: np.ndarray, rotation: Rotation) -> ToolPath:
        """Return the path of one tool through points [m], (n, 3), whose orientation stays."""
        rotations = Rotation.from_quat(np.tile(rotation.as_quat(), (len(time), 1)))
        return cls(time, poses(points, rotations))

    @classmethod
    def of_tools(cls, paths: Sequence[ToolPath]) -> ToolPath:
        """Return the path of several tools that move at the same time."""
        return cls(common_time(paths, "tool path"), np.concatenate([path.pose for path in paths]))

    def at_rows(self, rows: np.ndarray) -> ToolPath:
        """Return the path at the times of these row numbers, (k,)."""
        return ToolPath(self.time[rows], self.pose[:, rows])

    @property
    def tools(self) -> tuple[ToolPath, ...]:
        """Path of every tool by itself."""
        return tuple(ToolPath(self.time, pose) for pose in self.pose)

    @property
    def position(self) -> np.ndarray:
        """TCP positions [m], (tools, n, 3)."""
        return self.pose[..., :3]

    @cached_property
    def directions(self) -> np.ndarray:
        """Unit directions of travel, (tools, n, 3); zero where a tool stands still."""
        step = np.gradient(self.position, self.time, axis=1)
        speed = np.linalg.norm(step, axis=2, keepdims=True)
        # A standing tool has no direction; 1e-9 m/s is far below any feed.
        return np.where(speed > 1e-9, step / np.maximum(speed, 1e-9), 0.0)

    @property
    def rotations(self) -> tuple[Rotation, ...]:
        """Rotations base_from_tool over time, of every tool."""
        return tuple(Rotation.from_quat(pose[:, 3:]) for pose in self.pose)

    def deviation_from(self, reference: ToolPath) -> np.ndarray:
        """Return position difference [m] and rotation vector [rad] from a reference, (tools, n, 6)."""
        turns = turns_between(reference.pose[..., 3:], self.pose[..., 3:])
        return np.concatenate([self.position - reference.position, turns], axis=2)

    def distance_to(self, other: ToolPath) -> np.ndarray:
        """Return the distances at equal times [m], (n,): of the tool that is farthest off."""
        distances: np.ndarray = np.linalg.norm(self.position - other.position, axis=2)
        return distances.max(axis=0)

    def transformed(self, frame: Frame) -> ToolPath:
        """Return the path in another frame, in which `frame` is the present one."""
        if frame.is_at_the_origin:
            return self
        pairs = zip(self.position, self.rotations, strict=True)
        poses_of_tools = [
            poses(frame.points(position), frame.rotation * rotation) for position, rotation in pairs
        ]
        return ToolPath(self.time, np.stack(poses_of_tools))

    def displaced(self, deviation: np.ndarray) -> ToolPath:
        """Return the path that deviates from this one.

        Args:
            deviation: Deviation as of `deviation_from` [m, rad], broadcast to (tools, n, 6).
        """
        displaced_pose = np.empty_like(self.pose)
        displaced_pose[..., :3] = self.position + deviation[..., :3]
        displaced_pose[..., 3:] = turned(self.pose[..., 3:], deviation[..., 3:])
        return ToolPath(self.time, displaced_pose)


@dataclass(frozen=True)
class WrenchHistory:
    """Wrenches on the tools at their TCPs over time, base axes of the first robot.

    They stand at their times, and what lies between is straight.  A time that stands twice is a jump,
    from the wrench before it to the one behind it; the first row acts in initialisation.

    Attributes:
        time: Times [s], (n,), rising, but for jumps.
        wrench: fx, fy, fz [N], mx, my, mz [N m], (tools, n, 6); that on one tool may be given as (n, 6).
        spring: Springs that act on the tools beside it, at its `instants`, which stand for what the
            wrench would be with the tools elsewhere; None for a wrench that does not ask where they are.

    Raises:
        ValueError: As for ToolPath.

    Example:
        >>> forces = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 3.0], [0.0, 0.0, 7.0], [0.0, 0.0, 7.0]])
        >>> loads = WrenchHistory.of_forces(np.array([0.0, 1.0, 1.0, 2.0]), [forces])
        >>> loads.refined(np.array([0.0, 0.5, 1.0, 2.0])).force[0, :, 2]
        array([1., 2., 3., 7., 7.])
    """

    time: np.ndarray
    wrench: np.ndarray
    spring: ContactSpring | None = None

    def __post_init__(self) -> None:
        checked = of_tools(self.time, self.wrench, _WRENCH, "wrench history", jumps=True)
        object.__setattr__(self, "wrench", checked)

    @classmethod
    def none(cls, time: np.ndarray, tools: int = 1) -> WrenchHistory:
        """Return a wrench of zero at times (n,) [s]."""
        return cls(time, np.zeros((tools, len(time), _WRENCH)))

    @classmethod
    def of_forces(cls, time: np.ndarray, forces: Iterable[np.ndarray]) -> WrenchHistory:
        """Return forces [N] on the tools, (n, 3) each, without moments."""
        stacked = np.stack(list(forces))
        return cls(time, np.concatenate([stacked, np.zeros_like(stacked)], axis=2))

    @classmethod
    def of_means(cls, time: np.ndarray, means: np.ndarray) -> WrenchHistory:
        """Return wrenches that are constant over each step and jump between two of them.

        Args:
            time: Ends of the steps, rising [s], (n,).
            means: Row k acts over the step that ends at time[k], row 0 in initialisation,
                (tools, n, 6), or (n, 6) for one tool.

        Example:
            >>> steps = WrenchHistory.of_means(np.array([0.0, 1.0, 2.0]), np.eye(6)[:3])
            >>> steps.time, steps.force[0, :, 1]
            (array([0., 0., 1., 1., 2.]), array([0., 1., 1., 0., 0.]))
        """
        rows = np.arange(2 * len(time) - 1)
        return cls(time[rows // 2], means[..., (rows + 1) // 2, :])

    @classmethod
    def of_tools(cls, histories: Sequence[WrenchHistory]) -> WrenchHistory:
        """Return the wrenches on several tools at the same time."""
        time = common_time(histories, "wrench history")
        springs = [history.spring for history in histories if history.spring is not None]
        return cls(
            time,
            np.concatenate([history.wrench for history in histories]),
            ContactSpring.of_tools(springs) if len(springs) == len(histories) else None,
        )

    @property
    def instants(self) -> np.ndarray:
        """The times, each once [s], (k,)."""
        return self.time[self._first]

    @property
    def jumps(self) -> np.ndarray:
        """Times at which the wrenches may jump [s], (j,)."""
        return self.time[1:][np.diff(self.time) == 0.0]

    @property
    def before(self) -> np.ndarray:
        """Wrenches just before the instants [N, N m], (tools, k, 6)."""
        return self.wrench[:, self._first]

    @property
    def behind(self) -> np.ndarray:
        """Wrenches just behind the instants [N, N m], (tools, k, 6)."""
        return self.wrench[:, np.append(self.time[1:] != self.time[:-1], True)]

    @property
    def _first(self) -> np.ndarray:
        return np.append(True, self.time[1:] != self.time[:-1])

    @property
    def _instant(self) -> np.ndarray:
        """Number of each row's instant, (n,)."""
        return np.cumsum(self._first) - 1

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return the wrenches at given times, (tools, k, 6); at a jump those before it.

        Args:
            time: Times, from the first to the last [s], (k,).
        """
        after = np.searchsorted(self.time, time, side="left").clip(max=len(self.time) - 1)
        before = np.maximum(after - 1, 0)
        step = self.time[after] - self.time[before]
        part = np.divide(self.time[after] - time, step, out=np.zeros(len(time)), where=step > 0.0)
        part = part.clip(0.0, 1.0)[:, None]
        return (1.0 - part) * self.wrench[:, after] + part * self.wrench[:, before]

    def refined(self, time: np.ndarray) -> WrenchHistory:
        """Return the same loads with rows at other times, and at their jumps.

        Args:
            time: Rising, from the first time to the last, with the times of the jumps among them [s],
                (k,).
        """
        rows = np.sort(np.concatenate([time, self.jumps]))
        wrench = self.at(rows)
        second = np.flatnonzero(rows[1:] == rows[:-1]) + 1
        wrench[:, second] = self.wrench[:, np.searchsorted(self.time, rows[second], "right") - 1]
        spring = self.spring
        if spring is not None:
            instants = self.instants
            last_rows = np.searchsorted(instants, time).clip(max=len(instants) - 1)
            anchor = interpolate_rows(time, instants, spring.anchor, axis=1)
            spring = ContactSpring(anchor, spring.stiffness[:, last_rows])
        return WrenchHistory(rows, wrench, spring)

    def until(self, end: float) -> WrenchHistory:
        """Return the history up to a time, which is one of the instants."""
        rows, instants = self.time <= end, self.instants <= end
        spring = self.spring
        if spring is not None:
            spring = ContactSpring(spring.anchor[:, instants], spring.stiffness[:, instants])
        return WrenchHistory(self.time[rows], self.wrench[:, rows], spring)

    def transformed(self, frame: Frame) -> WrenchHistory:
        """Return the loads in another frame, in which `frame` is the present one."""
        if frame.is_at_the_origin:
            return self
        spring = self.spring and self.spring.transformed(frame)
        return WrenchHistory(self.time, frame.rotate(self.wrench), spring)

    def scaled(self, factor: float) -> WrenchHistory:
        """Return the wrenches times a factor, beside the same springs."""
        return replace(self, wrench=factor * self.wrench)

    def plus(self, force: np.ndarray) -> WrenchHistory:
        """Return the same loads with forces at the instants added [N], (tools, k, 3)."""
        wrench = self.wrench.copy()
        wrench[..., :3] += force[:, self._instant]
        return replace(self, wrench=wrench)

    def on(self, path: ToolPath) -> WrenchHistory:
        """Return the same loads, as wrenches on tools that take a path.

        Their springs then pull to that path, and carry nothing on it.

        Args:
            path: Paths of all tools at the instants of the wrenches.
        """
        if self.spring is None:
            return self
        spring = replace(self.spring, anchor=path.position)
        return replace(self.plus(self.spring.force(path.position)), spring=spring)

    @property
    def tools(self) -> tuple[WrenchHistory, ...]:
        """Wrench on every tool by itself."""
        springs = (None,) * len(self.wrench) if self.spring is None else self.spring.tools
        pairs = zip(self.wrench, springs, strict=True)
        return tuple(WrenchHistory(self.time, wrench, spring) for wrench, spring in pairs)

    @property
    def force(self) -> np.ndarray:
        """Forces [N], (tools, n, 3)."""
        return self.wrench[..., :3]

    @property
    def peak_force(self) -> float:
        """Largest force on a tool [N]."""
        return float(np.linalg.norm(self.force, axis=2).max())

    def change_from(self, other: WrenchHistory) -> float:
        """Return the largest force difference on a tool relative to the larger peak force.

        Args:
            other: Wrenches at the same instants, which may jump elsewhere.
        """
        sides = zip((self.before, self.behind), (other.before, other.behind), strict=True)
        change = np.stack([values[..., :3] - others[..., :3] for values, others in sides])
        largest = float(np.linalg.norm(change, axis=-1).max())
        return largest / max(self.peak_force, other.peak_force) if largest > 0.0 else 0.0

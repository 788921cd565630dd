"""Arcs through three points as chords that leave them by nothing that a robot could show."""

from __future__ import annotations

from dataclasses import replace
from math import acos, atan2, ceil, pi, tau
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.errors import ProgramError
from coupling.programs.program import Pose, ProgramMove

# Farthest way from a chord to its arc [m], and most moves of a program with arcs.
_SAGITTA, _MAX_MOVES = 1e-7, 500_000
# Sine of an angle between chords below which points are on a line.
_STRAIGHT = 1e-6
# How a tool turns on an arc: not at all, or evenly relative to the base or to the tangent.
Turning = Literal["none", "base", "path"]
# Rotations are one if they differ by less, and half turns if by less from it [rad].
_SAME_ROTATION = 1e-6


def add_arc(
    moves: list[ProgramMove],
    via: Pose,
    end: ProgramMove,
    turning: Turning,
    angle: float | None = None,
) -> None:
    """Add the moves of an arc from the last move's pose.

    Args:
        moves: Moves before it, added to.
        via: Place that it goes through.
        end: Move to its end, whose speed, or share of whose time, the chords have.
        turning: Rule by which the tool turns.
        angle: Angle that it goes on by, positive towards `via` [rad]; None: to its end.

    Raises:
        ProgramError: If there is no such arc, or how the tool turns on it is not known.
    """
    start = moves[-1].pose if moves else None
    if start is None or end.pose is None:
        raise ProgramError(f"{end.where}: expected a motion to a pose before an arc, got none")
    try:
        poses = _poses(start, via, end.pose, turning, angle)
    except ValueError as cause:
        raise ProgramError(f"{end.where}: {cause}") from cause
    if len(moves) + len(poses) > _MAX_MOVES:
        raise ProgramError(
            f"{end.where}: expected at most {_MAX_MOVES} chords of arcs, got more: read a part of it"
        )
    share = None if end.duration is None else end.duration / len(poses)
    moves += [replace(end, pose=pose, duration=share) for pose in poses]


def _poses(start: Pose, via: Pose, end: Pose, turning: Turning, angle: float | None) -> list[Pose]:
    """Return the ends of the chords; arguments as of `add_arc`."""
    first, middle, last = (np.array(pose[:3]) for pose in (start, via, end))
    u, v = middle - first, last - first
    normal = np.cross(u, v)
    square = float(normal @ normal)
    if square <= float((u @ u) * (v @ v)) * _STRAIGHT**2:
        raise ValueError("expected an arc through three points, got points on a line: write a line")
    outward = -(np.cross(v, normal) * (u @ u) + np.cross(normal, u) * (v @ v)) / (2.0 * square)
    axis, to_end = normal / square**0.5, v + outward
    sweep = atan2(float(axis @ np.cross(outward, to_end)), float(outward @ to_end)) % tau
    before, behind = (Rotation.from_quat(pose[3:]) for pose in (start, end))
    turn = behind * before.inv()
    if turning == "none" and turn.magnitude() > _SAME_ROTATION:
        raise ValueError("expected one rotation on this arc, got a tool that turns: write lines")
    if turning == "path":
        if sweep > pi + _SAME_ROTATION:
            raise ValueError("expected an arc of 180 deg at most, got a longer one: write two")
        turn = Rotation.from_rotvec(-sweep * axis) * turn
    way = turn.as_rotvec()
    if turning == "path" and way @ axis > 0.0 and turn.magnitude() > pi - _SAME_ROTATION:
        way *= 1.0 - tau / turn.magnitude()  # half a turn back: the tool keeps its rotation
    sweep = sweep if angle is None else angle
    step = 2.0 * acos(max(1.0 - _SAGITTA / float(np.linalg.norm(outward)), 0.0))
    part = np.linspace(0.0, 1.0, min(ceil(abs(sweep) / step), _MAX_MOVES) + 1)[1:, None]
    around = Rotation.from_rotvec(part * sweep * axis)
    rotation = Rotation.from_rotvec(part * way) * before
    points = first - outward + around.apply(outward)
    quaternions = (around * rotation if turning == "path" else rotation).as_quat(canonical=True)
    poses: list[Pose] = [tuple(pose) for pose in np.hstack([points, quaternions]).tolist()]
    return poses if angle is not None else [*poses[:-1], end]

"""Frames in which processes outside of this package have poses, wrenches and stiffnesses."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process.base import ProcessResponse
from elastic_robot.tool_load import symmetric

# Of poses; wrenches are in the same axes.
PoseFrame = Literal["part", "base"]
WrenchFrame = Literal["part", "base", "tool"]


def poses_in(frame: PoseFrame, path: ToolPath, part: Frame) -> np.ndarray:
    """Return the poses of the only TCP in a frame: x, y, z [m], qx, qy, qz, qw, qw >= 0, (n, 7).

    Example:
        >>> part = Frame.of_rpy([1.0, 0.0, 0.5], [0.0, 0.0, 0.0])
        >>> pose = np.array([[1.0, 0.0, 0.6, 0.0, 0.0, 0.0, 1.0]] * 2)
        >>> poses_in("part", ToolPath(np.array([0.0, 1.0]), pose), part)[0, :3].round(9)
        array([0. , 0. , 0.1])
    """
    if frame == "base":
        return path.pose[0]
    return path.transformed(part.inverse()).pose[0]


def wrench_in_base(
    frame: WrenchFrame, wrench: np.ndarray, path: ToolPath, part: Frame
) -> np.ndarray:
    """Return wrenches at the TCP in base axes [N, N m], (n, 6), from those in the axes of a frame.

    The reference point stays the TCP: only axes change.
    """
    return _rotate_wrench(_base_from(frame, path, part), wrench)


def _rotate_wrench(turn: Rotation, wrench: np.ndarray) -> np.ndarray:
    return np.hstack([turn.apply(wrench[:, :3]), turn.apply(wrench[:, 3:])])


def response_in_base(
    frame: WrenchFrame, values: np.ndarray, path: ToolPath, part: Frame
) -> ProcessResponse:
    """Return the response on the only tool that is given in the axes of a frame.

    Args:
        values: Time [s], one that is a jump twice, wrench at the TCP [N, N m], and stiffness xx, xy,
            xz, yy, yz, zz [N/m] behind it where it is known, (n, 7) or (n, 13).
        path: Actual path of the tool.
        part: base_from_part.
    """
    first = np.append(True, np.diff(values[:, 0]) > 0.0)
    turn = _base_from(frame, path, part)
    each = turn if turn.single else turn[np.cumsum(first) - 1]
    wrench = WrenchHistory(values[:, 0], _rotate_wrench(each, values[:, 1:7]))
    if values.shape[1] == 7:
        return ProcessResponse(wrench)
    axes = np.broadcast_to(turn.as_matrix(), (len(path.time), 3, 3))
    stiffness = axes @ symmetric(values[first, 7:]) @ axes.swapaxes(1, 2)
    return ProcessResponse(wrench, stiffness=stiffness)


def _base_from(frame: WrenchFrame, path: ToolPath, part: Frame) -> Rotation:
    return {
        "base": Rotation.identity(),
        "part": part.rotation,
        "tool": path.rotations[0],
    }[frame]

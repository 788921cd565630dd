"""The task of the benchmark: the ISO 9283 reference path, and what is measured of a solver of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.files.robot_file import find_robot, load_robot
from elastic_robot.trajectory import Trajectory, read_trajectory

REFERENCE = Path(__file__).parent.parent / "tests" / "reference"
TRAJECTORY = REFERENCE / "iso_path_joints.npz"
ROBOT = load_robot(find_robot("icme2008"))
# Reference files by torque curve.
CURVES = {"linear": "d_iso_nobacklash_10ms", "backlash": "d_iso_backlash_10ms"}
# The accuracy that counts [m].
ENOUGH = 1e-6
# Until here backlash has not yet amplified errors [s].
EARLY = 9.0


@dataclass(frozen=True)
class Task:
    """Follow the path with one torque curve, from equilibrium.

    Attributes:
        curve: A torque curve's name.
        drives: Motion of the drives.
        times: Of the reference, every 10 ms [s], (n,).
        expected: TCP positions there [m], (n, 3).
    """

    curve: str
    drives: Trajectory
    times: np.ndarray
    expected: np.ndarray

    @classmethod
    def load(cls, curve: str, end: float) -> Task:
        """Return the task up to a time [s]."""
        table = np.loadtxt(REFERENCE / f"{CURVES[curve]}.csv", delimiter=",", skiprows=1)
        table = table[table[:, 0] <= end + 1e-9]
        drives = read_trajectory(TRAJECTORY, len(ROBOT.joints))
        return cls(curve, drives, table[:, 0], table[:, 1:4])


@dataclass(frozen=True)
class Answer:
    """What a solver gave.

    Attributes:
        spent: Time it took [s].
        times: A subset of the reference's [s], (k,).
        position: Of the TCP there [m], (k, 3).
    """

    spent: float
    times: np.ndarray
    position: np.ndarray


@dataclass(frozen=True)
class Entry:
    """A solver with its settings.

    Attributes:
        family: "native", "MuJoCo" or "SciPy".
        name: Shown in the table.
        solve: Does the task.
    """

    family: str
    name: str
    solve: Callable[[], Answer]


@dataclass(frozen=True)
class Row:
    """A line of the table: time [s] and the largest TCP errors [m]."""

    family: str
    name: str
    spent: float
    whole: float
    early: float

    @property
    def good(self) -> bool:
        """Whether the error stays within ENOUGH over the whole path."""
        return self.whole <= ENOUGH

    @classmethod
    def of(cls, entry: Entry, task: Task) -> Row:
        """Return the line of a solver."""
        answer = entry.solve()
        rows = np.searchsorted(task.times, answer.times - 1e-6)
        error = np.abs(answer.position - task.expected[rows]).max(axis=1)
        # A solution that blew up is an infinite error.
        error = np.where(np.isfinite(error), error, np.inf)
        early = error[answer.times <= EARLY]
        return cls(entry.family, entry.name, answer.spent, float(error.max()), float(early.max()))

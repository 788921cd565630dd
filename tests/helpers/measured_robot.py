"""A robot to be measured: the FMU with other parameters, and what no model of it has.

Its tool goes where the FMU's goes under a run's command, and beyond that by hysteresis (a play operator
on a joint's angle), drift over the run, errors of gears that turn with a drive, and a displacement that
depends on where it is.  What a device sees of that has noise.  Shares no code with the project.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from replay import straight_wrench
from replay_robot import Robot, Settings
from replay_tables import columns, read_table
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

POSITION = ("x", "y", "z")
STEP = 0.004  # [s]


@dataclass(frozen=True)
class Extras:
    """What the robot has beyond the FMU.

    Attributes:
        hysteresis: Displacement of the tool by the joint that moves it most [m], from side to side half
            each way.
        gear_errors: Amplitude at the tool [m], one each of two joints.
        waves: Periods of these a turn of the joint.
        drift: Displacement of the tool at the end of a run [m].
        geometry: Displacement that grows linearly with the place, so large at 0.1 m from the middle [m].
        again: Standard deviation of what is new in every run, a drift [m].
        noise: Standard deviation of a measured coordinate [m].
        seed: Of phases and directions.
    """

    hysteresis: float = 0.0
    gear_errors: float = 0.0
    waves: tuple[float, float] = (97.0, 131.0)
    drift: float = 0.0
    geometry: float = 0.0
    again: float = 0.0
    noise: float = 2e-5
    seed: int = 1


@dataclass(frozen=True)
class Moved:
    """Where a tool was, was to be, and what was new in the run [m], (n, 3), base axes, at times [s]."""

    time: np.ndarray
    position: np.ndarray
    desired: np.ndarray
    anew: np.ndarray

    @property
    def deviation(self) -> np.ndarray:
        """Where it was less where it was to be [m], (n, 3)."""
        return self.position - self.desired

    def rms(self, constant: bool = True) -> float:
        """Rms distance [m]; without a constant where that is not to count."""
        off = self.deviation if constant else self.deviation - self.deviation.mean(axis=0)
        return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))

    def repeats(self) -> float:
        """Rms distance that the command leaves without what was new in this run [m]."""
        off = self.deviation - self.anew
        return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))

    def largest(self, constant: bool = True) -> float:
        """Largest distance [m]."""
        off = self.deviation if constant else self.deviation - self.deviation.mean(axis=0)
        return float(np.linalg.norm(off, axis=1).max())


@dataclass(frozen=True)
class Chain:
    """Kinematics of a robot file.

    Attributes:
        origins, axes: Of the joints, (j, 3).
        tcp: In the last body [m], (3,).
    """

    origins: np.ndarray
    axes: np.ndarray
    tcp: np.ndarray

    @classmethod
    def read(cls, file: Path) -> Chain:
        """Read a robot file."""
        data = tomllib.loads(file.read_text(encoding="utf-8"))
        origins, axes = (
            np.array([j[key] for j in data["joint"]], float) for key in ("origin", "axis")
        )
        return cls(origins, axes, np.array(data["tcp"]["position"], float))

    def levers(self, q: np.ndarray) -> np.ndarray:
        """Return what a radian of each joint moves the tool [m], (n, j, 3)."""
        turned, place = Rotation.identity(len(q)), np.zeros((len(q), 3))
        places, axes = [], []
        for number, (origin, axis) in enumerate(zip(self.origins, self.axes, strict=True)):
            place = place + turned.apply(origin)
            places.append(place)
            axes.append(turned.apply(axis))
            turned = turned * Rotation.from_rotvec(q[:, [number]] * axis)
        tool = place + turned.apply(self.tcp)
        return np.stack([np.cross(a, tool - p) for a, p in zip(axes, places, strict=True)], axis=1)


@dataclass
class MeasuredRobot:
    """The robot that really moves.

    Attributes:
        fmu: The FMU of the robot file.
        chain: Its kinematics.
        settings: Values of its FMU's parameters.
        extras: What it has beyond.
    """

    fmu: Robot
    chain: Chain
    settings: Settings
    extras: Extras

    def moved(self, folder: Path, number: int = 0) -> Moved:
        """Return where the tool goes under the command of a run folder, in run `number`."""
        desired, loads = read_table(folder / "desired.csv"), read_table(folder / "wrench.csv")
        time = np.arange(desired["time"][0], desired["time"][-1] + 1e-9, STEP)
        wrench = straight_wrench(loads, time)
        poses = self.fmu.poses(folder / "command.csv", time, wrench, self.settings)
        command = read_table(folder / "command.csv")
        q = np.column_stack([command[f"q{k + 1}"] for k in range(len(self.chain.axes))])
        q = CubicSpline(command["time"], q)(np.clip(time, *command["time"][[0, -1]]))
        wanted = CubicSpline(desired["time"], columns(desired, POSITION))(time)
        anew = self._anew(time, number)
        return Moved(time, poses[:, :3] + self._beyond(time, q, wanted) + anew, wanted, anew)

    def measure(self, folder: Path, file: Path, number: int = 0, until: float = np.inf) -> Moved:
        """Write what a device sees of a run, and return what it really was."""
        moved = self.moved(folder, number)
        rng = np.random.default_rng([self.extras.seed, number, 7])
        seen = moved.position + self.extras.noise * rng.standard_normal(moved.position.shape)
        rows = np.column_stack([moved.time, seen])[moved.time <= until]
        np.savetxt(file, rows, delimiter=",", header="time,x,y,z", comments="", fmt="%.9g")
        return moved

    def _anew(self, time: np.ndarray, number: int) -> np.ndarray:
        """Return what is new in a run [m], (n, 3): a shift and a drift."""
        anew = np.random.default_rng([self.extras.seed, number, 5]).standard_normal((2, 3))
        share = (time - time[0]) / (time[-1] - time[0])
        return self.extras.again * (anew[0] + share[:, None] * anew[1])

    def _beyond(self, time: np.ndarray, q: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Return what the tool does beyond the FMU's in every run [m], (n, 3)."""
        own, rng = self.extras, np.random.default_rng([self.extras.seed, 3])
        levers = self.chain.levers(q)
        reach = np.linalg.norm(levers, axis=2).mean(axis=0) * np.ptp(q, axis=0)
        first, second, *_ = np.argsort(-reach).tolist()
        beyond = np.zeros_like(place)
        for joint, waves in zip((first, second), own.waves, strict=True):
            phase, arm = (
                rng.uniform(0.0, 2.0 * np.pi),
                np.linalg.norm(levers[:, joint], axis=1).mean(),
            )
            turn = own.gear_errors / arm * np.sin(waves * q[:, joint] + phase)
            beyond += levers[:, joint] * turn[:, None]
        if own.hysteresis:
            half = 0.5 * own.hysteresis / np.linalg.norm(levers[:, first], axis=1).mean()
            behind = np.empty(len(q))
            behind[0] = q[0, first]
            for k in range(1, len(q)):
                behind[k] = np.clip(behind[k - 1], q[k, first] - half, q[k, first] + half)
            beyond += levers[:, first] * (behind - q[:, first])[:, None]
        way = rng.standard_normal(3)
        share = (time - time[0]) / (time[-1] - time[0])
        beyond += own.drift * share[:, None] * way / np.linalg.norm(way)
        skew = rng.standard_normal((3, 3))
        skew /= np.linalg.norm(skew, 2)
        return beyond + own.geometry / 0.1 * (place - place.mean(axis=0)) @ skew.T

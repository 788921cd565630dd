"""A tool on springs, dampers and masses along x and y, which goes exactly from step to step."""

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm
from spring_robot import upright

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.robot.contract import Advance
from elastic_robot.fmi.interface import Mode


@dataclass(frozen=True)
class VibratingRobot:
    """Its displacement u: M u'' + C u' + K u = F in the x-y plane; the drives are x, y, z."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray

    @property
    def rates(self) -> tuple[np.ndarray, np.ndarray]:
        """Return A and B of s' = A s + B F, s = (u, u')."""
        inverse = np.linalg.inv(self.mass)
        a = np.block(
            [
                [np.zeros((2, 2)), np.eye(2)],
                [-inverse @ self.stiffness, -inverse @ self.damping],
            ]
        )
        return a, np.vstack([np.zeros((2, 2)), inverse])

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the path from rest."""
        march = self.march(command, wrench, float(wrench.time[-1]), mode)
        return march(wrench, False)

    def march(self, command: JointPath, start: WrenchHistory, end: float, mode: Mode) -> Advance:
        """Begin at rest."""
        return VibratingMarch(self, command).advance


@dataclass
class VibratingMarch:
    """Its simulation in windows; `energy` is that which damping has taken."""

    robot: VibratingRobot
    command: JointPath
    begun: np.ndarray = field(default_factory=lambda: np.zeros(4))
    state: np.ndarray = field(default_factory=lambda: np.zeros(4))
    steps: dict[float, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)

    def advance(self, loads: WrenchHistory, is_repeat: bool) -> ToolPath:
        """Return the path within a window, at rows of the command; forces are constant over steps."""
        self.state = self.begun if is_repeat else self.state
        self.begun = self.state
        time = loads.instants
        states = [self.state]
        for step, force in zip(np.diff(time), loads.behind[0, :-1, :2], strict=True):
            advance, push = self._matrices(float(step))
            states.append(advance @ states[-1] + push @ force)
        self.state = states[-1]
        points = self.command.q[0][np.searchsorted(self.command.time, time)]
        points[:, :2] += np.array(states)[:, :2]
        return ToolPath(time, upright(points))

    def _matrices(self, step: float) -> tuple[np.ndarray, np.ndarray]:
        key = round(step, 12)
        if key not in self.steps:
            a, b = self.robot.rates
            whole = expm(np.block([[a, b], [np.zeros((2, 6))]]) * step)
            self.steps[key] = whole[:4, :4], whole[:4, 4:]
        return self.steps[key]

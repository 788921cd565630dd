"""Static equilibrium of the elastic coordinates with a spring at the TCP, a contact, or hysteresis.

Rest is where an energy is least: of springs, weight, the spring at the TCP, and what the elements of the
gears' hysteresis store and lose on a monotone way from where they were.  Newton's method walks
down to it, with an exact search along a step that leads beyond the valley.  A gear in its backlash,
which has no place of its own there under a given force, rests against the spring.
"""

from __future__ import annotations

import numpy as np

from elastic_robot.dynamics import Dynamics
from elastic_robot.hysteresis import Past
from elastic_robot.kinematics import base_from_tool
from elastic_robot.settings import SETTINGS
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TorqueCurve

# Passes of Newton's method before there is no equilibrium, and tries to find the floor along a step.
_MOST_PASSES = 200
_MOST_TRIES = 60
# Longest step of a coordinate [rad].
_LONGEST_STEP = 0.5
# A step ends on the floor of the valley: where the torque along it is this part of the one at its start.
_LEFT = 0.1
# Slopes that are added, over those of the flanks, until the energy's curvature is positive; close to
# each other, since one that is far too large leads off a saddle in tiny steps.
_SHIFTS = (0.0, *(2.0**k for k in range(-40, 15)))
# A gear that carries more than this many times what it loses across its backlash has one flank to rest
# on.
_CERTAIN = 3.0
# A flank is nearer to the anchor than the other by this at least [m]; less is rounding.
_NEARER = 1e-12
# Rounding of the spring's force, over stiffness and distance from the base.
_ROUNDING = 8.0 * float(np.finfo(float).eps)


class SpringStatics:
    """Equilibria of one robot, at given drives, under a load with a spring.

    Args:
        dynamics: Forces of the robot.
        curve: Torque curve S.
        q: Drive angles at the gears' outputs [rad], (n,).
        acting: Loads on the tool.
        past: Where the gears come from.
    """

    def __init__(
        self, dynamics: Dynamics, curve: TorqueCurve, q: np.ndarray, acting: ToolLoad, past: Past
    ) -> None:
        self._dynamics = dynamics
        self._curve = curve
        self._past = past
        self._acting = acting
        self._rigid = dynamics.chain.theta(q)
        self._backlash = np.isfinite(curve.half_width)
        self._width = np.where(self._backlash, curve.half_width, 0.0)
        self._flanks = curve.flank_slope(np.zeros(len(self._width)))
        reach = np.abs(acting.anchor).max() + np.abs(self._tcp(np.zeros(len(self._backlash)))).max()
        stiffness = np.abs(acting.stiffness).max() + acting.contact.stiffness
        noise = _ROUNDING * float(stiffness * reach**2)
        self._negligible = SETTINGS.neutral_torque + noise

    def rest(self) -> np.ndarray | None:
        """Return x [rad], (m,); None if there is no equilibrium.

        Where a gear that the spring does not support could rest on either flank, the one with the TCP
        nearer to the anchor is taken: a contact is touched there.  Without spring and contact it is the
        one that carries less.
        """
        try:
            start, neutral = self._start()
        except np.linalg.LinAlgError:  # numbers beyond all bounds
            return None
        x = self._descend(start, neutral)
        if x is None:
            return None
        for k in self._undecided(x):
            mirrored = x.copy()
            mirrored[k] = -x[k]
            other = self._descend(mirrored, neutral)
            if other is None or other[k] * x[k] > 0.0:
                continue
            if self._is_better(other, x, k):
                x = other
        return x

    def _start(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the start, and the mask of gears that stay in the middle of their backlash.

        The deflection under the load of the undeflected robot, on the flanks and the spring; neutral
        is a gear that neither force and weight nor the spring can hold anywhere.
        """
        rigid, acting = self._rigid, self._acting
        support = self._dynamics.support(rigid, acting)
        slipped = self._past.torque(np.zeros(len(self._width)))
        given = self._dynamics.static_torque(rigid, ToolLoad(acting.wrench)) - slipped
        neutral = self._backlash & (np.abs(given) < SETTINGS.neutral_torque)
        neutral &= support.diagonal() * self._width < SETTINGS.neutral_torque
        torque = self._dynamics.static_torque(rigid, acting) - slipped
        x = np.linalg.solve(np.diag(self._flanks) + support, torque)
        return np.where(neutral, 0.0, x + self._width * np.sign(x)), neutral

    def _descend(self, x: np.ndarray, neutral: np.ndarray) -> np.ndarray | None:
        """Return the rest that lies downhill of x; None if there is none."""
        residual = self._residual(x)
        for _ in range(_MOST_PASSES):
            free = np.where(neutral, 0.0, residual)
            step = self._step(x, free, neutral)
            if step is None:
                return None
            part, after = self._search(x, free, step)
            x = x + part * step
            if not np.abs(x).max() < np.pi:
                return None
            left = np.abs(np.where(neutral, 0.0, after)).max()
            stands = part == 1.0 and np.abs(step).max() < SETTINGS.equilibrium_step
            # Where it does not fall any more that is rounding, or the edge of a backlash.
            stalls = left <= self._negligible and left >= 0.5 * np.abs(free).max()
            residual = after
            if stands or stalls:
                loaded = neutral & (np.abs(residual) >= self._negligible)
                if not loaded.any():
                    return x
                neutral = neutral & ~loaded
        return None

    def _step(self, x: np.ndarray, free: np.ndarray, neutral: np.ndarray) -> np.ndarray | None:
        """Return Newton's step towards less energy; None if the energy has no floor.

        Inside its backlash a gear is held by the load alone.  A slope that sends it at most to the other
        end of the backlash, and vanishes with what is left to balance, keeps it from being thrown out;
        one that the load drives on crosses its backlash.
        """
        inside = self._backlash & (self._curve.region(x) == 0)
        slope = self._curve.slope(x) + self._past.slope(x)
        slope = slope + inside * np.abs(free) / np.where(inside, 2.0 * self._width, 1.0)
        gradient = self._dynamics.static_torque_gradient(self._theta(x), self._acting)
        driven = inside * np.maximum(gradient.diagonal(), 0.0)
        for shift in _SHIFTS:
            # The flanks, as a rounded one is flat at its foot.
            added = shift * self._flanks + (shift > 0.0) * driven
            matrix = np.diag(slope + added) - gradient
            matrix[neutral] = np.eye(len(x))[neutral]
            matrix[:, neutral] = np.eye(len(x))[:, neutral]
            try:
                np.linalg.cholesky(0.5 * (matrix + matrix.T))
            except np.linalg.LinAlgError:
                continue
            step: np.ndarray = np.linalg.solve(matrix, free)
            return step * min(1.0, _LONGEST_STEP / max(np.abs(step).max(), 1e-300))
        return None

    def _search(
        self, x: np.ndarray, free: np.ndarray, step: np.ndarray
    ) -> tuple[float, np.ndarray]:
        """Return the part of a step that leads to the valley's floor, and the residual there."""
        residual = self._residual(x + step)
        start, along = float(free @ step), float(residual @ step)
        if np.abs(step).max() < SETTINGS.equilibrium_step or not along < -_LEFT * start:
            return 1.0, residual
        # Between two of these places the torque along the step is nearly straight.
        low, at_low, high, at_high, stays = 0.0, start, 1.0, along, 0.0
        for part in self._edges(x, step):
            along = float(self._residual(x + part * step) @ step)
            if along < 0.0:
                high, at_high = part, along
                break
            low, at_low = part, along
        for _ in range(_MOST_TRIES):
            part = low + (high - low) * at_low / (at_low - at_high)
            residual = self._residual(x + part * step)
            along = float(residual @ step)
            if abs(along) <= _LEFT * start:
                break
            # False position; the value at an end that stays counts half (Dowell and Jarratt 1971).
            if along > 0.0:
                low, at_low, at_high = part, along, at_high * (0.5 if stays > 0.0 else 1.0)
            else:
                high, at_high, at_low = part, along, at_low * (0.5 if stays < 0.0 else 1.0)
            stays = along
        return part, residual

    def _edges(self, x: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Return the parts of a step, rising, at which gears leave or take up their flanks."""
        with np.errstate(divide="ignore", invalid="ignore"):
            parts = (np.array([[-1.0], [1.0]]) * self._width - x) / step
        parts = parts[:, self._backlash]
        return np.sort(parts[(parts > 0.0) & (parts < 1.0)])

    def _undecided(self, x: np.ndarray) -> np.ndarray:
        """Return the gears that might rest on their other flank too, driven on through backlash."""
        theta = self._theta(x)
        torque = self._dynamics.static_torque(theta, self._acting) - self._past.torque(x)
        driven = self._dynamics.static_torque_gradient(theta, self._acting).diagonal()
        lost = 2.0 * self._width * driven
        on_flank = self._backlash & (self._curve.region(x) != 0)
        return np.flatnonzero(on_flank & (driven > 0.0) & (np.abs(torque) < _CERTAIN * lost))

    def _residual(self, x: np.ndarray) -> np.ndarray:
        """Return the torque that is left to balance [N m], (m,)."""
        torque = self._dynamics.static_torque(self._theta(x), self._acting)
        return torque - self._curve.torque(x) - self._past.torque(x)

    def _is_better(self, other: np.ndarray, x: np.ndarray, gear: int) -> bool:
        """Return whether a gear should rest on its other flank."""
        if self._past.acts and not self._acting.is_sprung:
            before, after = (abs(self._curve.torque(at)[gear]) for at in (x, other))
            return bool(after < before)
        return self._gap(other) < self._gap(x) - _NEARER

    def _gap(self, x: np.ndarray) -> float:
        """Return the distance from the TCP to the anchor, or without a spring to the plane [m]."""
        if not self._acting.has_spring:
            gap = self._acting.anchor - self._tcp(x)
            return abs(float(self._acting.contact.depth(gap)))
        return float(np.linalg.norm(self._tcp(x) - self._acting.anchor))

    def _tcp(self, x: np.ndarray) -> np.ndarray:
        """Return the TCP's position [m], base axes, (3,)."""
        chain, data = self._dynamics.chain, self._dynamics.data
        return base_from_tool(chain, data, self._theta(x)).translation.copy()

    def _theta(self, x: np.ndarray) -> np.ndarray:
        theta = self._rigid.copy()
        theta[self._dynamics.chain.elastic] += x
        return theta

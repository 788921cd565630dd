"""Static equilibrium of the elastic coordinates: where the energy of the robot at rest is least.

    E(x) = sum_k int_0^x_k (S_k + H_k) + weight + balancers - f . p + (a - p)^T K (a - p) / 2 + k d^2 / 2

with torque curves S, hysteresis H on the way from where the gears were (`hysteresis.Past`), force f
and spring K on the TCP p, and a touched contact of depth d.  A moment that keeps its axes has no
potential: its torque is that at the last minimum, and the minimum is looked for again until it stays.
Dampers, and the friction of motors and of a contact, carry nothing at rest.

SciPy minimises E, in units of the springs' energy, from several starts: the deflection under the load
of the undeflected robot, then with each gear that its load drives through its backlash on the other
flank.  Which minimum is the robot's rest, docs/model.md says.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.optimize import minimize

from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import EquilibriumError, ParameterError
from elastic_robot.hysteresis import Hysteresis, Past
from elastic_robot.kinematics import base_from_tool, tcp_jacobian
from elastic_robot.settings import SETTINGS
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TorqueCurve, curve_energy

# Minimisations until a moment's torque is that at the minimum, and the change that is none [rad].
_MOST_MINIMISATIONS, _SAME = 20, 1e-10
# Steps of Newton's method behind a minimum, which is found to the rounding of energies only, and the
# shortest part of one.
_MOST_STEPS, _SHORTEST = 60, 2.0**-30
# Rounding of forces of a spring, over its stiffness and the distance of its ends from the base.
_ROUNDING = 1e-15
# Where SciPy's descent ends [J^(1/2)]: the torque of 1e-6 N m on a gear of 1e8 N m/rad.
_ENOUGH = {"gtol": 1e-10, "maxiter": 200}
# One flank is nearer to the anchor than the other by this at least [m]; less is rounding.
_NEARER = 1e-12


def equilibrium(
    dynamics: Dynamics,
    curve: TorqueCurve,
    q: np.ndarray,
    acting: ToolLoad,
    past: Past | None = None,
) -> np.ndarray:
    """Return the elastic coordinates at rest: S(x) + H(x) = J^T w - g.

    Without elements of hysteresis, H = 0, it does not depend on history.

    Args:
        dynamics: Forces of the robot.
        curve: Torque curve S.
        q: Drive angles at the gears' outputs [rad], (n,).
        acting: Loads on the tool.
        past: Where the gears come from; None where they have no elements.

    Returns:
        x [rad], (m,).

    Raises:
        ParameterError: If gears have elements and come from nowhere.
        EquilibriumError: If there is none up to the setting `most_deflection`: the robot buckles.
    """
    if dynamics.chain.elastic_count == 0:
        return np.zeros(0)
    if past is None:
        if dynamics.chain.elements.count:
            raise ParameterError(
                "past: expected where the gears come from, as they have hysteresis, got nothing"
            )
        past = Past.start(Hysteresis(dynamics.chain.elements, np.zeros(len(curve.half_width))))
    with np.errstate(over="ignore", invalid="ignore"):
        return EnergyAtRest(dynamics, curve, dynamics.chain.theta(q), acting, past).equilibrium()


def _solve(matrix: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """Return the step that takes a torque [N m]; the shortest where nothing holds a gear."""
    try:
        return np.linalg.solve(matrix, torque)
    except np.linalg.LinAlgError:
        return np.linalg.lstsq(matrix, torque, rcond=None)[0]


@dataclass(frozen=True)
class EnergyAtRest:
    """The energy of a robot in one posture of its drives, under one load.

    Attributes:
        dynamics: Forces of the robot.
        curve: Torque curve S.
        rigid: Angles of the chain without deflection [rad], (angles,).
        acting: Loads on the tool.
        past: Where the gears come from.
    """

    dynamics: Dynamics
    curve: TorqueCurve
    rigid: np.ndarray
    acting: ToolLoad
    past: Past

    def equilibrium(self) -> np.ndarray:
        """Return the equilibrium [rad], (m,).

        Of two flanks that a gear could rest on, it is the one with the TCP nearer to the anchor of a
        spring or to a contact's plane, and without these the one with less torque.

        Raises:
            EquilibriumError: If there is none.
        """
        start, middle = self._start()
        try:
            x = self._minimum(start, middle)
        except (ValueError, np.linalg.LinAlgError):  # numbers beyond all bounds
            x = None
        if x is None or not np.abs(x).max(initial=0.0) <= SETTINGS.most_deflection:
            raise EquilibriumError(self._refusal)
        for gear in self._undecided_gears(x):
            mirrored = x.copy()
            mirrored[gear] *= -1.0
            other = self._minimum(mirrored, middle)
            if other is None or other[gear] * x[gear] > 0.0:
                continue
            if self.preference(other, gear) < self.preference(x, gear) - _NEARER:
                x = other
        return x

    @property
    def count(self) -> int:
        """Number of elastic coordinates m."""
        return self.dynamics.chain.elastic_count

    @property
    def _refusal(self) -> str:
        chain, acting = self.dynamics.chain, self.acting
        q = np.round(self.rigid[chain.drive], 4).tolist()
        spring = (
            f" and a spring of {np.round(acting.stiffness, 3).tolist()} N/m anchored at"
            f" {np.round(acting.anchor, 6).tolist()} m"
        )
        contact = f" and a contact of {acting.contact.stiffness:.6g} N/m" * acting.contact.holds
        return (
            f"no static equilibrium found at q = {q} rad under the wrench"
            f" {np.round(acting.wrench, 3).tolist()} N, N m{acting.has_spring * spring}{contact}; the"
            " joints are too soft for this load"
        )

    @property
    def _width(self) -> np.ndarray:
        """Half widths of backlashes [rad], 0 without one, (m,)."""
        return np.where(np.isfinite(self.curve.half_width), self.curve.half_width, 0.0)

    @property
    def _negligible(self) -> float:
        """Torque that is none [N m]: what a gear does not feel, and the rounding of a spring's."""
        reach = (
            np.abs(self.acting.anchor).max() + np.abs(self._tool(np.zeros(len(self._width)))).max()
        )
        stiffness = np.abs(self.acting.stiffness).max() + self.acting.contact.stiffness
        return float(SETTINGS.neutral_torque + _ROUNDING * stiffness * reach**2)

    def _start(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the start, and the mask of gears that hardly anything holds, in mid-backlash."""
        flanks, width = self.curve.flank_slope(np.zeros(len(self._width))), self._width
        torque = self._torque(np.zeros(len(width)))
        support = self.dynamics.support(self.rigid, self.acting)
        wrench_torque = self.dynamics.static_torque(self.rigid, ToolLoad(self.acting.wrench))
        carrying = np.maximum(np.abs(wrench_torque), support.diagonal() * width)
        slips = np.zeros(len(width), dtype=bool)
        slips[self.dynamics.chain.elements.gears] = self.past.acts
        middle = (width > 0.0) & (carrying < SETTINGS.neutral_torque) & ~slips
        x = _solve(np.diag(flanks) + support, torque)
        return np.where(middle, 0.0, x + width * np.sign(x)), middle

    def _minimum(self, x: np.ndarray, middle: np.ndarray) -> np.ndarray | None:
        """Return the minimum of the energy that lies downhill of x; None if there is none.

        Where Newton's method leads to one on the flanks that x is on, there is nothing to descend.
        """
        middle = middle.copy()
        while True:
            minimum = self._balance(self._cross(x, middle), middle)
            if (
                minimum is None
                or not self._is_minimum(minimum, middle)
                or self._changes_flank(x, minimum)
            ):
                bottom = self._cross(self._bottom(x, middle), middle)
                minimum = self._balance(bottom, middle)
            if minimum is None:
                return None
            loaded = middle & (np.abs(self.residual(minimum)) >= SETTINGS.neutral_torque)
            if not loaded.any():
                return minimum
            middle, x = middle & ~loaded, minimum

    def _cross(self, x: np.ndarray, middle: np.ndarray) -> np.ndarray:
        """Return x with the gears that nothing stops inside their backlash on the flank behind it.

        Their elements of hysteresis may stop them there, and a load that falls with the angle.  Those
        that their load drives on carry what they lose across it, twice, so that a rounded flank is steep
        enough there.
        """
        residual, driven = self.residual(x), self._load_slope(x)
        inside = (self.curve.region(x) == 0) & ~middle
        holding = self.past.slope(x) - driven  # by elements of hysteresis and the load [N m/rad]
        leaves = np.abs(residual) > holding * (self._width - np.sign(residual) * x)
        torque = residual + 4.0 * np.sign(residual) * np.maximum(driven, 0.0) * self._width
        return np.where(inside & leaves, self.curve.deflection(torque), x)

    def _is_minimum(self, x: np.ndarray, middle: np.ndarray) -> bool:
        matrix = self._stiffness(x)[np.ix_(~middle, ~middle)]
        return bool(np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min(initial=np.inf) > 0.0)

    def _changes_flank(self, x: np.ndarray, other: np.ndarray) -> bool:
        return not np.array_equal(self.curve.region(x), self.curve.region(other))

    def _bottom(self, x: np.ndarray, middle: np.ndarray) -> np.ndarray:
        """Return where descents from x end, once the moment's torque there is that of the last one."""
        for _ in range(_MOST_MINIMISATIONS):
            before, x = x, self._descend(x, middle)
            if np.abs(x - before).max() < _SAME or not self.acting.wrench[3:].any():
                break
        return x

    def _descend(self, x: np.ndarray, middle: np.ndarray) -> np.ndarray:
        """Return where SciPy's descent from x ends; the moment's torque is that at x."""
        free = np.flatnonzero(~middle)
        unit = 1.0 / np.sqrt(self.curve.flank_slope(np.zeros(len(x))))[free]  # of 1 J^(1/2)
        moment = self._moment_torque(x)

        def at(y: np.ndarray) -> np.ndarray:
            placed = x.copy()
            placed[free] = unit * y
            return placed

        def energy(y: np.ndarray) -> float:
            return self.energy(at(y)) - float(moment @ at(y))

        def gradient(y: np.ndarray) -> np.ndarray:
            here = at(y)
            torque = self.residual(here) - self._moment_torque(here) + moment
            return -unit * torque[free]

        def curvature(y: np.ndarray) -> np.ndarray:
            matrix = self._stiffness(at(y))[np.ix_(free, free)]
            return unit[:, None] * 0.5 * (matrix + matrix.T) * unit

        end = minimize(
            energy,
            x[free] / unit,
            method="trust-exact",
            jac=gradient,
            hess=curvature,
            options=_ENOUGH,
        )
        return at(end.x)

    def _balance(self, x: np.ndarray, middle: np.ndarray) -> np.ndarray | None:
        """Return the rest next to x, by Newton's method with halved steps; None if there is none."""
        free = ~middle
        remaining = np.where(free, self.residual(x), 0.0)
        for _ in range(_MOST_STEPS):
            step = np.zeros_like(x)
            step[free] = _solve(self._stiffness(x)[np.ix_(free, free)], remaining[free])
            before, part = np.linalg.norm(remaining), 1.0
            while part > _SHORTEST:
                remaining = np.where(free, self.residual(x + part * step), 0.0)
                if np.linalg.norm(remaining) < before:
                    break
                part *= 0.5
            if part <= _SHORTEST:  # rounding
                break
            x = x + part * step
            if np.abs(step).max() < SETTINGS.equilibrium_step:
                break
        return x if np.abs(remaining).max() <= self._negligible else None

    def energy(self, x: np.ndarray) -> float:
        """Return E without the moment [J] at angles x [rad], (m,)."""
        chain, acting = self.dynamics.chain, self.acting
        theta, tool = self._theta(x), self._tool(x)
        gap = acting.anchor - tool
        energy = curve_energy(self.curve.torque, self.curve.bend_angles, x) + self.past.energy(x)
        energy += pin.computePotentialEnergy(chain.model, self.dynamics.data, theta)
        energy += chain.balancers.energy(theta) - acting.wrench[:3] @ tool
        energy += 0.5 * gap @ acting.stiffness @ gap
        if acting.contact.holds:
            depth = max(float(acting.contact.depth(gap)), 0.0)
            energy += 0.5 * acting.contact.stiffness * depth**2
        return float(energy)

    def _torque(self, x: np.ndarray) -> np.ndarray:
        """Return the torque that curves and dry friction have to carry [N m], (m,)."""
        return self.dynamics.static_torque(self._theta(x), self.acting)

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Return the torque that is left to balance [N m], (m,)."""
        return self._torque(x) - self.curve.torque(x) - self.past.torque(x)

    def _stiffness(self, x: np.ndarray) -> np.ndarray:
        """Return minus its derivative [N m/rad], (m, m)."""
        gradient = self.dynamics.static_torque_gradient(self._theta(x), self.acting)
        return np.diag(self.curve.slope(x) + self.past.slope(x)) - gradient

    def _moment_torque(self, x: np.ndarray) -> np.ndarray:
        chain = self.dynamics.chain
        if not self.acting.wrench[3:].any():
            return np.zeros(len(x))
        jacobian = tcp_jacobian(chain, self.dynamics.data, self._theta(x))
        return self.acting.wrench[3:] @ jacobian[3:, chain.elastic]

    def _undecided_gears(self, x: np.ndarray) -> np.ndarray:
        """Return the gears on a flank that their load might hold on the other flank, too.

        Those that it drives through backlash, and that carry at most twice what is lost on the way.
        """
        driven = self._load_slope(x)
        on_flank = (self._width > 0.0) & (np.abs(x) > self._width)
        across = 4.0 * self._width * driven
        return np.flatnonzero(on_flank & (driven > 0.0) & (np.abs(self.curve.torque(x)) < across))

    def _load_slope(self, x: np.ndarray) -> np.ndarray:
        """Return how each gear's load grows with its angle [N m/rad], (m,)."""
        return self.curve.slope(x) + self.past.slope(x) - np.diag(self._stiffness(x))

    def preference(self, x: np.ndarray, gear: int) -> float:
        """Return what is less where a gear should rest: distance [m] or torque [N m]; x [rad], (m,)."""
        gap = self.acting.anchor - self._tool(x)
        if self.acting.has_spring:
            return float(np.linalg.norm(gap))
        if self.acting.contact.holds:
            return abs(float(self.acting.contact.depth(gap)))
        return abs(float(self.curve.torque(x)[gear]))

    def _tool(self, x: np.ndarray) -> np.ndarray:
        """Return the TCP's position [m], base axes, (3,)."""
        chain = self.dynamics.chain
        return base_from_tool(chain, self.dynamics.data, self._theta(x)).translation.copy()

    def _theta(self, x: np.ndarray) -> np.ndarray:
        theta = self.rigid.copy()
        theta[self.dynamics.chain.elastic] += x
        return theta

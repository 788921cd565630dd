"""Static equilibrium of the elastic coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.linalg import lapack

from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import EquilibriumError, ParameterError
from elastic_robot.hysteresis import Hysteresis, Past
from elastic_robot.kinematics import base_from_tool
from elastic_robot.plane_contact import NO_CONTACT
from elastic_robot.settings import SETTINGS
from elastic_robot.spring_statics import SpringStatics
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TorqueCurve


def equilibrium(
    dynamics: Dynamics,
    curve: TorqueCurve,
    q: np.ndarray,
    acting: ToolLoad,
    past: Past | None = None,
) -> np.ndarray:
    """Return the elastic coordinates at rest: S(x) + H(x) = J^T w - g.

    Without elements of hysteresis, H = 0, it does not depend on history.  With them, with a spring at
    the TCP or a contact that is touched it is found by `SpringStatics`, and else where branches follow
    each other in a ring: two gears, one in its backlash, that turn each other's torque.

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
        EquilibriumError: If Newton's method finds none, because the robot buckles under the load, or
            one beyond the setting `most_deflection`.
    """
    if dynamics.chain.elastic_count == 0:
        return np.zeros(0)
    sprung = acting.has_spring
    if past is None:
        if dynamics.chain.elements.count:
            raise ParameterError(
                "past: expected where the gears come from, as they have hysteresis, got nothing"
            )
        past = Past.start(Hysteresis(dynamics.chain.elements, np.zeros(len(curve.half_width))))
    with np.errstate(over="ignore", invalid="ignore"):
        rest = _rest(dynamics, curve, q, acting, past)
    if rest is None or not np.abs(rest).max() <= SETTINGS.most_deflection:
        spring = (
            f" and a spring of {np.round(acting.stiffness, 3).tolist()} N/m anchored at"
            f" {np.round(acting.anchor, 6).tolist()} m"
        )
        contact = f" and a contact of {acting.contact.stiffness:.6g} N/m" * acting.contact.holds
        raise EquilibriumError(
            f"no static equilibrium found at q = {np.round(q, 4).tolist()} rad under the wrench"
            f" {np.round(acting.wrench, 3).tolist()} N, N m{sprung * spring}{contact}; the joints"
            " are too soft for this load"
        )
    return rest


def _rest(
    dynamics: Dynamics, curve: TorqueCurve, q: np.ndarray, acting: ToolLoad, past: Past
) -> np.ndarray | None:
    """Return the rest; a contact that is not touched without it changes nothing."""
    apart = replace(acting, contact=NO_CONTACT) if acting.contact.holds else acting
    rest = None if apart.is_sprung or past.acts else _free_rest(dynamics, curve, q, apart)
    if rest is None:
        rest = SpringStatics(dynamics, curve, q, apart, past).rest()
    if apart is acting:
        return rest
    if rest is not None and np.abs(rest).max() <= SETTINGS.most_deflection:
        theta = dynamics.chain.theta(q, rest)
        tcp = base_from_tool(dynamics.chain, dynamics.data, theta).translation
        if not acting.contact.depth(acting.anchor - tcp) > 0.0:
            return rest
    return SpringStatics(dynamics, curve, q, acting, past).rest()


def _free_rest(
    dynamics: Dynamics, curve: TorqueCurve, q: np.ndarray, acting: ToolLoad
) -> np.ndarray | None:
    """Return the rest without spring and hysteresis, (m,); None if Newton's method finds none.

    Newton's method on one branch of the curve per coordinate, started at the deflection under the
    load of the undeflected robot.  A gear with backlash rests on the flank that its load pushes it to;
    loaded by less than `neutral_torque` in the middle of its backlash it stays there; where the load
    changes sign inside the backlash it rests at that place if the robot hangs there in it, and on the
    flank that then carries less torque if it could rest on either.
    """
    chain = dynamics.chain
    rigid = chain.theta(q)
    torque = dynamics.static_torque(rigid, acting)
    switching = np.isfinite(curve.half_width)
    guard = np.where(switching, curve.half_width, -np.inf)
    neutral = switching & (np.abs(torque) < SETTINGS.neutral_torque)
    x = np.where(neutral, 0.0, curve.deflection(torque))
    region = np.where(neutral, 0, curve.region(x))
    bends = bool(curve.bends.any())
    solve, settled, last = None, False, np.inf
    for _ in range(SETTINGS.most_equilibrium_passes):
        branch = curve.in_region(region)
        theta = rigid.copy()
        theta[chain.elastic] += x
        torque = dynamics.static_torque(theta, acting)
        if solve is None:
            softening = dynamics.static_torque_gradient(theta, acting)
            slope = branch.slope(x)
            free = (region == 0) & ~neutral
            if free.any():
                slope = np.where(free, _slope_in_backlash(guard, torque, softening), slope)
            if bends:
                # A piece flatter than the load's gradient s would send Newton's method back, away
                # from the flank that the load drives the gear to.  Where a load t + s x, t >= 0,
                # rests on the flank k (x - B/2)^2 / (2 B) of a rounded backlash, its slope is
                # 2 s at least.
                slope = np.where(curve.bends, np.maximum(slope, 2.0 * softening.diagonal()), slope)
            solve = _solver(slope, softening, neutral)
        step = solve(np.where(neutral, 0.0, torque - branch.torque(x)))
        x = x + step
        largest = np.abs(step).max()
        if not largest < np.pi:
            break
        moved = _moved_regions(guard, region, x, softening, neutral)
        if moved is not region:
            region, solve = moved, None
        elif largest < SETTINGS.equilibrium_step:
            loaded = neutral & (np.abs(torque) >= SETTINGS.neutral_torque)
            if loaded.any():
                neutral = neutral & ~loaded
                x = np.where(loaded, curve.deflection(torque), x)
                region, solve = np.where(loaded, curve.region(x), region), None
                continue
            lighter = _lighter_flanks(guard, region, torque, softening, neutral)
            if settled or lighter is region:
                return x
            region, solve, settled = lighter, None, True
        elif bends or free.any() or largest > SETTINGS.slow_equilibrium * last:
            solve = None
        last = largest
    return None


def _slope_in_backlash(guard: np.ndarray, torque: np.ndarray, softening: np.ndarray) -> np.ndarray:
    """Return slopes that limit the steps of gears inside their backlash.

    There only the load holds a gear, and one that it hardly holds would be sent round the world by
    Newton's method, and the other joints along with it.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        limiting = np.abs(torque) / (SETTINGS.across_backlash * guard) + softening.diagonal()
    return np.maximum(limiting, 0.0)


def _solver(
    slope: np.ndarray, softening: np.ndarray, neutral: np.ndarray
) -> Callable[[np.ndarray], np.ndarray]:
    """Return the map from residual torque to Newton step; neutral coordinates do not move."""
    matrix = np.diag(slope) - softening
    if neutral.any():
        matrix[neutral] = np.eye(len(slope))[neutral]
    factors, pivots, singular = lapack.dgetrf(matrix)
    if singular:
        return lambda residual: np.full_like(residual, np.inf)
    return lambda residual: lapack.dgetrs(factors, pivots, residual)[0]


def _moved_regions(
    guard: np.ndarray,
    region: np.ndarray,
    x: np.ndarray,
    softening: np.ndarray,
    neutral: np.ndarray,
) -> np.ndarray:
    """Return the branches on which the iterate lies; `region` itself if they are the same.

    `guard` is the half width of the backlash, minus infinity for coordinates without.
    """
    inside = region * x < np.where(neutral, -np.inf, guard)
    if not inside.any():
        return region
    # In the backlash only the load acts.  Where it drives the gear away from rest, the gear falls
    # through to the other flank.
    into_backlash = np.where(softening.diagonal() < 0.0, 0, -region)
    moved = np.where(inside & (region != 0), into_backlash, region)
    through_backlash = inside & (region == 0) & (np.abs(x) > guard)
    moved = np.where(through_backlash, np.sign(x).astype(int), moved)
    return region if np.array_equal(moved, region) else moved


def _lighter_flanks(
    guard: np.ndarray,
    region: np.ndarray,
    torque: np.ndarray,
    softening: np.ndarray,
    neutral: np.ndarray,
) -> np.ndarray:
    """Return the branches of the equilibrium with less torque, for gears that could rest on either.

    `region` itself is returned if they are the same.
    """
    if not ((softening.diagonal() > 0.0) & (guard > 0.0)).any():
        return region  # nothing is unstable in its backlash, so there is one flank to rest on
    width = np.where(neutral, 0.0, np.maximum(guard, 0.0))
    across = torque - 2.0 * width * region * softening.diagonal()
    lighter = (region * across < 0.0) & (np.abs(across) < np.abs(torque)) & (width > 0.0)
    return np.where(lighter, -region, region) if lighter.any() else region

"""Wind-up of the gears of a moving robot under the torque that its links need.

The torque T that a gear passes on stretches its spring and its damper,

    d e' + S(e) + H = T(t),   e(0) given,                                                       (1)

the row of a gear in the equation of motion of [Flexible2008], with T = -(M theta'' + h - J^T w) and the
torque H of the elements of its hysteresis.

Without elements the distance of two solutions e_1 > e_2 under one T never grows, for S is continuous and
rises: d (e_1 - e_2)' = -(S(e_1) - S(e_2)) <= 0.  Hence one answer to each start, errors that die out on
a flank and stay as they are in the backlash, and no chatter.  In the backlash e' = T / d: a gear crosses
it, from flank to flank, when the integral of T has grown by 2 B d; where it arrives e'' jumps by
-S' e' / d.  With elements of elongation s_j, k (e_1 - e_2)^2 + sum f_j (s_1j - s_2j)^2 / a_j never
grows, where S is a line.

Gears do not depend on each other: each is followed by itself (`GearLaw.path`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.inverse.gear_elements import NO_ELEMENTS, GearElements
from coupling.inverse.gear_path import GearLaw
from coupling.results.gear_result import BacklashReversal
from elastic_robot.chain import Chain
from elastic_robot.parameters import Parameters
from elastic_robot.torque_curves import TorqueCurve

# Time constant d / k of a gear that is given no damper [s].  Its crossings then
# take sqrt(4 B d / T') under a torque that grows by T' a second: 4 ms at B = 1 mrad, T' = k 25 mrad/s,
# one cycle of a controller; and its wind-up on a flank lags by 0.1 ms, 0.1 urad at 1 mrad/s.
SHORTEST_TIME_CONSTANT = 1e-4

# What an angle may lie inside of the backlash and still be on its edge [rad].
_ON_EDGE = 1e-13


@dataclass(frozen=True)
class WindUp:
    """Motion of the gears.

    Attributes:
        time: Times [s], (n,).
        angle: Wind-up e [rad], (n, gears).
        rate: e' [rad/s], (n, gears).
        reversals: Passages through the backlash, by gear and time; `joint` counts the gears from 1.
    """

    time: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    reversals: tuple[BacklashReversal, ...]


def gears_of(parameters: Parameters, chain: Chain) -> Parameters:
    """Return the parameters of the gears alone, in the order of `chain.torsions`.

    Args:
        parameters: Parameters of all elastic coordinates.
        chain: The robot's chain.
    """
    return rows_of(parameters, chain.torsions)


def rows_of(parameters: Parameters, rows: np.ndarray) -> Parameters:
    """Return the parameters of some elastic coordinates alone, by their numbers, (k,)."""
    return replace(
        parameters,
        stiffness=parameters.stiffness[rows],
        damping=parameters.damping[rows],
        backlash=parameters.backlash[rows],
        hysteresis=parameters.hysteresis[rows],
        tables=tuple(parameters.tables[k] for k in rows),
    )


def damping_in_backlash(curve: TorqueCurve, damping: np.ndarray) -> np.ndarray:
    """Return the damping that `solve_wind_up` uses [N m s/rad], (gears,): that given, if there is any.

    Without a damper nothing says how fast a gear crosses its backlash: such a gear gets one with the
    time constant `SHORTEST_TIME_CONSTANT` on the steepest flank of S.
    """
    steepest = [GearLaw.of(curve, gear).slope.max() for gear in range(len(damping))]
    return np.where(damping > 0.0, damping, SHORTEST_TIME_CONSTANT * np.array(steepest))


def solve_wind_up(
    time: np.ndarray,
    torque: np.ndarray,
    curve: TorqueCurve,
    damping: np.ndarray,
    start: np.ndarray,
    elements: tuple[GearElements, ...] = (),
) -> WindUp:
    """Solve eq. (1) for all gears.

    Args:
        time: Evenly spaced times [s], (n,).
        torque: T of each gear [N m], (n, gears); straight between the times.
        curve: Torque curve S of the gears alone.
        damping: d [N m s/rad], (gears,), >= 0; see `damping_in_backlash` for 0.
        start: e at the first time [rad], (gears,), to which elements came from unloaded.
        elements: Elements of the hysteresis of each gear, (gears,); none: no gear has any.

    Example:
        >>> from elastic_robot.torque_curves import BacklashCurve
        >>> time = np.linspace(0.0, 1.0, 1001)
        >>> curve = BacklashCurve(np.array([1e4]), np.array([1e-3]))
        >>> torque = 20.0 - 40.0 * time[:, None]
        >>> wind_up = solve_wind_up(time, torque, curve, np.array([5.0]), np.array([3e-3]))
        >>> [(round(c.begins, 3), round(c.ends, 3), c.after) for c in wind_up.reversals]
        [(0.5, 0.522, -1)]
    """
    spacing = float((time[-1] - time[0]) / (len(time) - 1))
    used, reversals = damping_in_backlash(curve, damping), list[BacklashReversal]()
    angle, rate = np.empty((2, *torque.shape))
    for gear in range(torque.shape[1]):
        spring, own = GearLaw.of(curve, gear), elements[gear] if elements else NO_ELEMENTS
        path = spring.path(spacing, torque[:, gear], float(used[gear]), float(start[gear]), own)
        angle[:, gear], rate[:, gear] = path
        reversals += _reversals(gear + 1, time, path[0], spring.backlash)
    return WindUp(time, angle, rate, tuple(reversals))


def _reversals(
    joint: int, time: np.ndarray, angle: np.ndarray, backlash: tuple[float, float]
) -> list[BacklashReversal]:
    """Return the passages of a gear's angle (n,) between the ends of its backlash."""
    low, high = backlash
    if low == high:
        return []
    side = np.select([angle > high - _ON_EDGE, angle < low + _ON_EDGE], [1, -1])
    reversals, begins, before = [], float(time[0]), 0

    def passage(begins: float, ends: float, before: int, after: int) -> BacklashReversal:
        return BacklashReversal(joint=joint, begins=begins, ends=ends, before=before, after=after)

    for k in np.flatnonzero(np.diff(side)).tolist():
        here, then = int(side[k]), int(side[k + 1])

        def edge(flank: int, k: int = k) -> float:
            """Return when it is at the end of the backlash on the side of a flank."""
            at = high if flank > 0 else low
            share = (at - angle[k]) / (angle[k + 1] - angle[k])
            return float(time[k] + np.clip(share, 0.0, 1.0) * (time[k + 1] - time[k]))

        if here != 0:
            begins, before = edge(here), here
        if then != 0:
            reversals.append(passage(begins, edge(then), before, then))
    if side[-1] == 0:
        reversals.append(passage(begins, float(time[-1]), before, 0))
    return reversals

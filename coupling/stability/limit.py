"""The limiting depth of a cut: the first border of stability from below."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from coupling.stability.floquet import NEUTRAL, growth_of
from coupling.stability.steady_cut import SteadyCut
from coupling.stability.structure import Structure
from coupling.stability.zero_order import ZeroOrder

# The search begins at this part of what zero order has, which is up to 20 times too much where
# vibrations flip; steps far below it are wide, near it and beyond it narrow.
_START, _NEAR, _WIDE, _NARROW = 1.0 / 30.0, 0.4, 1.6, 1.2
# The border lies this close [1].
_CLOSE = 1e-3
# Depths that are less are none [m].
_NONE = 1e-8
# Steps of depth beyond the limit in which stable depths are looked for.
_STEP = 1.05


def first_border(
    structure: Structure, cut: SteadyCut, deepest: float, quick: ZeroOrder | None = None
) -> float:
    """Return the depth at which a cut, made deeper, becomes unstable first [m].

    Depths beyond it may be stable again (`stable_islands`); what lies within a step is not seen, but
    for the depth of the cut itself.

    Args:
        structure: Modes of robot and tool.
        cut: The cut.
        deepest: Depth up to which it is looked for [m].
        quick: The same by zero order; None: it is computed.

    Returns:
        The depth, infinite where the cut is stable up to the deepest one, and 0 where it never is.
    """
    quick = quick or ZeroOrder.of(structure, cut)
    expected = quick.limit(cut.cutter.tooth_period)
    low = max(_START * min(expected, deepest), _NONE)

    def growth(depth: float) -> float:
        return growth_of(structure, cut.at_depth(depth)) - NEUTRAL

    while growth(low) >= 0.0:
        low /= _WIDE**3
        if low < _NONE:
            return 0.0
    while low < deepest:
        high = min(low * (_WIDE if low < _NEAR * expected else _NARROW), deepest)
        if low < cut.depth < high:
            high = cut.depth
        if growth(high) >= 0.0:
            return float(brentq(growth, low, high, xtol=_CLOSE * low, rtol=_CLOSE))
        low = high
    return np.inf


def stable_islands(
    structure: Structure,
    cut: SteadyCut,
    limit: float,
    deepest: float,
    report: Callable[[int, int], None] = lambda completed, total: None,
) -> list[tuple[float, float]]:
    """Return depths beyond a limit at which a cut is stable again, from and to [m].

    Args:
        structure: Modes of robot and tool.
        cut: The cut, whose depth does not count.
        limit: Its first border from below [m]; infinite or 0 where there is none.
        deepest: Depth up to which they are looked for [m].
        report: Called with the number of depths that are looked at, and of all.
    """
    if not 0.0 < limit < deepest:
        return []

    def growth(depth: float) -> float:
        return growth_of(structure, cut.at_depth(depth)) - NEUTRAL

    # The border itself is as close to 0 as it was looked for.
    count = max(int(np.log(deepest / limit) / np.log(_STEP)), 2)
    depths = np.geomspace(limit * (1.0 + 5.0 * _CLOSE), deepest, count).tolist()
    growths = []
    for number, depth in enumerate(depths):
        report(number, count)
        growths.append(growth(depth))
    islands, begin = [], None
    for low, high, before, behind in zip(depths, depths[1:], growths, growths[1:], strict=False):
        if (before < 0.0) == (behind < 0.0):
            continue
        border = float(brentq(growth, low, high, xtol=_CLOSE * low, rtol=_CLOSE))
        if behind < 0.0:
            begin = border
        elif begin is not None:
            islands.append((begin, border))
            begin = None
    return islands if begin is None else [*islands, (begin, deepest)]

"""Simulations side by side: each FMU with a share of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np

from coupling.robot.robot_fmu import RobotFmu

T = TypeVar("T")


def side_by_side(
    fmus: Sequence[RobotFmu],
    points: Sequence[np.ndarray],
    work: Callable[[RobotFmu, np.ndarray], T],
) -> list[T]:
    """Return what work makes of every point, in their order.

    Args:
        fmus: What simulates; none is asked for two things at a time.
        points: What to work on.
        work: What an FMU makes of a point.
    """
    count = len(fmus)

    def share(number: int) -> list[T]:
        return [work(fmus[number], point) for point in points[number::count]]

    with ThreadPoolExecutor(count) as pool:
        shares = list(pool.map(share, range(count)))
    return [shares[k % count][k // count] for k in range(len(points))]

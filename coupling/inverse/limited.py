"""Commands within the limits of a drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class DriveLimits:
    joint: int
    lower: float = -np.inf
    upper: float = np.inf
    rate: float = np.inf
    acceleration: float = np.inf


def keep_within(fit, rows, limits, coefficients, misses):
    return coefficients, misses

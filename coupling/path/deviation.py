"""Deviations of actual tool paths from the desired ones, of cells, and under a periodic process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from coupling.path.frame import lengths
from coupling.path.histories import ToolPath

# Half a period more or less by this part of it ends at the same sample.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Deviation:
    """Figures of a deviation along a path [m].

    Attributes:
        maximum, rms: Largest and rms distance between actual and desired TCP at equal times; the mean is
            one over time.
        normal_maximum: Largest deviation across the direction of travel.
        tangential_maximum: Largest deviation along it: the tool is early or late.
        time_of_maximum: Time of it [s].
        maximum_less_constant, rms_less_constant: The same distances once the mean deviation over time, a
            vector in the axes of the path, is taken off: what a shift of the part or of the path leaves;
            NaN in a run of an earlier version.
        largest_turn: Largest angle between actual and desired orientation of the tool [rad]; 0 in a run
            of an earlier version, and where it is not given.
    """

    maximum: float
    rms: float
    normal_maximum: float
    tangential_maximum: float
    time_of_maximum: float
    maximum_less_constant: float = np.nan
    rms_less_constant: float = np.nan
    largest_turn: float = 0.0


def measure(actual: ToolPath, desired: ToolPath) -> Deviation:
    """Return the deviation of an actual path from the desired one: the worst figures of the tools."""
    return worst_of(measure_tools(actual, desired))


def measure_tools(actual: ToolPath, desired: ToolPath) -> tuple[Deviation, ...]:
    """Return the deviation of every tool's actual path from its desired one."""
    differences = actual.deviation_from(desired)
    return tuple(
        _of_tool(
            desired.time,
            difference[:, :3],
            directions,
            float(lengths(difference[:, 3:]).max()),
        )
        for difference, directions in zip(differences, desired.directions, strict=True)
    )


def worst_of(tools: Sequence[Deviation]) -> Deviation:
    """Return the largest of each figure of several tools, and the time of the largest deviation."""
    worst = max(tools, key=lambda figure: figure.maximum)
    largest = {name: max(getattr(figure, name) for figure in tools) for name in asdict(worst)}
    return replace(worst, **largest | {"time_of_maximum": worst.time_of_maximum})


def _of_tool(
    time: np.ndarray, difference: np.ndarray, directions: np.ndarray, turn: float
) -> Deviation:
    distance = lengths(difference)
    along = np.einsum("ij,ij->i", difference, directions)
    varying = lengths(less_constant(time, difference))
    across = np.sqrt(np.maximum(distance**2 - along**2, 0.0))
    return Deviation(
        maximum=float(distance.max()),
        rms=root_mean_square(time, distance),
        normal_maximum=float(across.max()),
        tangential_maximum=float(np.abs(along).max()),
        time_of_maximum=float(time[distance.argmax()]),
        maximum_less_constant=float(varying.max()),
        rms_less_constant=root_mean_square(time, varying),
        largest_turn=turn,
    )


def shares_of_time(time: np.ndarray) -> np.ndarray:
    """Return the weights of samples in a mean over time, by the trapezoidal rule, (n,); their sum is 1.

    Args:
        time: Rising, at any distances [s], (n,).

    Example:
        >>> shares_of_time(np.array([0.0, 1.0, 4.0]))
        array([0.125, 0.5  , 0.375])
    """
    if len(time) < 2:
        return np.ones(len(time))
    ends = np.pad(np.diff(time), 1)
    shares: np.ndarray = 0.5 * (ends[:-1] + ends[1:]) / (time[-1] - time[0])
    return shares


def less_constant(time: np.ndarray, difference: np.ndarray) -> np.ndarray:
    """Return deviations less their mean over time.

    Args:
        time: Rising times [s], (n,).
        difference: Differences, any unit, (n, k).

    Example:
        >>> less_constant(np.array([0.0, 1.0, 4.0]), np.array([[0.0], [0.0], [8.0]])).ravel()
        array([-3., -3.,  5.])
    """
    varying: np.ndarray = difference - shares_of_time(time) @ difference
    return varying


def root_mean_square(time: np.ndarray, distance: np.ndarray) -> float:
    """Return the root of the mean square over time.

    Args:
        time: Rising times [s], (n,).
        distance: Distances, any unit, (n,).
    """
    return float(np.sqrt(shares_of_time(time) @ distance**2))


@dataclass(frozen=True)
class ToolGap:
    """Gap between the surfaces of forming and supporting tool, across the sheet, over time.

    Attributes:
        time: Times [s], (n,).
        commanded: Gap that the command asks for [m].
        before, after: Widening of the gap, before and after compensation [m], (n,).
    """

    time: np.ndarray
    commanded: float
    before: np.ndarray
    after: np.ndarray


@dataclass(frozen=True)
class DeviationParts:
    """Parts of a deviation along a path.

    Attributes:
        slow: Its mean over a tooth period around each time [m], (n,) or (n, 3).
        ripple: Deviation less its slow part [m], shape of `slow`.
        lowest, highest: Its extremes within that period [m], shape of `slow`: where the walls and the
            floor of a cut lie at most, as an edge may be there when the tool is farthest off.
    """

    slow: np.ndarray
    ripple: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray

    @property
    def largest_slow(self) -> float:
        """Largest size of the slow part [m]."""
        return float(np.linalg.norm(self.slow, axis=-1).max())

    @property
    def largest_ripple(self) -> float:
        """Largest size of the ripple [m]."""
        return float(np.linalg.norm(self.ripple, axis=-1).max())

    @classmethod
    def of(cls, time: np.ndarray, deviation: np.ndarray, period: float) -> DeviationParts:
        """Return the parts of a deviation.

        Args:
            time: Rising [s], (n,).
            deviation: [m], (n,) or (n, 3); straight between the times, constant beyond them.
            period: Period of the teeth [s].

        Example:
            >>> time = np.linspace(0.0, 1.0, 101)
            >>> parts = DeviationParts.of(time, 5.0 + np.sin(20.0 * np.pi * time), 0.1)
            >>> [round(float(v[50]), 6) for v in (parts.slow, parts.lowest)]
            [5.0, 4.048943]
        """
        half = 0.5 * period
        # A point of constant values far beyond either end stands for all of them.
        instants = np.concatenate([[time[0] - period], time, [time[-1] + period]])
        values = np.concatenate([deviation[:1], deviation, deviation[-1:]])
        integral = make_interp_spline(instants, values, k=1).antiderivative()
        slow = (integral(time + half) - integral(time - half)) / period
        within = half * (1.0 + _ROUNDING)
        first = np.searchsorted(time, time - within)
        last = np.searchsorted(time, time + within, side="right")
        rows = np.column_stack([first, last]).ravel()  # every other piece is that within a period
        padded = np.concatenate([deviation, deviation[-1:]])
        lowest, highest = (take.reduceat(padded, rows)[::2] for take in (np.minimum, np.maximum))
        return cls(slow, deviation - slow, lowest, highest)

"""Forces measured in full slots at several feeds: means, and amplitudes of harmonics of a revolution."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.errors import IdentifyError
from coupling.files.measured_table import MeasuredTable

_FEED, _AXES = "feed_mm_min", "xyz"
_MEANS = tuple(f"mean_{axis}" for axis in _AXES)
_AMPLITUDE = re.compile(r"amplitude_([\d.]+)Hz_x$")
# A frequency is a harmonic of the spindle's if it is one to so much of it.
_HARMONIC = 0.02


def is_cutting(path: Path) -> bool:
    """Return whether a file's columns are those of measured cuts."""
    header = MeasuredTable.read(path, IdentifyError).header
    return _FEED in header and _MEANS[0] in header


@dataclass(frozen=True)
class SlotCutter:
    """Cutter and cut of the slots.

    Attributes:
        diameter: Diameter of the cutter [m].
        teeth: Number, evenly spaced.
        helix: Angle of the edges from the axis [rad].
        rpm: Speed of the spindle [1/min].
        depth: Axial depth [m].

    Raises:
        IdentifyError: If one of them is no length, angle, speed or number of teeth.
    """

    diameter: float
    teeth: int
    helix: float
    rpm: float
    depth: float

    def chip(self, feed: np.ndarray) -> np.ndarray:
        """Return the feeds per tooth [m] at feeds [m/s], (n,)."""
        chip: np.ndarray = feed * 60.0 / (self.rpm * self.teeth)
        return chip

    def __post_init__(self) -> None:
        for name, value, high in (
            ("--diameter-mm", 1e3 * self.diameter, 500.0),
            ("--depth-mm", 1e3 * self.depth, 500.0),
            ("--rpm", self.rpm, 1e6),
            ("--teeth", float(self.teeth), 100.0),
        ):
            if not 0.0 < value <= high:
                raise IdentifyError(f"{name}: expected a number up to {high:g}, got {value:g}")
        if not 0.0 <= self.helix < np.deg2rad(80.0):
            raise IdentifyError(
                f"--helix-deg: expected 0 to 80 deg, got {np.rad2deg(self.helix):.4g}"
            )


@dataclass(frozen=True)
class MeasuredSlots:
    """Forces measured in slots, by feed.

    Attributes:
        feed: Feeds [m/s], rising, (n,).
        mean: Mean forces across the feed, along it, axial; the first rises with the feed [N], (n, 3).
        once, passing: Amplitudes at the spindle's frequency and at that of the teeth, alike [N], (n, 3).
        axes: Columns that these axes are, with their signs, such as "+x", (3,).
    """

    feed: np.ndarray
    mean: np.ndarray
    once: np.ndarray
    passing: np.ndarray
    axes: tuple[str, str, str]

    @classmethod
    def read(cls, path: Path, cutter: SlotCutter) -> MeasuredSlots:
        """Read a table of slots.

        Raises:
            IdentifyError: With file, column, what was expected and what was got.
        """
        table = MeasuredTable.read(path, IdentifyError)
        frequency = cutter.rpm / 60.0
        stem_by_frequency = {
            float(match[1]): name[:-2] for name in table.header if (match := _AMPLITUDE.match(name))
        }
        stems = []
        for harmonic in dict.fromkeys((1, cutter.teeth)):
            wished = harmonic * frequency
            near = [f for f in stem_by_frequency if abs(f - wished) <= _HARMONIC * wished]
            if not near:
                raise IdentifyError(
                    f"{path}: expected columns amplitude_{wished:g}Hz_x, _y, _z, the"
                    f" {'teeth' if harmonic > 1 else 'spindle'}'s frequency at {cutter.rpm:g} 1/min, got"
                    f" {', '.join(f'{f:g} Hz' for f in sorted(stem_by_frequency)) or 'none'}: look at"
                    " --rpm and --teeth"
                )
            stems.append(stem_by_frequency[near[0]])
        names = [_FEED, *_MEANS, *(f"{stem}_{axis}" for stem in stems for axis in _AXES)]
        table.require(names)
        rows = table.of(names)
        rows = rows[np.argsort(rows[:, 0])]
        feed = rows[:, 0]
        if len(np.unique(feed)) < 3 or len(np.unique(feed)) < len(feed) or not feed[0] > 0.0:
            raise IdentifyError(
                f"{path}: {_FEED}: expected three feeds above 0 at least, each once, got"
                f" {', '.join(f'{value:g}' for value in feed)}"
            )
        mean = rows[:, 1:4]
        once = rows[:, 4:7]
        passing = rows[:, -3:]
        if np.any(rows[:, 4:] < 0.0):
            raise IdentifyError(
                f"{path}: expected amplitudes that are not negative, got one that is"
            )
        # Across the feed the mean rises most: K_tc is the largest coefficient.
        rise = np.abs(np.polyfit(feed, mean, 1)[0])
        order = [0, 1, 2] if rise[0] >= rise[1] else [1, 0, 2]
        wished_sign = np.array([1.0, -1.0, 1.0])
        sign = wished_sign * np.sign(mean[-1, order])
        axes = tuple(f"{'+' if s > 0 else '-'}{_AXES[k]}" for s, k in zip(sign, order, strict=True))
        return cls(
            feed / 6e4,
            sign * mean[:, order],
            once[:, order],
            passing[:, order],
            (axes[0], axes[1], axes[2]),
        )

    def only(self, rows: list[int]) -> MeasuredSlots:
        """Return the slots of these numbers."""
        return MeasuredSlots(
            self.feed[rows], self.mean[rows], self.once[rows], self.passing[rows], self.axes
        )

"""What a mill does along its desired path: chips, removal, torque and power, beside the spindle's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.process.cutting_force import Engagement, mean_wrench
from coupling.process.milling_force import Milling

# A tool slower than this does not feed [m/s].
_STANDING = 1e-6


@dataclass(frozen=True)
class CutCourse:
    """Figures of a cut at n times of its desired path, zero where nothing is cut.

    Attributes:
        time: Times [s], (n,).
        feed_per_tooth: Way of the tool from tooth to tooth [m], (n,).
        mean_chip, peak_chip: Mean and largest thickness of the chips over the engaged arcs [m], (n,).
        width: Radial width [m], (n,).
        depth: Largest axial depth [m], (n,).
        removal_rate: Volume removed by time, by edges and end [m^3/s], (n,).
        end_rate: The share of the end of the cutter, what stands on material, times the descent
            [m^3/s], (n,).
        force: Force of the edges on its side, the mean over a turn [N], (n,).
        thrust: Force that presses the tool upwards if edges on its end reach its middle [N], (n,).
        torque: Torque of the spindle, the mean over a turn [N m], (n,).
        speed: Speed of the spindle [rad/s].
        cutting_speed: Speed of the edges [m/s].
    """

    time: np.ndarray
    feed_per_tooth: np.ndarray
    mean_chip: np.ndarray
    peak_chip: np.ndarray
    width: np.ndarray
    depth: np.ndarray
    removal_rate: np.ndarray
    end_rate: np.ndarray
    force: np.ndarray
    thrust: np.ndarray
    torque: np.ndarray
    speed: float
    cutting_speed: float

    @classmethod
    def of(cls, milling: Milling) -> CutCourse:
        """Return the course of a cut."""
        cutter, time = milling.cutter, milling.desired.time
        rate = np.linalg.norm(np.gradient(milling.tips[:, :2], time, axis=0), axis=1)
        arcs = milling.engaged.at(time)
        feeds = (arcs.is_cut & (rate > _STANDING)[:, None]).any(axis=1)
        cut = arcs.is_cut & feeds[:, None]
        feed = np.where(feeds, rate * cutter.tooth_period, 0.0)
        across = (np.cos(arcs.start) - np.cos(arcs.end)) * cut
        angle = np.where(cut, arcs.end - arcs.start, 0.0).sum(axis=1)
        holds_middle = (arcs.start < 0.5 * np.pi) & (0.5 * np.pi < arcs.end)
        largest = np.where(holds_middle, 1.0, np.maximum(np.sin(arcs.start), np.sin(arcs.end)))
        wrench = np.zeros((len(time), 6))
        for arc in range(arcs.start.shape[1]):
            rows = np.flatnonzero(cut[:, arc])
            engagement = Engagement(
                np.column_stack([feed[rows], np.zeros(len(rows))]),
                *(table[rows, arc] for table in (arcs.start, arcs.end, arcs.depth)),
            )
            wrench[rows] += mean_wrench(cutter, milling.coefficients, engagement)
        torque = wrench[:, 5]
        if milling.end_edge:
            torque = torque + milling.end_wrench(time, milling.end_edge)[:, 5]
        section = cutter.radius * np.sum(across * arcs.depth, axis=1)
        end_area = np.pi * cutter.radius**2 * milling.engaged.end_share(time)
        end_rate = end_area * milling.descent(time) / cutter.tooth_period
        return cls(
            time,
            feed,
            feed * across.sum(axis=1) / np.maximum(angle, 1e-12),
            feed * np.max(largest * cut, axis=1),
            cutter.radius * across.sum(axis=1),
            np.max(arcs.depth * cut, axis=1),
            section * rate + end_rate,
            end_rate,
            np.linalg.norm(wrench[:, :3], axis=1),
            milling.end_wrench(time, cutter.radius)[:, 2],
            torque,
            cutter.speed,
            cutter.radius * cutter.speed,
        )

    @property
    def cuts(self) -> np.ndarray:
        """Mask of the times at which the tool cuts and feeds, (n,)."""
        mask: np.ndarray = self.feed_per_tooth > 0.0
        return mask

    @property
    def power(self) -> np.ndarray:
        """Power of the spindle in the cut, the mean over a turn [W], (n,)."""
        power: np.ndarray = self.torque * self.speed
        return power

"""The judge: robot and cut marched in time, edges that leave the cut and surfaces they leave behind.

Every edge cuts what all passes before have left at its angle: its chip is how far it reaches beyond
that, and where it does not reach it there is none, and no force. The modes go exactly from step to step,
under a force that goes on straight. Whether a vibration chatters is told by its growth from tooth to
tooth, not by its size: slow growth takes seconds to be seen.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coupling.errors import StabilityError
from coupling.process.cutting_force import wrench_of_edge
from coupling.stability.steady_cut import SteadyCut
from coupling.stability.structure import Structure

# Steps in a tooth period at least, and in a period of the fastest mode.
_STEPS, _PER_WAVE = 60, 24
# Teeth at least, and steps at most: some ten minutes.
_FEWEST, _MOST = 48, 20_000_000
# Below this an exponent's functions are their series.
_SMALL = 1e-4
# A change as large as this part of the feed per tooth is no longer a small one; what it is at first.
_LARGE, _FIRST = 0.2, 1e-3
# What has decayed to this part of its size is rounding.
_ROUNDING = 1e-9
# An edge rubs until it is this part of the feed per tooth above the surface, where chips end at nothing.
_RUBS = 0.05
# Parts of the time whose highest changes tell the growth.
_BLOCKS = 24


@dataclass(frozen=True)
class Marched:
    """Motion of the tool's tip in a cut.

    Attributes:
        time: Times of the teeth [s], (n,).
        displacement: Displacement of the tip at these times, along the feed and to its left [m], (n, 2).
        change: Largest change of the displacement from tooth to tooth [m], (n,).
        out_of_cut: Share of the time of each tooth in which an edge in the arc cuts nothing [1], (n,).
        feed_per_tooth: Way of the tool from tooth to tooth [m].
    """

    time: np.ndarray
    displacement: np.ndarray
    change: np.ndarray
    out_of_cut: np.ndarray
    feed_per_tooth: float

    @property
    def growth(self) -> float:
        """Growth of the change from tooth to tooth [1/s], of its later half while it is small."""
        large = np.flatnonzero(self.change > _LARGE * self.feed_per_tooth)
        gone = np.flatnonzero(self.change < _ROUNDING * self.change.max())
        end = max(min([len(self.time), *large[:1].tolist(), *gone[:1].tolist()]), 2)
        blocks = np.array_split(np.arange(end), min(_BLOCKS, end))
        highest = np.array([self.change[rows].max() for rows in blocks])
        middle = np.array([self.time[rows].mean() for rows in blocks])
        half = len(blocks) // 2 if len(blocks) > 4 else 0
        level = np.log(np.maximum(highest, np.finfo(float).tiny))
        return float(np.polyfit(middle[half:], level[half:], 1)[0])

    @property
    def is_stable(self) -> bool:
        """Whether the change from tooth to tooth decays."""
        return self.growth < 0.0


def march(
    structure: Structure,
    cut: SteadyCut,
    feed_per_tooth: float,
    seconds: float,
    refined: float = 1.0,
    report: Callable[[int, int], None] = lambda completed, total: None,
) -> Marched:
    """March a cut in time from the forced vibration of its teeth, a little disturbed.

    Args:
        structure: Modes of robot and tool.
        cut: The cut, with even pitch and without process damping.
        feed_per_tooth: Way of the tool from tooth to tooth [m].
        seconds: Time to march [s].
        refined: Factor of the number of steps.
        report: Called with the number of teeth that have passed, and of all.

    Raises:
        StabilityError: If its pitch varies, its flanks damp, or it takes too many steps.
    """
    if cut.pitch is not None or cut.damping is not None:
        raise StabilityError(
            "marching in time: expected even pitch and no process damping: leave out pitch_deg and"
            " process_damping in [stability]"
        )
    cutter, period = cut.cutter, cut.period
    waves = structure.fastest * period / (2.0 * np.pi)
    steps = int(np.ceil(refined * max(_STEPS, _PER_WAVE * waves)))
    table = _EdgeTable.of(cut, steps)
    step = period / steps
    z = structure.eigenvalue * step
    advance = np.exp(z)
    by_force = step * _phi1(z)[:, None] * structure.driving
    by_change = step * _phi2(z)[:, None] * structure.driving
    output = structure.displacement
    teeth = max(int(np.ceil(seconds / period)), _FEWEST)
    if teeth * steps > _MOST:
        raise StabilityError(
            f"marching in time: expected at most {_MOST} steps, got {teeth * steps}: march for"
            f" {seconds * _MOST / (teeth * steps):.2g} s"
        )
    tooth_steps = np.arange(cutter.teeth)[:, None] * steps - table.behind[None]
    bins, speed = cutter.teeth * steps, feed_per_tooth / period
    slices = np.broadcast_to(np.arange(len(table.behind)), tooth_steps.shape)

    rubbing = -_RUBS * feed_per_tooth

    def force_of(place: np.ndarray, chip: np.ndarray) -> np.ndarray:
        by_chip = table.by_chip[place, slices] * np.maximum(chip, 0.0)[..., None]
        by_edge = table.by_edge[place, slices] * (chip > rubbing)[..., None]
        total: np.ndarray = np.sum(by_chip + by_edge, axis=(0, 1))
        return total

    # Forced by the teeth alone, as if each left what it cuts without a vibration.
    places = [(k + tooth_steps) % bins for k in range(steps)]
    forced = np.array([force_of(at, feed_per_tooth * table.sin[at]) for at in places])
    changes = forced - np.roll(forced, 1, axis=0)
    driven = forced @ by_force.T + changes @ by_change.T
    state = np.zeros(len(z), dtype=complex)
    for drive in driven:
        state = advance * state + drive
    turn = np.exp(z * steps)
    state = np.where(turn != 1.0, state / np.where(turn != 1.0, 1.0 - turn, 1.0), 0.0)
    before = np.zeros((steps, 2))
    for k, drive in enumerate(driven):
        before[k] = (output @ state).real
        state = advance * state + drive
    surface = table.surface(before, feed_per_tooth)
    size = np.max(np.abs(before)) + feed_per_tooth
    state = state * (1.0 + _FIRST * feed_per_tooth / size)
    last = forced[-1]
    shown, change, out = np.zeros((teeth, 2)), np.zeros(teeth), np.zeros(teeth)
    for tooth in range(teeth):
        report(tooth, teeth)
        missed = engaged = 0
        for k in range(steps):
            number = tooth * steps + k
            place = (number + tooth_steps) % bins
            tip = (output @ state).real
            across = tip[0] + speed * number * step
            reach = across * table.sin[place] + tip[1] * table.cos[place]
            chip = reach - surface[place, slices]
            cuts = chip > 0.0
            surface[place, slices] += np.where(cuts, chip, 0.0)
            force = force_of(place, chip)
            is_in_arc = table.is_in_arc[place, slices]
            engaged += int(is_in_arc.sum())
            missed += int((is_in_arc & ~cuts).sum())
            state = advance * state + by_force @ force + by_change @ (force - last)
            last = force
            difference = tip - before[k]
            change[tooth] = max(change[tooth], float(np.hypot(difference[0], difference[1])))
            before[k] = tip
            if k == 0:
                shown[tooth] = tip
        out[tooth] = missed / max(engaged, 1)
    time = period * np.arange(teeth)
    return Marched(time[1:], shown[1:], change[1:], out[1:], feed_per_tooth)


def _phi1(z: np.ndarray) -> np.ndarray:
    """Return (exp(z) - 1) / z [1], shape of `z`."""
    safe = np.where(np.abs(z) < _SMALL, 1.0, z)
    return np.where(np.abs(z) < _SMALL, 1.0 + z / 2.0 + z**2 / 6.0, np.expm1(safe) / safe)


def _phi2(z: np.ndarray) -> np.ndarray:
    """Return (exp(z) - 1 - z) / z^2 [1], shape of `z`."""
    safe = np.where(np.abs(z) < _SMALL, 1.0, z)
    series = 0.5 + z / 6.0 + z**2 / 24.0
    return np.where(np.abs(z) < _SMALL, series, (np.expm1(safe) - safe) / safe**2)


@dataclass(frozen=True)
class _EdgeTable:
    """Edges in slices, at angles that are steps apart.

    Attributes:
        behind: Steps by which the edge of each slice lags behind the tip, (slices,).
        sin, cos: Sines and cosines of the angles, (angles,).
        by_chip, by_edge: Wrench of a slice by chip [N/m, N] and without [N, N m], (angles, slices, 6).
        is_in_arc: Mask of what is engaged, (angles, slices).
    """

    behind: np.ndarray
    sin: np.ndarray
    cos: np.ndarray
    by_chip: np.ndarray
    by_edge: np.ndarray
    is_in_arc: np.ndarray

    @classmethod
    def of(cls, cut: SteadyCut, steps: int) -> _EdgeTable:
        count = cut.cutter.teeth * steps
        apart = 2.0 * np.pi / count
        angle = apart * np.arange(count)
        # Slices lag by a step each; the middle of the lowest is at the first angle.
        slices = max(1, int(np.ceil(cut.cutter.lag * cut.depth / apart)))
        step = cut.depth if slices == 1 else apart / cut.cutter.lag
        edges = np.minimum(step * np.arange(slices + 1), cut.depth)
        height, thick = 0.5 * (edges[:-1] + edges[1:]), np.diff(edges)
        share = np.zeros((count, slices))
        for start, end, depth in cut.arcs:
            # The part of a step's angle that is within the arc.
            inside = np.minimum(angle + 0.5 * apart, end) - np.maximum(angle - 0.5 * apart, start)
            inside = np.clip(inside / apart, 0.0, 1.0)
            # The first angle reaches to either side of a whole turn.
            inside[0] = max(inside[0], np.clip((0.5 * apart - start) / apart, 0.0, 0.5))
            share += inside[:, None] * np.clip(depth - edges[:-1], 0.0, thick)
        K = cut.coefficients
        phi, at = np.broadcast_arrays(angle[:, None], height)
        radius = cut.cutter.radius
        return cls(
            np.arange(slices),
            np.sin(angle),
            np.cos(angle),
            share[..., None] * wrench_of_edge(radius, (K.K_tc, K.K_rc, K.K_ac), phi, at),
            share[..., None] * wrench_of_edge(radius, (K.K_te, K.K_re, K.K_ae), phi, at),
            share > 0.5 * thick,
        )

    def surface(self, before: np.ndarray, feed_per_tooth: float) -> np.ndarray:
        """Return how far the pass before the first one reached [m], (angles, slices).

        Args:
            before: Displacements at the steps of a tooth period [m], (steps, 2).
            feed_per_tooth: Way of the tool from tooth to tooth [m].
        """
        steps = len(before)
        step = (np.arange(len(self.sin))[:, None] + self.behind) % steps
        along = before[step, 0] + feed_per_tooth * (step / steps - 1.0)
        reach: np.ndarray = along * self.sin[:, None] + before[step, 1] * self.cos[:, None]
        return reach

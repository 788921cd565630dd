"""A steady cut as what drives chatter: the wrench by a displacement of the tool, tooth after tooth.

    w(t) = sum of G(t) (u(t) - u(t - tau)) + D(t) u'(t)

over the teeth: an edge cuts what the one before has left, a delay tau ago (regeneration) [Altintas1995],
[Insperger2004], and its flank is pressed into the waves that it cuts (process damping) [Chiou1998].
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from coupling.process.cutting_force import Cutter, CuttingCoefficients, wrench_of_edge

# Gauss points along the engaged part of an edge, as of the force itself.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
# A piece of a revolution shorter than this part of a turn is none [rad].
_NOTHING = 1e-9


@dataclass(frozen=True)
class ProcessDamping:
    """Force of a worn flank on the waves of a surface, small against them.

    The flank's land indents the volume b l^2 r' / (2 v) of a surface that falls away with the rate
    r' at the cutting speed v; the contact answers it with a force, and with friction along the cut
    [Chiou1998], [Ahmadi2011].

    Attributes:
        indentation: Indentation force coefficient K_sp [N/m^3]; 1.5e14 for steel, 4e13 for aluminium.
        wear_land: Length of the land l [m]; some 0.05 to 0.1 mm of a sharp edge.
        friction: Coefficient of friction [1].
    """

    indentation: float
    wear_land: float
    friction: float = 0.3

    def per_depth(self, cutting_speed: float) -> float:
        """Return the radial damping by axial depth [N s/m^2] at a cutting speed [m/s]."""
        return 0.5 * self.indentation * self.wear_land**2 / cutting_speed


@dataclass(frozen=True)
class Channel:
    """Part of the cut's force: a gain times what the tool does, within one period.

    Attributes:
        delay: Delay tau [s] of a tooth that cuts what another has left; None for a force by the rate.
        pieces: Beginnings and ends of the times within which teeth are in the cut and the gain is
            smooth [s], (p, 2), within 0 and the period.
        tips: Angles of the tips of the teeth at time 0 [rad], (teeth,).
    """

    delay: float | None
    pieces: np.ndarray
    tips: np.ndarray


@dataclass(frozen=True)
class ShallowArc:
    """An arc of a cut besides its deepest one.

    Attributes:
        start, end: Engaged angles phi, within 0 and pi [rad].
        share: Its depth in that of the cut [1].
    """

    start: float
    end: float
    share: float


@dataclass(frozen=True)
class SteadyCut:
    """A cut in steady feed.

    Attributes:
        cutter: The tool.
        coefficients: Cutting coefficients of the material.
        start, end: Engaged angles phi of the deepest arc, within 0 and pi [rad].
        depth: Its axial depth [m], >= 0.
        pitch: Angles from each tooth to the next [rad], (teeth,), a whole turn in all; None: even.
        damping: Process damping; None: none.
        shallow: Further arcs, whose depths go with that of the deepest one.

    Example:
        >>> mill = Cutter(radius=8e-3, teeth=2, helix=0.0, speed=100.0)
        >>> slot = SteadyCut(mill, CuttingCoefficients(6e8, 2e8, 0, 0, 0, 0), 0.0, np.pi, 1e-3)
        >>> slot.mean_gain[:2].round(-3).tolist()  # b N/4 [-K_r, -K_t; K_t, -K_r] [N/m]
        [[-100000.0, -300000.0], [300000.0, -100000.0]]
    """

    cutter: Cutter
    coefficients: CuttingCoefficients
    start: float
    end: float
    depth: float
    pitch: tuple[float, ...] | None = None
    damping: ProcessDamping | None = None
    shallow: tuple[ShallowArc, ...] = ()

    @property
    def arcs(self) -> tuple[tuple[float, float, float], ...]:
        """Start, end [rad] and depth [m] of all arcs."""
        others = ((arc.start, arc.end, arc.share * self.depth) for arc in self.shallow)
        return ((self.start, self.end, self.depth), *others)

    def at_depth(self, depth: float) -> SteadyCut:
        """Return the cut with another axial depth [m]."""
        return replace(self, depth=depth)

    def at_speed(self, rpm: float) -> SteadyCut:
        """Return the cut at another speed of the spindle [1/min]."""
        return replace(self, cutter=replace(self.cutter, speed=rpm * 2.0 * np.pi / 60.0))

    @property
    def rpm(self) -> float:
        """Speed of the spindle [1/min]."""
        return self.cutter.speed * 60.0 / (2.0 * np.pi)

    @property
    def period(self) -> float:
        """Time after which the cut repeats: a tooth's, or a turn's where the pitch varies [s]."""
        if self.pitch is None:
            return self.cutter.tooth_period
        return 2.0 * np.pi / self.cutter.speed

    @property
    def cutting_speed(self) -> float:
        """Speed of the edges [m/s]."""
        return self.cutter.radius * self.cutter.speed

    @cached_property
    def channels(self) -> tuple[Channel, ...]:
        """Parts of the force; empty where no tooth is in the cut."""
        if self.depth <= 0.0 or all(end - start < _NOTHING for start, end, _ in self.arcs):
            return ()
        if self.pitch is None:
            even = 2.0 * np.pi / self.cutter.teeth
            all_tips = even * np.arange(self.cutter.teeth)
            channels = [Channel(self.period, self._pieces(all_tips), all_tips)]
        else:
            tips = np.cumsum((0.0, *self.pitch[:-1]))
            all_tips = tips
            channels = [
                Channel(angle / self.cutter.speed, self._pieces(tip), tip)
                for tip, angle in zip(tips[:, None], self.pitch, strict=True)
            ]
        if self.damping is not None:
            channels.append(Channel(None, self._pieces(all_tips), all_tips))
        return tuple(channels)

    def _pieces(self, tips: np.ndarray) -> np.ndarray:
        """Return the times between which teeth, or some of them, are in the cut, (p, 2)."""
        turn = self.period * self.cutter.speed
        corners = np.array(
            [
                angle + lag
                for start, end, depth in self.arcs
                for angle in (start, end)
                for lag in (0.0, self.cutter.lag * depth)
            ]
        )
        angles = np.unique(np.append((corners[:, None] - tips).ravel() % turn, [0.0, turn]))
        angles = angles[np.append(True, np.diff(angles) > _NOTHING)]
        angles[-1] = turn
        pieces = np.column_stack([angles[:-1], angles[1:]])
        middle = pieces.mean(axis=1)
        cuts = [np.any(high > low) for low, high in self._engaged_heights(middle[:, None] + tips)]
        return pieces[self._in_cut(middle, tips)] / self.cutter.speed if any(cuts) else pieces[:0]

    def _in_cut(self, angle: np.ndarray, tips: np.ndarray) -> np.ndarray:
        """Return whether an edge is in the cut at angles of rotation, (n,)."""
        inside = np.zeros(len(angle), dtype=bool)
        for low, high in self._engaged_heights(angle[:, None] + tips):
            inside |= np.any(high > low, axis=1)
        return inside

    def _engaged_heights(self, tip: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield heights between which edges are in the cut, by arc and by turn of a long edge."""
        lag, tip = self.cutter.lag, tip % (2.0 * np.pi)
        for start, end, depth in self.arcs:
            if lag == 0.0:
                inside = (start < tip) & (tip < end)
                yield np.zeros_like(tip), np.where(inside, depth, 0.0)
                continue
            for turn in range(int(np.ceil(lag * depth / (2.0 * np.pi))) + 1):
                behind = tip + 2.0 * np.pi * turn
                low = np.clip((behind - end) / lag, 0.0, depth)
                yield low, np.clip((behind - start) / lag, 0.0, depth)

    def gain(self, channel: Channel, time: np.ndarray) -> np.ndarray:
        """Return the wrench by what the tool does, of all teeth of a channel.

        Args:
            channel: The part of the force.
            time: Times [s], (n,).

        Returns:
            Wrench by displacement [N/m, N] or by rate [N s/m, N s], axes f, n, z, (n, 6, 2).
        """
        K = self.coefficients
        edge: tuple[float, float, float] = (K.K_tc, K.K_rc, K.K_ac)
        if channel.delay is None:
            assert self.damping is not None
            radial = self.damping.per_depth(self.cutting_speed)
            edge = (self.damping.friction * radial, radial, 0.0)
        tip = self.cutter.speed * time[:, None] + channel.tips
        total = np.zeros((len(time), 6, 2))
        for low, high in self._engaged_heights(tip):
            # Axes: times, teeth, Gauss points.
            height = low[..., None] + 0.5 * (1.0 + _NODES) * (high - low)[..., None]
            phi = (tip % (2.0 * np.pi))[..., None] - self.cutter.lag * height
            weight = 0.5 * (high - low)[..., None] * _WEIGHTS
            wrench = wrench_of_edge(self.cutter.radius, edge, phi, height)
            chip = np.stack([np.sin(phi), np.cos(phi)], axis=-1)
            total += np.einsum("ntg,ntgw,ntgc->nwc", weight, wrench, chip)
        return total

    @cached_property
    def mean_gain(self) -> np.ndarray:
        """Regeneration's gain, the mean over a turn [N/m, N], (6, 2)."""
        nodes, weights = np.polynomial.legendre.leggauss(24)
        K = self.coefficients
        total = np.zeros((6, 2))
        for start, end, depth in self.arcs:
            phi = 0.5 * (start + end) + 0.5 * (end - start) * nodes
            wrench = wrench_of_edge(
                self.cutter.radius, (K.K_tc, K.K_rc, K.K_ac), phi, np.full_like(phi, 0.5 * depth)
            )
            chip = np.column_stack([np.sin(phi), np.cos(phi)])
            share = depth * 0.5 * (end - start) * weights / (2.0 * np.pi)
            total += np.einsum("p,pw,pc->wc", share, wrench, chip)
        return self.cutter.teeth * total

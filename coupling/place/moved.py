"""Places of a path in the base frame of robots, in many settings, and the order to go through them."""

from __future__ import annotations

import numpy as np

from coupling.place.following import Targets
from coupling.place.lanes import Columns, cross
from coupling.place.serial_robot import TipMotion
from coupling.place.settings import Placed
from coupling.place.stations import Stations
from coupling.toolpaths.tilt import APPROACH
from coupling.toolpaths.upright import keeps


class Moved:
    """Places of a path in the base frame of robots, in n settings; lanes are places times settings.

    Args:
        placed: The settings.
        sphere_radius: Of the tool's end [m].
        stations: The places.
    """

    def __init__(self, placed: Placed, sphere_radius: float, stations: Stations) -> None:
        self._placed, self._radius, self._stations = placed, sphere_radius, stations
        self._part, self._tilt = placed.part.as_matrix(), placed.tilt.as_matrix()
        keep = keeps(stations.tool) and keeps(stations.axes)
        self._one = self._held(0) if keep else None

    def targets(self, places: np.ndarray, settings: np.ndarray) -> Targets:
        """Return the poses of the tool at some places in some settings."""
        origin = self._placed.position[settings].T[:, None]
        position = origin + _turned(self._part[settings], self._stations.position[places])
        held = [self._one or self._held(place) for place in places]
        columns = [np.hstack([tool[k][:, settings] for tool, _ in held]) for k in range(3)]
        shift = np.hstack([own[:, settings] for _, own in held])
        return Targets(position.reshape(3, -1), columns, shift)

    def motion(self, places: np.ndarray, settings: np.ndarray) -> TipMotion:
        """Return how the tool moves there."""
        own, part = self._stations, self._part[settings]
        axes = own.axes[places].as_matrix()

        def tilted(vectors: np.ndarray) -> np.ndarray:
            """W v in base axes, (3, p, n), W = A M A^-1 the turn by a tilt M measured in axes A."""
            seen = np.einsum("pji,pj->pi", axes, vectors)
            turned = np.einsum("pij,njk,pk->pni", axes, self._tilt[settings], seen, optimize=True)
            in_base: np.ndarray = np.einsum("nij,pnj->ipn", part, turned, optimize=True)
            return in_base

        # The tool is R = W Q: it turns with the axes by g, and by W (w_Q - g) on them.
        turn, turn_rate = own.turn[places], own.turn_rate[places]
        with_axes, on_axes = _turned(part, turn), tilted(own.spin[places] - turn)
        of_tilt = with_axes - tilted(turn)
        spin_rate = _turned(part, turn_rate) + tilted(own.spin_rate[places] - turn_rate)
        spin_rate += cross(of_tilt, on_axes)
        return TipMotion(
            _turned(part, own.velocity[places]).reshape(3, -1),
            _turned(part, own.acceleration[places]).reshape(3, -1),
            (with_axes + on_axes).reshape(3, -1),
            spin_rate.reshape(3, -1),
        )

    def wrench(self, places: np.ndarray, settings: np.ndarray) -> np.ndarray:
        """Return the wrench on the tool, which turns with the part, (6, lanes)."""
        force, moment = np.split(self._stations.wrench[places], 2, axis=1)
        part = self._part[settings]
        return np.concatenate([_turned(part, v).reshape(3, -1) for v in (force, moment)])

    def gravity(self, places: np.ndarray, settings: np.ndarray) -> np.ndarray:
        """Return gravity, (3, lanes)."""
        return np.tile(self._placed.gravity[settings].T, len(places))

    def _held(self, place: int) -> tuple[Columns, np.ndarray]:
        """Return base_from_tool by its columns, and the TCP's shift, in all settings."""
        along_path, axes = self._stations.tool[place], self._stations.axes[place]
        part_from_tool = axes * self._placed.tilt * axes.inv() * along_path * self._placed.spin
        matrix = (self._placed.part * part_from_tool).as_matrix()
        columns = [np.ascontiguousarray(matrix[:, :, k].T) for k in range(3)]
        contact = part_from_tool.inv().apply(along_path.apply(APPROACH))
        if self._stations.centered:
            contact = np.zeros_like(contact)
        return columns, self._radius * (contact - APPROACH).T


def _turned(rotation: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return R v for every v, (p, 3), and every R, (n, 3, 3), as (3, p, n)."""
    product: np.ndarray = np.tensordot(rotation, vectors, axes=(2, 1)).transpose(1, 2, 0)
    return np.ascontiguousarray(product)


def order_of(position: np.ndarray) -> list[tuple[int, int | None]]:
    """Return places, each with a neighbour that comes before it: the middle one first, then the nearest.

    Args:
        position: Where they are [m], (k, d).
    """
    first = int(np.argmin(np.linalg.norm(position - position.mean(axis=0), axis=1)))
    order: list[tuple[int, int | None]] = [(first, None)]
    distance = np.linalg.norm(position - position[first], axis=1)
    nearest = np.full(len(position), first)
    distance[first] = np.inf
    for _ in range(len(position) - 1):
        k = int(np.argmin(distance))
        order.append((k, int(nearest[k])))
        further = np.linalg.norm(position - position[k], axis=1)
        closer = np.isfinite(distance) & (further < distance)
        distance[closer], nearest[closer] = further[closer], k
        distance[k] = np.inf
    return order


def waves_of(
    order: list[tuple[int, int | None]], at_once: int
) -> list[tuple[np.ndarray, np.ndarray | None]]:
    """Return groups of places that are solved at once, each place with one of an earlier group.

    Args:
        order: As `order_of` gives it.
        at_once: Places in a group at most; the first place is one by itself.
    """
    parent = dict(order)
    waves: list[tuple[np.ndarray, np.ndarray | None]] = [(np.array([order[0][0]]), None)]
    for start in range(1, len(order), at_once):
        group = [place for place, _ in order[start : start + at_once]]
        before = []
        for place in group:
            earlier = parent[place]
            while earlier in group:
                earlier = parent[earlier]
            assert earlier is not None
            before.append(earlier)
        waves.append((np.array(group), np.array(before)))
    return waves

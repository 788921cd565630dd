"""Places of a path in the base frame of robots, in many settings, and the order to go through them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial import KDTree

from coupling.place.settings import PlacedSettings
from coupling.place.stations import Stations
from coupling.robot.batch.following import Targets
from coupling.robot.batch.rigid_robot import TipMotion
from coupling.robot.batch.vectors import Columns, cross
from coupling.toolpaths.tilt import APPROACH
from coupling.toolpaths.untilted import keeps

# Places whose figures bound those of all.
_BOUNDING = 3

# Places, and as many of earlier groups that they are solved from; none before the first.
Wave = tuple[np.ndarray, np.ndarray | None]


class MovedPath:
    """Places of a path in the base frame of robots, in n settings; the batch is places times settings.

    Args:
        sphere_radius: Radius of the tool's end [m].
    """

    def __init__(self, placed: PlacedSettings, sphere_radius: float, stations: Stations) -> None:
        self._placed, self._radius, self._stations = placed, sphere_radius, stations
        self._part, self._tilt = placed.part.as_matrix(), placed.tilt.as_matrix()
        keep = keeps(stations.tool) and keeps(stations.axes)
        self._one = (
            self._columns_at(np.zeros(1, dtype=int), np.arange(len(self._part))) if keep else None
        )

    def targets(self, places: np.ndarray, settings: np.ndarray) -> Targets:
        """Return the poses of the tool at places (p,) in settings (s,), numbers of both."""
        origin = self._placed.position[settings].T[:, None]
        position = origin + _rotate(self._part[settings], self._stations.position[places])
        if self._one is None:
            return Targets(position.reshape(3, -1), *self._columns_at(places, settings))
        every = np.tile(settings, len(places))
        columns, shift, quaternion = self._one
        tool = [column[:, every] for column in columns]
        return Targets(position.reshape(3, -1), tool, shift[:, every], quaternion[every])

    def motion(self, places: np.ndarray, settings: np.ndarray) -> TipMotion:
        """Return the tool's motion at places (p,) in settings (s,), numbers of both."""
        stations, part = self._stations, self._part[settings]
        axes = stations.axes[places].as_matrix()

        def tilted(vectors: np.ndarray) -> np.ndarray:
            """W v in base axes, (3, p, n), W = A M A^-1 the turn by a tilt M measured in axes A."""
            in_part = np.einsum("pji,pj->pi", axes, vectors)
            tilted_vectors = np.einsum(
                "pij,njk,pk->pni", axes, self._tilt[settings], in_part, optimize=True
            )
            in_base: np.ndarray = np.einsum("nij,pnj->ipn", part, tilted_vectors, optimize=True)
            return in_base

        # The tool is R = W Q: it turns with the axes by g, and by W (w_Q - g) on them.
        turn, turn_rate = stations.turn[places], stations.turn_rate[places]
        with_axes, on_axes = _rotate(part, turn), tilted(stations.spin[places] - turn)
        of_tilt = with_axes - tilted(turn)
        spin_rate = _rotate(part, turn_rate) + tilted(stations.spin_rate[places] - turn_rate)
        spin_rate += cross(of_tilt, on_axes)
        return TipMotion(
            _rotate(part, stations.velocity[places]).reshape(3, -1),
            _rotate(part, stations.acceleration[places]).reshape(3, -1),
            (with_axes + on_axes).reshape(3, -1),
            spin_rate.reshape(3, -1),
        )

    def wrench(self, places: np.ndarray, settings: np.ndarray) -> np.ndarray:
        """Return the wrench on the tool, base axes [N, N m], (6, batch): it turns with the part."""
        force, moment = np.split(self._stations.wrench[places], 2, axis=1)
        part = self._part[settings]
        return np.concatenate([_rotate(part, v).reshape(3, -1) for v in (force, moment)])

    def gravity(self, places: np.ndarray, settings: np.ndarray) -> np.ndarray:
        """Return gravity, base axes [m/s^2], (3, batch)."""
        return np.tile(self._placed.gravity[settings].T, len(places))

    def _columns_at(
        self, places: np.ndarray, settings: np.ndarray
    ) -> tuple[Columns, np.ndarray, np.ndarray]:
        """Return base_from_tool by its columns, the TCP's shift, (3, batch), and its quaternion."""
        at, by = np.repeat(places, len(settings)), np.tile(settings, len(places))
        along_path, axes, placed = self._stations.tool[at], self._stations.axes[at], self._placed
        part_from_tool = axes * placed.tilt[by] * axes.inv() * along_path * placed.spin[by]
        base_from_tool = placed.part[by] * part_from_tool
        matrix = base_from_tool.as_matrix()
        columns = [np.ascontiguousarray(matrix[:, :, k].T) for k in range(3)]
        contact = part_from_tool.inv().apply(along_path.apply(APPROACH))
        if self._stations.centered:
            contact = np.zeros_like(contact)
        return columns, self._radius * (contact - APPROACH).T, base_from_tool.as_quat()


def _rotate(rotation: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return R v for every v, (p, 3), and every R, (n, 3, 3), as (3, p, n)."""
    product: np.ndarray = np.tensordot(rotation, vectors, axes=(2, 1)).transpose(1, 2, 0)
    return np.ascontiguousarray(product)


def waves_of(poses: np.ndarray, near: float) -> list[Wave]:
    """Return groups of places that are solved at once, each place with one of an earlier group.

    The middle one first, then all that are near places before them; where none is, the nearest one.

    Args:
        poses: Positions and orientations of the tool, as lengths [m], (k, d).
        near: Largest distance of a place from the one that it is solved from [m].
    """
    first = int(np.argmin(np.linalg.norm(poses - poses.mean(axis=0), axis=1)))
    group = np.array([first])
    waves: list[Wave] = [(group, None)]
    remaining = np.arange(len(poses)) != first
    distance, nearest = np.full(len(poses), np.inf), np.full(len(poses), first)
    while remaining.any():
        away, which = KDTree(poses[group]).query(poses)
        closer = away < distance
        distance[closer], nearest[closer] = away[closer], group[which[closer]]
        group = np.flatnonzero(remaining & (distance <= max(near, distance[remaining].min())))
        waves.append((group, nearest[group]))
        remaining[group] = False
    return waves


def bounding_waves(poses: np.ndarray, waves: Sequence[Wave]) -> list[Wave]:
    """Return the first place of waves and those of the second one that are farthest from each other.

    Args:
        poses: Positions and orientations of the tool at all places, as lengths [m], (k, d).
        waves: All places, in the order in which they are solved.
    """
    first = list(waves[:1])
    if len(waves) == 1:
        return first
    chosen, (group, before) = [int(waves[0][0][0])], waves[1]
    while len(chosen) < min(_BOUNDING, 1 + len(group)):
        away = np.linalg.norm(poses[group][:, None] - poses[chosen], axis=2).min(axis=1)
        chosen.append(int(group[np.argmax(away)]))
    is_chosen = np.isin(group, chosen[1:])
    assert before is not None
    return [*first, (group[is_chosen], before[is_chosen])]


def split(waves: Sequence[Wave], most: int) -> Iterator[Wave]:
    """Yield groups of at most so many places."""
    for places, before in waves:
        for start in range(0, len(places), most):
            share = slice(start, start + most)
            yield places[share], None if before is None else before[share]

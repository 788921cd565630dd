"""Moves of a G-code program as arrays: their ways and feeds, and where the tool is along them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.toolpaths.cam_path import Course, PassingLaw
from coupling.toolpaths.gcode_directions import MoveDirections
from coupling.toolpaths.gcode_moves import UNTILTED, Dwell, GcodeMove, GcodeProgram
from coupling.toolpaths.rotary import Kinematics
from coupling.toolpaths.segments import Chain

# Part of a move over which differences stand for derivatives, and parts at which they are taken: of a
# move whose tool turns by less than this [rad], and of any other.
_DIFFERENCE_STEP, _SMALL_TURN = 1e-4, 0.5
_SMALL_TURN_PARTS, _LARGE_TURN_PARTS = np.linspace(0.0, 1.0, 3), np.linspace(0.0, 1.0, 33)
# Moves whose turns are looked at together.
_BATCH_SIZE = 20_000


class GcodeCourse(Course):
    """Moves joined end to end, whose ways are lengths of X, Y, Z, or angles where these stay.

    Args:
        program: A program.
        kinematics: Rotary axes that its angles are of; None where it has none.
        rapid: Speed of rapids [m/s].
        roll: Function from vectors from tip to holder, (k, 3), to rotations part_from_tool.

    Attributes:
        turns: Whether the tool is ever tilted.

    Raises:
        ValueError: If a tool turns from a direction to the opposite one.
    """

    def __init__(
        self,
        program: GcodeProgram,
        kinematics: Kinematics | None,
        rapid: float,
        roll: Callable[[np.ndarray], Rotation],
    ) -> None:
        self._program, self._kinematics = program, kinematics
        self._rapid_speed, self._roll = rapid, roll
        self._moves: list[GcodeMove] = []
        waits: dict[int, float] = {}
        for step in program.steps:
            if isinstance(step, GcodeMove):
                self._moves.append(step)
            elif isinstance(step, Dwell) and self._moves:
                last = len(self._moves) - 1
                waits[last] = waits.get(last, 0.0) + step.duration
        self._directions = MoveDirections(self._moves, kinematics)
        self._chain = Chain([move.segment for move in self._moves])
        self.lengths = self._chain.lengths
        self.waits = np.zeros(len(self._moves))
        self.waits[list(waits)] = list(waits.values())
        self._waited = np.zeros(len(self._moves), dtype=bool)
        self._waited[list(waits)] = True
        self.turns = any(move.turn is not None for move in self._moves)
        if self.turns:
            self._directions.require_planes()

    def points(self, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return tips [m] and vectors from tip to holder [1], axes of X, Y, Z, (k, 3) each.

        Args:
            way: Rising ways from the first point on [m and rad], (k,).
        """
        which, along = self._chain.place(way)
        places = self._chain.points_at(which, along)
        if not self.turns:
            return places, np.tile(UNTILTED.axis, (len(places), 1))
        part = along / self.lengths[which]
        return self._tips(which, part, places), self._directions.axes(which, part)

    def at(self, way: np.ndarray) -> tuple[np.ndarray, Rotation]:
        """Return points [m], (k, 3), and rotations part_from_tool at rising ways, (k,), in the part."""
        points, axes = self.points(way)
        if (plane := self._program.plane) is not None:
            points, axes = plane.points(points), plane.rotate(axes)
        return points, self._roll(axes)

    def passing(self, law: PassingLaw) -> tuple[np.ndarray, np.ndarray]:
        """Return the speeds of the moves [m/s or rad/s], and whether the tool rests behind each, (n,).

        It rests where it waits, in a corner, between a rapid and a feed, and where it begins or ends to
        turn in place.
        """
        return self._speeds(law.fastest_turn), self._stops(law.corner)

    def _speeds(self, fastest_turn: float) -> np.ndarray:
        """Return the speeds of the moves, none of which turns the tool too fast [m/s or rad/s], (n,)."""
        rapid = np.where(self._stays, fastest_turn, self._rapid_speed)
        feeds = np.array([np.nan if move.feed is None else move.feed for move in self._moves])
        feeds = np.where(self._rapid, rapid, feeds)
        for rows, parts in self._turning():
            turning, moving = self._rates(rows, parts)
            slowest = fastest_turn * self.lengths[rows] / np.maximum(turning, 1e-12)
            feeds[rows] = np.minimum(feeds[rows], slowest)
            # A table may carry the part faster than the axes go.
            tip = self._rapid_speed * self.lengths[rows] / np.maximum(moving, 1e-12)
            feeds[rows] = np.where(self._rapid[rows], np.minimum(feeds[rows], tip), feeds[rows])
        return feeds

    def _stops(self, angle: float) -> np.ndarray:
        """Return whether the tool rests behind each move, by the angle of a corner [rad], (n,)."""
        begins, ends = self._along
        size = np.maximum(np.linalg.norm(begins[1:], axis=1), np.linalg.norm(ends[:-1], axis=1))
        sharp = np.linalg.norm(begins[1:] - ends[:-1], axis=1)
        corner = sharp > 2.0 * np.sin(0.5 * angle) * size + 1e-12
        stays = self._stays
        corner |= (self._rapid[1:] != self._rapid[:-1]) | (stays[1:] != stays[:-1])
        for k in np.flatnonzero(stays[1:] & stays[:-1] & ~corner).tolist():
            corner[k] = self._turns_otherwise(k, angle)
        return np.append(corner | self._waited[:-1], True)

    def acceleration_jump(self, speeds: np.ndarray, stops: np.ndarray) -> float:
        """Return the largest jump of the tip's acceleration where moves meet without a rest [m/s^2].

        At a speed v it is v^2 times the change of the curvature vector, v^2/r from a line to an arc.
        """
        change = np.linalg.norm(self._bends[0][1:] - self._bends[1][:-1], axis=1)
        jumps = np.minimum(speeds[1:], speeds[:-1]) ** 2 * change
        return float(np.max(jumps, initial=0.0, where=~stops[:-1]))

    def turn_jump(self, speeds: np.ndarray, stops: np.ndarray) -> float:
        """Return the largest jump of the axis's rate where moves meet without a rest [rad/s]."""
        if not self.turns:
            return 0.0
        which, last_parts = np.arange(len(self._moves)), np.ones(len(self._moves))
        begins, ends = (
            (
                self._directions.axes(which, part + _DIFFERENCE_STEP)
                - self._directions.axes(which, part - _DIFFERENCE_STEP)
            )
            / (2.0 * _DIFFERENCE_STEP * self.lengths[:, None])
            for part in (0.0 * last_parts, last_parts)
        )
        change = np.linalg.norm(begins[1:] - ends[:-1], axis=1)
        jumps = np.minimum(speeds[1:], speeds[:-1]) * change
        return float(np.max(jumps, initial=0.0, where=~stops[:-1]))

    @cached_property
    def _stays(self) -> np.ndarray:
        return np.array([move.stays for move in self._moves])

    @cached_property
    def _rapid(self) -> np.ndarray:
        return np.array([move.feed is None for move in self._moves])

    @property
    def _is_machine(self) -> bool:
        """Whether the tip's way follows from X, Y, Z by the machine's kinematics."""
        return self.turns and self._program.coordinates == "machine"

    @cached_property
    def _along(self) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of the tip by the way at both ends of the moves, (n, 3) each."""
        if not self._is_machine:
            begins, ends = self._tangents
            return begins, ends
        ahead, behind = self._offsets
        width = 2.0 * _DIFFERENCE_STEP * self.lengths[:, None]
        return (ahead[2] - ahead[0]) / width, (behind[2] - behind[0]) / width

    @cached_property
    def _bends(self) -> tuple[np.ndarray, np.ndarray]:
        """Second derivatives of the tip by the way at both ends of the moves [1/m], (n, 3) each."""
        if not self._is_machine:
            begins, ends = self._curvatures
            return begins, ends
        width = (_DIFFERENCE_STEP * self.lengths[:, None]) ** 2
        ahead, behind = self._offsets
        return (
            (ahead[2] - 2.0 * ahead[1] + ahead[0]) / width,
            (behind[2] - 2.0 * behind[1] + behind[0]) / width,
        )

    @cached_property
    def _tangents(self) -> np.ndarray:
        """Unit tangents at both ends of the moves, (2, n, 3); zero where X, Y, Z stay."""
        way = np.array([move.end for move in self._moves])
        way -= [move.start for move in self._moves]
        size = np.linalg.norm(way, axis=1, keepdims=True)
        along = np.divide(
            way, size, out=np.zeros_like(way), where=(size > 0.0) & ~self._stays[:, None]
        )
        tangents = np.stack([along, along])
        for number, move in enumerate(self._moves):
            if move.arc is not None:
                tangents[:, number] = move.arc.directions()
        return tangents

    @cached_property
    def _curvatures(self) -> np.ndarray:
        return np.array([move.curvatures for move in self._moves]).transpose(1, 0, 2)

    @cached_property
    def _offsets(self) -> np.ndarray:
        """Tips a step before, at, and a step behind both ends of the moves [m], (2, 3, n, 3)."""
        which = np.arange(len(self._moves))
        places = [[getattr(move, name) for move in self._moves] for name in ("start", "end")]
        tips = np.empty((2, 3, len(which), 3))
        for side, (place, part) in enumerate(zip(np.array(places), (0.0, 1.0), strict=True)):
            for number, step in enumerate((-_DIFFERENCE_STEP, 0.0, _DIFFERENCE_STEP)):
                way = step * self.lengths[:, None] * ~self._stays[:, None]
                bend = 0.5 * way**2 * self._curvatures[side]
                at = place + way * self._tangents[side] + bend
                tips[side, number] = self._tips(which, np.full(len(which), part + step), at)
        return tips

    def _turns_otherwise(self, number: int, corner: float) -> bool:
        """Return whether the tool turns about another axis behind a turn in place than in it."""
        which = np.array([number, number + 1])
        parts = np.array([1.0, 0.0])
        rate = self._directions.axes(which, parts + _DIFFERENCE_STEP) - self._directions.axes(
            which, parts - _DIFFERENCE_STEP
        )
        rate /= 2.0 * _DIFFERENCE_STEP * self.lengths[which, None]
        size = np.linalg.norm(rate, axis=1).max()
        return bool(np.linalg.norm(rate[1] - rate[0]) > 2.0 * np.sin(0.5 * corner) * size + 1e-9)

    def _turning(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return numbers of moves that turn the tool, a few thousand at a time, and parts to look at."""
        if not self.turns:
            return []
        small = self._directions.angle_sums < _SMALL_TURN
        kinds = [
            (small & (self._directions.angle_sums > 0.0), _SMALL_TURN_PARTS),
            (~small, _LARGE_TURN_PARTS),
        ]
        return [
            (rows[k : k + _BATCH_SIZE], parts)
            for rows, parts in ((np.flatnonzero(kind), parts) for kind, parts in kinds)
            for k in range(0, len(rows), _BATCH_SIZE)
        ]

    def _rates(self, rows: np.ndarray, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the largest derivatives of rotation [rad] and tip [m] by the part of moves, (r,)."""
        which, part = np.repeat(rows, len(parts)), np.tile(parts, len(rows))
        axis = self._directions.axes(which, part)
        rate = self._directions.axes(which, part + _DIFFERENCE_STEP) - self._directions.axes(
            which, part - _DIFFERENCE_STEP
        )
        # The tool turns about its own axis as well, so that it is turned the shortest way from upright.
        turning = np.linalg.norm(rate, axis=1) / np.sqrt(np.maximum(0.5 + 0.5 * axis[:, 2], 1e-12))
        moving = np.zeros(len(which))
        if self._is_machine:
            starts = np.array([self._moves[k].start for k in rows.tolist()])
            ways = np.array([self._moves[k].end for k in rows.tolist()]) - starts
            places = [
                np.repeat(starts, len(parts), axis=0)
                + np.repeat(ways, len(parts), axis=0) * (part + step)[:, None]
                for step in (-_DIFFERENCE_STEP, _DIFFERENCE_STEP)
            ]
            before, behind = (
                self._tips(which, part + step, place)
                for step, place in zip((-_DIFFERENCE_STEP, _DIFFERENCE_STEP), places, strict=True)
            )
            moving = np.linalg.norm(behind - before, axis=1)
        shape = (len(rows), len(parts))
        width = 2.0 * _DIFFERENCE_STEP
        return turning.reshape(shape).max(axis=1) / width, moving.reshape(shape).max(axis=1) / width

    def _tips(self, which: np.ndarray, part: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Return the tips [m], (k, 3), of moves (k,) at parts of them (k,) and X, Y, Z, (k, 3)."""
        if self._kinematics and self._is_machine:
            return self._kinematics.tip(places, self._directions.angles_at(which, part))
        return places

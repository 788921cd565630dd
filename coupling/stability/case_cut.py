"""The cuts of a case: where its tool cuts, how deep, in which posture, and what vibrates there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from coupling.case.case import Case
from coupling.case.stability import LONGEST_EDGE
from coupling.errors import StabilityError
from coupling.modes.case_places import MOST_ROWS
from coupling.modes.locked_robot import LockedRobot
from coupling.modes.measured_response import read_responses
from coupling.path.deviation import DeviationParts
from coupling.path.histories import ToolPath
from coupling.process.cutting_force import Engagement, mean_wrench
from coupling.process.engaged_arcs import Arcs, StatedArcs
from coupling.process.milling_force import ActualTip, Milling, MillingForce
from coupling.process.milling_table import MillingForceTable
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.stability.fitted_response import fitted_modes
from coupling.stability.steady_cut import ProcessDamping, ShallowArc, SteadyCut
from coupling.stability.structure import Structure, ToolMode
from elastic_robot.linearisation import Linearisation

# A shallower cut is none [m], nor is one whose tool moves less from tooth to tooth [m].
_TOUCHES, _STANDING = 1e-6, 1e-9
# Depth up to which limits are looked for, in diameters of the cutter.
_DEEPEST = 4.0
# A depth is the mean over this time at least, so that vibrations are none [s].
_SLOW = 0.1
# The chart's speeds, in programmed ones.
_SPEEDS = (0.25, 2.0)


@dataclass(frozen=True)
class PlacedCut:
    """A cut at a place, with the posture of the robot.

    Attributes:
        time: Time along the path [s]; None for a posture that was named.
        q: Joint angles of the undeflected robot [rad], (joints,).
        feed: Direction of the feed in the part's x-y plane, from its x axis [rad].
        cut: The cut, as deep as it is programmed.
        feed_per_tooth: Way of the tool from tooth to tooth [m].
        programmed_depth: Depth that the program has [m]; that of the cut is what the tool cuts.
    """

    time: float | None
    q: np.ndarray
    feed: float
    cut: SteadyCut
    feed_per_tooth: float
    programmed_depth: float

    @property
    def section(self) -> float:
        """Area that is cut, across the feed, over the radius [m]."""
        start, end, depth = np.transpose(self.cut.arcs)
        return float(np.sum((np.cos(start) - np.cos(end)) * depth))


@dataclass(frozen=True)
class StructureThere:
    """What vibrates at a place.

    Attributes:
        linear: The robot, linearised under the mean wrench of the cut.
        robot: Its modes.
        whole: Modes of robot and tool in series.
        unloaded: Numbers of the joints, from 1, whose gears the mean wrench leaves in their backlash;
            they are taken as engaged.
    """

    linear: Linearisation
    robot: Structure
    whole: Structure
    unloaded: tuple[int, ...]

    @property
    def is_undamped(self) -> bool:
        """Whether the robot gives way and has no damping at all."""
        return len(self.linear.mass) > 0 and not np.any(self.linear.damping)


class CaseCuts:
    """Cuts of a milling case.

    Args:
        case: The case.

    Raises:
        StabilityError: If its process is no milling, or its tool's response cannot be read.
    """

    def __init__(self, case: Case) -> None:
        self.case, self.milling = case, milling_of(case)
        self._placed = case.robots[0]
        self._locked = LockedRobot(self._placed.description, self._placed.torque_curve)
        self._engaged = LockedRobot(self._placed.description, "linear")

    @cached_property
    def tool(self) -> tuple[ToolMode, ...]:
        """Modes of tool, holder and spindle; none where the case has none."""
        table = self.case.stability
        modes = [
            ToolMode(mode.frequency_Hz, mode.damping_ratio, mode.stiffness_N_m)
            for mode in table.tool_mode
        ]
        if table.tool_response is not None:
            modes += fitted_modes(read_responses(table.tool_response), str(table.tool_response))
        return tuple(modes)

    @property
    def deepest(self) -> float:
        """Depth up to which limits are looked for [m]."""
        return self.case.stability.max_depth_m or _DEEPEST * 2.0 * self.milling.cutter.radius

    @property
    def speeds(self) -> tuple[float, float]:
        """Lowest and highest speed of the spindle to look at [1/min]."""
        table = self.case.stability
        if table.spindle_rpm is not None:
            return table.spindle_rpm[0], table.spindle_rpm[1]
        rpm = self.milling.cutter.speed * 30.0 / np.pi
        return _SPEEDS[0] * rpm, _SPEEDS[1] * rpm

    @cached_property
    def base_from_part(self) -> np.ndarray:
        """Rotation from the part to the robot's base, (3, 3)."""
        turn = self._placed.world_from_base.rotation.inv() * self.case.task.part.rotation
        matrix: np.ndarray = turn.as_matrix()
        return matrix

    @cached_property
    def along_path(self) -> tuple[PlacedCut, ...]:
        """Cuts along the desired path, a few thousand at most; none where it never cuts.

        Raises:
            PlanningError: If the robot cannot follow the path.
        """
        desired = self.case.desired
        directions = self.milling.feed_directions()
        arcs = self.milling.engaged.at(desired.time)
        way = np.linalg.norm(np.gradient(self.milling.tips[:, :2], desired.time, axis=0), axis=1)
        way *= self.milling.cutter.tooth_period
        cuts = np.any(arcs.is_cut & (arcs.depth > _TOUCHES), axis=1)
        cutting = np.flatnonzero(cuts & (way > _STANDING))
        if len(cutting) == 0:
            return ()
        rows = cutting[np.unique(np.linspace(0, len(cutting) - 1, MOST_ROWS).astype(int))]
        path = desired.tools[0].at_rows(rows)
        in_base = path.transformed(self._placed.world_from_base.inverse())
        q = InverseKinematics(self._placed.description, self._placed.home).plan(in_base).q[0]
        cuts_at_rows = [self._cut(arcs, row) for row in rows.tolist()]
        return tuple(
            PlacedCut(
                float(desired.time[row]),
                q[k],
                float(np.arctan2(directions[row, 1], directions[row, 0])),
                cut,
                float(way[row]),
                cut.depth,
            )
            for k, (row, cut) in enumerate(zip(rows.tolist(), cuts_at_rows, strict=True))
        )

    def as_deep_as(self, path: ToolPath, placed: Sequence[PlacedCut]) -> tuple[PlacedCut, ...]:
        """Return cuts with the depths that a tool has on its actual path, its vibrations apart.

        A robot that sags cuts deeper than is programmed.

        Args:
            path: Actual path of the tool, in the world.
            placed: Cuts along the desired path.

        Returns:
            Those that the tool touches.
        """
        milling = self.milling
        period = max(_SLOW, milling.cutter.turn_period)
        actual, time = path.tools[0], np.array([cut.time for cut in placed])
        mean_position = DeviationParts.of(actual.time, actual.position[0], period).slow
        tip = ActualTip(milling.part, actual.time, mean_position)
        depth = np.zeros(len(placed))
        for rows, engagement in milling.cuts(tip, time, milling.feed_at(time)):
            np.maximum.at(depth, rows, engagement.depth)
        return tuple(
            replace(cut, cut=cut.cut.at_depth(value))
            for cut, value in zip(placed, depth.tolist(), strict=True)
            if value > _TOUCHES
        )

    @property
    def path_of_cuts(self) -> tuple[ToolPath, np.ndarray]:
        """Path of the tool where it cuts, base frame, and joint angles [rad], (n, joints)."""
        path = self.case.desired.tools[0].transformed(self._placed.world_from_base.inverse())
        time = np.array([placed.time for placed in self.along_path])
        q = np.stack([placed.q for placed in self.along_path])
        return path.at_rows(np.searchsorted(path.time, time)), q

    def _cut(self, arcs: Arcs, row: int) -> SteadyCut:
        """Return the cut at a place of a path by its number."""
        which = np.flatnonzero(arcs.is_cut[row])
        return self._steady_cut(
            np.column_stack([arcs.start[row, which], arcs.end[row, which], arcs.depth[row, which]])
        )

    def _steady_cut(self, arcs: np.ndarray) -> SteadyCut:
        """Return the cut of arcs by start, end [rad] and depth [m], (arcs, 3)."""
        table, milling = self.case.stability, self.milling
        damping = table.process_damping
        (start, end, depth), *others = arcs[np.argsort(-arcs[:, 2])].tolist()
        return SteadyCut(
            milling.cutter,
            milling.coefficients,
            start,
            end,
            depth,
            milling.cutter.pitch,
            None
            if damping is None
            else ProcessDamping(damping.indentation_N_m3, damping.wear_land_m, damping.friction),
            tuple(ShallowArc(first, last, low / depth) for first, last, low in others),
        )

    def in_posture(self, q: np.ndarray, feed: float, rpm: float, depth: float) -> PlacedCut:
        """Return a cut in a posture, engaged as in the path's largest section, with the path's feed.

        Args:
            q: Joint angles [rad], (joints,).
            feed: Direction of the feed in the part's x-y plane, from its x axis [rad].
            rpm: Speed of the spindle [1/min].
            depth: Axial depth [m].

        Raises:
            StabilityError: If the number of angles is another one, the cut is deeper than edges are
                long, its feed per tooth is not below the radius, or the path cuts nowhere.
        """
        joints = len(self._placed.description.joints)
        if len(q) != joints:
            raise StabilityError(
                f"posture: expected {joints} angles, one for each joint of"
                f" {self._placed.description.name}, got {len(q)}"
            )
        if not 0.0 < depth <= LONGEST_EDGE:
            raise StabilityError(
                f"depth: expected more than 0 and at most {1e3 * LONGEST_EDGE:.4g} mm, got"
                f" {1e3 * depth:.4g} mm"
            )
        engaged = self.milling.engaged
        if isinstance(engaged, StatedArcs):
            cut = self._steady_cut(np.array([[engaged.start, engaged.end, depth]]))
        else:
            arcs = engaged.at(self.case.desired.time)
            section = arcs.section(self.milling.cutter.radius)
            if not section.any():
                raise StabilityError(
                    f"{self.case.name}: expected a path that cuts, got one that stays off the stock:"
                    ' lower it, or state engagement = "slot", "up" or "down"'
                )
            cut = self._cut(arcs, int(np.argmax(section))).at_depth(depth)
        cut = cut.at_speed(rpm)
        feed_per_tooth, radius = self._feed_rate * cut.cutter.tooth_period, cut.cutter.radius
        if feed_per_tooth >= radius:
            raise StabilityError(
                f"{rpm:.4g} 1/min: expected a feed per tooth below the radius of the cutter,"
                f" {1e3 * radius:.4g} mm, got {1e3 * feed_per_tooth:.4g} mm: name a higher speed"
            )
        return PlacedCut(None, q, feed, cut, feed_per_tooth, cut.depth)

    def beyond_limits(self, q: np.ndarray) -> tuple[str, ...]:
        """Return a sentence for each joint whose angle [rad], (joints,), is beyond its limits."""
        limits = [joint.limits or (-np.inf, np.inf) for joint in self._placed.description.joints]
        return tuple(
            f"joint {number}: expected {np.rad2deg(low):.4g} to {np.rad2deg(high):.4g} deg, its limits,"
            f" got {np.rad2deg(angle):.4g}"
            for number, (angle, (low, high)) in enumerate(zip(q.tolist(), limits, strict=True), 1)
            if not low <= angle <= high
        )

    @cached_property
    def _feed_rate(self) -> float:
        """Feed of the path in its cuts, the median, or its highest speed [m/s]."""
        time = self.case.desired.time
        speed = np.linalg.norm(np.gradient(self.milling.tips[:, :2], time, axis=0), axis=1)
        is_cut = np.any(self.milling.engaged.at(time).is_cut, axis=1) & (speed > 0.0)
        return float(np.median(speed[is_cut])) if is_cut.any() else float(speed.max())

    def base_from_cut(self, feed: float) -> np.ndarray:
        """Return the rotation from axes of a cut (feed, left of it, spindle) to the base, (3, 3).

        Args:
            feed: Direction of the feed in the part's x-y plane, from its x axis [rad].
        """
        cos, sin = np.cos(feed), np.sin(feed)
        return self.base_from_part @ np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])

    def mean_wrench(self, placed: PlacedCut) -> np.ndarray:
        """Return the mean wrench of a cut, base axes [N, N m], (6,)."""
        cut = placed.cut
        chip = np.tile([placed.feed_per_tooth, 0.0], (len(cut.arcs), 1))
        engagement = Engagement(chip, *np.transpose(cut.arcs))
        in_cut = mean_wrench(cut.cutter, cut.coefficients, engagement).sum(axis=0)
        in_base: np.ndarray = (in_cut.reshape(2, 3) @ self.base_from_cut(placed.feed).T).ravel()
        return in_base

    def structure(
        self, placed: PlacedCut, damping: float = 1.0, stiffness: float = 1.0
    ) -> StructureThere:
        """Return what vibrates in a cut.

        Args:
            damping, stiffness: Factors of the damping and of the stiffness of the robot's gears.

        Raises:
            StabilityError: If the robot has no equilibrium there, nothing gives way, or its modes are
                not independent.
        """
        wrench = self.mean_wrench(placed)
        linear = self._locked.linear(placed.q, wrench)
        unloaded = self._locked.unloaded_joints(linear)
        if unloaded and self._locked.torque_curve == "backlash":
            linear = self._engaged.linear(placed.q, wrench)
        linear = replace(
            linear, damping=damping * linear.damping, stiffness=stiffness * linear.stiffness
        )
        if len(linear.mass) == 0 and not self.tool:
            raise StabilityError(
                f"{self.case.name}: expected a robot or a tool that gives way, got neither: add"
                " stiffness and damping under [[joint]] of the robot file, or [[stability.tool_mode]]"
            )
        robot = Structure.of_robot(linear, self.base_from_cut(placed.feed))
        parts = [robot, *([Structure.of_modes(list(self.tool))] if self.tool else [])]
        return StructureThere(linear, robot, Structure.in_series(*parts), unloaded)

    @property
    def joints(self) -> tuple[int, ...]:
        """Number of the joint of each of the robot's elastic coordinates, from 1."""
        return self._locked.joints


def milling_of(case: Case) -> Milling:
    """Return the milling of a case.

    Raises:
        StabilityError: If its process is another one.
    """
    if not isinstance(case.process_table, MillingForceTable):
        raise StabilityError(
            f"{case.name}: process: model: expected 'milling-force', whose cut has teeth, got"
            f" {case.process_table.model!r}"
        )
    process = case.process
    return (
        process if isinstance(process, MillingForce) else case.process_table.process(case.task)
    ).milling


def is_milling(case: Case) -> bool:
    """Return whether a case's process is a milling cut that is computed here."""
    return isinstance(case.process_table, MillingForceTable)

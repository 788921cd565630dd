"""Numbers that have a usual range: those of case and robot files, and what follows from several."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.files.sources import Number, kind, places
from coupling.path.histories import WrenchHistory
from coupling.results.cut_result import CutResult
from coupling.robot.parameter_table import PARAMETER_KINDS
from coupling.run.mistaken_units import remark
from coupling.run.usual_ranges import EXPECTED, range_key
from elastic_robot.body import triangle_excess
from elastic_robot.description import Robot
from elastic_robot.drive import Drive

_STANDARD_GRAVITY = 9.81  # of a rated load [m/s^2]
# Keys of a robot file that are looked at in the robot, which has those of its URDF as well.
_OF_ROBOT = (
    "joint.origin",
    "joint.mass",
    "joint.com",
    "joint.inertia",
    "joint.limits",
    "joint.max_rate",
    "joint.max_acceleration",
    "joint.gear.hysteresis.slip_torque",
)
# Lists of pairs, whose columns are different things.
_COLUMNS = {
    "joint.torque_table": ("angle", "torque"),
    "joint.balancer.torque_table": ("angle", "torque"),
}


@dataclass(frozen=True)
class Quantity:
    """A number that has a usual range.

    Attributes:
        value: In the unit there.
        is_computed: Whether a formula has computed it, so that nobody was mistaken in its unit.
    """

    place: str
    key: str
    value: float
    is_computed: bool = False

    @property
    def remark(self) -> str:
        """What there is to say of it, "" where it is usual."""
        return remark(self.place, self.key, self.value, self.is_computed)


def quantities_of_case(
    case: Case, cut: CutResult | None, wrench: WrenchHistory | None
) -> Iterator[Quantity]:
    """Yield all of a case that is looked at."""
    yield from _of_tables(case)
    # A robot that both tools share is looked at once.
    for placed in {robot.description.name: robot for robot in case.robots}.values():
        yield from quantities_of_robot(placed.description)
        yield from quantities_of_file(placed.description.name, placed.provenance.numbers)
    for tool, placed in enumerate(case.robots):
        yield from _of_column(placed, case.desired.pose[tool][:, :3])
    if cut is not None:
        yield from _of_cut(cut, case)
    if wrench is not None:
        is_computed = case.process_table.FORMULA
        yield Quantity(
            "process: largest force", "answer.peak_force", wrench.peak_force, is_computed
        )


def _of_tables(case: Case) -> Iterator[Quantity]:
    for place, value in places(case.resolved):
        key = range_key(kind(place))
        for size in _sizes(value):
            if key in EXPECTED:
                yield Quantity(place.replace(".", ": "), key, size)


def quantities_of_file(name: str, numbers: Sequence[Number]) -> Iterator[Quantity]:
    """Yield the numbers of a robot file that are not looked at in its robot."""
    for number in numbers:
        whole = kind(number.place)
        place = f"robot {name}: {_in_words(number.place)}"
        if whole in _COLUMNS:
            for column, values in zip(_COLUMNS[whole], np.transpose(number.value), strict=True):
                largest = _largest(values)
                yield Quantity(f"{place}: {column}", f"{whole}.{column}", largest)
        elif whole in EXPECTED and whole not in _OF_ROBOT:
            yield from (Quantity(place, whole, size) for size in _sizes(number.value, whole))
    yield from _of_payload(name, {number.place: number.value for number in numbers})


def _in_words(place: str) -> str:
    """Return a place of a robot file as errors have it: joint 2: tilt 1: damping."""
    return place.replace("[", " ").replace("]", "").replace(".", ": ")


def _sizes(value: object, key: str = "") -> list[float]:
    """Return what is looked at of a value: a number, the largest of a list, or a vector's length."""
    if isinstance(value, bool) or not isinstance(value, int | float | list):
        return []
    entries = np.ravel(np.asarray(value, dtype=object))
    if any(isinstance(entry, bool) or not isinstance(entry, int | float) for entry in entries):
        return []
    if key == "gravity":
        return [float(np.linalg.norm(entries.astype(float)))]
    return [_largest(entries)] if len(entries) else []


def _largest(entries: Iterable[float]) -> float:
    """Return the number of the largest magnitude, the positive one of two."""
    return float(max(entries, key=lambda entry: (abs(entry), entry)))


def _of_payload(name: str, values: dict[str, object]) -> Iterator[Quantity]:
    mass, rated = values.get("payload.mass"), values.get("payload_N")
    if isinstance(mass, int | float) and isinstance(rated, int | float):
        place = f"robot {name}: payload: mass of {mass:g} kg"
        yield Quantity(place, "robot.payload_over_rating", mass * _STANDARD_GRAVITY / rated)


def quantities_of_robot(robot: Robot) -> Iterator[Quantity]:
    """Yield what is looked at in a robot."""
    reach = _robot_reach(robot)
    if reach > 0.0:
        yield Quantity(f"robot {robot.name}: length of its links", "robot.reach", reach)
    for number, joint in enumerate(robot.joints, start=1):
        place = f"robot {robot.name}: joint {number}"
        body = joint.body
        lists = {"origin": joint.origin, "com": body.com, "inertia": body.inertia}
        lists |= {} if joint.limits is None else {"limits": joint.limits}
        for key, entries in lists.items():
            yield Quantity(f"{place}: {key}", f"joint.{key}", _largest(entries))
        yield Quantity(f"{place}: mass", "joint.mass", body.mass)
        for key, highest in (
            ("max_rate", joint.max_rate),
            ("max_acceleration", joint.max_acceleration),
        ):
            if highest is not None:
                yield Quantity(f"{place}: {key}", f"joint.{key}", highest)
        slip = PARAMETER_KINDS["hysteresis"].read(joint)
        yield Quantity(f"{place}: hysteresis", "joint.gear.hysteresis.slip_torque", slip)
        excess = 100.0 * triangle_excess(body)
        yield Quantity(
            f"{place}: inertia over the sum of the others", "joint.inertia_excess", excess
        )
        if joint.drive is not None:
            yield from _of_drive(place, joint.drive)


def _of_drive(place: str, drive: Drive) -> Iterator[Quantity]:
    inertia = drive.inertia
    bandwidth = drive.rate_gain / inertia / (2.0 * np.pi)
    yield Quantity(f"{place}: rate loop", "joint.drive.rate_bandwidth", bandwidth)
    yield Quantity(
        f"{place}: friction at rest",
        "joint.drive.friction_over_inertia",
        drive.friction / inertia,
    )
    if drive.viscous > 0.0:
        ratio = drive.viscous / inertia
        yield Quantity(f"{place}: viscous friction", "joint.drive.viscous_over_inertia", ratio)
    if drive.torque_limit is not None:
        yield Quantity(
            f"{place}: max_torque_Nm",
            "joint.drive.torque_over_inertia",
            drive.torque_limit / inertia,
        )


def _robot_reach(robot: Robot) -> float:
    """Return the length of all links of a robot, to its TCP [m]."""
    lengths = [np.linalg.norm(joint.origin) for joint in robot.joints[1:]]
    return float(sum(lengths) + np.linalg.norm(robot.tcp_position))


def _of_column(placed: PlacedRobot, points: np.ndarray) -> Iterator[Quantity]:
    """Yield how close a tool comes to the column of its robot, where the path is at its height.

    Args:
        points: Points of its tool in the world [m], (k, 3).
    """
    robot = placed.description
    reach = _robot_reach(robot)
    if len(robot.joints) < 2 or not reach:
        return
    first, shoulder = robot.joints[0], np.asarray(robot.joints[1].origin)
    axis = np.asarray(first.axis) / np.linalg.norm(first.axis)
    foot = np.asarray(first.origin)
    way = placed.world_from_base.inverse().points(points) - foot
    along = way @ axis
    low, high = sorted((-float(foot @ axis), float(shoulder @ axis)))
    distance = np.linalg.norm(way - np.outer(along, axis), axis=1)[(low <= along) & (along <= high)]
    if len(distance):
        yield Quantity(
            f"robot {robot.name}: distance of the {placed.name} tool from the column of joint 1",
            "robot.distance_from_column",
            float(distance.min()) / reach,
        )


def _of_cut(cut: CutResult, case: Case) -> Iterator[Quantity]:
    diameter = case.resolved["process"]["cutter_diameter_m"]
    depth, feed = cut.figures["depth_m"].largest, cut.figures["feed_per_tooth_m"].largest
    yield Quantity("process: axial depth", "milling.axial_depth", depth / diameter)
    yield Quantity("process: feed per tooth", "milling.feed_per_tooth", feed)
    yield Quantity("process: speed of the spindle", "process.spindle_speed_rpm", cut.rpm)

"""Values that are legal in a case or an answer but out of what is usual: a remark, not an error."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.case.case import Case, PlacedRobot
from coupling.files.sources import Number, kind, places
from coupling.path.histories import WrenchHistory
from coupling.process import NoisySchema
from coupling.results.cut_result import CutResult
from coupling.robot.parameter_table import PARAMETER_KINDS
from coupling.run.cut_figures import cut_result, cut_warnings, material_remark
from coupling.run.usual_ranges import EXPECTED, range_key, remark
from coupling.toolpaths.tilt import APPROACH
from elastic_robot.description import Robot, triangle_excess
from elastic_robot.fmi.interface import IDEAL
from elastic_robot.gear_parts import Drive

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
        place: Its place, in words.
        key: Its key of `EXPECTED`.
        value: In the unit there.
    """

    place: str
    key: str
    value: float

    @property
    def remark(self) -> str:
        """What there is to say of it, "" where it is usual."""
        return remark(self.place, self.key, self.value)


# Share of a mean force along the tool's approach from which on it is remarked: within 60 degrees of it.
_PULL = 0.5


def remarks(case: Case, wrench: WrenchHistory | None = None) -> tuple[str, ...]:
    """Return a sentence for each value that is out of what is usual.

    Args:
        wrench: Response of the process; None where it was not evaluated.
    """
    cut = cut_result(case)
    texts = [text for quantity in _quantities(case, cut, wrench) if (text := quantity.remark)]
    texts += [] if cut is None else cut_warnings(case, cut)
    texts += material_remark(case)
    stated = case.resolved["process"].get("stiffness_N_m") == 0.0
    if wrench is not None and wrench.peak_force == 0.0 and not stated:
        texts.append(
            "process: expected a force along the path, got 0 N everywhere: check that the path is in"
            " contact with the part, and its frame and units"
        )
    if wrench is not None:
        texts += _of_pulling_forces(case, wrench)
    for placed in case.robots:
        texts += [f"robot {placed.description.name}: {text}" for text in placed.provenance.remarks]
        texts += unsure_stiffness(placed)
        texts += _upward_gravity(placed.description, placed.world_from_base.rotation)
        texts += _home_beyond_limits(placed)
    return tuple(dict.fromkeys((*texts, *_of_rigid_robots(case), *_of_ideal_drives(case))))


def _of_pulling_forces(case: Case, wrench: WrenchHistory) -> Iterator[str]:
    """Yield a sentence for each tool that a user's own process or record pulls into the part.

    A part pushes a forming tool off.  Helical mills are pulled along their axis as well, but by less
    than what pushes them sideways.
    """
    if not isinstance(case.process_table, NoisySchema):
        return
    forces = wrench.at(case.desired.time)[..., :3]
    for placed, path, force in zip(case.robots, case.desired.tools, forces, strict=True):
        force = _without_peaks(force)
        size = float(np.linalg.norm(force, axis=1).mean())
        pull = float(np.sum(force * path.rotations[0].apply(APPROACH), axis=1).mean())
        if size > 0.0 and pull > _PULL * size:
            yield (
                f"robot {placed.description.name}: expected a force that pushes the tool off the part,"
                f" got one that pulls it into the part (mean along its approach {pull:.3g} N, mean"
                f" magnitude {size:.3g} N): check the frame, and the sign, which is that of the force on"
                " the tool, not on the part or the sensor"
            )


def _without_peaks(force: np.ndarray) -> np.ndarray:
    """Return forces [N], (n, 3), none longer than twice the median of those that are there.

    A wrong sign lets many an iteration diverge, to a few forces of any direction that outweigh others.
    """
    size = np.linalg.norm(force, axis=1, keepdims=True)
    longest = 2.0 * np.median(size[size > 0.0]) if np.any(size) else 1.0
    shortened: np.ndarray = force * longest / np.maximum(size, longest)
    return shortened


def _of_rigid_robots(case: Case) -> Iterator[str]:
    """Yield a sentence for each robot that does not give way anywhere."""
    for robot in case.robots:
        if robot.description.is_rigid:
            yield (
                f"robot {robot.description.name}: no joint is elastic, so that its deviation is zero"
                " under any force: add stiffness and damping under [[joint]] of its file"
            )


def _home_beyond_limits(placed: PlacedRobot) -> Iterator[str]:
    """Yield a sentence for each joint whose angle at home is one that it cannot take."""
    for number, (joint, angle) in enumerate(
        zip(placed.description.joints, np.rad2deg(placed.home).tolist(), strict=True), start=1
    ):
        low, high = (-np.inf, np.inf) if joint.limits is None else np.rad2deg(joint.limits).tolist()
        if not low <= angle <= high:
            yield (
                f"robot {placed.description.name}: home_deg of joint {number}: expected {low:.4g} to"
                f" {high:.4g} deg, its limits, got {angle:.4g}: give [{placed.table}] another"
                " home posture"
            )


def unsure_stiffness(placed: PlacedRobot) -> list[str]:
    """Return a sentence where the stiffness of a robot's gears is known as a range, or none."""
    whole = placed.provenance.stiffness_range
    if whole is None:
        return []
    return [
        f"robot {placed.description.name}: the stiffness of {len(placed.provenance.stiffness_ranges)}"
        f" gears is known as a range ({whole[0]:.2g} to {whole[1]:.2g} N m/rad): more measurements of"
        " this robot narrow it (elastic-robot identify)"
    ]


def remarks_on_robot(robot: Robot, numbers: Sequence[Number] = ()) -> list[str]:
    """Return a sentence for each value of a robot that is out of what is usual.

    Args:
        robot: The robot.
        numbers: Numbers of its file.
    """
    quantities = (*_of_robot(robot), *_of_file(robot.name, numbers))
    said = [text for quantity in quantities if (text := quantity.remark)]
    return [*said, *_upward_gravity(robot, Rotation.identity())]


def _upward_gravity(robot: Robot, world_from_base: Rotation) -> list[str]:
    """Return a sentence where gravity pulls a robot upward in the world, or none."""
    gravity = world_from_base.apply(robot.gravity)
    if gravity[2] <= 0.5 * np.linalg.norm(gravity):
        return []
    return [
        f"robot {robot.name}: gravity: expected one that points down in the world, got"
        f" {gravity[2]:.4g} m/s2 along z: change its sign; a robot that hangs has base_rpy_deg"
    ]


def _of_ideal_drives(case: Case) -> Iterator[str]:
    """Yield a sentence for each robot whose motors move nowhere, neither in the model nor the plant."""
    plant = [None] * len(case.robots) if case.plant is None else case.plant.robots
    for robot, difference in zip(case.robots, plant, strict=True):
        motors = any(joint.drive for joint in robot.description.joints)
        if motors and robot.drive == IDEAL and (difference is None or difference.drive == IDEAL):
            confirmed = robot.provenance.servos_confirmed
            why = "" if confirmed else " as measurements do not confirm the servos of its file"
            yield (
                f"robot {robot.description.name}: its drives are ideal{why}, all figures are without"
                f' following error and friction: drive = "servo" in [{robot.table}] computes the command'
                " of its servos"
            )


def _quantities(
    case: Case, cut: CutResult | None, wrench: WrenchHistory | None
) -> Iterator[Quantity]:
    """Yield all of a case that is looked at."""
    yield from _of_tables(case)
    # A robot that both tools share is looked at once.
    for placed in {robot.description.name: robot for robot in case.robots}.values():
        yield from _of_robot(placed.description)
        yield from _of_file(placed.description.name, placed.provenance.numbers)
    for tool, placed in enumerate(case.robots):
        yield from _of_column(placed, case.desired.pose[tool][:, :3])
    if cut is not None:
        yield from _of_cut(cut, case)
    if wrench is not None:
        yield Quantity("process: largest force", "answer.peak_force", wrench.peak_force)


def _of_tables(case: Case) -> Iterator[Quantity]:
    """Yield the numbers of a case's tables."""
    for place, value in places(case.resolved):
        key = range_key(kind(place))
        for size in _sizes(value):
            if key in EXPECTED:
                yield Quantity(place.replace(".", ": "), key, size)


def _of_file(name: str, numbers: Sequence[Number]) -> Iterator[Quantity]:
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
    """Yield the weight of a payload over the load that its robot is rated for."""
    mass, rated = values.get("payload.mass"), values.get("payload_N")
    if isinstance(mass, int | float) and isinstance(rated, int | float):
        place = f"robot {name}: payload: mass of {mass:g} kg"
        yield Quantity(place, "robot.payload_over_rating", mass * _STANDARD_GRAVITY / rated)


def _of_robot(robot: Robot) -> Iterator[Quantity]:
    """Yield what is looked at in a robot."""
    reach = robot_reach(robot)
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
    """Yield what follows from several keys of a drive."""
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


def robot_reach(robot: Robot) -> float:
    """Return the length of all links of a robot, to its TCP [m]."""
    lengths = [np.linalg.norm(joint.origin) for joint in robot.joints[1:]]
    return float(sum(lengths) + np.linalg.norm(robot.tcp_position))


def _of_column(placed: PlacedRobot, points: np.ndarray) -> Iterator[Quantity]:
    """Yield how close a tool comes to the column of its robot, where the path is at its height.

    Args:
        placed: The robot.
        points: Points of its tool in the world [m], (k, 3).
    """
    robot = placed.description
    reach = robot_reach(robot)
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
    """Yield what follows from tool path and cutter of a milling case."""
    diameter = case.resolved["process"]["cutter_diameter_m"]
    depth, feed = cut.figures["depth_m"].largest, cut.figures["feed_per_tooth_m"].largest
    yield Quantity("process: axial depth", "milling.axial_depth", depth / diameter)
    yield Quantity("process: feed per tooth", "milling.feed_per_tooth", feed)
    yield Quantity("process: speed of the spindle", "process.spindle_speed_rpm", cut.rpm)

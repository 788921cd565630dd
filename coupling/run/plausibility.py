"""Values that are legal in a case or an answer but out of what is usual: a remark, not an error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.files.gear_table import ARCMIN
from coupling.path.histories import WrenchHistory
from coupling.process.milling_force import MillingForceTable
from elastic_robot.description import Robot, triangle_excess
from elastic_robot.fmi.interface import IDEAL


@dataclass(frozen=True)
class UsualRange:
    """Range in which a value usually is.

    Attributes:
        low, high: Its ends.
        unit: Unit of both.
        why: Things that have these values.
        or_none: Whether 0 says that there is none of it, which is usual as well.
    """

    low: float
    high: float
    unit: str
    why: str
    or_none: bool = False


_SHEET = "from foil to thick plate; single point forming is done up to a few millimetres"
_TOOL = "tools for incremental forming"
_STEP = "steps between the contours of a formed wall"
_CUTTING = "of cutting: plastics at the lower end, nickel alloys at the upper"
_EDGE = "of an edge: sharp in plastics at the lower end, worn in steel at the upper"

# What is usual, by the table of the resolved case and its key; "joint" is the robots' files, "milling"
# and "answer" are what follows from a case.
EXPECTED = {
    "process.tensile_strength_Pa": UsualRange(
        3e7, 2.5e9, "Pa", "metal sheet, from soft aluminium to press-hardened steel"
    ),
    "process.strength_Pa": UsualRange(2e7, 3e9, "Pa", "factor of the hardening laws of metals"),
    "process.youngs_modulus_Pa": UsualRange(1e9, 4.2e11, "Pa", "from plastics to tungsten"),
    "process.sheet_thickness_m": UsualRange(5e-5, 1e-2, "m", _SHEET),
    "process.tool_diameter_m": UsualRange(1e-3, 0.1, "m", _TOOL),
    "support.tool_diameter_m": UsualRange(1e-3, 0.1, "m", _TOOL),
    "support.gap_m": UsualRange(5e-5, 2e-2, "m", "one or two thicknesses of a sheet"),
    "process.step_down_m": UsualRange(2e-5, 5e-3, "m", _STEP),
    "process.penetration_stiffness_N_m": UsualRange(
        1e3, 1e8, "N/m", "sheet under a tool; 1.2e5 is 1 mm of soft aluminium", or_none=True
    ),
    "process.pinch_stiffness_N_m": UsualRange(
        1e3, 1e9, "N/m", "sheet between two tools", or_none=True
    ),
    "process.stiffness_N_m": UsualRange(
        1e2, 1e10, "N/m", "from a foam to a block of steel", or_none=True
    ),
    "process.cutter_diameter_m": UsualRange(1e-4, 0.3, "m", "end mills and face mills"),
    "process.spindle_speed_rpm": UsualRange(100.0, 2e5, "1/min", "spindles for milling"),
    "process.K_tc_Pa": UsualRange(2e7, 1e10, "Pa", f"coefficients {_CUTTING}"),
    "process.K_rc_Pa": UsualRange(1e6, 1e10, "Pa", f"coefficients {_CUTTING}", or_none=True),
    "process.K_ac_Pa": UsualRange(1e6, 1e10, "Pa", f"coefficients {_CUTTING}", or_none=True),
    "process.K_te_N_m": UsualRange(1e2, 1e6, "N/m", f"coefficients {_EDGE}", or_none=True),
    "process.K_re_N_m": UsualRange(1e2, 1e6, "N/m", f"coefficients {_EDGE}", or_none=True),
    "process.K_ae_N_m": UsualRange(1e2, 1e6, "N/m", f"coefficients {_EDGE}", or_none=True),
    "tool_path.feed_m_s": UsualRange(
        2e-4, 2.0, "m/s", "feeds of forming, milling and measuring with robots"
    ),
    "tool_path.rapid_m_s": UsualRange(1e-3, 4.0, "m/s", "what robots reach between cuts"),
    "tool_path.step_down_m": UsualRange(2e-5, 5e-3, "m", _STEP),
    "tool_path.depth_m": UsualRange(1e-4, 0.5, "m", "depth of formed parts"),
    "robot.reach": UsualRange(
        0.05, 20.0, "m", "the length of all links, from a small arm to the longest ones"
    ),
    "joint.limits": UsualRange(
        0.0, 20.0, "rad", "wrists that turn three times to either side at most"
    ),
    "joint.stiffness": UsualRange(
        1e3, 2e8, "N m/rad", "from gears of small arms to those of the heaviest robots"
    ),
    "joint.inertia": UsualRange(
        0.0, 1e-4, "%", "the largest principal moment of a body is at most the sum of the others"
    ),
    "joint.tilt.stiffness": UsualRange(
        1e3, 1e9, "N m/rad", "bearings and links, from small arms to the heaviest robots"
    ),
    "joint.backlash": UsualRange(
        1e-6, 3e-3, "rad", "half a backlash of up to 20 arc minutes", or_none=True
    ),
    "joint.gear.hysteresis": UsualRange(
        1e-3, 1e4, "N m", "friction in gears, from small arms to the heaviest robots", or_none=True
    ),
    "joint.gear.slip_angle": UsualRange(
        1e-7, 3e-3, "rad", "up to the width of a loop of 10 arc minutes"
    ),
    "joint.gear.kinematic_error": UsualRange(
        1e-7, 1e-3, "rad", "sines of up to 3 arc minutes, as of toothed belts"
    ),
    "joint.drive.inertia": UsualRange(
        1e-3, 5e3, "kg m2", "rotors by their gears' ratios squared, at the gears' output"
    ),
    "joint.drive.friction": UsualRange(
        1e-2, 5e3, "N m", "friction of motors and gears at rest, at the gears' output", or_none=True
    ),
    "joint.drive.position_gain": UsualRange(3.0, 100.0, "1/s", "position loops of machine axes"),
    "joint.drive.rate_bandwidth": UsualRange(
        2.0, 500.0, "Hz", "rate loops: their gain by the rotor's inertia and 2 pi"
    ),
    "milling.axial_depth": UsualRange(
        0.0, 2.0, "diameters of the cutter", "slots to about one deep, walls to two"
    ),
    "milling.feed_per_tooth": UsualRange(
        2e-6, 1.5e-3, "m", "less than the radius of an edge rubs, more breaks it"
    ),
    "answer.peak_force": UsualRange(
        0.5, 5e4, "N", "forces on a robot's tool; the heaviest robots carry 23 kN", or_none=True
    ),
}

# Units that are mistaken for the right one, and what one of them is in the right one.
MISTAKEN = {
    "Pa": {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "m": {"mm": 1e-3, "um": 1e-6},
    "m/s": {"mm/s": 1e-3, "m/min": 1.0 / 60.0, "mm/min": 1e-3 / 60.0},
    "N/m": {"N/mm": 1e3, "N/um": 1e6},
    "N m/rad": {
        "N m/deg": 180.0 / np.pi,
        "N m/arcmin": 1.0 / ARCMIN,
        "kN m/rad": 1e3,
        "MN m/rad": 1e6,
    },
    "rad": {"arcmin": ARCMIN, "deg": np.pi / 180.0},
    "kg m2": {"kg cm2": 1e-4},
    "Hz": {"rad/s": 0.5 / np.pi},
    "1/s": {"m/min/mm": 1e3 / 60.0},
    "1/min": {"1/s": 60.0, "rad/s": 30.0 / np.pi},
    "N": {"kN": 1e3, "mN": 1e-3},
}


def remarks(case: Case, wrench: WrenchHistory | None = None) -> tuple[str, ...]:
    """Return a sentence for each value that is out of what is usual.

    Args:
        wrench: Response of the process; None where it was not evaluated.
    """
    found = [
        text for place, key, value in _values(case, wrench) if (text := remark(place, key, value))
    ]
    stated = case.resolved["process"].get("stiffness_N_m") == 0.0
    if wrench is not None and wrench.peak_force == 0.0 and not stated:
        found.append(
            "process: expected a force along the path, got 0 N everywhere: check that the path is in"
            " contact with the part, and its frame and units"
        )
    for placed in case.robots:
        found += [f"robot {placed.description.name}: {text}" for text in placed.provenance.remarks]
        found += unsure_stiffness(placed)
        found += _home_beyond_limits(placed)
    return tuple(dict.fromkeys((*found, *_of_rigid_robots(case), *_of_ideal_drives(case))))


def _of_rigid_robots(case: Case) -> Iterator[str]:
    """Yield a sentence for each robot that does not give way anywhere."""
    for own in case.robots:
        if own.description.is_rigid:
            yield (
                f"robot {own.description.name}: no joint is elastic, so that its deviation is zero under"
                " any force: add stiffness and damping under [[joint]] of its file"
            )


def _home_beyond_limits(placed: PlacedRobot) -> Iterator[str]:
    """Yield a sentence for each joint whose angle at home is one that it cannot take."""
    table = "robot" if placed.name == "forming" else placed.name
    for number, (joint, angle) in enumerate(
        zip(placed.description.joints, np.rad2deg(placed.home).tolist(), strict=True), start=1
    ):
        low, high = (-np.inf, np.inf) if joint.limits is None else np.rad2deg(joint.limits).tolist()
        if not low <= angle <= high:
            yield (
                f"robot {placed.description.name}: home_deg of joint {number}: expected {low:.4g} to"
                f" {high:.4g} deg, its limits, got {angle:.4g}: give [{table}] another home posture"
            )


def unsure_stiffness(placed: PlacedRobot) -> list[str]:
    """Return a sentence where the stiffness of a robot's gears is that of a class, or none."""
    whole = placed.provenance.stiffness_range
    if whole is None:
        return []
    return [
        f"robot {placed.description.name}: the stiffness of {len(placed.provenance.stiffness_ranges)}"
        f" gears is typical of a class ({whole[0]:.2g} to {whole[1]:.2g} N m/rad), not of this robot:"
        " measure it (elastic-robot identify)"
    ]


def remarks_on_robot(robot: Robot) -> list[str]:
    """Return a sentence for each value of a robot that is out of what is usual."""
    return [text for place, key, value in _of_robot(robot) if (text := remark(place, key, value))]


def _of_ideal_drives(case: Case) -> Iterator[str]:
    """Yield a sentence for each robot whose motors move nowhere, neither in the model nor the plant."""
    plant = [None] * len(case.robots) if case.plant is None else case.plant.robots
    for own, moved in zip(case.robots, plant, strict=True):
        motors = any(joint.drive for joint in own.description.joints)
        if motors and own.drive == IDEAL and (moved is None or moved.drive == IDEAL):
            table = "robot" if own.name == "forming" else own.name
            yield (
                f"robot {own.description.name}: its drives are ideal, all figures are without following"
                f' error and friction: drive = "servo" in [{table}] computes the command of its servos'
            )


def remark(place: str, key: str, value: float) -> str:
    """Return what there is to say of a value, "" where it is usual.

    Args:
        place: Its place, in words.
        key: One of `EXPECTED`.
        value: In the unit there.

    Example:
        >>> print(remark("process: tensile_strength_Pa", "process.tensile_strength_Pa", 310.0))
        process: tensile_strength_Pa: expected 3e+07 to 2.5e+09 Pa (metal sheet, from soft aluminium
        to press-hardened steel), got 310 Pa: did you mean 3.1e+08 Pa (310 MPa)?
    """
    usual = EXPECTED[key]
    if usual.low <= value <= usual.high or (usual.or_none and value == 0.0):
        return ""
    meant = [
        f"{factor * value:.4g} {usual.unit} ({value:.6g} {unit})"
        for unit, factor in MISTAKEN.get(usual.unit, {}).items()
        if usual.low <= factor * value <= usual.high
    ]
    return (
        f"{place}: expected {usual.low:.4g} to {usual.high:.4g} {usual.unit} ({usual.why}), got"
        f" {value:.6g} {usual.unit}" + (f": did you mean {' or '.join(meant)}?" if meant else "")
    )


def _values(case: Case, wrench: WrenchHistory | None) -> Iterator[tuple[str, str, float]]:
    """Yield place, key of `EXPECTED` and value of all that is looked at."""
    for table, keys in case.resolved.items():
        for name, value in keys.items():
            if f"{table}.{name}" in EXPECTED:
                yield f"{table}: {name}", f"{table}.{name}", value
    # A robot that both tools share is looked at once.
    for robot in {placed.description.name: placed.description for placed in case.robots}.values():
        yield from _of_robot(robot)
    yield from _of_milling(case)
    if wrench is not None:
        yield "process: largest force", "answer.peak_force", wrench.peak_force


def _of_robot(robot: Robot) -> Iterator[tuple[str, str, float]]:
    """Yield the same of a robot."""
    lengths = [np.linalg.norm(joint.origin) for joint in robot.joints[1:]]
    reach = float(sum(lengths) + np.linalg.norm(robot.tcp_position))
    if reach > 0.0:
        yield f"robot {robot.name}: length of its links", "robot.reach", reach
    for number, joint in enumerate(robot.joints, start=1):
        place = f"robot {robot.name}: joint {number}"
        if joint.limits is not None:
            largest = max(joint.limits, key=abs)
            yield f"{place}: limits", "joint.limits", abs(largest)
        if joint.stiffness is not None:
            yield f"{place}: stiffness", "joint.stiffness", joint.stiffness
            yield f"{place}: backlash", "joint.backlash", joint.backlash
            slip = sum(element.slip_torque for element in joint.hysteresis)
            yield f"{place}: hysteresis", "joint.gear.hysteresis", slip
        for element in joint.hysteresis:
            yield f"{place}: slip angle", "joint.gear.slip_angle", element.slip_angle
        for error in joint.kinematic_error:
            amplitude = error.amplitude
            yield f"{place}: kinematic error", "joint.gear.kinematic_error", amplitude
        if joint.drive is not None:
            bandwidth = joint.drive.rate_gain / joint.drive.inertia / (2.0 * np.pi)
            yield f"{place}: rotor's inertia", "joint.drive.inertia", joint.drive.inertia
            yield f"{place}: friction at rest", "joint.drive.friction", joint.drive.friction
            gain = joint.drive.position_gain
            yield f"{place}: position gain", "joint.drive.position_gain", gain
            yield f"{place}: rate loop", "joint.drive.rate_bandwidth", bandwidth
        for tilt in joint.tilt:
            yield f"{place}: stiffness of a tilt", "joint.tilt.stiffness", tilt.stiffness
        excess = triangle_excess(joint.body)
        yield f"{place}: inertia over the sum of the others", "joint.inertia", 100.0 * excess


def _of_milling(case: Case) -> Iterator[tuple[str, str, float]]:
    """Yield what follows from tool path and cutter of a milling case."""
    table = case.process_table
    if not isinstance(table, MillingForceTable):
        return
    height = case.task.part.coordinates(case.task.forming.position[0])[:, 2]
    depth = max(table.surface_z_m - float(height.min()), 0.0) / table.cutter_diameter_m
    yield "process: depth below surface_z_m", "milling.axial_depth", depth
    feed = case.resolved["tool_path"].get("feed_m_s")
    if feed is not None:
        teeth_per_second = table.spindle_speed_rpm / 60.0 * table.teeth
        yield "process: feed per tooth", "milling.feed_per_tooth", feed / teeth_per_second

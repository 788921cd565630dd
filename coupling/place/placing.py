"""A case to be placed: its free settings, its path's places, and its case file in another setting."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from coupling.case.case import Case
from coupling.case.place import Objective
from coupling.case.robots import read_described_robot
from coupling.errors import CaseError
from coupling.inverse.inversion import MovingRobot
from coupling.path.frame import Frame
from coupling.path.histories import WrenchHistory
from coupling.place.gear_loops import GearLoops
from coupling.place.objective import PlaceDemands, PlaceObjective
from coupling.place.screen import Screen
from coupling.place.settings import LENGTHS, NAMES, ArmHome, CellLayout, Ranges
from coupling.place.stations import Stations, stations_along
from coupling.process.base import Process
from coupling.robot.batch.redundancy import POSE
from coupling.stability.case_cut import is_milling
from elastic_robot.description import Robot

# How far the part may be moved to each side where the case does not say [m], and the tool tilted [deg].
_DEFAULT_SHIFT, _DEFAULT_TILT = 0.5, 30.0
# How far the elbow of a redundant robot is moved to both sides where the case does not say [deg].
_ELBOW = 90.0
# How far a tool may be tilted at most [deg].
_MAX_TILT = 89.0


@dataclass(frozen=True)
class Placing:
    """A case to be placed.

    Attributes:
        robot: Its robot as its file describes it.
        present: Its own setting, by `NAMES` [m], [rad], (9,).
        wrench: Response of its process to its desired path, part axes.
    """

    case: Case
    robot: Robot
    gears: GearLoops
    cell: CellLayout
    present: np.ndarray
    ranges: Ranges
    wrench: WrenchHistory
    stations: Stations
    goal: PlaceObjective

    def screen(self, stations: Stations) -> Screen:
        """Return the screen of settings at some places of the path."""
        return Screen(self.robot, self.gears, self.arm, self.cell, stations)

    @property
    def arm(self) -> ArmHome:
        """Home posture of the robot."""
        return ArmHome.of(self.robot, self.case.robots[0].home)

    def content(self, setting: np.ndarray, home: np.ndarray) -> dict[str, Any]:
        """Return the case in another setting, as the content of a case file.

        Args:
            setting: By `NAMES` [m], [rad], (9,).
            home: Joint angles near which its path begins [rad], (joints,).
        """
        content = copy.deepcopy(self.case.resolved)
        robot, part, tool_path = (content[name] for name in ("robot", "part", "tool_path"))
        keys = setting_keys(setting)
        part["position_m"] = [keys[f"{name}_m"] for name in LENGTHS]
        part["rpy_deg"] = [*part["rpy_deg"][:2], keys["yaw_deg"]]
        for name in ("lead_deg", "lean_deg", "rotation_deg"):
            tool_path[name] = keys[name]
        robot["base_rpy_deg"] = [keys["base_roll_deg"], *robot["base_rpy_deg"][1:]]
        robot["home_deg"] = np.round(np.rad2deg(home), 2).tolist()
        return content


def setting_keys(setting: np.ndarray) -> dict[str, float]:
    """Return a setting by `NAMES` [m], [rad], (9,), by the keys of [place], [m] and [deg].

    Example:
        >>> setting_keys(np.array([1.0, 0, 0.5, 0, np.deg2rad(15), 0, 0, 0, 0]))["lead_deg"]
        15.0
    """
    keys = {}
    for name, value in zip(NAMES, setting.tolist(), strict=True):
        key = (f"{name}_m", value) if name in LENGTHS else (f"{name}_deg", np.rad2deg(value))
        keys[key[0]] = round(float(key[1]), 9) + 0.0
    return keys


def require_one_robot(case: Case) -> None:
    """Refuse a case that cannot be placed before its process is evaluated.

    Raises:
        CaseError: If it has two robots, or its robot less than six joints, or none that gives way.
    """
    if len(case.robots) > 1:
        raise CaseError(f"{case.name}: expected a case of one robot, got one with [support]")
    robot = case.robots[0].description
    if len(robot.joints) < POSE:
        raise CaseError(
            f"{case.name}: expected a robot of at least {POSE} joints, got {len(robot.joints)}"
        )
    if case.place.elbow_deg is not None and len(robot.joints) == POSE:
        raise CaseError(
            f"{case.name}: place: elbow_deg: expected it for a robot of more than {POSE} joints, got"
            f" {robot.name} of {POSE}: leave it out"
        )
    if robot.is_rigid:
        raise CaseError(
            f"{case.name}: expected a robot that gives way, got {robot.name} without an elastic joint:"
            " it is as stiff at every place; add stiffness and damping under [[joint]]"
        )


def placing(case: Case, process: Process, objective: Objective | None = None) -> Placing:
    """Return a case as it is to be placed, with one evaluation of its process.

    Args:
        objective: Objective in place of the case's own.

    Raises:
        CaseError: If nothing is free, the objective is backlash and its gears have none, nor
            hysteresis, or it is stability and the process no milling.
    """
    require_one_robot(case)
    placed, table, resolved = case.robots[0], case.place, case.resolved
    robot = read_described_robot(resolved["robot"]["description"], Path())
    present = _present(resolved)
    diameter = case.process_table.forming_tool_diameter
    ranges = _ranges(case, present, diameter is not None)
    if len(ranges.free) == 0:
        raise CaseError(
            f"{case.name}: place: expected a range with low < high, got none: nothing is free"
        )
    optimised = objective or table.optimise
    gears = GearLoops.of(MovingRobot(placed.description, placed.torque_curve))
    if optimised == "backlash" and not (gears.backlash.any() or gears.slip_torque.any()):
        raise CaseError(
            f"{case.name}: expected gears with backlash or hysteresis to optimise, got"
            f" {robot.name} without any: optimise stiffness"
        )
    if optimised == "stability" and not is_milling(case):
        raise CaseError(
            f"{case.name}: expected the process milling-force to optimise stability, got"
            f" {case.process_table.model}: optimise stiffness"
        )
    gravity = np.array(robot.gravity)
    base_rpy, part_rpy = (
        np.deg2rad(resolved[table_name][key])
        for table_name, key in (("robot", "base_rpy_deg"), ("part", "rpy_deg"))
    )
    radius, untilted_lean = 0.5 * (diameter or 0.0), np.deg2rad(case.tool_path.untilted_lean_deg)
    cell = CellLayout(part_rpy, base_rpy, radius, float(untilted_lean), gravity)
    wrench = process.evaluate(case.desired).wrench
    stations = stations_along(case.untilted, radius, wrench)
    in_part = wrench.transformed(Frame(np.zeros(3), case.task.part.rotation.inv()))
    demands = PlaceDemands(
        joint_margin=float(np.deg2rad(table.joint_margin_deg)),
        conditioning=table.least_conditioning,
        clear_share=table.clear_share,
    )
    goal = PlaceObjective(optimised, demands, bool(np.any(stations.wrench)))
    return Placing(case, robot, gears, cell, present, ranges, in_part, stations, goal)


def _present(resolved: Mapping[str, Any]) -> np.ndarray:
    """Return the setting that a case is in, (9,)."""
    tool_path = resolved["tool_path"]
    angles = [
        resolved["part"]["rpy_deg"][2],
        *(tool_path[f"{name}_deg"] for name in ("lead", "lean", "rotation")),
        resolved["robot"]["base_rpy_deg"][0],
        0.0,
    ]
    return np.concatenate([resolved["part"]["position_m"], np.deg2rad(angles)])


def _ranges(case: Case, present: np.ndarray, has_sphere: bool) -> Ranges:
    low, high = present.copy(), present.copy()
    untilted = case.tool_path.untilted_lean_deg
    tilts = {  # where the process knows the tool's sphere
        "lead": [-_DEFAULT_TILT, _DEFAULT_TILT],
        "lean": [untilted - _DEFAULT_TILT, min(untilted + _DEFAULT_TILT, _MAX_TILT)],
    }
    redundant = len(case.robots[0].home) > POSE
    defaults = (tilts if has_sphere else {}) | ({"elbow": [-_ELBOW, _ELBOW]} if redundant else {})
    for k, name in enumerate(NAMES):
        length = name in LENGTHS
        stated = getattr(case.place, f"{name}_m" if length else f"{name}_deg")
        if stated is None and length:
            stated = [present[k] - _DEFAULT_SHIFT, present[k] + _DEFAULT_SHIFT]
        elif stated is None:
            stated = defaults.get(name)
        if stated is not None:
            low[k], high[k] = stated if length else np.deg2rad(stated)
    least = np.deg2rad(untilted - _MAX_TILT)
    if low[NAMES.index("lean")] < least:
        raise CaseError(
            f"{case.name}: place: lean_deg: expected at least {np.rad2deg(least):g} from the wall's"
            f" normal, got {np.rad2deg(low[NAMES.index('lean')]):g}"
        )
    return Ranges(low, high)

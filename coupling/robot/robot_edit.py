"""A robot file with other numbers: its comments and its order stay as they are."""

from __future__ import annotations

import os
from collections.abc import MutableMapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.container import OutOfOrderTableProxy
from tomlkit.items import AoT, Array, InlineTable

from coupling.files.gear_table import SHEET_KEYS
from coupling.files.robot_schema import JointTable, UrdfJoint
from coupling.files.sources import SOURCES, lost_places, numbers
from coupling.files.toml_file import document
from coupling.robot.parameter_kind import ParameterKind
from coupling.robot.parameter_table import PARAMETER_KINDS
from coupling.robot.parameters import apply_values, part_of, place_of, value_of, with_joints
from elastic_robot.description import Robot, Tilt
from elastic_robot.errors import RobotFileError
from elastic_robot.gear_parts import StopElement


class RobotEdit:
    """A robot file while numbers of its joints change, named as in `joint[3].tilt[1].stiffness`.

    Args:
        robot: Its robot; joints count along its chain, in a file beside a URDF they may not.

    Example:
        >>> import tempfile
        >>> from coupling.files.robot_file import load_robot, shipped_robots
        >>> file = shipped_robots()["icme2008"]
        >>> edit = RobotEdit(file, load_robot(file))
        >>> edit.change("joint[2].stiffness", 2e6, "a hammer test")
        >>> edit.remark("joint[2].stiffness", "to 5 %")
        >>> "stiffness = 2000000.0 # to 5 %" in edit.text("Softer.", file)
        True
    """

    def __init__(self, file: Path, robot: Robot) -> None:
        self._file, self._content = file, document(file, RobotFileError)
        entries = list(enumerate(self._content.get("joint", []), start=1))
        order = list(range(1, len(entries) + 1))
        if "urdf" in self._content:
            numbers = {joint.name: i for i, joint in enumerate(robot.joints, start=1)}
            order = [numbers[table["name"]] for _, table in entries]
        self._joints: dict[int, tuple[int, MutableMapping[str, Any]]] = dict(
            zip(order, entries, strict=True)
        )
        self._robot = robot
        self._tilt_remarks: dict[tuple[int, int], str] = {}
        self._write_damping()

    def change(
        self,
        name: str,
        value: float,
        source: str = "",
        interval: tuple[float, float] | None = None,
    ) -> None:
        """Give a parameter another value, with what [sources] says of it, as the row of its kind says.

        The range that the file states of a gear's stiffness, that of a class, goes with the old value.

        Else the elements of a gear stay as they are: those of a data sheet, which follow from stiffness
        and backlash, take its place in the file before one of these changes.

        Args:
            interval: 95 % interval, which the file states of a gear's stiffness; None for none.

        Raises:
            RobotFileError: If it is the payload's beside a URDF.
        """
        joint, tilt, key = place_of(name)
        kind, before = PARAMETER_KINDS[key], value_of(self._robot, name)
        if kind.at_rest and not tilt:
            self._write_elements(joint)
        self._robot = apply_values(self._robot, {name: value})
        head, table = self._part(name)
        if kind.in_file is not None:
            numbers = kind.in_file(part_of(self._robot, name))
            for place, number in numbers.items():
                inner, last = _inside(table, place, is_made=True)
                inner[last] = number
        else:
            numbers = dict.fromkeys(
                place for place in kind.scaled_in_file if _scale(table, place, value / before)
            )
        if key == "stiffness" and not tilt:
            if interval is None:
                table.pop("stiffness_range", None)
            else:
                table["stiffness_range"] = [min(interval[0], value), max(interval[1], value)]
                if source:
                    self._set_source(f"{head}.stiffness_range", f"95 % interval, {source}")
            self._drop_lost_sources()
        if source:
            for place in [_find_shared_place(kind)] if _find_shared_place(kind) else numbers:
                self._set_source(f"{head}.{place}", source)

    def remark(self, name: str, text: str) -> None:
        """Set the comment beside a parameter, if the file has it so; a tilt's array has one a tilt."""
        joint, tilt, key = place_of(name)
        text = " ".join(text.split())
        if tilt and not isinstance(self._joints[joint][1]["tilt"], AoT):
            if key == "stiffness":
                self._tilt_remarks[joint, tilt] = text
            return
        kind, (_, table) = PARAMETER_KINDS[key], self._part(name)
        if kind.in_file is None and not _find_shared_place(kind):
            return  # the file has it in another form
        place = kind.scaled_in_file[0].replace("[]", "") if _find_shared_place(kind) else key
        for outer in place.split(".")[:-1]:
            if outer not in table:
                return
            table = table[outer]
            # One line holds several numbers, of which one is what all of them are told by.
            if isinstance(table, InlineTable | Array):
                if _find_shared_place(kind):
                    table.comment(text)
                return
            if isinstance(table, AoT):
                table = table[0]
        last = place.rpartition(".")[2]
        if last in table:
            table[last].comment(text)

    def add_tilt(self, joint: int, tilt: dict[str, Any], sources: dict[str, str]) -> None:
        """Add a tilt behind those of a joint, with what [sources] says of its keys."""
        at, table = self._joints[joint]
        table.setdefault("tilt", []).append(tilt)
        changed = self._robot.joints[joint - 1]
        tilts = (*changed.tilt, Tilt(tuple(tilt["axis"]), tilt["stiffness"], tilt["damping"]))
        self._robot = with_joints(self._robot, {joint - 1: replace(changed, tilt=tilts)})
        for key, source in sources.items():
            self._set_source(f"joint[{at}].tilt[{len(table['tilt'])}].{key}", source)

    def add_elements(self, joint: int, elements: Sequence[StopElement]) -> None:
        """Give a gear without hysteresis its elements."""
        slipping = replace(self._robot.joints[joint - 1], hysteresis=tuple(elements))
        self._robot = with_joints(self._robot, {joint - 1: slipping})
        _, table = self._joints[joint]
        gear = table.setdefault("gear", tomlkit.inline_table())
        gear["hysteresis"] = [asdict(element) for element in elements]

    def text(self, head: str, target: Path) -> str:
        """Return the new file.

        Args:
            target: Place of the written file: it names its URDF from there.
        """
        for joint in {joint for joint, _ in self._tilt_remarks}:
            table = self._joints[joint][1]
            lines = tomlkit.array()
            for number, tilt in enumerate(table["tilt"], start=1):
                lines.add_line(tilt, comment=self._tilt_remarks.get((joint, number)))
            lines.add_line(indent="")
            table["tilt"] = lines
        urdf = self._content.get("urdf")
        if urdf is not None and not urdf["file"].startswith("package://"):
            file = (self._file.parent / urdf["file"]).resolve()
            urdf["file"] = Path(os.path.relpath(file, target.parent.resolve())).as_posix()
        above = "".join(f"{f'# {line}'.rstrip()}\n" for line in head.splitlines())
        return f"{above}\n{tomlkit.dumps(self._content)}"

    def _write_damping(self) -> None:
        """Write each damping for [modal_damping], where a new stiffness would change all of them."""
        table = self._content.pop("modal_damping", None)
        if table is None:
            return
        source = f"a damping ratio of {table['ratio']:g} of all modes"
        for number, (at, joint_table) in self._joints.items():
            joint = self._robot.joints[number - 1]
            if joint.stiffness is not None:
                joint_table["damping"] = joint.damping
                self._set_source(f"joint[{at}].damping", source)
            for k, tilt in enumerate(joint.tilt):
                joint_table["tilt"][k]["damping"] = tilt.damping
                self._set_source(f"joint[{at}].tilt[{k + 1}].damping", source)
        self._drop_lost_sources()

    def _write_elements(self, joint: int) -> None:
        """Write backlash and elements of a gear for the numbers of its data sheet, if it has these."""
        at, table = self._joints[joint]
        data = self._content.unwrap()
        schema = UrdfJoint if "urdf" in data else JointTable
        joint_keys = schema.model_validate(data["joint"][at - 1])
        if not joint_keys.gear.from_sheet:
            return
        sheet = [
            n for n in numbers(data) if n.place in {f"joint[{at}].gear.{k}" for k in SHEET_KEYS}
        ]
        source = "from " + ", ".join(f"{n.place.rpartition('.')[2]} = {n.value}" for n in sheet)
        source += "".join(f"; {text}" for text in dict.fromkeys(n.source for n in sheet) if text)
        backlash, elements = joint_keys.hysteresis()
        if isinstance(table["gear"], OutOfOrderTableProxy):  # dotted keys, which cannot be deleted
            gear = table["gear"].unwrap()
            del table["gear"]
            table["gear"] = tomlkit.inline_table()
            table["gear"].update(gear)
        for key in SHEET_KEYS:
            table["gear"].pop(key, None)
        table["gear"]["hysteresis"] = [asdict(element) for element in elements]
        self._set_source(f"joint[{at}].gear.hysteresis", source)
        if joint_keys.gear.lost_motion_arcmin is not None:
            table["backlash"] = backlash
            self._set_source(f"joint[{at}].backlash", source)
        self._drop_lost_sources()

    def _drop_lost_sources(self) -> None:
        """Remove what [sources] says of numbers that are not there any more."""
        for key in lost_places(self._content.unwrap()):
            del self._content[SOURCES][key]

    def _set_source(self, place: str, source: str) -> None:
        self._content.setdefault(SOURCES, tomlkit.table())[place] = source

    def _part(self, name: str) -> tuple[str, MutableMapping[str, Any]]:
        """Return the place of a parameter's part as [sources] names it, and its table."""
        joint, tilt, _ = place_of(name)
        if not joint:
            if "urdf" in self._content:
                raise RobotFileError(
                    f"{self._file}: payload: expected a file without URDF, whose frames are the robot's,"
                    " to write it, got one with a URDF"
                )
            return "payload", self._content["payload"]
        at, table = self._joints[joint]
        if not tilt:
            return f"joint[{at}]", table
        return f"joint[{at}].tilt[{tilt}]", table["tilt"][tilt - 1]


def _find_shared_place(kind: ParameterKind) -> str:
    """Return the place of all numbers of a kind together; "" where each is by itself."""
    places = kind.scaled_in_file
    if any("[]" in place for place in places):
        return places[0].partition("[]")[0]
    outer = {place.rpartition(".")[0] for place in places}
    return outer.pop() if len(outer) == 1 < len(places) else ""


def _inside(table: MutableMapping[str, Any], place: str, is_made: bool = False) -> tuple[Any, str]:
    """Return the table that has a place's last key, and that key; an empty one where there is none."""
    *outer, last = place.split(".")
    for key in outer:
        if key not in table:
            if not is_made:
                return {}, last
            table[key] = tomlkit.inline_table()
        table = table[key]
    return table, last


def _scale(table: MutableMapping[str, Any], place: str, factor: float) -> bool:
    """Multiply a number of a table, or those of a list; return whether it is there."""
    several, _, last = place.partition("[].")
    inner, key = _inside(table, several)
    if key not in inner:
        return False
    if last:
        for entry in inner[key]:
            entry[last] = factor * float(entry[last])
    elif isinstance(inner[key], list):
        inner[key] = [[angle, factor * torque] for angle, torque in inner[key]]
    else:
        inner[key] = factor * float(inner[key])
    return True

"""A robot file with other numbers: its comments and its order stay as they are."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, MutableMapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.container import OutOfOrderTableProxy
from tomlkit.items import AoT, Array, InlineTable

from coupling.files.gear_table import SHEET_KEYS
from coupling.files.robot_schema import JointTable, UrdfJoint
from coupling.files.sources import SOURCES, lost_places, numbers
from coupling.files.toml_file import document
from elastic_robot.description import Robot
from elastic_robot.errors import RobotFileError
from elastic_robot.gear_parts import StopElement

# Parameters that are sums: of a gear's elements, and what of a motor's friction is there at rest.
_SLIPPING = (".hysteresis", ".friction")


class RobotEdit:
    """A robot file while numbers of its joints change, named as in `joint[3].tilt[1].stiffness`.

    Args:
        file: The file.
        robot: Its robot; joints count along its chain, in a file beside a URDF they may not.

    Raises:
        RobotFileError: If the file cannot be read.

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
        self._tilt_remarks: dict[tuple[int, int], str] = {}

    def change(self, name: str, value: float, source: str = "") -> None:
        """Give a parameter another value, with what [sources] says of it.

        A gear's hysteresis is the torque at which all of its elements slip, a motor's friction that at
        rest: their parts are changed alike.  Else the elements stay as they are: those of a data sheet,
        which follow from stiffness and backlash, take its place in the file before one of these changes.
        """
        joint, tilt, _ = place_of(name)
        if name.endswith(_SLIPPING):
            self._change_slipping(joint, name.rpartition(".")[2], float(value), source)
            return
        place, table, key = self._found(name)
        if key in ("stiffness", "backlash") and not tilt:
            self._write_elements(joint)
        table[key] = value
        if key == "stiffness" and not tilt:
            table.pop("stiffness_range", None)  # it is the robot's from now on, not that of a class
            self._drop_lost_sources()
        if source:
            self._set_source(f"{place}.{key}", source)

    def remark(self, name: str, text: str) -> None:
        """Set the comment beside a parameter, if the file has it; a tilt's array has one a tilt."""
        _, table, key = self._found(name)
        joint, tilt, _ = place_of(name)
        text = " ".join(text.split())
        if name.endswith(_SLIPPING):
            _slipping(table, key)[2].comment(text)
        elif tilt and not isinstance(self._joints[joint][1]["tilt"], AoT):
            if key == "stiffness":
                self._tilt_remarks[joint, tilt] = text
        elif key in table:
            table[key].comment(text)

    def set_number(self, place: str, value: object, source: str, remark: str) -> None:
        """Set a number of a joint's tables or of the payload, as [sources] names its place.

        Args:
            place: For instance `joint[2].drive.friction.coulomb_Nm`; a joint's number along the chain.
            value: The number or array; None leaves what there is.
            source: Its entry in [sources].
            remark: Comment beside it, where it stands on a line of its own.
        """
        table: MutableMapping[str, Any] = self._content
        head, _, rest = place.partition(".")
        if head != "payload":
            at, table = self._joints[place_of(place)[0]]
            head = f"joint[{at}]"
        elif "urdf" in self._content:
            raise RobotFileError(
                f"{self._file}: payload: expected a file without URDF, whose frames are the robot's,"
                " to write it, got one with a URDF"
            )
        else:
            table = table["payload"]
        *inside, key = rest.split(".")
        for name in inside:
            if name not in table:
                if value is None:
                    return
                table[name] = tomlkit.inline_table()
            table = table[name]
        if value is not None:
            table[key] = value
            self._set_source(f"{head}.{rest}", source)
        inline = isinstance(table, InlineTable)
        if remark and key in table and not inline and hasattr(table[key], "comment"):
            table[key].comment(" ".join(remark.split()))

    def scale_balancer(self, joint: int, factor: float, source: str) -> None:
        """Multiply the torque of a joint's balancer: its points, or the pressure of its gas."""
        place = f"joint[{joint}].balancer"
        table = self._joints[joint][1]["balancer"]
        if "gas_spring" in table:
            pressure = factor * float(table["gas_spring"]["pressure_Pa"])
            self.set_number(f"{place}.gas_spring.pressure_Pa", pressure, source, "")
        else:
            points = [[angle, factor * torque] for angle, torque in table["torque_table"]]
            self.set_number(f"{place}.torque_table", points, source, "")

    def scale_rotor(self, joint: int, factor: float, source: str) -> None:
        """Multiply the inertia of a joint's rotor."""
        own = float(self._joints[joint][1]["drive"]["rotor_inertia_kg_m2"])
        place = f"joint[{joint}].drive.rotor_inertia_kg_m2"
        self.set_number(place, factor * own, source, "")

    def add_tilt(self, joint: int, tilt: dict[str, Any], sources: dict[str, str]) -> None:
        """Add a tilt behind those of a joint, with what [sources] says of its keys."""
        at, table = self._joints[joint]
        table.setdefault("tilt", []).append(tilt)
        for key, source in sources.items():
            self._set_source(f"joint[{at}].tilt[{len(table['tilt'])}].{key}", source)

    def add_elements(self, joint: int, elements: Iterable[StopElement]) -> None:
        """Give a gear without hysteresis its elements."""
        _, table = self._joints[joint]
        gear = table.setdefault("gear", tomlkit.inline_table())
        gear["hysteresis"] = [asdict(element) for element in elements]

    def text(self, head: str, target: Path) -> str:
        """Return the new file.

        Args:
            head: Comment at its beginning.
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

    def _change_slipping(self, joint: int, kind: str, value: float, source: str) -> None:
        """Change all parts of a gear's hysteresis, or of a motor's friction at rest, alike."""
        at, table = self._joints[joint]
        if kind == "hysteresis":
            self._write_elements(joint)
            table = self._joints[joint][1]
        place, parts, _ = _slipping(table, kind)
        keys = ("slip_torque",) if kind == "hysteresis" else ("coulomb_Nm", "stiction_Nm")
        found = [(part, key) for part in parts for key in keys if key in part]
        whole = [float(part[key]) for part, key in found]
        factor = value / (sum(whole) if kind == "hysteresis" else whole[-1])
        for (part, key), own in zip(found, whole, strict=True):
            part[key] = factor * own
        if source:
            self._set_source(f"joint[{at}].{place}", source)

    def _write_elements(self, joint: int) -> None:
        """Write backlash and elements of a gear for the numbers of its data sheet, if it has these."""
        at, table = self._joints[joint]
        data = self._content.unwrap()
        schema = UrdfJoint if "urdf" in data else JointTable
        own = schema.model_validate(data["joint"][at - 1])
        if not own.gear.from_sheet:
            return
        sheet = [
            n for n in numbers(data) if n.place in {f"joint[{at}].gear.{k}" for k in SHEET_KEYS}
        ]
        source = "from " + ", ".join(f"{n.place.rpartition('.')[2]} = {n.value}" for n in sheet)
        source += "".join(f"; {text}" for text in dict.fromkeys(n.source for n in sheet) if text)
        backlash, elements = own.hysteresis()
        if isinstance(table["gear"], OutOfOrderTableProxy):  # dotted keys, which cannot be deleted
            kept = table["gear"].unwrap()
            del table["gear"]
            table["gear"] = tomlkit.inline_table()
            table["gear"].update(kept)
        for key in SHEET_KEYS:
            table["gear"].pop(key, None)
        table["gear"]["hysteresis"] = [asdict(element) for element in elements]
        self._set_source(f"joint[{at}].gear.hysteresis", source)
        if own.gear.lost_motion_arcmin is not None:
            table["backlash"] = backlash
            self._set_source(f"joint[{at}].backlash", source)
        self._drop_lost_sources()

    def _drop_lost_sources(self) -> None:
        """Remove what [sources] says of numbers that are not there any more."""
        for key in lost_places(self._content.unwrap()):
            del self._content[SOURCES][key]

    def _set_source(self, place: str, source: str) -> None:
        """Set what [sources] says of a number."""
        self._content.setdefault(SOURCES, tomlkit.table())[place] = source

    def _found(self, name: str) -> tuple[str, MutableMapping[str, Any], str]:
        """Return a parameter's place as [sources] names it, its table and its key."""
        joint, tilt, _ = place_of(name)
        at, table = self._joints[joint]
        key = name.rpartition(".")[2]
        if not tilt:
            return f"joint[{at}]", table, key
        return f"joint[{at}].tilt[{tilt}]", table["tilt"][tilt - 1], key


def _slipping(table: MutableMapping[str, Any], kind: str) -> tuple[str, list[Any], Any]:
    """Return where hysteresis or friction of a joint are, their tables, and what a comment goes to."""
    place = ("gear", "hysteresis") if kind == "hysteresis" else ("drive", "friction")
    outer = table[place[0]]
    inner = outer[place[1]]
    parts = list(inner) if kind == "hysteresis" else [inner]
    key = "slip_torque" if kind == "hysteresis" else "coulomb_Nm"
    whole = next((own for own in (outer, inner) if isinstance(own, InlineTable | Array)), None)
    return ".".join(place), parts, parts[0].item(key) if whole is None else whole


_NAME = re.compile(r"(?:joint\[(\d+)\](?:\.tilt\[(\d+)\])?|payload)\.(.+)")


def place_of(name: str) -> tuple[int, int, str]:
    """Return the joint's and the tilt's number of a parameter, and what stands behind them.

    Numbers are from 1; joint 0 is the payload, tilt 0 the torsion.

    Example:
        >>> place_of("joint[3].tilt[1].stiffness"), place_of("payload.com.x")
        ((3, 1, 'stiffness'), (0, 0, 'com.x'))
    """
    found = _NAME.match(name)
    assert found is not None, name
    joint, tilt, kind = found.groups()
    return int(joint or 0), int(tilt or 0), kind

"""identified.toml: the start file with what was identified, and why the rest was kept."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from coupling.errors import IdentifyError
from coupling.files.robot_file import axes_of_file
from coupling.files.robot_writer import robot_text
from coupling.files.sources import SOURCES
from coupling.identify.found import Identification, rms
from coupling.identify.judge import Judged
from elastic_robot.description import Robot


def identified_text(
    found: Identification, data: Mapping[str, Any], start: Path, target: Path, source: str
) -> str:
    """Return the robot file with the identified values.

    Args:
        found: The identification.
        data: Content of the start file.
        start: The start file.
        target: Where the new one will be.
        source: What was measured, for [sources].

    Raises:
        IdentifyError: If the identification refuses to be written.
    """
    if found.refusal:
        raise IdentifyError(f"{target}: not written: {found.refusal}")
    content = copy.deepcopy(dict(data))
    sources = dict(content.pop(SOURCES, {}))
    axes = axes_of_file(start)
    tables = joint_tables(found.robot, content)
    remarks: dict[str, str] = {}
    for parameter, value in zip(found.parameters, _values(found), strict=True):
        joint, tilt = place_of(parameter.name)
        at, table = tables[joint]
        name = f"joint[{at}]" + (f".tilt[{tilt}]" if tilt else "")
        key = "backlash" if parameter.is_backlash else "stiffness"
        is_new = parameter.name in found.added
        if is_new and not parameter.identified:
            continue
        if is_new and tilt:
            description = found.robot.joints[joint - 1].tilt[tilt - 1]
            axis = np.round(axes[joint - 1].T @ description.axis, 15) + 0.0
            new = {"axis": axis.tolist(), "stiffness": value, "damping": description.damping}
            table.setdefault("tilt", []).append(new)
            sources[f"{name}.axis"] = "tested by elastic-robot identify"
            sources[f"{name}.damping"] = "the ratio to the stiffness that the joint itself has"
        elif parameter.identified:
            (table["tilt"][tilt - 1] if tilt else table)[key] = value
        remarks[f"{name}.{key}"] = _remark(parameter, found)
        if parameter.identified:
            sources[f"{name}.{key}"] = f"identified, {source}"
    content[SOURCES] = sources
    move_urdf(content, start, target)
    return robot_text(content, remarks, _head(found, start, source))


def move_urdf(content: dict[str, Any], start: Path, target: Path) -> None:
    """Let the URDF of a start file be found from where the new file will be."""
    if "urdf" in content and not content["urdf"]["file"].startswith("package://"):
        file = (start.parent / content["urdf"]["file"]).resolve()
        content["urdf"]["file"] = Path(os.path.relpath(file, target.parent.resolve())).as_posix()


def _values(found: Identification) -> list[float]:
    """Return the written values in the file's units."""
    return [float(value) for value in found.fit.elasticity.in_units(found.written)]


def _head(found: Identification, start: Path, source: str) -> str:
    kept = [p.name for p in found.parameters if not p.identified and p.name not in found.added]
    return (
        f"Made from {start.name} by elastic-robot identify: {source}.\n"
        f"Residual {1e3 * rms(found.residual):.4f} mm rms over all components, rows left out"
        f" {1e3 * rms(found.left_out):.4f} mm; this file {1e3 * found.rms_written:.4f} mm, the start"
        f" {1e3 * found.rms_start:.4f} mm.\n"
        + (f"Not identified, as in {start.name}: {', '.join(kept)}." if kept else "All identified.")
    )


def _remark(parameter: Judged, found: Identification) -> str:
    if parameter.identified:
        return f"95 %: {parameter.low:.4g} to {parameter.high:.4g}"
    at_least = f"; 95 %: {parameter.low:.4g} or more" if np.isfinite(parameter.low) else ""
    if parameter.is_backlash or parameter.low == 0.0:
        at_least = ""
    return f"NOT IDENTIFIED, start value kept: {parameter.reason}{at_least}"


def place_of(name: str) -> tuple[int, int]:
    """Return the joint's and the tilt's number of a parameter, from 1; tilt 0 for the torsion."""
    head, _, rest = name.partition("]")
    joint = int(head.removeprefix("joint["))
    tilt = int(rest[len(".tilt[") :].partition("]")[0]) if rest.startswith(".tilt[") else 0
    return joint, tilt


def joint_tables(robot: Robot, content: dict[str, Any]) -> dict[int, tuple[int, dict[str, Any]]]:
    """Return each joint's place and table in the file, by its number in the chain."""
    entries = list(enumerate(content.get("joint", []), start=1))
    if "urdf" not in content:
        return dict(zip(range(1, len(entries) + 1), entries, strict=True))
    numbers = {joint.name: i for i, joint in enumerate(robot.joints, start=1)}
    return {numbers[table["name"]]: (at, table) for at, table in entries}

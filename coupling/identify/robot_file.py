"""identified.toml: the start file with what was identified, and why the rest was kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coupling.errors import IdentifyError
from coupling.files.robot_edit import RobotEdit, place_of
from coupling.files.robot_file import axes_of_file
from coupling.identify.found import Identification, rms
from coupling.identify.judge import IdentifiedParameter


def identified_text(found: Identification, start: Path, target: Path, source: str) -> str:
    """Return the robot file with the identified values.

    Args:
        found: The identification.
        start: The start file.
        target: Where the new one will be.
        source: What was measured, for [sources].

    Raises:
        IdentifyError: If the identification refuses to be written.
        RobotFileError: If the start file cannot be read.
    """
    if found.refusal:
        raise IdentifyError(f"{target}: not written: {found.refusal}")
    file = RobotEdit(start, found.robot)
    axes = axes_of_file(start)
    for parameter, value in zip(found.parameters, _values(found), strict=True):
        joint, tilt = place_of(parameter.name)
        is_new = parameter.name in found.added
        if is_new and not parameter.identified:
            continue
        if is_new and tilt:
            description = found.robot.joints[joint - 1].tilt[tilt - 1]
            axis = np.round(axes[joint - 1].T @ description.axis, 15) + 0.0
            new = {"axis": axis.tolist(), "stiffness": value, "damping": description.damping}
            sources = {
                "axis": "tested by elastic-robot identify",
                "damping": "the ratio to the stiffness that the joint itself has",
            }
            file.add_tilt(joint, new, sources)
        if parameter.identified:
            file.change(parameter.name, value, f"identified, {source}")
        file.remark(parameter.name, _remark(parameter, found))
    return file.text(_head(found, start, source), target)


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


def _remark(parameter: IdentifiedParameter, found: Identification) -> str:
    if parameter.identified:
        return f"95 %: {parameter.low:.4g} to {parameter.high:.4g}"
    at_least = f"; 95 %: {parameter.low:.4g} or more" if np.isfinite(parameter.low) else ""
    if parameter.is_backlash or parameter.low == 0.0:
        at_least = ""
    return f"NOT IDENTIFIED, start value kept: {parameter.reason}{at_least}"

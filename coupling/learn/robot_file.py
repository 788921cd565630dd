"""learned.toml: the robot file with what was learned, and how sure it is."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from coupling.errors import LearnError
from coupling.files.robot_writer import robot_text
from coupling.files.sources import SOURCES
from coupling.identify.robot_file import joint_tables, move_urdf, place_of
from coupling.learn.judge import Judged
from coupling.learn.learning import Learned


def learned_text(found: Learned, data: Mapping[str, Any], target: Path) -> str:
    """Return the robot file with what was learned.

    Args:
        found: What was learned.
        data: Content of the first run's robot file.
        target: Where the new one will be.

    Raises:
        LearnError: If nothing should be written.
    """
    if found.refusal:
        raise LearnError(f"{target}: not written: {found.refusal}")
    start = found.sources[0].file
    content = copy.deepcopy(dict(data))
    sources = dict(content.pop(SOURCES, {}))
    measured = " and ".join(source.seen.name for source in found.sources)
    tables, remarks = joint_tables(found.robot, content), dict[str, str]()
    for own in found.parameters:
        joint, tilt = place_of(own.parameter.name)
        at, table = tables[joint]
        place = f"joint[{at}]" + (f".tilt[{tilt}]" if tilt else "")
        kind = own.parameter.kind
        if own.written != 1.0:
            (table["tilt"][tilt - 1] if tilt else table)[kind] = own.written * own.parameter.value
            sources[f"{place}.{kind}"] = f"learned, {measured}"
        remarks[f"{place}.{kind}"] = remark(own)
    content[SOURCES] = sources
    move_urdf(content, start, target)
    return robot_text(content, remarks, _head(found, start, measured))


def remark(own: Judged) -> str:
    """Return how sure a value is, in words."""
    value = own.parameter.value
    span = f"95 %: {own.low * value:.4g} to {own.high * value:.4g}"
    if own.told:
        return span
    if own.written != 1.0:
        return f"fits best beside the others, but {own.reason}; {span}"
    return f"NOT LEARNED, kept: {own.reason}"


def _head(found: Learned, start: Path, measured: str) -> str:
    before, after = found.left
    kept = [own.parameter.name for own in found.parameters if own.written == 1.0]
    return (
        f"Made from {start.name} by elastic-robot learn: {measured}.\n"
        f"Of the measurement's slow part {start.name} leaves {1e6 * before:.1f} um rms, this file"
        f" {1e6 * after:.1f} um, behind frame and clock.\n"
        + (f"Not told by it, as in {start.name}: {', '.join(kept)}." if kept else "All learned.")
    )

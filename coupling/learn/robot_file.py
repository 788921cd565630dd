"""learned.toml: the robot file with what was learned, and how sure it is."""

from __future__ import annotations

from pathlib import Path

from coupling.errors import LearnError
from coupling.files.robot_edit import RobotEdit
from coupling.learn.judge import LearnedParameter
from coupling.learn.learning import Learned


def learned_text(found: Learned, target: Path) -> str:
    """Return the robot file of the first run with what was learned.

    Args:
        found: What was learned.
        target: Where the new file will be.

    Raises:
        LearnError: If nothing should be written.
        RobotFileError: If the run's robot file cannot be read.
    """
    if found.refusal:
        raise LearnError(f"{target}: not written: {found.refusal}")
    start = found.sources[0].file
    measured = " and ".join(source.seen.name for source in found.sources)
    file = RobotEdit(start, found.robot)
    for own in found.parameters:
        if own.written != 1.0:
            value = own.written * own.parameter.value
            file.change(own.parameter.name, value, f"learned, {measured}")
        file.remark(own.parameter.name, remark(own))
    return file.text(_head(found, start, measured), target)


def remark(own: LearnedParameter) -> str:
    """Return how sure a value is, in words."""
    value = own.parameter.value
    span = f"95 %: {own.low * value:.4g} to {own.high * value:.4g}"
    if own.identifiable:
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
        + (
            f"Not identifiable from it, as in {start.name}: {', '.join(kept)}."
            if kept
            else "All learned."
        )
    )

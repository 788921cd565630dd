"""learned.toml: the robot file with what was learned, and how sure it is."""

from __future__ import annotations

from pathlib import Path

from coupling.errors import LearnError
from coupling.identification.robot_file import FileEntry, fitted_text
from coupling.identification.runs.judge import LearnedParameter
from coupling.identification.runs.learning import Learned


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
    entries = [
        FileEntry(own.name, None if own.written == own.start else own.written, remark(own))
        for own in found.parameters
    ]
    head = _head(found, start, measured)
    return fitted_text(start, found.robot, entries, f"learned, {measured}", head, target)


def remark(own: LearnedParameter) -> str:
    """Return how sure a value is, in words."""
    span = f"95 %: {own.low:.4g} to {own.high:.4g}"
    if own.identifiable:
        return span
    if own.written != own.start:
        return f"fits best beside the others, but {own.reason}; {span}"
    return f"NOT LEARNED, kept: {own.reason}"


def _head(found: Learned, start: Path, measured: str) -> str:
    before, after = found.left
    kept = [own.name for own in found.parameters if own.written == own.start]
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

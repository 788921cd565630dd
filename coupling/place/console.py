"""A placement on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from coupling.place.folder import StoredPlacement
from coupling.results.placement_result import PlacementResult, SettingResult

# What the page is called.
REPORT = "report.html"
_UM = 1e6


def print_placement(console: Console, placement: StoredPlacement, folder: Path) -> None:
    """Say in plain words what the best settings come to, and where they are."""
    figures = placement.figures
    lines = [_header(figures)]
    if figures.present is None:
        lines.append("As it is, the robot cannot follow the path.")
    lines += [_row(name, own) for name, own in figures.named]
    lines += [f"  {own.file}: {in_words(own.setting, figures.free)}" for own in figures.best]
    refused = ", ".join(f"{what} {count}" for what, count in figures.refused.items() if count)
    lines.append(
        f"{figures.settings} settings looked at; of the {figures.filling} that fill the ranges"
        f" refused: {refused or 'none'}."
    )
    if figures.limited_joints == 0:
        lines.append(
            "Warning: the robot file has no limits of its joints: look whether they are kept."
        )
    lines.append("Look whether robot, tool and part are free of collisions before you drive there.")
    lines.append(f"Placement: {folder}  (report: {folder / REPORT})")
    console.print("\n".join(lines))


def _header(figures: PlacementResult) -> str:
    moved = "process [um]" if figures.forced else "100 N [um]"
    return f"{'':<16}{moved:>13} {'backlash 20 % off [um]':>23}  backlash reversals (gear: times)"


def _row(name: str, own: SettingResult) -> str:
    remark = "" if own.admitted else "; breaks a demand of [place]"
    return (
        f"{name:<16}{_UM * own.moved_m:>13.0f} {_UM * own.exposure_m:>23.1f} "
        f" {changes(own)}{remark}"
    )


def changes(own: SettingResult) -> str:
    """Return the reversals of gears with backlash, in words.

    Args:
        own: A setting in place.json.
    """
    said = [
        f"{gear.joint}: {gear.backlash_reversals}" for gear in own.gears if gear.backlash_reversals
    ]
    return ", ".join(said) or "none"


def in_words(setting: dict[str, float], free: Sequence[str]) -> str:
    """Return the free values of a setting, in words."""
    said = []
    for name in free:
        key, unit = (f"{name}_m", "m") if f"{name}_m" in setting else (f"{name}_deg", "deg")
        said.append(f"{name.replace('_', ' ')} {np.round(setting[key], 4):g} {unit}")
    return ", ".join(said)

"""Paths that are cut in mid-motion out of the ISO 9283 path."""

from __future__ import annotations

import tempfile
import tomllib
from pathlib import Path

import numpy as np
import tomlkit

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.files.csv_table import POSE_COLUMNS, write_table
from coupling.run.execute import run_compensation
from docs.scripts.runs import CASES, example

FEED = 0.25  # [m/s]
CUTS = ((1.0, 2.5), (4.3, 5.8), (11.9, 13.4))  # in straights and in the large circle [s]
BEGINNING = 0.1  # [s]
_UM = 1e6


def sentence() -> str:
    """Return what is left at the beginning of paths that are cut."""
    whole = example("iso9283", tool_path={"feed_m_s": FEED, "sample_s": 0.004})
    first = []
    for cut in CUTS:
        with tempfile.TemporaryDirectory() as folder:
            found = run_compensation(_part_of(whole, cut, Path(folder))).correction
        distance = _UM * found.achieved.distance_to(found.desired).ravel()
        first.append(distance[found.desired.time <= BEGINNING].max())
    return (
        f"Three pieces of the ISO 9283 path at {FEED:g} m/s have deviations of {min(first):.1f}"
        f" to {max(first):.1f} um in their first {BEGINNING:g} s."
    )


def _part_of(whole: Case, cut: tuple[float, float], folder: Path) -> Case:
    """Return the case of a piece of a path, at its times."""
    desired, part = whole.desired, whole.task.part
    piece = desired.at_rows(np.arange(*np.searchsorted(desired.time, cut)))
    pose = piece.transformed(part.inverse()).pose[0]
    table = np.column_stack([piece.time - piece.time[0], pose])
    write_table(folder / "path.csv", ("time", *POSE_COLUMNS), table)
    data = tomllib.loads((CASES / "iso9283.toml").read_text(encoding="utf-8"))
    data["tool_path"] = {"kind": "csv", "file": str(folder / "path.csv")}
    file = folder / "case.toml"
    file.write_text(tomlkit.dumps(data), encoding="utf-8")
    return load_case(file)

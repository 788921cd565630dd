"""Robots that are given backlash in their gears, as their files know none."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tomlkit

from docs.scripts.experiment import scratch
from docs.scripts.runs import CASES

# Half widths of the backlash [rad], joint by joint.
EVEN, MIXED = (1e-4,) * 6, (3e-4, 1e-4, 2e-4, 1.5e-4, 4e-4, 2e-4)
KUKA = CASES.parent / "robots" / "kuka_kr210.toml"
# Where inverse kinematics starts [deg].
FANUC_HOME = [8.0, 23.0, -16.0, 0.0, -51.0, -8.0]
KUKA_HOME = [0.0, 17.2, 11.5, 0.0, 61.3, 0.0]


def kept(data: Mapping[str, Any], name: str) -> Path:
    """Return the file of a robot."""
    file = scratch(f"{name}.toml")
    file.write_text(tomlkit.dumps(data), encoding="utf-8")
    return file


def with_backlash(file: Path, backlash: Sequence[float]) -> str:
    """Return the file of a robot with backlash in its gears."""
    data = tomllib.loads(file.read_text(encoding="utf-8"))
    for joint, own in zip(data["joint"], backlash, strict=True):
        joint["backlash"] = own
    return str(kept(data, f"{file.stem}_{len(set(backlash))}"))

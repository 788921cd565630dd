"""Robots and paths that the search was not made with, learned: what the page shows of them."""

from __future__ import annotations

import tempfile
import tomllib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import tomli_w

from coupling.files.robot_file import find_robot
from docs.scripts.learning_shop import Shop
from docs.scripts.learning_studies import DEPTH, Left, Trial, Truth, case_text, hidden
from docs.scripts.page import table
from docs.scripts.runs import CASES

# Half widths of the play that robots are given whose files know none [rad], joint by joint.
EVEN, MIXED = (1e-4,) * 6, (3e-4, 1e-4, 2e-4, 1.5e-4, 4e-4, 2e-4)
KUKA = CASES.parent / "robots" / "kuka_kr210.toml"
FANUC_HOME = [8.0, 23.0, -16.0, 0.0, -51.0, -8.0]
KUKA_HOME = [0.0, 17.2, 11.5, 0.0, 61.3, 0.0]


@cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    """Return a folder for robot files that cases name, as long as the program runs."""
    return tempfile.TemporaryDirectory()


def _kept(data: Mapping[str, Any], name: str) -> Path:
    """Return the file of a robot."""
    file = Path(_folder().name, f"{name}.toml")
    file.write_text(tomli_w.dumps(data), encoding="utf-8")
    return file


def _with_play(file: Path, play: Sequence[float]) -> str:
    """Return the file of a robot with play in its gears."""
    data = tomllib.loads(file.read_text(encoding="utf-8"))
    for joint, own in zip(data["joint"], play, strict=True):
        joint["backlash"] = own
    return str(_kept(data, f"{file.stem}_{len(set(play))}"))


def _cone(home: Sequence[float], file: str, at: Sequence[float], **path: Any) -> dict[str, Any]:
    """Return the case of the cone's first contours elsewhere, by another robot."""
    return case_text(
        "cone",
        robot={"description": file, "home_deg": list(home)},
        part={"position_m": list(at)},
        tool_path={"depth_m": DEPTH} | path,
    )


def cases() -> dict[str, tuple[dict[str, Any], int]]:
    """Return cases, and the seed of the hidden robot of each, by what they are."""
    fanuc, abb = find_robot("fanuc_r2000ic"), find_robot("abb_irb7600")
    home = [0.0, 10.0, 20.0, 0.0, 60.0, 0.0]
    return {
        "FANUC R-2000iC, play 0.1 mrad": (
            _cone(FANUC_HOME, _with_play(fanuc, EVEN), (1.8, 0.0, 0.5)),
            31,
        ),
        "FANUC R-2000iC, plays of 0.1 to 0.4 mrad": (
            _cone(FANUC_HOME, _with_play(fanuc, MIXED), (1.6, 0.3, 0.6)),
            32,
        ),
        "KUKA KR 210, play 0.1 mrad": (
            _cone(KUKA_HOME, _with_play(KUKA, EVEN), (1.9, 0.1, 0.9)),
            41,
        ),
        "ABB IRB 7600, plays of 0.1 to 0.4 mrad": (
            _cone(home, _with_play(abb, MIXED), (1.7, -0.3, 0.9)),
            51,
        ),
        "example, cone elsewhere": (_cone(home, "icme2008", (1.3, 0.4, 0.6)), 61),
        "example, pyramid": (_cone(home, "icme2008", (1.6, 0.0, 0.8), kind="pyramid"), 75),
        "example, ISO 9283 at 0.25 m/s, base rolled by 6 degrees": (
            case_text(
                "iso9283",
                robot={"base_rpy_deg": [6.0, 0.0, 0.0]},
                tool_path={"feed_m_s": 0.25},
            ),
            71,
        ),
    }


def others() -> str:
    """Return what the commands leave, and what is left where all of the robot is known."""
    rows = []
    for name, (data, seed) in cases().items():
        with Shop(data) as shop:
            truth = hidden(shop.robot, seed)
            found = shop.learned(truth, Trial(), seed)
            left = (*map(str, found.left), str(_known(shop, data, truth)))
        rows.append((name, *left))
    head = ("", "as its file says", "one pass", "two passes", "all of it known")
    return table(head, rows)


def _known(shop: Shop, data: Mapping[str, Any], truth: Truth) -> Left:
    """Return what the command leaves that is made for the robot that really moves."""
    file = find_robot(data["robot"]["description"])
    robot = tomllib.loads(file.read_text(encoding="utf-8"))
    for number, joint in enumerate(robot["joint"], start=1):
        _scale(joint, f"joint[{number}]", truth)
        for tilt, own in enumerate(joint.get("tilt", []), start=1):
            _scale(own, f"joint[{number}].tilt[{tilt}]", truth)
    return shop.left_by(_kept(robot, f"known_{truth.name.replace(' ', '_')}"), truth)


def _scale(values: dict[str, Any], name: str, truth: Truth) -> None:
    """Make the values of a table of a robot file those of the robot that really moves."""
    for key in values:
        if f"{name}.{key}" in truth.factors:
            values[key] *= truth.factors[f"{name}.{key}"]

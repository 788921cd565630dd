"""Robots and paths that the search was not made with, learned: what the page shows of them."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

from coupling.files.robot_file import find_robot
from docs.scripts.learning_shop import Shop
from docs.scripts.learning_studies import DEPTH, Left, Trial, Truth, case_text, hidden
from docs.scripts.page import table
from docs.scripts.robots_with_backlash import (
    EVEN,
    FANUC_HOME,
    KUKA,
    KUKA_HOME,
    MIXED,
    kept,
    with_backlash,
)

HOME = [0.0, 10.0, 20.0, 0.0, 60.0, 0.0]


def cone_of(home: Sequence[float], file: str, at: Sequence[float], **path: Any) -> dict[str, Any]:
    """Return the case of the cone's first contours elsewhere, by another robot."""
    return case_text(
        "cone",
        robot={"description": file, "home_deg": list(home)},
        part={"position_m": list(at)},
        tool_path={"depth_m": DEPTH} | path,
    )


def rolled() -> dict[str, Any]:
    """Return the case of ISO 9283 on a base that is rolled, so that every gear is loaded."""
    return case_text(
        "iso9283", robot={"base_rpy_deg": [6.0, 0.0, 0.0]}, tool_path={"feed_m_s": 0.25}
    )


def cases() -> dict[str, tuple[dict[str, Any], int]]:
    """Return cases, and the seed of the hidden robot of each, by what they are."""
    fanuc, abb = find_robot("fanuc_r2000ic"), find_robot("abb_irb7600")
    return {
        "FANUC R-2000iC, backlash 0.1 mrad": (
            cone_of(FANUC_HOME, with_backlash(fanuc, EVEN), (1.8, 0.0, 0.5)),
            31,
        ),
        "FANUC R-2000iC, backlash of 0.1 to 0.4 mrad": (
            cone_of(FANUC_HOME, with_backlash(fanuc, MIXED), (1.6, 0.3, 0.6)),
            32,
        ),
        "KUKA KR 210, backlash 0.1 mrad": (
            cone_of(KUKA_HOME, with_backlash(KUKA, EVEN), (1.9, 0.1, 0.9)),
            41,
        ),
        "ABB IRB 7600, backlash of 0.1 to 0.4 mrad": (
            cone_of(HOME, with_backlash(abb, MIXED), (1.7, -0.3, 0.9)),
            51,
        ),
        "example, cone at another place": (cone_of(HOME, "icme2008", (1.3, 0.4, 0.6)), 61),
        "example, pyramid": (cone_of(HOME, "icme2008", (1.6, 0.0, 0.8), kind="pyramid"), 75),
        "example, ISO 9283 at 0.25 m/s, base rolled by 6 degrees": (rolled(), 71),
        "example, cone at 0.15 m/s, 4 mm deep": (
            cone_of(HOME, "icme2008", (1.6, 0.0, 0.8), feed_m_s=0.15, depth_m=0.004),
            62,
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
    head = ("", "with its file", "one run", "two runs", "true parameters")
    return table(head, rows)


def _known(shop: Shop, data: Mapping[str, Any], truth: Truth) -> Left:
    """Return what the command leaves that is made for the robot that really moves."""
    file = find_robot(data["robot"]["description"])
    robot = tomllib.loads(file.read_text(encoding="utf-8"))
    for number, joint in enumerate(robot["joint"], start=1):
        _scale(joint, f"joint[{number}]", truth)
        for tilt, own in enumerate(joint.get("tilt", []), start=1):
            _scale(own, f"joint[{number}].tilt[{tilt}]", truth)
    return shop.left_by(kept(robot, f"known_{truth.name.replace(' ', '_')}"), truth)


def _scale(values: dict[str, Any], name: str, truth: Truth) -> None:
    """Make the values of a table of a robot file those of the robot that really moves."""
    for key in values:
        if f"{name}.{key}" in truth.factors:
            values[key] *= truth.factors[f"{name}.{key}"]

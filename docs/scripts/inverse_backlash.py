"""What a wrong backlash leaves, as check says and as replays find, for docs/inverse.md."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.check.checked import checked
from coupling.files.robot_file import find_robot
from coupling.inverse.inversion import MovingRobot
from coupling.path.deviation import Deviation
from coupling.path.histories import WrenchHistory
from coupling.run.execute import run_compensation
from docs.scripts.page import table
from docs.scripts.robots_with_backlash import (
    EVEN,
    FANUC_HOME,
    KUKA,
    KUKA_HOME,
    MIXED,
    with_backlash,
)
from docs.scripts.runs import CASES as FILES
from docs.scripts.runs import example

_CONE = {"depth_m": 0.003}
_SHORT = {"depth_m": 0.0015}


def _iso(feed: float, **tables: dict[str, Any]) -> Callable[[], Case]:
    path = {"feed_m_s": feed, "sample_s": 0.004}
    return lambda: example("iso9283", tool_path=path, **tables)


def _cone(**path: Any) -> Callable[[], Case]:
    return lambda: example("cone", tool_path=_CONE | path)


def _other(file: str, home: Sequence[float], at: Sequence[float], **path: Any) -> Case:
    return example(
        "cone",
        robot={"description": file, "home_deg": list(home)},
        part={"position_m": list(at)},
        tool_path=_SHORT | path,
    )


def _abb() -> Case:
    robot = {"description": with_backlash(find_robot("abb_irb7600"), MIXED)}
    return example("iso9283", robot=robot, tool_path={"feed_m_s": 0.25})


CASES: dict[str, Callable[[], Case]] = {
    "cone, 0.05 m/s": _cone(),
    "cone, 0.15 m/s": _cone(feed_m_s=0.15),
    "cone, placed so that gears keep their flank": lambda: example("cone_robust", tool_path=_CONE),
    "pyramid, 0.15 m/s": _cone(kind="pyramid", feed_m_s=0.15),
    "ISO 9283, 0.1 m/s": _iso(0.1),
    "ISO 9283, 0.25 m/s": _iso(0.25),
    "same, drives limited to 9 rad/s²": _iso(0.25, controller={"max_acceleration_rad_s2": 9.0}),
    "same, rows every 12 ms": _iso(0.25, controller={"cycle_s": 0.012}),
    "ISO 9283, 1 m/s": _iso(1.0),
    "groove of a G-code, in air and sheet": lambda: load_case(FILES / "gcode_groove.toml"),
    "slot, milled": lambda: example("milling_20000"),
    "cone, FANUC R-2000iC, backlash of 0.1 to 0.4 mrad": lambda: _other(
        with_backlash(find_robot("fanuc_r2000ic"), MIXED), FANUC_HOME, (1.6, 0.3, 0.6)
    ),
    "cone, KUKA KR 210, backlash 0.1 mrad": lambda: _other(
        with_backlash(KUKA, EVEN), KUKA_HOME, (1.9, 0.1, 0.9)
    ),
    "pyramid, the same robot": lambda: _other(
        with_backlash(KUKA, EVEN), KUKA_HOME, (1.9, 0.1, 0.9), kind="pyramid"
    ),
    "ISO 9283, 0.25 m/s, ABB IRB 7600, backlash of 0.1 to 0.4 mrad": _abb,
}


def wrong_backlashes() -> str:
    """Return the table."""
    rows = []
    for name, make in CASES.items():
        case = make()
        begin = _cpu()
        (robot,) = checked(case, case.process.evaluate(case.desired).wrench)
        took = _cpu() - begin
        (light,) = checked(case, WrenchHistory.none(case.desired.time))
        run = run_compensation(case)
        told, alone = ([own.deviation for own in one.backlash] for one in (robot, light))
        found = [own.deviation for own in run.robustness if own.name.startswith("backlash")]
        at_rest = max((gear.backlash_error for gear in robot.gears if gear.at_risk), default=0.0)
        ratio = _largest(told) / _largest(found)
        rows.append(
            (
                name,
                f"{1e6 * at_rest:.0f}" if at_rest else "none",
                _figures(told),
                _figures(found),
                f"{ratio:.2f}",
                _figures(alone),
                f"{case.desired.time[-1]:.0f}",
                f"{took:.1f}",
            )
        )
        print(*rows[-1], flush=True)
    head = (
        *("path", "one gear, static [um]", "`check --evaluate` [um]"),
        *(
            "replays of the run [um]",
            "ratio",
            "`check`, weight only [um]",
            "path [s]",
            "CPU time [s]",
        ),
    )
    return table(head, rows)


def drift() -> str:
    """Return how many times an error of the backlash the first gears' links drift by."""
    found = []
    for make in CASES.values():
        placed = make().robots[0]
        moving = MovingRobot(placed.description, placed.torque_curve)
        (inertia,) = moving.model.yielding_inertia(moving.model.chain.theta(placed.home[None]))
        gear = int(moving.model.chain.torsions[0])
        parameters = moving.model.parameters
        stiffness, damping = parameters.stiffness[gear], parameters.damping[gear]
        found.append(float(np.sqrt(stiffness * inertia[0])) / damping)
    return (
        f"At the home posture $1 / 2 \\zeta$ is {min(found):.0f} to {max(found):.0f} for the first gear"
        " of the robots below."
    )


def _cpu() -> float:
    """Return the time of this process and of those that it has ended [s]."""
    return sum(os.times()[:4])


def _largest(deviations: Sequence[Deviation]) -> float:
    return max(own.maximum for own in deviations)


def _figures(deviations: Sequence[Deviation]) -> str:
    rest = max(own.maximum_less_constant for own in deviations)
    return " / ".join(
        f"{float(f'{1e6 * figure:.3g}'):g}" for figure in (_largest(deviations), rest)
    )

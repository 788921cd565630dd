"""Tables of the comparison of implementations, as Markdown."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping

from coupling.path.histories import ToolPath
from docs.scripts.page import table
from examples.compare_implementations import (
    CURVES,
    LOAD,
    NO_LOAD,
    STEPS,
    Both,
    at_rest,
    desired,
    iso_path,
    kinematics,
    rest_at_start,
    rms,
    robot,
    settling_time,
)

_UM, _MM = 1e6, 1e3


def statics() -> str:
    """Return the differences of kinematics and rest between the implementations."""
    cases = [("(a) neither gravity nor load", kinematics())]
    for curve, name in CURVES.items():
        cases.append((f"(b) gravity, {name}", at_rest(robot, curve, NO_LOAD)))
        cases.append((f"(b) gravity and load, {name}", at_rest(robot, curve, LOAD)))
    return table(
        ("largest difference over ten postures", "position [m]", "orientation [rad]"),
        ((name, f"{both.distance.max():.1e}", f"{both.angle.max():.1e}") for name, both in cases),
    )


def sag_and_settling(falls: Mapping[str, Both]) -> str:
    """Return sag and settling time of the robot where the path begins."""
    rows = []
    height = desired().position[0, 0, 2]
    for curve, fall in falls.items():
        rest = rest_at_start(curve)
        sags = [
            f"{_MM * (path.position[0, 0, 2] - height):.6f}" for path in (rest.ours, rest.mujoco)
        ]
        times = [f"{settling_time(path):.3f}" for path in (fall.ours, fall.mujoco)]
        rows.append((CURVES[curve], *sags, *times))
    return table(("", "sag [mm]", "by MuJoCo", "settling time [s]", "by MuJoCo"), rows)


def between_implementations(paths: Mapping[str, Both]) -> str:
    """Return their differences along the path, beside what MuJoCo's step is worth."""
    rows = []
    for curve, both in paths.items():
        change = iso_path(curve).mujoco(2.0 * STEPS[curve]).distance_to(both.mujoco)
        rows.append(
            (
                CURVES[curve],
                f"{both.distance.max():.1e}",
                f"{rms(both.distance):.1e}",
                f"{change.max():.1e}",
                f"{_MM * STEPS[curve]:g}",
            )
        )
    head = ("", "max [m]", "rms [m]", "MuJoCo with half the step, max [m]", "that step [ms]")
    return table(head, rows)


def between_torque_curves(paths: Mapping[str, Both]) -> str:
    """Return the differences of the paths from the rigid one and from each other."""

    def row(name: str, pairs: Iterable[tuple[ToolPath, ToolPath]]) -> list[str]:
        distances = [_UM * first.distance_to(second) for first, second in pairs]
        largest = [f"{distance.max():.3f}" for distance in distances]
        return [name, *largest, *(f"{rms(distance):.3f}" for distance in distances)]

    rigid = desired()
    rows = [
        row(f"rigid / {CURVES[curve]}", ((both.ours, rigid), (both.mujoco, rigid)))
        for curve, both in paths.items()
    ]
    for (one, first), (other, second) in itertools.combinations(paths.items(), 2):
        pairs = ((first.ours, second.ours), (first.mujoco, second.mujoco))
        rows.append(row(f"{CURVES[one]} / {CURVES[other]}", pairs))
    return table(("between", "max [um]", "by MuJoCo", "rms [um]", "by MuJoCo"), rows)

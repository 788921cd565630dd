"""What a command leaves on a robot that has drives: cone and ISO 9283 path of the examples, a KR 300.

Corrected for drives that are where their command is, run on the motors, servos and friction of its file;
corrected for those; and this on robots whose drives are not as the file says.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

from coupling.case.file import Case
from coupling.case.robots import OneOfDrives
from coupling.events import unwatched
from coupling.path.deviation import Deviation, measure
from coupling.run.execute import loop_of
from coupling.run.models import Models, cell_of
from coupling.run.plant import coupled_on
from coupling.solve.correction import Correction
from docs.scripts.page import table
from docs.scripts.runs import example
from docs.scripts.trust_comparison import Against, Comparison
from elastic_robot.description import Drive, Robot

PATHS = {"cone": "the example cone", "iso9283": "ISO 9283 path"}
# Other drives than those of the file; the Coulomb friction of recordings A and B differs by 2 to 45 %.
OTHERS: dict[str, Callable[[Drive], Drive]] = {
    "friction 20 % more": lambda d: replace(d, friction=1.2 * d.friction, viscous=1.2 * d.viscous),
    "friction 20 % less": lambda d: replace(d, friction=0.8 * d.friction, viscous=0.8 * d.viscous),
    "gain of the position loop 10 % less": lambda d: replace(
        d, position_gain=0.9 * d.position_gain
    ),
    "gain of the rate loop 20 % less": lambda d: replace(d, rate_gain=0.8 * d.rate_gain),
}


def with_drives(robot: Robot, other: Callable[[Drive], Drive]) -> Robot:
    """Return the robot with other drives."""
    joints = [
        joint if joint.drive is None else replace(joint, drive=other(joint.drive))
        for joint in robot.joints
    ]
    return replace(robot, joints=tuple(joints))


@cache
def left(path: str) -> dict[str, Deviation]:
    """Return what commands of the KR 300 leave along a path of the examples."""
    return left_in(example(path, robot={"description": "kuka_kr300"}))


def left_in(case: Case) -> dict[str, Deviation]:
    """Return what commands leave in a case of a robot with servos, by what was done.

    Raises:
        RuntimeError: If a correction or a coupling does not converge.
    """
    rows: dict[str, Deviation] = {}
    with Models("native") as models:
        found = _corrected(case, models, "ideal")
        rows["ideal drives, not corrected"] = measure(found.before.path, found.desired)
        rows["ideal drives, corrected"] = measure(found.achieved, found.desired)
        rows["that command on the servos"] = _moved(case, models, found, case.robots[0].description)
        found = _corrected(case, models, "servo")
        rows["servos, not corrected"] = measure(found.before.path, found.desired)
        rows["servos, corrected for them"] = measure(found.achieved, found.desired)
        for name, other in OTHERS.items():
            robot = with_drives(case.robots[0].description, other)
            rows[f"that command, {name}"] = _moved(case, models, found, robot)
    return rows


def _corrected(case: Case, models: Models, drive: OneOfDrives) -> Correction:
    """Return the correction for such drives.

    Raises:
        RuntimeError: If that does not converge.
    """
    cell, _ = cell_of([replace(robot, drive=drive) for robot in case.robots], models)
    found = case.method.correct(loop_of(case, cell), case.motion)
    if not found.converged:
        raise RuntimeError(found.reason)
    return found


def _moved(case: Case, models: Models, found: Correction, robot: Robot) -> Deviation:
    """Return what a command leaves on a robot with servos that is coupled with the process anew.

    Raises:
        RuntimeError: If that does not converge.
    """
    placed = [replace(case.robots[0], description=robot, drive="servo")]
    cell, _ = cell_of(placed, models)
    coupling = coupled_on(case, cell, 1.0, found.joints, found.achieved, unwatched)
    if not coupling.converged:
        raise RuntimeError(coupling.reason)
    return measure(coupling.path, found.desired)


def in_micrometres(metres: float) -> str:
    """Return a length in words [um]."""
    return f"{1e6 * metres:{'.1g' if metres < 5e-8 else '.2g' if metres < 1e-5 else '.0f'}}"


def drives_table() -> str:
    """Return the page's table: what is left of both paths [um]."""
    found = {words: left(path) for path, words in PATHS.items()}
    names = next(iter(found.values()))
    lines = [
        (
            name,
            *(
                f"{in_micrometres(rows[name].maximum)} / {in_micrometres(rows[name].rms)}"
                for rows in found.values()
            ),
        )
        for name in names
    ]
    return table(("a KR 300, largest / rms deviation [um]", *found), lines)


def values() -> dict[str, Any]:
    """Return what the page says of it, by the names of its template."""
    cone = left("cone")
    before = cone["servos, not corrected"].maximum
    entries = {
        "driven": ("servos, corrected for them", "robot with drives as its file", Against.PROGRAM),
        "undriven": ("that command on the servos", "robot's drives ignored", Against.ROBOT),
        "rubbed": ("that command, friction 20 % less", "off by 20 % of friction", Against.ROBOT),
    }
    return {
        "drives": drives_table(),
        **{
            key: Comparison(
                f"command, {what}",
                against,
                cone[row].maximum,
                before,
                f"{in_micrometres(cone[row].maximum)} of {in_micrometres(before)} um",
            )
            for key, (row, what, against) in entries.items()
        },
    }

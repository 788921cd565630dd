"""What a run comes to, in a sentence with its conditions."""

from __future__ import annotations

from collections.abc import Sequence

from coupling.path.deviation import Deviation
from coupling.report.run_tables import mode_names
from coupling.report.section import Section
from coupling.report.style import UM
from coupling.results.run_result import ReplayResult, RunResult

# Where a turn of the tool is reported: a point so far from its TCP [m] is off by more than the TCP for
# it, and by so much at least [m].
_LEVER, _TOLD = 0.1, 1e-5


def verdict(figures: RunResult, process: str) -> Section:
    """Return what a run comes to.

    Args:
        figures: Content of result.json.
    """
    reason = figures.reason
    state = reason[:1].upper() + reason[1:] if figures.converged else f"NOT CONVERGED: {reason}"
    sentences = [f"{state}.", sentence(figures, process)]
    forecast, outlook = figures.forecast, figures.outlook
    if forecast is not None:
        sentences.insert(0, f"{forecast.sentence}.")
    gains = outlook is None or outlook.gains
    if outlook is not None:
        sentences.insert(2 if gains else 0, outlook.sentence)
    return Section("", sentences, good=figures.converged and gains)


def sentence(figures: RunResult, process: str) -> str:
    """Return the same without the iteration's reason and what is expected on other robots."""
    # Without inertia there are no motors.
    moved = figures.mode == "dynamic"
    robots = " and ".join(
        f"{robot.title} ({robot.description}, torque curve {robot.torque_curve}"
        f"{', motors under their servos' if moved and robot.drive == 'servo' else ''})"
        for robot in figures.robots
    )
    before, after = (figures.deviation_before_m.maximum, figures.deviation_after_m.maximum)
    turned = _turned(figures.deviations[-1])
    if figures.kind == "couple":
        what = f"Commanded along its path as it is, the tool is up to {_um(before)} off{turned}"
    else:
        what = (
            f"The command leads the tool to within {_um(after)} of its path{turned}, {_um(before)}"
            " without"
        )
    own, _ = mode_names(figures.mode)
    count = "the file describes it" if len(figures.robots) == 1 else "the files describe them"
    return (
        f"{what}, for the {own} {robots} as {count}, under the process {process} on the tool's actual"
        f" path; {_of_gears(figures)}."
    )


def _turned(left: Deviation) -> str:
    """Return how far the tool's orientation is off, in words; "" where its position is off by more."""
    moved = _LEVER * left.largest_turn
    if not moved > max(left.maximum, _TOLD):
        return ""
    angle = f"{float(f'{UM * left.largest_turn:.3g}'):g} urad"
    return f" and turned by {angle} at most ({_um(moved)} at {_LEVER:g} m from the TCP)"


def _of_gears(figures: RunResult) -> str:
    """Return what an error of the backlash would do, and those of what not every robot has."""
    sentences = [_of_backlash(figures)]
    others = {"hysteresis": "gears", "friction": "motors", "servo gain": "motors"}
    for name, where in {**others, "kinematic error": "gears"}.items():
        rows = [row for row in figures.robustness if row.name.startswith(name)]
        sentences += [_worst(rows, where)] if rows else []
    return "; ".join(sentences)


def _worst(rows: Sequence[ReplayResult], where: str = "gears") -> str:
    worst = max(rows, key=lambda row: row.deviation_m.maximum)
    return f"{worst.name} in all {where} would leave {_um(worst.deviation_m.maximum)}"


def _of_backlash(figures: RunResult) -> str:
    """Return what an error of the backlash would do."""
    rows = [row for row in figures.robustness if row.name.startswith("backlash")]
    if rows:
        return _worst(rows)
    with_backlash = [gear for gear in figures.gears if gear.backlash_20_percent_m > 0.0]
    if figures.gears and not with_backlash:
        return "no gear has backlash in this model"
    gears = [gear for gear in with_backlash if gear.backlash_reversals or gear.in_backlash_s]
    if gears:
        names = ", ".join(dict.fromkeys(f"joint {gear.joint}" for gear in gears))
        return (
            f"a wrong backlash would show, a compensation computes by how much: gears reverse or"
            f" are unloaded in their backlash ({names})"
        )
    return "a wrong backlash would show as little but a constant: no gear reverses"


def _um(length: float) -> str:
    return f"{float(f'{UM * length:.3g}'):g} um"

"""What a run comes to, in a sentence with its conditions."""

from __future__ import annotations

import html

from coupling.report.tables import mode_names
from coupling.results.run_result import RunResult

_UM = 1e6


def verdict(figures: RunResult, process: str) -> str:
    """Return what a run comes to, as HTML.

    Args:
        figures: Content of result.json.
        process: Name of the process's model.
    """
    state = "yes" if figures.converged else "no"
    word = "Converged" if figures.converged else "Not converged"
    text = sentence(figures, process) + " (" + figures.reason + ".)"
    told = f"<b>{word}</b>: {html.escape(text)}"
    forecast, outlook = figures.forecast, figures.outlook
    if forecast is not None:
        told = f"<b>{html.escape(forecast.sentence)}.</b><br>{told}"
    if outlook is None:
        return f'<p class="verdict {state}">{told}</p>'
    expected = html.escape(outlook.sentence)
    if outlook.gains:
        return f'<p class="verdict {state}">{told}<br>{expected}</p>'
    return f'<p class="verdict no"><b>{expected}</b><br>{told}</p>'


def sentence(figures: RunResult, process: str) -> str:
    """Return the same in plain text, without the iteration's reason."""
    robots = " and ".join(
        f"{robot.title} ({robot.description}, torque curve {robot.torque_curve})"
        for robot in figures.robots
    )
    before, after = (figures.deviation_before_m.maximum, figures.deviation_after_m.maximum)
    if figures.kind == "couple":
        what = f"commanded along its path as it is, the tool is up to {_um(before)} off"
    else:
        what = (
            f"the command leads the tool to within {_um(after)} of its path, {_um(before)} without"
        )
    own, _ = mode_names(figures.mode)
    count = "the file describes it" if len(figures.robots) == 1 else "the files describe them"
    return (
        f"{what}, for the {own} {robots} as {count}, under the process {process} on the path that the"
        f" tool really takes; {_of_backlash(figures)}."
    )


def _of_backlash(figures: RunResult) -> str:
    """Return what an error of the backlash would do."""
    rows = [row for row in figures.robustness if row.name.startswith("backlash")]
    if rows:
        worst = max(rows, key=lambda row: row.deviation_m.maximum)
        return f"{worst.name} in all gears would leave {_um(worst.deviation_m.maximum)}"
    with_backlash = [gear for gear in figures.gears if gear.backlash_20_percent_m > 0.0]
    if figures.gears and not with_backlash:
        return "no gear has backlash in this model"
    gears = [gear for gear in with_backlash if gear.backlash_reversals or gear.in_backlash_s]
    if gears:
        names = ", ".join(dict.fromkeys(f"joint {gear.joint}" for gear in gears))
        return (
            f"a wrong backlash would show, by how much a compensation tells: gears reverse or"
            f" are unloaded in their backlash ({names})"
        )
    return "a wrong backlash would show as little but a constant: no gear reverses"


def _um(length: float) -> str:
    return f"{float(f'{_UM * length:.3g}'):g} um"

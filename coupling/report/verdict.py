"""What a run comes to, in a sentence with its conditions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from coupling.path.deviation import Deviation
from coupling.path.length_text import in_words
from coupling.report.lengths import three_digits
from coupling.report.run_tables import mode_names
from coupling.results.replay import Replay
from coupling.results.run_result import RunResult
from coupling.results.section import UM, Section
from coupling.robot.parameter_table import VARIED

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
    stability = figures.stability
    if stability is not None and not stability.stable:  # the reason says so
        state = f"UNSTABLE: {reason}"
    elif stability is not None:
        state += f"; {stability.sentence[:1].lower()}{stability.sentence[1:]}"
    sentences = [f"{state}.", sentence(figures, process)]
    forecast, outlook = figures.forecast, figures.outlook
    if forecast is not None:
        sentences.insert(0, f"{forecast.sentence}.")
    if outlook is not None:
        sentences.insert(2 if figures.gains else 0, outlook.sentence)
    sentences += _of_class(figures)
    return Section("", sentences, good=figures.converged and figures.gains and figures.is_stable)


def sentence(figures: RunResult, process: str) -> str:
    """Return the same without the iteration's reason and what is expected on other robots."""
    # Without inertia there are no motors.
    is_dynamic = figures.mode == "dynamic"
    robots = " and ".join(
        f"{robot.title} ({robot.description}, torque curve {robot.torque_curve}"
        f"{', motors under their servos' if is_dynamic and robot.drive == 'servo' else ''})"
        for robot in figures.robots
    )
    before, after = (figures.deviation_before_m.maximum, figures.deviation_after_m.maximum)
    turn_words = _describe_turn(figures.deviations[-1])
    if figures.kind == "couple":
        what = f"Uncorrected, the tool deviates from its path by {_up_to(before)}{turn_words}"
    else:
        what = (
            f"Under the command the tool deviates from its path by {_up_to(after)}{turn_words},"
            f" uncorrected by {_up_to(before)}"
        )
    mode, _ = mode_names(figures.mode)
    count = "its file" if len(figures.robots) == 1 else "their files"
    return (
        f"{what}. Valid for the {mode} {robots} with the parameters of {count}, and for the process"
        f" {process} on the tool's actual path; {_of_gears(figures)}."
    )


def _up_to(length: float) -> str:
    """Return a largest deviation [m] in words."""
    return "less than 1 um" if length < 1e-6 else f"up to {in_words(length)}"


def _of_class(figures: RunResult) -> Iterator[str]:
    """Yield a sentence where the stiffness of gears is known as a range."""
    ranges = [
        robot.stiffness_range_Nm_rad for robot in figures.robots if robot.stiffness_range_Nm_rad
    ]
    if not ranges:
        return
    low, high = min(ranges)[0], max(high for _, high in ranges)
    yield (
        f"The stiffness of the gears is known as a range ({three_digits(low)} to {three_digits(high)}"
        " N m/rad)."
    )


def _describe_turn(deviation: Deviation) -> str:
    """Return how far the tool's orientation is off, in words; "" where its position is off by more."""
    arc_m = _LEVER * deviation.largest_turn
    if not arc_m > max(deviation.maximum, _TOLD):
        return ""
    angle = f"{three_digits(UM * deviation.largest_turn)} urad"
    return f" and rotates by up to {angle} ({in_words(arc_m)} at {_LEVER:g} m from the TCP)"


def _of_gears(figures: RunResult) -> str:
    """Return what an error of the backlash would do, and those of what not every robot has."""
    sentences = [_of_backlash(figures)]
    for _, variation in VARIED.values():
        if variation.place:
            names = variation.named_replays
            rows = [row for row in figures.robustness if row.name in names]
            sentences += [_worst(rows, variation.place)] if rows else []
    return "; ".join(sentences)


def _worst(rows: Sequence[Replay], where: str = "gears") -> str:
    worst = max(rows, key=lambda row: row.deviation.maximum)
    return f"with {worst.name} in all {where} {in_words(worst.deviation.maximum)} would remain"


def _of_backlash(figures: RunResult) -> str:
    """Return what an error of the backlash would do."""
    rows = [row for row in figures.robustness if row.name.startswith("backlash")]
    if rows:
        return _worst(rows)
    with_backlash = [gear for gear in figures.gears if gear.backlash_error > 0.0]
    if not with_backlash:
        return "no gear has backlash in this model"
    gears = [gear for gear in with_backlash if gear.reversals or gear.in_backlash]
    if gears:
        names = ", ".join(dict.fromkeys(f"joint {gear.joint}" for gear in gears))
        return (
            f"gears reverse or are unloaded in their backlash ({names}), so that an error of the"
            " backlash has an effect, which a compensation computes"
        )
    return (
        "no gear reverses, so that an error of the backlash causes little but a constant deviation"
    )

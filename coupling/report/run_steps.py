"""What to do after a run, as commands that can be copied."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from coupling.report.lengths import state_tolerance
from coupling.results.iteration_result import CORRECTIONS, QUASISTATIC_VALIDATION
from coupling.results.replay import Worsening
from coupling.results.run_result import RunResult
from coupling.results.section import NextStep

# Gears that are named on the first screen.
_NAMED = 2

# Part of what is allowed that is as good as nothing.
_SMALL = 0.02

# Purposes of steps.
STABLE = "Find a depth and speed that do not chatter:"
STIFFER = "Find a place where the robot is stiffer:"


@dataclass(frozen=True)
class RunContext:
    """What a first screen needs beside a run's figures.

    Attributes:
        folder, case: Run folder and case file, as commands name them.
        robots: Robot files, as the case names them, by the robots' names.
        tolerance: Deviation that the part allows [m]; None where it is not stated.
        learning: Page of how the command was learned from measured runs; empty where there is none.
    """

    folder: str
    case: str
    robots: Mapping[str, str]
    tolerance: float | None = None
    learning: str = ""


def is_enough(figures: RunResult, context: RunContext) -> bool:
    """Return whether an iteration without a result came so near that its tolerance is to be raised."""
    allowed = figures.deviation_before_m.maximum if context.tolerance is None else context.tolerance
    return figures.deviation_after_m.maximum <= _SMALL * allowed


def is_validated_quasistatic(figures: RunResult) -> bool:
    """Return whether an inverse failed on a robot without inertia, for which it was not computed."""
    return not figures.converged and QUASISTATIC_VALIDATION in figures.reason


def repeat_alike(context: RunContext) -> NextStep:
    """Return the step after a process that answers one path differently."""
    return NextStep.by(
        "Make the process repeatable (a fixed seed, a fresh start), or average its forces; this shows"
        " whether it is:",
        *("check", context.case, "--evaluate"),
    )


def critical_joints(figures: RunResult, robot: str | None = None) -> str:
    """Return the joints whose backlash is felt most along the path, in words; empty for none.

    Args:
        robot: Name of the robot whose joints are asked for; None: they are named with their robots.
    """
    gears = [
        gear
        for gear in figures.gears
        if gear.at_risk and gear.reversals and robot in (None, gear.robot)
    ]
    worst = sorted(gears, key=lambda gear: -gear.backlash_error)[:_NAMED]
    is_named = robot is None and len(figures.robots) > 1
    return " and ".join(
        f"joint {gear.joint}{f' of the {gear.robot} robot' if is_named else ''}"
        for gear in sorted(worst, key=lambda gear: (gear.robot or "", gear.joint))
    )


def gears_of(joints: str) -> str:
    """Return the gears of joints that are named in words.

    Example:
        >>> gears_of("joint 5"), gears_of("joint 1 and joint 5")
        ('gear of joint 5', 'gears of joint 1 and joint 5')
    """
    return f"{'gears' if ' and ' in joints else 'gear'} of {joints}"


def _plans(figures: RunResult, context: RunContext) -> Iterator[NextStep]:
    """Yield the steps that plan the measurement of every robot."""
    for robot in figures.robots:
        is_alone = len(figures.robots) == 1
        joints = critical_joints(figures, None if is_alone else robot.name)
        who = "robot" if is_alone else f"{robot.name} robot"
        plan = "plan.csv" if is_alone else f"plan_{robot.name}.csv"
        yield NextStep.by(
            f"Measure the {who}{f', the {gears_of(joints)} first' if joints else ''}; this plans it:",
            *("identify", "--plan", "--robot", context.robots[robot.name], "-o", plan),
        )


def run_steps(
    figures: RunResult, context: RunContext, good: bool | None, shift: Worsening | None
) -> Iterator[NextStep]:
    """Yield what to do next; `place` and `next` are for one robot.

    Args:
        good: Whether the command is good enough; None where that is open.
        shift: Robot on which a shift of the part does as well; None for none.
    """
    folder, is_alone = context.folder, len(figures.robots) == 1
    if not figures.is_stable:
        yield NextStep.by(STABLE, "stability", context.case)
        return
    if not figures.converged and is_enough(figures, context):
        ask = 1.5 * figures.deviation_after_m.maximum
        yield NextStep.by(
            f"Ask for less: tolerance_m = {ask:.1g} in [compensation] of {context.case}; then again:",
            *("compensate", context.case, "-o", folder, "--overwrite"),
        )
        return
    if is_validated_quasistatic(figures):
        yield NextStep.by(
            f'Validate it on the robot that moves, mode = "dynamic" in [robot] of {context.case}:',
            *("compensate", context.case, "-o", folder, "--overwrite"),
        )
        yield NextStep(
            f'Or correct the other: method = "mirror" in [compensation] of {context.case}.'
        )
        return
    if figures.disturbing_difference is not None:
        yield repeat_alike(context)
        return
    if not figures.converged:
        if figures.outcome == "exhausted" and CORRECTIONS in figures.reason:
            yield NextStep.by(
                f"Allow it more steps, max_passes in [compensation] of {context.case}; then again:",
                *("compensate", context.case, "-o", folder, "--overwrite"),
            )
        yield NextStep.by("See whether robot and path fit each other:", "check", context.case)
        if is_alone:
            yield NextStep.by(STIFFER, "place", context.case)
        return
    if context.tolerance is None:
        yield state_tolerance(context.case)
    if shift is not None:
        touch_off = "" if figures.touched_off else f"touch_off = true in [part] of {context.case}, "
        yield NextStep.by(
            f"Touch the part off and run it uncorrected; {touch_off}this computes what remains:",
            *("couple", context.case, "-o", f"{folder}_uncorrected"),
        )
    if good is not True and figures.forecast is None:
        yield from _plans(figures, context)
        if is_alone and any(gear.at_risk for gear in figures.gears):
            yield NextStep.by("Or place the part where no gear reverses:", "place", context.case)
    is_worse = figures.outlook is not None and figures.outlook.worse is not None
    if is_worse or (shift is not None and not is_alone):
        return
    purpose = "Write the robot program:"
    if shift is not None:
        purpose = "Or learn the robot from a part made under this command; write its program:"
    yield NextStep.export(purpose, folder, figures.robots[0].title)
    if context.learning:
        yield NextStep(
            f"Run it, measure again, and go on from all runs: the command stands in {context.learning}."
        )
    elif is_alone:
        yield NextStep.by(
            "Run it, measure the tool's path, and correct what remains:",
            *("next", folder, "measured.csv", "-o", f"{folder}_next"),
        )

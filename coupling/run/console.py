"""What a run shows on the terminal: progress, a row per evaluation, a summary in plain words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from coupling import events
from coupling.case.file import Case
from coupling.events import Event
from coupling.inverse.diagnosis import GearDiagnosis
from coupling.path.deviation import Deviation, ToolGap, measure
from coupling.path.histories import ToolPath
from coupling.results.outlook import Replay
from coupling.results.run_result import GapResult
from coupling.robot.robot import BacklashReversal
from coupling.run.deviations import Deviations
from coupling.run.execute import Run, RunBegins
from coupling.run.figures import outlook_of
from coupling.run.plant import PlantReplay
from coupling.run.tooth_passing import tooth_passing_parts
from coupling.solve.correction import HOW, CorrectionIteration, RefinedTimes
from coupling.solve.fixed_point import Evaluated, Evaluation
from coupling.store import WaitingForOther

_HEADER = (
    f"{'eval':>5} {'path change max':>16} {'rms':>10} {'force change':>13} {'deviation':>11}\n"
    f"{'':>5} {'[um]':>16} {'[um]':>10} {'[%]':>13} {'[um]':>11}"
)


class RunView:
    """Shows a run while it goes on; a context manager that clears its progress bar.

    Args:
        console: Console to write to; text is no markup to it.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._progress = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.fields[count]}"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
        )
        self._task = self._progress.add_task("", visible=False, count="")
        self._desired: ToolPath | None = None
        self._count = 0

    def __enter__(self) -> RunView:
        self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._progress.stop()

    def watch(self, event: Event) -> None:
        """Show what happens."""
        match event:
            case events.Progress():
                self._working(event)
            case events.ProcessMessage(line):
                self._said(f"process: {line}")
            case WaitingForOther(text):
                self._print(text)
            case events.WarningEvent(text):
                self._print(f"Warning: {text}", "yellow")
            case RunBegins(desired):
                self._desired = desired
                self._print(_HEADER, "bold")
            case RefinedTimes(desired):
                self._desired = desired
            case Evaluated(evaluation, path):
                self._evaluated(evaluation, path)
            case CorrectionIteration():
                self._passed(event)

    def _working(self, work: events.Progress) -> None:
        self._progress.update(
            self._task,
            description=work.what,
            completed=work.done,
            total=work.total,
            count=f"{work.done}/{work.total} steps",
            visible=work.done < work.total,
        )

    def _said(self, line: str) -> None:
        self._progress.update(self._task, description=line, total=None, count="", visible=True)

    def _evaluated(self, evaluation: Evaluation, path: ToolPath) -> None:
        assert self._desired is not None
        self._count += 1
        first = evaluation.number == 1
        force = "" if first else f"{100.0 * evaluation.force_change:.4f}"
        deviation = measure(path, self._desired).maximum
        self._print(
            f"{self._count:>5} {1e6 * evaluation.path_change:>16.4f}"
            f" {1e6 * evaluation.path_change_rms:>10.4f} {force:>13} {1e6 * deviation:>11.3f}"
        )

    def _passed(self, finished: CorrectionIteration) -> None:
        text = f"      iteration {finished.number}: deviation max {_um(finished.deviation.maximum)}"
        text += f", rms {_um(finished.deviation.rms)}"
        correction = finished.correction
        if correction is not None:
            text += (
                f"; largest step of the correction {_um(correction.largest_step)} at t ="
                f" {correction.step_time:.2f} s"
            )
            if correction.limited_samples:
                text += f"; rate limited at {correction.limited_samples} samples"
        self._print(text, "cyan")

    def _print(self, text: str, style: str | None = None) -> None:
        self._console.print(text, style=style)


def print_summary(
    console: Console, case: Case, run: Run, folder: Path, from_store: int = 0
) -> None:
    """Say in plain words what a run found and where it is.

    Args:
        console: Console to write to; text is no markup to it.
        case: The case.
        run: The run.
        folder: Its folder.
        from_store: Number of answers of the process that were taken from the store.
    """
    mode, compensated = case.mode, run.kind == "compensate"
    found, deviations = run.correction, Deviations.of(run)
    how = HOW[found.before.how]
    lines = [
        f"{'Converged' if found.converged else 'NOT CONVERGED'}: {found.reason}.",
        f"{'Before compensation the' if compensated else 'The'} {mode} robot, {how}, deviates by"
        f" {_figures(deviations.before)}",
        f"  gravity alone (no process):          {_figures(deviations.gravity)}",
        f"  process alone (loaded - unloaded):   {_figures(deviations.process)}",
    ]
    lines += case.touch_off_remarks
    if compensated:
        lines.append(
            f"After compensation the {mode} robot, with the process on the path that it really takes,"
            f" deviates by {_figures(deviations.after)}"
        )
    if compensated and mode != "dynamic" and deviations.dynamic is not None:
        lines.append(
            f"The dynamic robot under the same command and wrench deviates by"
            f" {_figures(deviations.dynamic)}"
        )
    outlook = outlook_of(run, deviations.before) if compensated else None
    if outlook is not None:
        lines.insert(1 if outlook.gains else 0, outlook.sentence)
    if run.robustness:
        lines += _of_other_robots(run.robustness)
    if run.forecast is not None:
        lines.insert(0, f"{run.forecast.sentence}.")
    if run.plant is not None:
        lines += _of_plant(run.plant)
    if found.backlash_reversals:
        lines.append(_of_gears(found.backlash_reversals, run.robustness))
    lines += [
        line
        for name, gears in zip(run.robots, run.gears, strict=True)
        for line in gear_lines(gears, name if len(run.robots) > 1 else "")
    ]
    if run.gap is not None:
        lines += _of_cell(run, run.gap, compensated)
    parts = tooth_passing_parts(run)
    if parts is not None:
        slow = max(part.largest_slow for part in parts)
        ripple = max(part.largest_ripple for part in parts)
        lines.append(
            f"The force repeats with every tooth: the slow part of the deviation is at most"
            f" {_um(slow)}, the ripple"
            f" around it {_um(ripple)}."
        )
    taken = f", {from_store} of them from the store" if from_store else ""
    lines += [
        f"Peak force {found.answer.wrench.peak_force:.1f} N; {found.evaluations} evaluations of the"
        f" process{taken}; {sum(run.durations.values()):.1f} s.",
    ]
    lines += [f"Warning: {warning}" for warning in run.warnings]
    lines += [f"Remark: {remark}" for remark in run.remarks]
    lines.append(f"Result: {folder}  (report: {folder / 'report.html'})")
    if outlook is not None and not outlook.gains:
        lines.append(
            "Do not send this command to a robot yet: it may be worse than none, see above."
        )
    safe = found.converged and (outlook is None or outlook.gains)
    style = None if safe else "yellow"
    console.print("\n".join(lines), style=style)


def _of_other_robots(replays: Sequence[Replay]) -> list[str]:
    """Return what the command leaves on robots that differ from the model."""
    return [
        "The command assumes the robot's parameters. As written, on dynamic robots that differ:",
        *(
            f"  {replay.name + ':':<37}max {_um(replay.deviation.maximum)},"
            f" rms {_um(replay.deviation.rms)}{_less_constant(replay.deviation)}"
            for replay in replays
        ),
    ]


def _of_plant(plant: PlantReplay) -> list[str]:
    """Return what the command leaves on the plant."""
    what = ", ".join(plant.differences) or "no difference"
    if plant.coupling is None:
        how = "under the wrench on the model"
    else:
        count, state = len(plant.coupling.evaluations), plant.coupling.outcome.value
        how = f"coupled with its process ({state}, {count} evaluations)"
    lines = [f"On the plant ({what}), {how}, the tool deviates by {_figures(plant.deviation())}"]
    return lines + ([f"  Warning: {plant.remark}"] if plant.remark else [])


def _of_gears(changes: Sequence[BacklashReversal], replays: Sequence[Replay]) -> str:
    """Return how often which gear passes through its backlash, and what a wrong one leaves."""
    counts = Counter((change.robot, change.joint) for change in changes)
    each = ", ".join(
        f"{f'{robot} ' if robot else ''}joint {joint}: {count}"
        for (robot, joint), count in sorted(counts.items())
    )
    left = [own.deviation.maximum for own in replays if own.name.startswith("backlash")]
    much = f", by up to {_um(max(left))} where all are 20 % off" if left else ""
    return (
        f"Gears pass through their backlash {len(changes)} times ({each}): a wrong backlash would show"
        f" there{much}."
    )


def gear_lines(gears: Sequence[GearDiagnosis], robot: str = "") -> list[str]:
    """Return a line for each gear whose backlash would show at the tool.

    What it tells of a gear is to compare them by: in motion the tool is off by several times as much.

    Args:
        gears: Gears of one robot along its path.
        robot: Its name in a cell of several.
    """
    lines = []
    for gear in gears:
        if not gear.at_risk:
            continue
        kept = f"; {gear.bias:.0f} N m of preload would avoid them" if gear.bias else ""
        if gear.base_tilt is not None:
            kept += f", or a base tilted by {np.rad2deg(gear.base_tilt.angle):.1f} deg"
        unloaded = (
            f", {gear.in_backlash:.1f} s unloaded in its backlash" if gear.in_backlash else ""
        )
        lines.append(
            f"  {f'{robot} ' if robot else ''}joint {gear.joint}: {gear.changes} backlash reversals"
            f"{unloaded}; a backlash 20 % off would be {_um(gear.miss)} at the tool at rest{kept}"
        )
    return lines


def _of_cell(run: Run, gap: ToolGap, compensated: bool) -> list[str]:
    """Return what there is to say of the gap between the tools and of each robot."""
    found = GapResult.extremes(gap)
    before, after = (
        f"{1e3 * low:.3f} to {1e3 * high:.3f} mm"
        for low, high in (
            (found.narrowest_before, found.widest_before),
            (found.narrowest_after, found.widest_after),
        )
    )

    text = f"Gap between the tools, commanded {1e3 * gap.commanded:.3f} mm: {before}"
    robots = {name: Deviations.of(run, tool) for tool, name in enumerate(run.robots)}
    if not compensated:
        return [f"{text}."] + [
            f"  {name} robot: {_figures(own.before)}" for name, own in robots.items()
        ]
    lines = [f"{text} before, {after} after."]
    for name, own in robots.items():
        lines.append(f"  {name} robot before: {_figures(own.before)}")
        lines.append(f"  {name} robot after:  {_figures(own.after)}")
    return lines


def _um(length: float) -> str:
    return f"{1e6 * length:.2f} um"


def _figures(deviation: Deviation) -> str:
    return (
        f"max {_um(deviation.maximum)} at t = {deviation.time_of_maximum:.2f} s,"
        f" rms {_um(deviation.rms)}{_less_constant(deviation)}"
    )


def _less_constant(deviation: Deviation) -> str:
    most, rms = deviation.maximum_less_constant, deviation.rms_less_constant
    return f"; less a constant max {_um(most)}, rms {_um(rms)}"

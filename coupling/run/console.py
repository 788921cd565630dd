"""What a run shows on the terminal: progress, and a row per evaluation."""

from __future__ import annotations

import time
from bisect import bisect_left
from types import TracebackType

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
)

from coupling import events
from coupling.events import Event
from coupling.path.deviation import measure
from coupling.path.histories import ToolPath
from coupling.path.length_text import format_um
from coupling.results.iteration_result import CorrectionIteration, Evaluation
from coupling.run.execute import RunBegins
from coupling.solve.correction import RefinedTimes
from coupling.solve.fixed_point import Evaluated
from coupling.store import WaitingForOther

# How long nothing is said where no terminal shows a bar [s].
_SILENT = 20.0
_HEADER = (
    f"{'eval':>5} {'path change max':>16} {'rms':>10} {'force change':>13} {'deviation':>11}\n"
    f"{'':>5} {'[um]':>16} {'[um]':>10} {'[%]':>13} {'[um]':>11}"
)
# So long a speed is watched before it is believed [s], in so many reports, and by this factor that of
# the second half of that time may differ from the whole's: a process that starts is slow at first.
_WATCHED, _REPORTS, _STEADY = 2.0, 3, 1.5
# Reports that are kept; of more every other one is dropped.
_KEPT = 128


class RunView:
    """Shows a run while it goes on; a context manager that clears its progress bar."""

    def __init__(self, console: Console, verbose: bool = False) -> None:
        self._console, self._verbose = console, verbose
        self._progress = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.fields[count]}"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[ahead]}"),
            console=console,
            transient=True,
            disable=not console.is_terminal,  # else it leaves an empty line
        )
        self._task = self._progress.add_task("", visible=False, count="", ahead="")
        self._log = None if console.is_terminal else Console(stderr=True, soft_wrap=True)
        self._stage, self._began, self._told = "", 0.0, 0.0
        self._remaining, self._done = RemainingTime(), 0
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
                if self._verbose:
                    self._print(_HEADER, "bold")
            case RefinedTimes(desired):
                self._desired = desired
            case Evaluated(evaluation, path):
                self._evaluated(evaluation, path)
            case CorrectionIteration() if self._verbose:
                self._finished(event)

    def _working(self, work: events.Progress) -> None:
        now = time.monotonic()
        is_new = work.what != self._stage
        if is_new:
            self._stage, self._began, self._told = work.what, now, now
            self._remaining = RemainingTime()
        # Where a stage is repeated, as a simulation of an inverse is, each pass has its beginning.
        if is_new or work.done < self._done:
            self._progress.reset(self._task)
        self._done = work.done
        self._remaining.report(now, work.done)
        seconds = self._remaining.ahead(work.total) if work.done < work.total else None
        ahead = "" if seconds is None else f"about {seconds:.0f} s more"
        # How long a single step takes is not known, nor what follows one that is done.
        is_known = work.total > 1 and work.done < work.total
        self._progress.update(
            self._task,
            description=work.what if work.done < work.total else "working",
            completed=work.done,
            total=work.total if is_known else None,
            count=f"{work.done}/{work.total} steps" if is_known else "",
            ahead=ahead,
            visible=True,
        )
        if self._log is not None and now - self._told > _SILENT:
            self._told = now
            sentence = (
                f"{work.what}: {work.done} of {work.total} steps, for {now - self._began:.0f} s"
            )
            self._log.print(f"{sentence}{ahead and ', '}{ahead}", markup=False)

    def _said(self, line: str) -> None:
        self._progress.update(
            self._task, description=line, total=None, count="", ahead="", visible=True
        )

    def _evaluated(self, evaluation: Evaluation, path: ToolPath) -> None:
        assert self._desired is not None
        self._count += 1
        if not self._verbose:
            size = format_um(measure(path, self._desired).maximum)
            self._said(f"evaluation {self._count}: the tool is up to {size} um off")
            return
        first = evaluation.number == 1
        force = "" if first else f"{100.0 * evaluation.force_change:.4f}"
        deviation = measure(path, self._desired).maximum
        self._print(
            f"{self._count:>5} {1e6 * evaluation.path_change:>16.4f}"
            f" {1e6 * evaluation.path_change_rms:>10.4f} {force:>13} {1e6 * deviation:>11.3f}"
        )

    def _finished(self, finished: CorrectionIteration) -> None:
        text = f"      iteration {finished.number}: deviation max"
        text += f" {format_um(finished.deviation.maximum)} um,"
        text += f" rms {format_um(finished.deviation.rms)} um"
        if finished.largest_step is not None:
            text += (
                f"; largest step of the correction {format_um(finished.largest_step)} um at t ="
                f" {finished.step_time:.2f} s"
            )
            if finished.limited_samples:
                text += f"; rate limited at {finished.limited_samples} samples"
        self._print(text, "cyan")

    def _print(self, text: str, style: str | None = None) -> None:
        self._console.print(text, style=style)


class RemainingTime:
    """Estimates the remaining time of work from its reports.

    The time before the first report, in which processes start and libraries are loaded, is no work.
    """

    def __init__(self) -> None:
        self._times: list[float] = []
        self._done: list[int] = []

    def report(self, now: float, steps_done: int) -> None:
        """Note how far the work is; steps that were undone begin it anew.

        Args:
            now: Time [s].
            steps_done: Steps that are done.
        """
        if self._done and steps_done < self._done[-1]:
            self._times, self._done = [], []
        if steps_done and (not self._done or steps_done > self._done[-1]):
            self._times.append(now)
            self._done.append(steps_done)
            if len(self._times) > _KEPT:
                self._times, self._done = self._times[::2], self._done[::2]

    def ahead(self, total: int) -> float | None:
        """Return the time that the work will still take [s]; None while its speed is not known.

        Example:
            >>> work = RemainingTime()
            >>> for second in range(5): work.report(10.0 + second, 100 * (second + 1))
            >>> work.ahead(1000)
            5.0
        """
        times, steps = self._times, self._done
        if len(times) < _REPORTS or times[-1] - times[0] < _WATCHED:
            return None
        half = min(bisect_left(times, 0.5 * (times[0] + times[-1])), len(times) - 2)
        whole, recent = (
            (steps[-1] - steps[k]) / max(times[-1] - times[k], 1e-9) for k in (0, half)
        )
        if not whole / _STEADY < recent < whole * _STEADY:
            return None
        return (total - steps[-1]) / recent

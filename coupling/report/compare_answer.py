"""First screen of runs beside each other: which leaves least, and what to do with it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from coupling.path.length_text import in_words
from coupling.report.background import tolerance_of
from coupling.report.bars import bars
from coupling.report.comparison import Comparison
from coupling.report.lengths import judged
from coupling.report.report_file import name_path
from coupling.report.run_report import run_report
from coupling.results.section import Answer, KeyFigure, NextStep
from coupling.run.stored_run import StoredRun

# Runs whose figures stand on the first screen, the best ones of many; its picture has all.
_FIGURES = 3
_MEASURED_KIND = "measured, less a shift of the whole path"
_EXPECTED_KIND = "expected on the real robot"


def comparison_answer(comparison: Comparison) -> Answer:
    """Return the first screen: which run leaves least, and what to do with it."""
    standings = [_Standing.of(comparison, number) for number in range(len(comparison.runs))]
    best = min(standings, key=lambda standing: standing.order)
    own_answer, tolerance = run_report(best.run).answer, tolerance_of(best.run)
    good, steps = own_answer.good, [step for step in own_answer.steps if step.command]
    many = f"of {len(standings)} runs " if len(standings) > 1 else ""
    who = f"{many}{best.name} leaves least," if many else f"the run {best.name} leaves"
    words = f"{who} up to {in_words(best.deviation)}, {best.kind}"
    if best.kind == _MEASURED_KIND:
        good = None if tolerance is None else best.deviation <= tolerance
        expected = [s for s in standings if s.kind == _EXPECTED_KIND and s.run.figures.converged]
        next_best = min([best, *expected], key=lambda standing: standing.deviation)
        purpose = "Write the robot program of the best one:"
        if next_best is not best:
            purpose = f"Run {next_best.name} and measure it as well:"
            words = (
                f"of what was measured {best.name} leaves least, up to {in_words(best.deviation)};"
                f" {next_best.name} is to leave {in_words(next_best.deviation)}, {next_best.kind}"
            )
        robot = next_best.run.figures.robots[0].title
        steps = [NextStep.export(purpose, name_path(next_best.run.folder), robot)]
    sentence, reason = judged(words, good, tolerance), own_answer.sentence
    if best.kind == _MEASURED_KIND:
        reason = ""
    elif good is False and best.run.figures.converged and not best.run.figures.gains:
        # What is worse than the simple alternative is not to be sent, though others are worse still.
        sentence, reason = (
            f"{words[:1].upper()}{words[1:]}. {own_answer.sentence}",
            own_answer.reason,
        )
    standings_shown = standings
    if len(standings) > _FIGURES:
        standings_shown = sorted(standings, key=lambda standing: standing.order)[:_FIGURES]
    learning = _next_command(comparison)
    return Answer(
        sentence=sentence,
        reason=reason,
        good=good,
        figures=[
            KeyFigure(
                standing.name,
                in_words(standing.deviation),
                f"{standing.kind}; uncorrected {in_words(standing.before)}",
            )
            for standing in standings_shown
        ],
        steps=[*steps, *learning] if good else [*learning, *steps],
        picture=bars(
            [
                ("uncorrected", standings[0].before),
                *((f"{s.name}, {s.kind.split()[0].rstrip(',')}", s.deviation) for s in standings),
            ],
            tolerance,
        ),
    )


@dataclass(frozen=True)
class _Standing:
    """What one run comes to among others.

    Attributes:
        name, run: The run.
        deviation: Largest deviation to go by [m].
        before: Deviation without a correction [m].
        kind: Source of the deviation, in words.
    """

    name: str
    run: StoredRun
    deviation: float
    before: float
    kind: str

    @classmethod
    def of(cls, comparison: Comparison, number: int) -> _Standing:
        run, measured = comparison.runs[number], comparison.measured.get(number)
        figures, expected = run.figures, run.figures.expected_deviation()
        deviation, kind = figures.deviations[-1].maximum, "if the file is right"
        if measured is not None:
            deviation, kind = measured.run.size.maximum, _MEASURED_KIND
        elif expected is not None and figures.kind != "couple":
            deviation, kind = expected.maximum, _EXPECTED_KIND
        return cls(
            comparison.names[number], run, deviation, figures.deviation_before_m.maximum, kind
        )

    @property
    def order(self) -> tuple[bool, bool, float]:
        """What is measured first, what is not finished last."""
        is_measured = self.kind == _MEASURED_KIND
        return not (is_measured or self.run.figures.converged), not is_measured, self.deviation


def _next_command(comparison: Comparison) -> Iterator[NextStep]:
    """Yield the step from what was measured to the next command."""
    if not comparison.measured:
        return
    words = ["next"]
    for number, measured in sorted(comparison.measured.items()):
        words += [name_path(comparison.runs[number].folder), str(measured.file)]
    last = comparison.runs[max(comparison.measured)]
    words += ["-o", f"{name_path(last.folder)}_next"]
    yield NextStep.by("Compute the next command from what was measured:", *words)

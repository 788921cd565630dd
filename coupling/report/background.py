"""What a result rests on: evaluations of the process, and every input with its source."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from typing import Any

from coupling.errors import ResultError
from coupling.files.toml_file import validate
from coupling.path.length_text import in_words
from coupling.results.run_result import RunResult, TouchOffResult
from coupling.results.run_state import RunCase, StoredAnswer
from coupling.results.section import UM, Note, Section, Table
from coupling.run.stored_run import CASE, StoredRun

# Evaluations that are listed one by one.
_LISTED = 12
_KEY = 12


def cost(figures: RunResult, case: RunCase, answers: Sequence[StoredAnswer]) -> list[str]:
    """Return where the process was evaluated and what that cost, in sentences.

    Args:
        figures: Content of result.json.
        case: Excerpt of its case.
        answers: `answers` of run.json.
    """
    where = "on the actual path of each iteration"
    if figures.kind == "compensate" and case.compensation.method == "inverse":
        where = "first on the desired path, then on the actual path under each command"
    text = [
        f"Process {case.process.model}: evaluated {figures.process_evaluations} times, {where}; peak"
        f" force {figures.peak_force_N:.1f} N."
    ]
    if answers:
        computed = [answer.seconds for answer in answers if answer.origin == "computed"]
        spent = (
            f"{len(computed)} computed in {sum(computed):.3g} s, {sum(computed) / len(computed):.3g} s"
            " each"
            if computed
            else "none computed"
        )
        text.append(
            f"{len(answers)} evaluations: {spent}, {len(answers) - len(computed)} from the store."
        )
    return text


def evaluations_table(answers: Sequence[StoredAnswer]) -> list[Table]:
    """Return the process's answers one by one, where they are few."""
    rows = [
        (str(k), answer.origin, f"{answer.seconds:.3f}", answer.key[:_KEY])
        for k, answer in enumerate(answers, start=1)
    ]
    columns = ("answer", "from", "took [s]", "key in the store")
    return [Table(columns, rows)] if 0 < len(rows) <= _LISTED else []


def inputs(figures: RunResult, case: str) -> list[Section]:
    """Return every input with its source.

    Args:
        figures: Content of result.json.
        case: Text of case.toml.
    """
    robots = [
        Section(
            f"Inputs: robot {robot.title}: {robot.description}",
            [
                Table(
                    ("numbers", "source"),
                    [(", ".join(places), source) for source, places in robot.sources.items()],
                    "words",
                )
            ],
        )
        for robot in figures.robots
    ]
    keys = ", ".join(key[:_KEY] for key in dict.fromkeys(figures.evaluation_keys))
    rows = [
        *figures.versions.items(),
        ("FMU", figures.fmu_fingerprint),
        ("evaluations of the process (keys in the store)", keys or "not kept"),
    ]
    text = Note("All defaults are filled in: running it reproduces these results.")
    return [
        *robots,
        Section("Inputs: programs", [Table(("", "version"), rows, "words")]),
        Section("Inputs: case", [text, Note(case.strip(), as_it_stands=True)]),
    ]


def touched_off(robots: Iterable[tuple[str, TouchOffResult | None]]) -> list[str]:
    """Return what the touch-off of robots came to, by their names; nothing for those without."""
    said = []
    for name, touch_off in robots:
        if touch_off is None:
            continue
        part, rpy, shift, turn = (
            ", ".join(f"{factor * value:.{digits}f}" for value in values)
            for values, factor, digits in (
                (touch_off.part_position_m, 1.0, 6),
                (touch_off.part_rpy_deg, 1.0, 4),
                (touch_off.shift_m, UM, 1),
                (touch_off.turn_rad, 1e3, 3),
            )
        )
        said.append(
            f"{name} robot: the part, touched off by the robot with its sag, is at {part} m, roll,"
            f" pitch, yaw {rpy} deg. The frame that the controller shows deviates from that by"
            f" {shift} um and {turn} mrad, world axes. Residual of the touched points:"
            f" {in_words(touch_off.residual_m)}."
        )
    return said


def real_part(figures: RunResult, case: RunCase) -> dict[str, Any]:
    """Return the placement of the part, by the keys of [part]: where it is touched off, the real one.

    Args:
        figures: Content of result.json.
        case: Excerpt of its case.
    """
    touch_off = figures.robots[0].touch_off
    if touch_off is None:
        return case.part.model_dump()
    return {"position_m": touch_off.part_position_m, "rpy_deg": touch_off.part_rpy_deg}


def case_of(run: StoredRun) -> RunCase:
    """Return what pages tell of a run's case.

    Raises:
        ResultError: If it is none.
    """
    return validate(case_content(run), RunCase, ResultError, str(run.folder / CASE))


def tolerance_of(run: StoredRun) -> float | None:
    """Return the deviation that the part of a run allows [m]; None where it is not stated."""
    tolerance = case_of(run).part.tolerance_mm
    return None if tolerance is None else 1e-3 * tolerance


def case_content(run: StoredRun) -> dict[str, Any]:
    """Return the content of a run's case.

    Raises:
        ResultError: If it is no TOML.
    """
    try:
        return tomllib.loads(run.case)
    except tomllib.TOMLDecodeError as cause:
        raise ResultError(f"{run.folder / CASE}: is not valid TOML: {cause}") from cause

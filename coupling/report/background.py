"""What a result rests on: evaluations of the process, and every input with its source."""

from __future__ import annotations

import html
import tomllib
from collections.abc import Sequence
from typing import Any

from coupling.errors import ResultError
from coupling.files.toml_file import validate
from coupling.report.tables import table
from coupling.results.run_result import RobotResult, RunResult
from coupling.results.run_state import AnswerResult, RunCase
from coupling.run.stored_run import CASE, StoredRun

# Evaluations that are listed one by one.
_LISTED = 12
_KEY = 12
_UM = 1e6
CONVERGENCE_TEXT = (
    "Thin lines: how far the robot's answer is from the path that the process saw, for each"
    " evaluation of the process. Thick line: deviation from the desired path after each correction."
)
_WHERE = {
    "inverse": "first on the desired path, then on the path that the tool takes under each command",
    "mirror": "on the paths that the tool takes, from iteration to iteration",
}


def process_text(figures: RunResult, case: RunCase, answers: Sequence[AnswerResult]) -> str:
    """Return where the process was evaluated and what that cost, as HTML.

    Args:
        figures: Content of result.json.
        case: What pages tell of its case.
        answers: `answers` of run.json.
    """
    method = case.compensation.method if figures.kind == "compensate" else ""
    where = _WHERE.get(method, "on the paths that the tool takes, until they agree")
    text = (
        f"<p>{html.escape(case.process.model)}, evaluated {figures.process_evaluations} times,"
        f" {where}; peak force {figures.peak_force_N:.1f} N.</p>"
    )
    if answers:
        computed = [own.seconds for own in answers if own.origin == "computed"]
        spent = (
            f"{len(computed)} computed in {sum(computed):.3g} s, {sum(computed) / len(computed):.3g} s"
            " each"
            if computed
            else "none computed"
        )
        text += (
            f"<p>Of {len(answers)} answers {spent}, {len(answers) - len(computed)} from the store of"
            " evaluations.</p>"
        )
    if 0 < len(answers) <= _LISTED:
        rows = [
            (str(k), html.escape(own.origin), f"{own.seconds:.3f}", own.key[:_KEY])
            for k, own in enumerate(answers, start=1)
        ]
        text += table(("answer", "from", "took [s]", "key in the store"), rows)
    return f"{text}<p>{CONVERGENCE_TEXT}</p>"


def inputs(figures: RunResult, case: str) -> str:
    """Return every input with its source, as HTML.

    Args:
        figures: Content of result.json.
        case: Text of case.toml.
    """
    text = "<section><h2>Inputs and their sources</h2>"
    for robot in figures.robots:
        rows = [
            (html.escape(", ".join(places)), html.escape(source))
            for source, places in robot.sources.items()
        ]
        name = html.escape(f"{robot.title}: {robot.description}")
        text += f"<h3>Robot {name}</h3>{table(('numbers', 'source'), rows, 'words')}"
        text += _touch_off(robot)
    rows = [(html.escape(name), html.escape(own)) for name, own in figures.versions.items()]
    rows.append(("FMU", html.escape(figures.fmu_fingerprint)))
    keys = ", ".join(key[:_KEY] for key in dict.fromkeys(figures.evaluation_keys))
    rows.append(("answers of the process (keys in the store)", html.escape(keys) or "not kept"))
    return (
        f"{text}<h3>Programs</h3>{table(('', 'version'), rows, 'words')}<h3>Case</h3><p>With every"
        f' default filled in; it runs again to the same figures.</p><pre tabindex="0">'
        f"{html.escape(case.strip())}</pre></section>"
    )


def _touch_off(robot: RobotResult) -> str:
    """Return what a robot's touch-off came to, as HTML; empty for a run without."""
    found = robot.touch_off
    if found is None:
        return ""
    part, rpy, shift, turn = (
        ", ".join(f"{factor * value:.{digits}f}" for value in values)
        for values, factor, digits in (
            (found.part_position_m, 1.0, 6),
            (found.part_rpy_deg, 1.0, 4),
            (found.shift_m, 1e6, 1),
            (found.turn_rad, 1e3, 3),
        )
    )
    return (
        f"<p>Touched off with its sag: the part is really at {part} m, roll, pitch, yaw {rpy} deg; there"
        f" the controller shows a frame that is off by {shift} um and {turn} mrad, world axes. The"
        f" touched points fit that to {_UM * found.residual_m:.2f} um.</p>"
    )


def real_part(figures: RunResult, case: RunCase) -> dict[str, Any]:
    """Return the placement of the part, by the keys of [part]: where it is touched off, the real one.

    Args:
        figures: Content of result.json.
        case: What pages tell of its case.
    """
    found = figures.robots[0].touch_off
    if found is None:
        return case.part.model_dump()
    return {"position_m": found.part_position_m, "rpy_deg": found.part_rpy_deg}


def case_of(run: StoredRun) -> RunCase:
    """Return what pages tell of a run's case.

    Raises:
        ResultError: If it is none.
    """
    return validate(case_content(run), RunCase, ResultError, str(run.folder / CASE))


def case_content(run: StoredRun) -> dict[str, Any]:
    """Return the content of a run's case.

    Raises:
        ResultError: If it is no TOML.
    """
    try:
        return tomllib.loads(run.case)
    except tomllib.TOMLDecodeError as cause:
        raise ResultError(f"{run.folder / CASE}: is not valid TOML: {cause}") from cause

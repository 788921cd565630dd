"""The files of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import tomlkit

from coupling.case.case import Case
from coupling.errors import ResultError
from coupling.files.atomic_file import writing
from coupling.files.csv_table import (
    ANCHOR_COLUMNS,
    CORRECTION_COLUMNS,
    POSE_COLUMNS,
    WRENCH_COLUMNS,
    WrittenTables,
)
from coupling.files.written_files import claim_file, claimed_folder
from coupling.results.replay import worst_backlash
from coupling.results.run_result import RunResult
from coupling.run.execute import Run
from coupling.run.expected_robots import DRAWN_ROBOTS
from coupling.run.figures import figures_of
from coupling.run.path_checks import OTHER_MODE, TOOL_GAP, other_mode
from coupling.run.plant import PLANT_REPLAY
from coupling.run.robot_results import drawn_robots
from coupling.run.simulated_motor_torques import MOTOR_TORQUES
from coupling.run.stored_run import (
    ANCHOR,
    CASE,
    EXPECTED,
    GAP,
    GAP_COLUMNS,
    MOTORS,
    PLANT,
    RESULT,
    WRONG_BACKLASH,
    motor_columns,
    workpiece_file,
)


def write_run(folder: Path, case: Case, run: Run) -> WrittenTables:
    """Write all files of a run but the report into an existing folder.

    The files of a single robot are in the folder itself, those of a cell's robots in folders by their
    names.

    Returns:
        Its tables, for who reads the folder at once.

    Raises:
        ResultError: If a file cannot be written.
    """
    tables = WrittenTables()
    with writing(folder, ResultError):
        claim_file(folder / CASE).write_text(tomlkit.dumps(case.resolved), encoding="utf-8")
        _write_workpieces(folder, run)
        robots = drawn_robots(case, run)
        _write_figures(folder, figures_of(run, case.title, robots))
        gap = run.finding_of(TOOL_GAP)
        if gap is None:
            _write_tool(folder, run, 0, tables)
            return tables
        gaps = np.column_stack([gap.before, gap.after]) + gap.commanded
        _write(tables, folder, GAP, GAP_COLUMNS, gap.time, gaps)
        for tool, name in enumerate(run.robots):
            claimed_folder(folder / name)
            figures = figures_of(run, f"{case.title}, {name} robot", robots, tool)
            _write_figures(folder / name, figures)
            _write_tool(folder / name, run, tool, tables)
    return tables


def _write_figures(folder: Path, figures: RunResult) -> None:
    claim_file(folder / RESULT).write_text(figures.text(), encoding="utf-8")


def _write_tool(folder: Path, run: Run, tool: int, tables: WrittenTables) -> None:
    correction, time, plant = run.correction, run.desired.time, run.finding_of(PLANT_REPLAY)
    paths = {"desired": run.desired, "uncompensated": run.before, "achieved": correction.achieved}
    if plant is not None:
        paths[PLANT] = plant.path
    wrong = worst_backlash(run.robustness)
    if wrong is not None and wrong.path is not None:
        paths[WRONG_BACKLASH] = wrong.path
    expected = run.finding_of(DRAWN_ROBOTS).worst
    if expected is not None and expected.path is not None:
        paths[EXPECTED] = expected.path
    other = run.finding_of(OTHER_MODE)
    for name, path in (("uncompensated", other.before), ("achieved", other.after)):
        if path is not None:
            paths[f"{name}_{other_mode(run.mode)}"] = path
    for name, path in paths.items():
        _write(tables, folder, name, POSE_COLUMNS, time, path.pose[tool])
    drives = correction.joints.robots[tool].columns
    command = np.column_stack([correction.command.pose[tool], *drives.values()])
    _write(tables, folder, "command", (*POSE_COLUMNS, *drives), correction.joints.time, command)
    _write(tables, folder, "correction", CORRECTION_COLUMNS, time, correction.correction[tool])
    wrench = correction.response.wrench
    _write(tables, folder, "wrench", WRENCH_COLUMNS, wrench.time, wrench.wrench[tool])
    spring = wrench.spring
    if spring is not None:
        rows = np.hstack([spring.anchor[tool], spring.entries[tool]])
        _write(tables, folder, ANCHOR, ANCHOR_COLUMNS, time, rows)
    motors = run.finding_of(MOTOR_TORQUES)[tool]
    if motors is not None:
        history = motors.history
        _write(tables, folder, MOTORS, motor_columns(history.joints), history.time, history.torque)
    if plant is not None and plant.coupling is not None:
        wrench = plant.loads.on(plant.path)
        _write(tables, folder, f"{PLANT}_wrench", WRENCH_COLUMNS, wrench.time, wrench.wrench[tool])


def _write_workpieces(folder: Path, run: Run) -> None:
    pieces = {"before": run.correction.before.response, "after": run.correction.response}
    if run.kind == "couple":
        del pieces["after"]
    for state, response in pieces.items():
        if response is not None and response.workpiece is not None:
            response.workpiece.write(claim_file(workpiece_file(folder, state)))


def _write(
    tables: WrittenTables,
    folder: Path,
    name: str,
    columns: tuple[str, ...],
    time: np.ndarray,
    values: np.ndarray,
) -> None:
    table = np.column_stack([time, values])
    tables.write(claim_file(folder / f"{name}.csv"), ("time", *columns), table)

"""Run folders read back, for reports and for the user's own evaluation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import get_args

import numpy as np

from coupling.errors import ResultError, locate_errors, reason_of
from coupling.files.atomic_folder import unfinished_name
from coupling.files.csv_table import (
    ANCHOR_COLUMNS,
    CORRECTION_COLUMNS,
    POSE_COLUMNS,
    WRENCH_COLUMNS,
    WrittenTables,
)
from coupling.path.contact_spring import ContactSpring
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.path.workpiece import Workpiece
from coupling.results.base import Shown
from coupling.results.replay import worst_backlash
from coupling.results.run_result import RunResult
from coupling.results.run_state import RunState, StoredAnswer
from coupling.results.stability_result import FIGURES as STABILITY
from elastic_robot.fmi.interface import Mode
from elastic_robot.tool_load import symmetric

RESULT, RUN, CASE = "result.json", "run.json", "case.toml"
# Robots of a cell, as their folders are called; other folders there are the user's.
FORMING = "forming"
CELL = (FORMING, "support")
PLANT, ANCHOR, MOTORS, WRONG_BACKLASH = "plant", "anchor", "motors", "wrong_backlash"
EXPECTED = "expected"
GAP, GAP_COLUMNS = "gap", ("before", "after")
# Times of two tables that are the same [s].
_SAME = 1e-9


def workpiece_file(folder: Path, state: str) -> Path:
    """Return the file of the workpiece "before" or "after" compensation."""
    return folder / f"workpiece_{state}.vtu"


@dataclass(frozen=True)
class StoredRobot(Shown):
    """One robot's files of a run.

    Attributes:
        desired, uncompensated, achieved: Paths of its tool.
        joints: Motion of its drives, in the rows of the controller.
        command: Path of its undeflected tool at these rows.
        correction: Path of the undeflected tool minus desired, at its times [m, rad], (n, 6).
        plant: Path of its tool on the plant; None where the case has none.
        expected: Path of its tool on the worst of the robots that are drawn from what is known of it;
            None where none is drawn.
        wrong_backlash: Path of its tool on the robot whose backlash differs, where it leaves more; None
            where it was not simulated.
        motor_torque: Times [s], (n,), and the torque that its motors need by joint, from 0 [N m], (n,)
            each; None where it has no motors.
        other: Paths of the tool by `figures.stages`, the robot simulated in the mode that is not the
            run's; those that were simulated.
    """

    figures: RunResult
    desired: ToolPath
    uncompensated: ToolPath
    achieved: ToolPath
    joints: JointPath
    command: ToolPath
    correction: np.ndarray
    wrench: WrenchHistory
    plant: ToolPath | None = None
    expected: ToolPath | None = None
    wrong_backlash: ToolPath | None = None
    motor_torque: tuple[np.ndarray, dict[int, np.ndarray]] | None = None
    other: Mapping[str, ToolPath] = field(default_factory=dict)

    @property
    def actual(self) -> dict[str, ToolPath]:
        """Actual paths by `figures.stages`."""
        return dict(zip(self.figures.stages, (self.uncompensated, self.achieved), strict=False))

    @property
    def on_other_robots(self) -> dict[str, ToolPath]:
        """Paths under the command on robots that differ from the model, by their difference."""
        paths = {"on the robot of [plant]": self.plant}
        wrong = worst_backlash(self.figures.robustness)
        if wrong is not None:
            paths[f"with {wrong.name}"] = self.wrong_backlash
        return {name: path for name, path in paths.items() if path is not None}


@dataclass(frozen=True)
class StoredRun(Shown):
    """A run read back from its folder.

    Attributes:
        robots: Robots by name; the files of a single one are in the run's folder itself.
        gap: Gap between the tools before and after compensation [m], (n, 2); None for one robot.
        workpieces: Workpieces by `figures.stages`, where the process tells.
        case: Text of its case.toml; empty where it has none.
        answers: The process's answers in their order, as run.json tells them; none where it is gone.
        case_file: Case file that was run, as run.json tells it; empty where it is gone.
    """

    folder: Path
    figures: RunResult
    robots: dict[str, StoredRobot]
    gap: np.ndarray | None
    workpieces: dict[str, Workpiece]
    case: str = ""
    answers: tuple[StoredAnswer, ...] = ()
    case_file: str = ""

    @property
    def first(self) -> StoredRobot:
        """The robot that holds the tool; in a cell, the forming tool."""
        return next(iter(self.robots.values()))


def read_run(folder: Path, tables: WrittenTables | None = None) -> StoredRun:
    """Read a run folder.

    Args:
        tables: Tables of it that were just written; None: all are read from their files.

    Raises:
        ResultError: If a file is missing or broken.
    """
    figures, gap = _read_figures(folder), None
    tables = tables or WrittenTables()
    robots = {FORMING: folder}
    if (folder / f"{GAP}.csv").exists():
        if figures.pinch_gap_m is None:
            raise ResultError(f"{folder / RESULT}: expected that of two robots beside {GAP}.csv")
        gap = tables.read(folder / f"{GAP}.csv", ("time", *GAP_COLUMNS), ResultError)[:, 1:]
        robots = {name: folder / name for name in CELL}
    pieces = {
        stage: Workpiece.read(file)
        for stage, name in zip(figures.stages, ("before", "after"), strict=False)
        if (file := workpiece_file(folder, name)).exists()
    }
    read = {name: _read_robot(place, tables) for name, place in robots.items()}
    state = _read_state(folder)
    return StoredRun(
        folder, figures, read, gap, pieces, _read_case(folder), state.answers, state.case or ""
    )


def _read_case(folder: Path) -> str:
    """Return the text of a run's case, which for one robot of a cell is that of the cell."""
    for place in (folder, folder.parent):
        if (place / CASE).exists():
            try:
                return (place / CASE).read_text(encoding="utf-8")
            except (OSError, UnicodeDecodeError) as cause:
                raise ResultError(f"{place / CASE}: cannot be read: {reason_of(cause)}") from cause
    return ""


def _read_state(folder: Path) -> RunState:
    """Return what run.json tells; nothing rests on it."""
    for place in (folder, folder.parent):
        with suppress(ResultError):
            return RunState.read(place / RUN, ResultError)
    return RunState(state="")


def _read_figures(folder: Path) -> RunResult:
    logs = (folder / RUN, unfinished_name(folder.resolve()) / RUN)
    log = next((file for file in logs if file.exists()), None)
    advice = "name a run folder" if log is None else f"its run has not finished, see {log}"
    if (folder / STABILITY).exists():
        advice = "its cut was judged, see report.html there, and no command computed"
    return RunResult.read(folder / RESULT, ResultError, advice)


def drive_columns(header: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    """Return the names of angles, rates and accelerations among a table's columns.

    Example:
        >>> drive_columns(["time", "qx", "q1", "qd1", "qdd1"])
        (('q1',), ('qd1',), ('qdd1',))
    """
    return tuple(
        tuple(
            name for name in header if name.startswith(letters) and name[len(letters) :].isdigit()
        )
        for letters in ("q", "qd", "qdd")
    )


def motor_columns(joints: Iterable[int]) -> tuple[str, ...]:
    """Return the names of the torques of joints' motors, from 0, in the table of a run's motors."""
    return tuple(f"tau{joint + 1}" for joint in joints)


def _motor_torque(
    folder: Path, tables: WrittenTables
) -> tuple[np.ndarray, dict[int, np.ndarray]] | None:
    file = folder / f"{MOTORS}.csv"
    if not file.exists():
        return None
    names = [name for name in tables.header(file, ResultError) if name.startswith("tau")]
    if not all(name[3:].isdecimal() and int(name[3:]) > 0 for name in names):
        raise ResultError(f"{file}: expected columns tau1, tau2 .., got {', '.join(names)}")
    values = tables.read(file, ("time", *names), ResultError).T
    return values[0], {int(name[3:]) - 1: v for name, v in zip(names, values[1:], strict=True)}


def _read_robot(folder: Path, tables: WrittenTables) -> StoredRobot:
    times: dict[str, np.ndarray] = {}

    def table(name: str, columns: tuple[str, ...]) -> np.ndarray:
        values = tables.read(folder / f"{name}.csv", ("time", *columns), ResultError)
        times[name] = values[:, 0]
        return values

    def tool_path(name: str) -> ToolPath:
        values = table(name, POSE_COLUMNS)
        return ToolPath(values[:, 0], values[:, 1:])

    def path_if_any(name: str) -> ToolPath | None:
        return tool_path(name) if (folder / f"{name}.csv").exists() else None

    figures = _read_figures(folder)
    names = drive_columns(tables.header(folder / "command.csv", ResultError))
    command = table("command", (*POSE_COLUMNS, *sum(names, ())))
    poses, motion = command[:, 1 : 1 + len(POSE_COLUMNS)], command[:, 1 + len(POSE_COLUMNS) :]
    blocks = np.split(motion, np.cumsum([len(block) for block in names])[:-1], axis=1)
    wrench = table("wrench", WRENCH_COLUMNS)
    has_anchor = (folder / f"{ANCHOR}.csv").exists()
    with locate_errors(str(folder), ValueError, ResultError):
        rows = table(ANCHOR, ANCHOR_COLUMNS)[:, 1:] if has_anchor else None
        spring = (
            None if rows is None else ContactSpring(rows[None, :, :3], symmetric(rows[:, 3:])[None])
        )
        robot = StoredRobot(
            figures=figures,
            desired=tool_path("desired"),
            uncompensated=tool_path("uncompensated"),
            achieved=tool_path("achieved"),
            joints=JointPath(
                command[:, 0], *((block,) if block.shape[1] else () for block in blocks)
            ),
            command=ToolPath(command[:, 0], poses),
            correction=table("correction", CORRECTION_COLUMNS)[:, 1:],
            wrench=WrenchHistory(wrench[:, 0], wrench[:, 1:], spring),
            plant=path_if_any(PLANT),
            expected=path_if_any(EXPECTED),
            wrong_backlash=path_if_any(WRONG_BACKLASH),
            motor_torque=_motor_torque(folder, tables),
            other={
                stage: tool_path(file.stem)
                for stage, name in zip(figures.stages, ("uncompensated", "achieved"), strict=False)
                for mode in get_args(Mode)
                if (file := folder / f"{name}_{mode}.csv").is_file()
            },
        )
    _require_one_run(folder, times)
    return robot


def _require_one_run(folder: Path, times: Mapping[str, np.ndarray]) -> None:
    """Refuse tables that are cut short, or of different runs; a command may end a little later."""
    desired = times["desired"]
    for name, time in times.items():
        off = time[[0, -1]] - desired[[0, -1]]
        if name == "command":
            off = np.minimum(off, 0.0)
        if np.abs(off).max() > _SAME:
            raise ResultError(
                f"{folder / name}.csv: expected rows from {desired[0]:.6g} to {desired[-1]:.6g} s as in"
                f" desired.csv, got {time[0]:.6g} to {time[-1]:.6g} s: one of them is cut short, or of"
                " another run"
            )
        if name not in ("command", "wrench", ANCHOR) and len(time) != len(desired):
            raise ResultError(
                f"{folder / name}.csv: expected {len(desired)} rows as in desired.csv, got"
                f" {len(time)}"
            )

"""The inputs of the next command's run: robot file, discrepancy and case, in a folder."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit

from coupling.errors import CaseError, LearnError
from coupling.files.atomic_file import write_atomically, writing
from coupling.files.toml_file import load_toml
from coupling.files.written_files import (
    LEARNING,
    begin_folder,
    claim,
    claim_file,
    is_free,
    is_of_kind,
)
from coupling.identification.next.command import CommandPlan

CASE, ROBOT, DISCREPANCY, PLAN = "case.toml", "robot.toml", "discrepancy.csv", "next.json"
LEARNED = "learned.json"
_KIND = "inputs"


def inputs_folder(run: Path) -> Path:
    """Return the folder of a run's inputs: beside it.

    Example:
        >>> inputs_folder(Path("results/second")).name
        'second_inputs'
    """
    return run.with_name(f"{run.name}_inputs")


def case_file(folder: Path, case: str) -> Path:
    """Return the file of the next run's case in its folder: called as the case is, as its pages are.

    Example:
        >>> case_file(Path("second_inputs"), "cone").name, case_file(Path("second_inputs"), "robot").name
        ('cone.toml', 'case.toml')
    """
    name = f"{case}.toml"
    return folder / (CASE if name == ROBOT else name)


def require_inputs_folder(folder: Path) -> None:
    """Refuse a folder for inputs that holds something else.

    Raises:
        LearnError: With the folder.
    """
    if folder.exists() and not folder.is_dir():
        raise LearnError(f"{folder}: expected a folder for the inputs of the run, got a file")
    if not is_free(folder) and not is_of_kind(folder, _KIND):
        raise LearnError(
            f"{folder}: holds files that are not the inputs of the run: name another one (--output)"
        )


def begin_inputs(folder: Path) -> None:
    """Make the folder of the inputs, in which files of an earlier command are replaced.

    Raises:
        LearnError: If something cannot be written.
    """
    with writing(folder, LearnError):
        begin_folder(folder, _KIND)
        claim(folder, (ROBOT, LEARNED, DISCREPANCY, PLAN, LEARNING))


def write_inputs(folder: Path, plan: CommandPlan) -> Path:
    """Write the inputs of the next run, and return the file of its case.

    Args:
        plan: Plan of the next command.

    Raises:
        LearnError: If something cannot be written.
    """
    robot = _robot_file(folder, plan)
    discrepancy = None
    if plan.correction is not None:
        discrepancy = folder / DISCREPANCY
        base_table = plan.correction.discrepancy(plan.history)
        world_from_base = plan.history.runs[0].source.world_from_base
        write_atomically(discrepancy, base_table.transformed(world_from_base).text(), LearnError)
    last = plan.history.runs[-1].source
    text = next_case_text(load_toml(last.folder / CASE, CaseError), robot, discrepancy)
    file = case_file(folder, last.stored.figures.case)
    with writing(folder, LearnError):
        claim_file(file)
    write_atomically(file, text, LearnError)
    return file


def _robot_file(folder: Path, plan: CommandPlan) -> Path:
    """Return the file of the robot that the command is computed for, written if it is a new one."""
    model, runs = plan.model, plan.history.runs
    if plan.learned is not None and model.run_count == len(runs):
        target = folder / ROBOT
        measured = " and ".join(source.measured.name for source in plan.history.sources)
        text = plan.learned.text(runs[0].source.file, measured, target)
        write_atomically(target, text, LearnError)
        return target
    return runs[model.run_count].source.file


def next_case_text(data: Mapping[str, Any], robot: Path, discrepancy: Path | None = None) -> str:
    """Return the case of a run with another robot file, and what its robot does beyond the model.

    A [plant] that was the model but for factors stays the robot that it was.

    Args:
        data: Content of the run's case.toml, whose paths are absolute.
        robot: The robot file.
        discrepancy: The table; None: nothing beyond the model.
    """
    content = copy.deepcopy(dict(data))
    before = content["robot"]["description"]
    content["robot"]["description"] = str(robot.resolve())
    content.pop("discrepancy", None)
    if discrepancy is not None:
        content["discrepancy"] = {"file": str(discrepancy.resolve())}
    plant = content.get("plant")
    if plant is not None:
        plant.setdefault("description", before)
    return tomlkit.dumps(content)

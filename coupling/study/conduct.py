"""A study from a run folder to its table: begin or go on, simulate what is missing."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

import elastic_robot
from coupling.case.case import Case
from coupling.case.plant import StudyTable
from coupling.errors import CaseError, StudyError
from coupling.events import Progress, Watch
from coupling.files.scratch import ScratchFolder
from coupling.files.toml_file import load_toml, validate
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.results.study_result import StudySample, StudySource
from coupling.run.expected_robots import ExpectedRobots
from coupling.run.stored_run import CASE, StoredRun, read_run
from coupling.run.uncertain_parameters import GROWS, UncertainParameters, draw_samples
from coupling.study.folder import (
    ROWS,
    SampleTable,
    begin,
    different,
    in_short,
    points_of,
    require_same,
)
from coupling.study.robot_pool import StudyJob, Workers, simulate_here
from coupling.study.statistics import samples_for


@dataclass(frozen=True)
class Study:
    """A study that has begun.

    Attributes:
        tolerance: Deviation that the part allows [m]; None where it is not stated.
        points: Values of the parameters, in their units, (n, k).
    """

    folder: Path
    case: str
    source: StudySource
    tolerance: float | None
    table: StudyTable
    points: np.ndarray
    run: StoredRun
    work: StudyJob


def changed_table(table: StudyTable, **options: int | None) -> StudyTable:
    """Return [study] with options of the command line in place of its keys.

    Raises:
        CaseError: If a value is not possible, or there are too few samples for the band.
    """
    stated = {name: value for name, value in options.items() if value is not None}
    data = {**table.model_dump(exclude_none=True), **stated}
    study_table = validate(data, StudyTable, CaseError, "study")
    least = samples_for(study_table.coverage)
    if study_table.samples < least:
        raise CaseError(
            f"study: samples: expected at least {least} for a band that holds"
            f" {100 * study_table.coverage:g} % of further robots, got {study_table.samples}"
        )
    return study_table


def require_run_of(case: Case, run: Path) -> None:
    """Raise a StudyError unless a run folder's command is that of a case."""
    whole = load_toml(run / "case.toml", StudyError)
    resolved_case = tomllib.loads(tomlkit.dumps(case.resolved))
    for name in ("plant", "study"):
        whole.pop(name, None)
        resolved_case.pop(name, None)
    other = different(whole, resolved_case)
    if other:
        raise StudyError(
            f"{run}: holds the command of another case, which differs in {in_short(other)}: compute"
            " it anew (--overwrite), or name another folder"
        )


def open_study(
    folder: Path, case: Case, table: StudyTable, run: Path, couple: bool, store: Path | None = None
) -> Study:
    """Begin a study in its folder, or go on with the one that was begun there.

    Args:
        store: Store of evaluations that keeps what it answers then, if any.

    Raises:
        StudyError: If another study was begun there, or nothing is uncertain.
        ResultError: If the run cannot be read.
    """
    require_run_of(case, run)
    stored = read_run(run)
    if stored.figures.kind != "compensate" or stored.figures.shares_m.dynamic_after is None:
        raise StudyError(
            f"{run}: expected a run of compensate, got one of {stored.figures.kind}, which corrects"
            " nothing"
        )
    work = replace(_work(case, stored, run, couple), store=store and store.resolve())
    parameters, count = work.parameters, table.samples
    if not parameters.entries:
        raise StudyError(
            "study: expected a parameter that changes something in this case, got"
            f" {', '.join(parameters.silent) or 'none that a file or a source gives a range'}"
        )
    identity = _identity(case, table, work)
    if require_same(folder, identity):
        points = points_of(folder, table.design, count, table.seed, parameters)
    else:
        points = draw_samples(table.design, count, table.seed, parameters)
        begin(folder, identity, points, parameters)
    source = StudySource(
        case=stored.case_file or str(run / CASE),
        robot=case.resolved["robot"]["description"],
        run=str(run),
    )
    return Study(folder, case.title, source, case.tolerance, table, points, stored, work)


def simulate_samples(study: Study, workers: Workers, watch: Watch) -> list[StudySample]:
    """Return all samples of a study in their order; what is missing in its table is simulated.

    Raises:
        StudyError: If the workers fail or the table cannot be written; what is finished is kept.
    """
    count = len(study.points)
    with SampleTable(study.folder / ROWS) as rows:
        todo = {k: study.points[k].tolist() for k in range(count) if not rows.has(k)}
        if todo:
            _fill(rows, study, todo, workers, watch)
        return [rows.samples[k] for k in range(count)]


def _fill(
    rows: SampleTable, study: Study, todo: dict[int, list[float]], workers: Workers, watch: Watch
) -> None:
    count = len(study.points)
    what = "simulating sampled robots"
    watch(Progress(what, count - len(todo), count))
    missing = len(todo)
    try:
        for sample in _simulate(study, todo, workers):
            rows.add(sample)
            missing -= 1
            watch(Progress(what, count - missing, count))
    except KeyboardInterrupt as stop:
        # Of the last one it may be on the disk already and not yet among the rows.
        with SampleTable(study.folder / ROWS) as written:
            written_count = len(written.samples)
        stop.add_note(f"{written_count} of {count} samples are kept: the same command continues")
        raise


def _simulate(
    study: Study, todo: dict[int, list[float]], workers: Workers
) -> Iterator[StudySample]:
    """Give every missing sample as soon as it is done; one worker is this program itself."""
    if not workers.scheduler and min(workers.count, len(todo)) == 1:
        return simulate_here(study.work, todo)
    # Here, because Dask is needed nowhere else and may be missing.
    from coupling.study.cluster import simulate

    return simulate(study.work, todo, workers, study.folder)


def _work(case: Case, run: StoredRun, folder: Path, couple: bool) -> StudyJob:
    robots = [run.robots[robot.name] for robot in case.robots]
    wrench = WrenchHistory.of_tools([loaded_robot.wrench for loaded_robot in robots])
    has_force = bool(np.any(wrench.wrench))
    if case.study.spreads():
        placed, parameters = case.robots, UncertainParameters.chosen(case, has_force)
    else:
        expected = ExpectedRobots.of(case, has_force)
        placed, parameters = expected.completed, expected.parameters
    fmus = []
    with ScratchFolder() as scratch:
        for robot in placed:
            file = scratch / f"{robot.name}.fmu"
            build_fmu(robot.description, file, BuildOptions(case.fmu))
            fmus.append(file.read_bytes())
    return StudyJob(
        kind=case.fmu,
        robots=placed,
        fmus=tuple(fmus),
        parameters=parameters,
        desired=ToolPath.of_tools([loaded_robot.desired for loaded_robot in robots]),
        achieved=ToolPath.of_tools([loaded_robot.achieved for loaded_robot in robots]),
        joints=JointPath.of_robots([loaded_robot.joints for loaded_robot in robots]),
        wrench=wrench,
        process=(folder / "case.toml").resolve() if couple else None,
    )


def _identity(case: Case, table: StudyTable, work: StudyJob) -> dict[str, Any]:
    """Return what must be the same for a study to go on."""
    digest = sha256()
    for values in (work.joints.time, *work.joints.q, *work.joints.qd, *work.joints.qdd):
        digest.update(values.tobytes())
    for history in (work.wrench.time, work.wrench.wrench, work.desired.time, work.desired.pose):
        digest.update(history.tobytes())
    resolved = {
        name: keys for name, keys in case.resolved.items() if name not in ("plant", "study")
    }
    samples = {} if table.design in GROWS else {"samples": table.samples}
    return {
        "version": elastic_robot.__version__,
        "case": resolved,
        "command": digest.hexdigest(),
        "fmu": sha256(b"".join(work.fmus)).hexdigest(),
        "design": table.design,
        "seed": table.seed,
        **samples,
        "couple": work.process is not None,
        "payload_position_m": list(work.parameters.payload_position or ()),
        "parameters": {entry.name: entry.in_words() for entry in work.parameters.entries},
    }

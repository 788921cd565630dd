"""What samples of a force cost is told as it is: beside the process asked every millisecond."""

import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import tomlkit
from places import CASES
from wall_case import WALL_CASE

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import InterpolatedPath, divide_steps
from coupling.process.elastic_wall import ElasticWallTable
from coupling.process.isf_force_law import IsfForceLawTable
from coupling.robot.cell import Cell
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.run.sampling import SAMPLING, SamplingCheck, flatter, parabolic, sampling_of, steeper
from coupling.solve.correction import Correction
from coupling.solve.coupling import couple
from coupling.solve.fixed_point import Loop, Tolerance

# Of the coupling that is the reference [m]: far below what samples cost.
EXACT = Tolerance(1e-8, 5e-9, 1e-5)
LINE = {"points_m": [[0.0, 0.0, 0.0], [0.06, 0.02, -0.008]], "feed_m_s": 0.1, "blend_s": 0.2}
WALL = {"stiffness_N_m": 5e4}
SHORT_CONE = {"depth_m": 0.001, "radius_m": 0.03, "feed_m_s": 0.15}


def wall(tmp_path: Path, sample: float, **robot: object) -> Case:
    text = WALL_CASE.format(
        robot="icme2008", home=[0.0, 10.0, 20.0, 0.0, 60.0, 0.0], part=[1.7, 0.0, 0.9]
    )
    tables = tomllib.loads(text)
    tables["tool_path"] |= LINE | {"sample_s": sample}
    tables["process"] |= WALL
    tables["robot"] |= robot
    return written(tables, tmp_path)


def cone(tmp_path: Path, sample: float, **robot: object) -> Case:
    tables = tomllib.loads((CASES / "cone.toml").read_text())
    tables["tool_path"] |= SHORT_CONE | {"sample_s": sample}
    tables["robot"] |= robot
    return written(tables, tmp_path)


def written(tables: dict, folder: Path) -> Case:
    file = folder / "sampled.toml"
    file.write_text(tomlkit.dumps(tables))
    return load_case(file)


@dataclass(frozen=True)
class Seen:
    """Error by samples [m], really and as it is told."""

    really: float
    told: SamplingCheck
    steps: float


@contextmanager
def compensated(case: Case) -> Iterator[tuple[Cell, Loop, Correction]]:
    """Robots of a case, their loop with the process, and the command."""
    with FmuPool(case.fmu) as fmus:
        cell, _ = cell_of(case.robots, fmus)
        loop = case.loop(cell)
        yield cell, loop, case.method.correct(loop, case.motion)


def error_by_samples(case: Case, loop: Loop, found: Correction) -> float:
    """Distance [m] from the path coupled to rest with the process, asked every millisecond."""
    time, _ = divide_steps(case.motion.path.time, 1e-3)

    def told(path: ToolPath) -> ToolPath:
        return ToolPath.of_tools([InterpolatedPath(tool).at(time) for tool in path.tools])

    forming = told(case.motion.path)
    task = replace(case.task, forming=forming, sample_rows=np.arange(len(time)))
    often = replace(loop, process=case.process_table.process(task), tolerance=EXACT)
    often = replace(often, scheme=case.coupling.new_scheme())
    reference = couple(often, found.joints, told(found.achieved))
    assert reference.converged
    own = found.achieved.time
    reached = reference.path.at_rows(np.searchsorted(time, own[np.isin(own, time)]))
    off = reached.distance_to(found.achieved.at_rows(np.flatnonzero(np.isin(own, time))))
    assert len(off) > 0.9 * len(own)
    return float(off.max())


def seen(case: Case) -> Seen:
    with compensated(case) as (cell, loop, found):
        step = float(np.diff(case.desired.time).max())
        return Seen(error_by_samples(case, loop, found), sampling_of(case, cell, found), step)


@pytest.mark.parametrize("robot", ["icme2008", "fanuc_r2000ic"])
def test_the_error_by_samples_is_of_second_order(tmp_path, robot):
    """A line of 1 s into a wall, robots without backlash, 20, 40 and 80 samples a second."""
    runs = [
        seen(wall(tmp_path, sample, description=robot, torque_curve="linear"))
        for sample in (0.05, 0.025, 0.0125)
    ]
    orders = np.diff(np.log([run.really for run in runs])) / np.diff(
        np.log([run.steps for run in runs])
    )
    np.testing.assert_allclose(orders, 2.0, atol=0.35)
    for run in runs:
        assert 0.5 < run.told.error / run.really < 2.0


@pytest.mark.parametrize("sample", [0.04, 0.02])
def test_what_is_told_is_right_within_a_factor_of_two(tmp_path, monkeypatch, sample):
    """Ramps, corners and backlash; asked once more as a formula is, or by parabolas as of a program."""
    case = cone(tmp_path, sample)
    with compensated(case) as (cell, loop, found):
        really = error_by_samples(case, loop, found)
        as_formula = sampling_of(case, cell, found)
        monkeypatch.setattr(IsfForceLawTable, "FORMULA", False)
        by_parabolas = sampling_of(case, cell, found)
    assert really > 1e-7
    assert by_parabolas.error != as_formula.error
    for told in (as_formula, by_parabolas):
        assert 0.5 < told.error / really < 2.0


def test_what_is_told_belongs_to_the_desired_path(tmp_path):
    """Its row holds the deviation under all of the force, and its warning comes above the tolerance."""
    case = wall(tmp_path, 0.1, torque_curve="linear")
    with compensated(case) as (cell, _, found):
        told = sampling_of(case, cell, found)
    assert told.replay.name == "sampling"
    assert told.replay.deviation.maximum == pytest.approx(told.error, rel=0.05)

    def warnings(tolerance: float, kind: str = "compensate", converged: bool = False):
        method = SimpleNamespace(tolerance_m=tolerance)
        command = SimpleNamespace(
            finding_of=lambda check: told,
            case=SimpleNamespace(method=method),
            kind=kind,
            correction=SimpleNamespace(converged=converged),
        )
        return SAMPLING.warnings(command)

    assert warnings(1.1 * told.error) == []
    assert warnings(0.5 * told.error, "couple") == []
    assert warnings(0.5 * told.error, "couple", converged=True)
    (warning,) = warnings(0.5 * told.error)
    assert warning.name == "sampling"
    assert f"{1e6 * told.error:.4g} um" in str(warning)
    assert "sample_s" in str(warning)


def test_a_program_of_unknown_corners_is_told_of_by_parabolas(tmp_path, monkeypatch):
    """Contact that begins between two samples: its corner is no sample, and the estimate says so."""
    from coupling.toolpaths.instants import NO_CORNERS

    monkeypatch.setattr(ElasticWallTable, "corners", lambda table, task: NO_CORNERS)
    monkeypatch.setattr(ElasticWallTable, "FORMULA", False)
    monkeypatch.setitem(LINE, "points_m", [[0.0, 0.0, 0.0022], [0.06, 0.02, -0.008]])
    run = seen(wall(tmp_path, 0.05, torque_curve="linear"))
    assert 1.0 / 3.0 < run.told.error / run.really < 3.0


def test_parabolas_are_kept_and_corners_and_jumps_stay():
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.5, 1.5, 12))
    coefficients = rng.normal(size=(3, 6))

    def force(t):
        return np.stack([t**0, t, t**2], axis=1) @ coefficients

    fine = np.linspace(time[0], time[-1], 301)
    # Four straight pieces a step of at most 1.5 s leave 1/8 (1.5 / 4)^2 of the second derivative.
    bound = 0.125 * 0.375**2 * 2.0 * np.abs(coefficients[2]).max()
    for choice in (flatter, steeper):
        smooth = parabolic(WrenchHistory(time, force(time)), choice)
        assert np.abs(smooth.at(fine)[0] - force(fine)).max() <= bound * (1.0 + 1e-9)
    kinked = WrenchHistory(time, np.abs(time - time[6])[:, None] * np.ones(6))
    np.testing.assert_allclose(parabolic(kinked, flatter).at(fine), kinked.at(fine), atol=1e-12)
    assert not np.allclose(parabolic(kinked, steeper).at(fine), kinked.at(fine), atol=1e-3)
    steps = WrenchHistory.of_means(time, force(time))
    bent = parabolic(steps, steeper)
    np.testing.assert_array_equal(bent.jumps, steps.jumps)
    np.testing.assert_allclose(bent.at(fine), steps.at(fine), atol=1e-12)

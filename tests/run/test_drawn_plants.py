"""Robots and forces drawn from what robot files and processes state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from line_case import line_case
from places import CASES

from coupling.case.file import load_case
from coupling.process import PROCESSES
from coupling.process.isf_force_law import IsfForceLawTable
from coupling.process.sheet_fem_table import SheetFemTable
from coupling.robot.robot_fmu import SimulatedModel
from coupling.run.drawn_plants import basis_of, drawn_differences
from coupling.run.execute import run_compensation

RANGES = {1: (5e6, 4e7), 4: (1e6, 3e6)}


def test_draws_fill_the_ranges_evenly_in_their_logarithm_and_leave_the_other_gears(example):
    """The same at each call; of 64 draws each quarter of a range has 16."""
    models = [SimulatedModel(example, "backlash", None)]
    drawn = list(drawn_differences(models, [RANGES], 0.19, 64, seed=1))
    again = list(drawn_differences(models, [RANGES], 0.19, 64, seed=1))
    assert drawn == again
    factors = np.array([differences[0].amounts["stiffness"] for differences, _ in drawn])
    own = [joint.stiffness for joint in example.joints]
    for number, (low, high) in RANGES.items():
        along = np.log(factors[:, number - 1] * own[number - 1] / low) / np.log(high / low)
        assert np.all(np.histogram(along, 4, (0.0, 1.0))[0] == 16)
    assert np.all(np.delete(factors, [0, 3], axis=1) == 1.0)
    force = np.array([factor for _, factor in drawn])
    assert np.all(np.histogram(force, 4, (0.81, 1.19))[0] == 16)


def test_what_no_source_states_is_named(example):
    models = [SimulatedModel(example, "backlash", None)]
    part = basis_of(models, [RANGES], None)
    assert part.drawn == ("the stated stiffness of 2 gears",)
    assert part.missing[:2] == ("the stiffness of 3 gears", "the force")
    assert not part.is_whole
    whole = basis_of(models, [dict.fromkeys(range(1, 6), (1e6, 3e7))], 0.19)
    assert whole.is_whole
    assert whole.drawn == ("the stated stiffness of 5 gears", "a force of +-19 %")
    assert whole.missing == (
        "hysteresis, which the file leaves out",
        "friction and servos, which the file leaves out",
    )


def test_the_errors_of_forces_are_those_of_the_comparisons_with_measurements():
    stated = {table: table.FORCE_ERROR for table in PROCESSES.values() if table.FORCE_ERROR}
    assert stated == {IsfForceLawTable: 0.19, SheetFemTable: 0.37}


def test_a_run_states_the_deviation_on_drawn_robots_where_there_are_ranges(tmp_path):
    case = line_case(tmp_path, "native")
    assert run_compensation(case).drawn == ()
    (placed,) = case.robots
    provenance = replace(placed.provenance, stiffness_ranges=RANGES)
    run = run_compensation(replace(case, robots=(replace(placed, provenance=provenance),)))
    assert len(run.drawn) == 32
    largest = [replay.deviation.maximum for replay in run.drawn]
    assert len(set(largest)) == 32
    # Two gears of a third to twice their stiffness leave more than 2 % of all of them.
    assert max(largest) > max(row.deviation.maximum for row in run.robustness if "2 %" in row.name)


@pytest.mark.parametrize("name", ["cone", "bm3"])
def test_a_shipped_force_law_states_its_error(name):
    assert load_case(CASES / f"{name}.toml").process_table.FORCE_ERROR is not None

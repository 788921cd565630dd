"""Robots and forces drawn from what robot files and processes state."""

from dataclasses import replace

import numpy as np
import pytest
from line_case import line_case
from placed_robots import placed_robot
from places import CASES

from coupling.case.file import load_case
from coupling.path.deviation import measure
from coupling.process import PROCESSES
from coupling.process.isf_force_law import IsfForceLawTable
from coupling.process.milling_table import MillingForceTable
from coupling.process.sheet_fem_table import SheetFemTable
from coupling.results.outlook import DeviationInterval
from coupling.run.execute import run_compensation
from coupling.run.expected_robots import DRAWN_ROBOTS, ExpectedRobots, assumed_ranges

pytestmark = pytest.mark.usefixtures("drawn_robots")

RANGES = {1: (5e6, 4e7), 4: (1e6, 3e6)}


def test_draws_fill_the_ranges_evenly_in_their_logarithm_and_leave_the_other_gears(example):
    """The same at each call; of 64 draws each quarter of a range has 16."""
    placed = placed_robot(example, ranges=RANGES)
    expected = ExpectedRobots.among([placed], (0.84, 1.0), assumes=False)
    drawn = list(expected.draws(64))
    assert drawn == list(expected.draws(64))
    factors = np.array([draw.differences[0].amounts["stiffness"] for draw in drawn])
    stiffness = [joint.stiffness for joint in example.joints]
    for number, (low, high) in RANGES.items():
        along = np.log(factors[:, number - 1] * stiffness[number - 1] / low) / np.log(high / low)
        assert np.all(np.histogram(along, 4, (0.0, 1.0))[0] == 16)
    assert np.all(np.delete(factors, [0, 3], axis=1) == 1.0)
    force = np.array([draw.force for draw in drawn])
    assert np.all(np.histogram(force, 4, (0.84, 1.0))[0] == 16)


def test_what_no_source_states_is_named(example):
    part = ExpectedRobots.among([placed_robot(example, ranges=RANGES)], None, assumes=False).basis
    assert part.drawn == ("the stated stiffness of 2 gears",)
    assert part.missing[:2] == ("the stiffness of 3 gears", "the force")
    assert not part.is_whole
    known = placed_robot(example, ranges=dict.fromkeys(range(1, 6), (1e6, 3e7)))
    whole = ExpectedRobots.among([known], (0.84, 1.0)).basis
    assert whole.is_whole
    assert whole.drawn == ("the stated stiffness of 5 gears", "84 to 100 % of the force")
    free = ExpectedRobots.among([known], None, has_force=False).basis
    assert (free.is_whole, free.drawn) == (True, whole.drawn[:1])
    assert whole.missing == ("errors of the file's backlash", "kinematic errors of the gears")
    assumed = ExpectedRobots.among([placed_robot(example, ranges=RANGES)], (0.84, 1.0)).basis
    assert assumed.is_whole
    assert assumed.drawn[1] == "an assumed 25 % of the stiffness of 3 gears"


def test_real_forces_differ_from_the_computed_ones_as_much_as_they_were_measured_to():
    """1525 N were measured, 557 N less than by finite elements, 290 N less than by the law."""
    stated = {table: table.FORCE_FACTORS for table in PROCESSES.values() if table.FORCE_FACTORS}
    assert set(stated) == {IsfForceLawTable, SheetFemTable, MillingForceTable}
    # K_tc of 7075: 600 to 1319 MPa, 767 MPa in the first row.
    assert stated[MillingForceTable] == pytest.approx((600.0 / 767.0, 1319.0 / 767.0), abs=5e-3)
    for table, more in ((SheetFemTable, 557.0), (IsfForceLawTable, 290.0)):
        low, high = stated[table]
        assert high - 1.0 == pytest.approx(more / 1525.0, abs=5e-3)
        assert 1.0 - low == pytest.approx(high - 1.0)


def test_a_run_states_the_deviation_on_drawn_robots_where_there_are_ranges(tmp_path):
    case = line_case(tmp_path, "native")
    (placed,) = case.robots
    gears = [joint for joint in placed.description.joints if joint.stiffness]
    assert len(assumed_ranges(placed)) == len(gears)
    without = run_compensation(case).finding_of(DRAWN_ROBOTS)
    assert len(without.stated) == 64
    assert without.basis.drawn == (f"an assumed 25 % of the stiffness of {len(gears)} gears",)
    provenance = replace(placed.provenance, stiffness_ranges=RANGES)
    run = run_compensation(replace(case, robots=(replace(placed, provenance=provenance),)))
    largest = [replay.deviation.maximum for replay in run.finding_of(DRAWN_ROBOTS).stated]
    assert len(set(largest)) == 64
    # Two gears of a third to twice their stiffness leave more than 2 % of all of them.
    assert max(largest) > max(row.deviation.maximum for row in run.robustness if "2 %" in row.name)
    # Every usual value does something, and robots that have all of them leave more than those without.
    exact = measure(run.dynamic, run.desired).maximum
    assert [own.name for own in run.finding_of(DRAWN_ROBOTS).left_out] == [
        "hysteresis 0.5 arc minutes wide",
        "servos",
        "servos and friction",
    ]
    assert all(
        own.deviation.maximum > 10.0 * exact for own in run.finding_of(DRAWN_ROBOTS).left_out
    )
    assert len(run.finding_of(DRAWN_ROBOTS).completed) == 16
    stated, usual = (
        DeviationInterval.around(own)
        for own in (run.finding_of(DRAWN_ROBOTS).stated, run.finding_of(DRAWN_ROBOTS).completed)
    )
    assert usual.low > stated.low


@pytest.mark.parametrize("name", ["cone", "bm3"])
def test_a_shipped_force_law_states_its_error(name):
    assert load_case(CASES / f"{name}.toml").process_table.FORCE_FACTORS is not None

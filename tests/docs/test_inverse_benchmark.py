"""The benchmark of the inverse: it inverts what it says, and its verdicts follow from its rows."""

import numpy as np
import pytest

from benchmarks import stopwatch
from benchmarks.inverse import PARTS, InverseRow, goals, lines, measured
from benchmarks.inverse_tasks import InverseTask, cone_task, iso_task
from coupling.path.histories import ToolPath, WrenchHistory


def test_the_first_seconds_of_the_iso_path_are_inverted_and_simulated(monkeypatch):
    monkeypatch.setattr(stopwatch, "_SHORT", 0.0)  # each runs once
    row = measured(iso_task().first(0.05), "backlash")
    assert row.duration == pytest.approx(1.14)
    assert tuple(row.parts) == PARTS
    assert all(spent > 0.0 for spent in (*row.parts.values(), row.half, *row.peers.values()))
    assert row.inverse == pytest.approx(sum(row.parts.values()) - row.parts["plan"])


def test_the_tasks_are_the_paths_that_are_named():
    iso, cone = iso_task(), cone_task()
    speed = np.linalg.norm(np.diff(iso.path.position[0], axis=0), axis=1) / np.diff(iso.path.time)
    assert iso.duration == pytest.approx(22.8)
    assert speed.max() == pytest.approx(0.25, rel=1e-3)
    assert 150.0 < cone.duration < 151.0
    assert cone.wrench.peak_force > 300.0


def test_there_and_back_a_path_goes_on_where_it_turns():
    time = np.array([1.0, 2.0, 4.0])
    pose = np.zeros((3, 7))
    pose[:, 0], pose[:, 6] = [0.0, 1.0, 5.0], 1.0
    load = WrenchHistory.of_forces(time, [np.outer([7.0, 8.0, 9.0], [1.0, 0.0, 0.0])])
    long = InverseTask("there", ToolPath(time, pose), load, np.zeros(6)).there_and_back(3)
    np.testing.assert_array_equal(long.path.time, [0.0, 1.0, 3.0, 5.0, 6.0, 7.0, 9.0])
    np.testing.assert_array_equal(long.path.position[0, :, 0], [0.0, 1.0, 5.0, 1.0, 0.0, 1.0, 5.0])
    np.testing.assert_array_equal(long.wrench.force[0, :, 0], [7.0, 8.0, 9.0, 8.0, 7.0, 8.0, 9.0])


def rows(links: float, half: float) -> list[InverseRow]:
    parts = {"plan": 9.0, "links": links, "drives": 0.5}
    return [
        InverseRow("cone", curve, 150.7, parts, half, {"native FMU": 0.5})
        for curve in ("linear", "backlash")
    ]


def test_goals_are_those_of_backlash_without_planning():
    found = goals(rows(2.0, 1.0), (603.0, 0.4))
    assert [goal.ratio for goal in found] == pytest.approx([2.5, 2.5, 0.4])
    assert [goal.reached for goal in found] == [True, False, False]
    assert not goals(rows(2.1, 1.5), None)[0].reached


def test_the_table_relates_the_inverse_to_its_half_and_to_others():
    assert lines(rows(2.0, 1.25)).splitlines()[-1] == (
        "| cone, 151 s | `backlash` | 9.00 | 2.00 | 0.50 | 2.50 | 2.00 | 5.00 |"
    )

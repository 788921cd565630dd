"""A wrench that was measured as a process, along the path it was recorded on."""

from pathlib import Path

import numpy as np
import pytest
from own_program import task
from places import LINE_CASE

from coupling.case.file import load_case
from coupling.errors import CaseError
from coupling.files.csv_table import WRENCH_COLUMNS, write_table
from coupling.path.linear import arc_length
from coupling.process import MeasuredWrenchTable
from coupling.run.execute import run_coupling


def measured(file: Path, text: str, **keys: object):
    file.write_text(text)
    return MeasuredWrenchTable.model_validate({"model": "measured", "file": str(file), **keys})


def test_a_record_in_tool_axes_turns_with_the_tool(tmp_path):
    table = measured(
        tmp_path / "w.csv", "time,fx,fy,fz,mx,my,mz\n0,0,0,0,0,0,0\n1,10,20,30,1,2,3\n"
    )
    process, path = table.process(task()), task().desired
    wrench = process.evaluate(path).wrench.wrench[0]
    expected = np.outer(path.time, [10.0, 20.0, 30.0])
    np.testing.assert_allclose(wrench[:, :3], path.rotations[0].apply(expected), atol=1e-12)
    turned = path.displaced(np.array([0, 0, 0, 0.1, 0.2, 0.3]))
    moments = process.evaluate(turned).wrench.wrench[0][:, 3:]
    np.testing.assert_allclose(
        moments, turned.rotations[0].apply(np.outer(path.time, [1.0, 2.0, 3.0])), atol=1e-12
    )


def test_a_record_over_distance_belongs_to_the_place(tmp_path):
    """fx = 100 N times the share of the way, whatever the speed; no moments measured."""
    path = task().desired
    length = arc_length(path.position[0])[-1]
    table = measured(
        tmp_path / "w.csv", f"distance,fx,fy,fz\n0,0,0,0\n{length},100,0,0\n", frame="base"
    )
    wrench = table.process(task()).evaluate(path).wrench.wrench[0]
    np.testing.assert_allclose(
        wrench[:, 0], 100.0 * arc_length(path.position[0]) / length, atol=1e-10
    )
    assert np.all(wrench[:, 1:] == 0.0)
    middle = wrench[10, 0]
    assert middle == pytest.approx(26.0, abs=2.0)  # a quarter of the way at half time


BAD_RECORDS = {
    "time,fx,fy,fz\n0,0,0,0\n0.9,0,0,0\n": "at least 0 to 1 s for the tool path, got 0 to 0.9 s",
    "fx,fy,fz\n0,0,0\n": "either a column time or a column distance",
    "time,distance,fx,fy,fz\n0,0,0,0,0\n": "either a column time or a column distance",
    "time,fx,fy\n0,0,0\n": "columns fz are missing",
    "time,fx,fy,fz,mx\n0,0,0,0,0\n": "columns my, mz are missing",
    "time,fx,fy,fz\n0,0,0,0\n0.7,0,0,0\n0.6,0,0,0\n": (
        "time: expected rising values, got 0.6 s after 0.7 s in row 3"
    ),
}


@pytest.mark.parametrize("text", BAD_RECORDS)
def test_a_bad_record_is_refused(tmp_path, text):
    with pytest.raises(CaseError, match=BAD_RECORDS[text]):
        measured(tmp_path / "w.csv", text).process(task())


def test_a_measured_case_couples_in_two_evaluations(tmp_path):
    """The record does not ask where the tool is: the second evaluation repeats the first."""
    text = (LINE_CASE).read_text()
    begin = text.index("[process]")
    rest = text[text.index("[coupling]") :]
    record = '[process]\nmodel = "measured"\nfile = "record.csv"\nframe = "part"\n\n'
    (tmp_path / "case.toml").write_text(text[:begin] + record + rest)
    end = load_case(LINE_CASE).desired.time[-1]
    table = np.zeros((2, 7))
    table[1, [0, 3]] = end, 200.0
    write_table(tmp_path / "record.csv", ("time", *WRENCH_COLUMNS), table)
    run = run_coupling(load_case(tmp_path / "case.toml"))
    assert run.correction.converged
    assert run.correction.evaluations == 2
    assert run.correction.response.wrench.peak_force == pytest.approx(200.0)

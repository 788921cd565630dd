"""The example of two robots, shortened: what its run says, writes and refuses."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from command_line import BY_MODE, FILES
from line_case import changed_text
from places import CASES
from reported import compensated, on_terminal

from coupling.case.file import load_case
from coupling.errors import BuildError, CaseError
from coupling.files.written_files import LIST
from coupling.fmu_export.ssp import SspSystem
from coupling.path.deviation import measure
from coupling.path.interpolation import SampledPath
from coupling.path.length_text import in_unit, length_unit
from coupling.process import ProcessResponse
from coupling.report.run_report import cell_head
from coupling.report.stored_result import write_report
from coupling.results.gear_result import BacklashReversal
from coupling.results.section import Table
from coupling.run.folder import write_run
from coupling.run.path_checks import OTHER_MODE, TOOL_GAP, UNLOADED_PATHS, OtherModePaths, tool_gap
from coupling.run.robustness import ROBUSTNESS
from coupling.run.stored_run import read_run
from coupling.solve.correction import HOW

CASE = CASES / "two_robots.toml"


def changed(tmp_path, *changes: tuple[str, str]):
    file = tmp_path / "two_robots.toml"
    file.write_text(changed_text(CASE, *changes))
    return file


SHORT = (
    ("depth_m        = 0.005", "depth_m = 0.001"),
    ("radius_m       = 0.06", "radius_m = 0.01"),
    ("feed_m_s       = 0.05", "feed_m_s = 0.05\nsample_s = 0.04"),
)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Return the example shortened to two small contours, compensated, and its folder."""
    folder = tmp_path_factory.mktemp("cell")
    return compensated(folder, load_case(changed(folder, *SHORT)))


def test_two_robots_case_shortened_is_compensated(finished):
    """Both tools within 10 um of their paths, and so the gap, which was off by far more."""
    case, run, _ = finished
    assert run.correction.converged, run.correction.reason
    assert run.deviation(run.before).maximum > 1e-3
    assert run.deviation(run.correction.achieved).maximum <= 1e-5
    assert len(run.desired.tools) == 2
    assert case.task.support is not None
    assert np.abs(run.finding_of(TOOL_GAP).before).max() > 5e-5
    assert np.abs(run.finding_of(TOOL_GAP).after).max() <= 2e-5


def test_a_coupled_cell_speaks_of_no_compensation(finished, tmp_path):
    case, run, out = finished
    assert "after, if the file is right" in (out / "report.html").read_text(encoding="utf-8")
    as_it_was = replace(run.correction, achieved=run.before)
    coupled = replace(run, kind="couple", correction=as_it_was)
    write_run(tmp_path, case, coupled)
    report = write_report(tmp_path).read_text(encoding="utf-8")
    page = report[report.index("<body>") : report.index("<h2>Inputs: case</h2>")]
    for text in (on_terminal(tmp_path), page):
        assert "ompensation" not in text
        assert " after." not in text


def test_a_cell_shows_the_other_mode_of_its_worse_robot(finished):
    """The quasi-static row of the cell's table is measured on both robots' quasi-static paths."""
    _, run, out = finished
    stored = read_run(out)
    tables = [part for section in cell_head(stored) for part in section.parts]
    rows = {row[0].strip(): row for part in tables if isinstance(part, Table) for row in part.rows}
    row = rows["quasi-static robot under the same command and wrench"]
    expected = [
        measure(path, run.desired)
        for path in (run.finding_of(OTHER_MODE).before, run.finding_of(OTHER_MODE).after)
    ]
    _, unit = length_unit(run.deviation(run.before).maximum)
    assert [row[1], row[4]] == [in_unit(deviation.maximum, unit) for deviation in expected]
    assert expected[1].maximum > 5.0 * measure(run.correction.achieved, run.desired).maximum


def _reversal(
    joint: int, begins: float, ends: float, before: int, after: int, robot: str
) -> BacklashReversal:
    return BacklashReversal(
        robot=robot, joint=joint, begins=begins, ends=ends, before=before, after=after
    )


@pytest.fixture(scope="module")
def told(finished, tmp_path_factory):
    """Return the run's folder and report, as if its path before were one-way and gears reversed."""
    case, run, _ = finished
    changes = (
        _reversal(1, 0.1, 0.2, -1, 1, "forming"),
        _reversal(1, 0.3, 0.4, 1, 1, "support"),
        _reversal(4, 0.5, 0.6, 0, 1, "support"),
    )
    before = replace(run.correction.before, response=None, how="one-way")
    other = replace(run.correction, before=before, backlash_reversals=changes)
    folder = tmp_path_factory.mktemp("told")
    write_run(folder, case, replace(run, correction=other))
    write_report(folder)
    return folder


def test_a_path_before_that_is_not_coupled_is_said_to_be_one_way(told):
    """In result.json, on the terminal and in the report; it has no workpiece of its own."""
    assert json.loads((told / "result.json").read_text())["before"] == "one-way"
    page = (told / "support" / "report.html").read_text(encoding="utf-8")
    for text in (on_terminal(told), page):
        assert HOW["one-way"] in text
        assert HOW["coupled"] not in text


def test_a_run_on_finer_times_than_its_case_has_the_same_figures(finished, tmp_path):
    """Every path between its samples as well: deviations and gap at the samples are as they were."""
    case, run, _ = finished
    found = run.correction
    fine = SampledPath.of(found.desired).refined(0.0021)
    desired, rows = fine.path, fine.sample_rows
    assert len(rows) == len(found.desired.time) < len(desired.time)
    finer = replace(
        found,
        desired=desired,
        unloaded=SampledPath.of(found.unloaded).refined(0.0021).path,
        before=replace(found.before, path=SampledPath.of(run.before).refined(0.0021).path),
        correction=found.joints.q[0][0, 0] * np.ones((2, len(desired.time), 6)),
        achieved=SampledPath.of(found.achieved).refined(0.0021).path,
        response=ProcessResponse(found.response.wrench.refined(desired.time)),
    )
    gap = tool_gap(case, finer)
    np.testing.assert_allclose(
        gap.before[rows], run.finding_of(TOOL_GAP).before, rtol=0, atol=1e-12
    )
    findings = dict(run.findings)
    findings |= {UNLOADED_PATHS.name: None, OTHER_MODE.name: OtherModePaths(), TOOL_GAP.name: gap}
    findings[ROBUSTNESS.name] = ()
    between = replace(run, correction=finer, findings=findings)
    write_run(tmp_path, case, between)
    for robot in read_run(tmp_path).robots.values():
        assert np.array_equal(robot.desired.time, desired.time)
    own, before = between.deviation(between.before), run.deviation(run.before)
    assert own.maximum == pytest.approx(before.maximum, rel=1e-3)
    assert own.rms == pytest.approx(before.rms, rel=1e-2)


def test_other_robots_are_told_for_each_robot_and_for_the_worst(finished):
    _, run, out = finished
    whole, *own = (
        json.loads((out / place / "result.json").read_text()) for place in (".", *run.robots)
    )
    assert len(whole["robustness"]) >= 4
    for row, *rows in zip(whole["robustness"], *(one["robustness"] for one in own), strict=True):
        assert {row["name"]} == {one["name"] for one in rows}
        sizes = [one["deviation_m"]["maximum"] for one in rows]
        assert row["deviation_m"]["maximum"] == max(sizes)
        assert sizes[0] != sizes[1]
    assert [drive["robot"] for drive in whole["command"]["drives"]] == ["forming"] * 6 + [
        "support"
    ] * 6
    assert [drive["robot"] for drive in own[1]["command"]["drives"]] == ["support"] * 6


def test_passages_of_a_cell_are_told_with_their_robot(told):
    for place, count in ((".", 3), ("forming", 1), ("support", 2)):
        figures = json.loads((told / place / "result.json").read_text())
        assert len(figures["backlash_reversals"]) == count
    said = on_terminal(told)
    assert "Gears enter their backlash 3 times" in said
    for row in ("forming joint 1 +1 +1 ", "support joint 1 +1 +0 ", "support joint 4 +1 +0 "):
        assert re.search(row, said)
    for name in ("forming", "support"):
        page = (told / name / "report.html").read_text(encoding="utf-8")
        assert "gear in its backlash" in page


def test_the_supporting_tool_takes_its_share_of_the_force(finished):
    """Within what the pinch adds at 1e5 N/m over a gap that is right to 20 um: 2 N."""
    _, run, _ = finished
    forming, support = (
        np.linalg.norm(force, axis=1).max() for force in run.correction.response.wrench.force
    )
    assert support == pytest.approx(0.5 * forming, abs=4.0)
    assert forming > 100.0


def test_equal_robots_face_to_face_sag_alike(finished):
    """Unloaded, in their own bases: the mean sag of both agrees to a few percent."""
    _, run, _ = finished
    sags = (run.correction.unloaded.position - run.desired.position)[..., 2].mean(axis=1)
    assert sags[0] < -1e-3
    assert sags[1] == pytest.approx(sags[0], rel=0.05)


def test_a_cell_leaves_one_folder_for_each_robot(finished):
    _, run, out = finished
    assert {f.name for f in out.iterdir()} == {
        *("case.toml", "result.json", "gap.csv", "report.html", "forming", "support"),
        LIST,
    }
    for name in ("forming", "support"):
        files = {f.name for f in (out / name).iterdir()}
        assert files == (FILES | BY_MODE["quasistatic"] | {"wrong_backlash.csv"}) - {
            "case.toml",
            "run.json",
        }
    cell = read_run(out)
    for tool, name in enumerate(("forming", "support")):
        stored = cell.robots[name]
        achieved = run.correction.achieved.tools[tool]
        assert np.array_equal(stored.achieved.pose, achieved.pose)
        own = measure(achieved, run.desired.tools[tool])
        assert stored.figures.deviation_after_m.maximum == pytest.approx(own.maximum)
    assert cell.robots["support"].joints.q[0].shape[1] == 6
    np.testing.assert_allclose(cell.gap[:, 1], 1e-3 + run.finding_of(TOOL_GAP).after, atol=1e-15)
    page = (out / "report.html").read_text()
    assert 'href="support/report.html"' in page
    assert "Gap between the tools" in page
    figures = json.loads((out / "result.json").read_text())["pinch_gap_m"]
    assert figures["narrowest_after"] == pytest.approx(1e-3, abs=2e-5)


def test_the_resolved_case_of_a_cell_is_the_case(finished):
    case, _, out = finished
    again = load_case(out / "case.toml")
    assert np.array_equal(again.desired.pose, case.desired.pose)
    assert [robot.name for robot in again.robots] == ["forming", "support"]


BAD_CELLS = {
    "no share": (("support_share             = 0.5", ""), "key support_share is missing"),
    "strategy": (('"following"', '"folowing"'), "did you mean 'following'"),
    "home": (
        ("-50.0, 0.0]\nbase", "-50.0]\nbase"),
        "support: home_deg: expected 6 angles, .* got 5",
    ),
}


@pytest.mark.parametrize("name", BAD_CELLS)
def test_a_bad_cell_is_named(tmp_path, name):
    change, words = BAD_CELLS[name]
    with pytest.raises(CaseError, match=words):
        load_case(changed(tmp_path, change))


def test_a_process_that_knows_one_tool_is_refused_in_a_cell(tmp_path):
    text = CASE.read_text()
    wall = '[process]\nmodel = "elastic-wall"\nstiffness_N_m = 1e5\n'
    (tmp_path / "case.toml").write_text(text[: text.index("[process]")] + wall)
    with pytest.raises(CaseError, match=r"two tools with .*, got 'elastic-wall'"):
        load_case(tmp_path / "case.toml")


def test_a_cell_is_no_system_of_one_robot():
    with pytest.raises(BuildError, match="a cell of two robots"):
        SspSystem.of(load_case(CASE))


def test_fixed_height_needs_a_wall(tmp_path):
    text = CASE.read_text().replace('"following"', '"fixed-height"')
    begin, end = text.index("[tool_path]"), text.index("[process]")
    line = "[tool_path]\nkind = 'line'\nfeed_m_s = 0.1\npoints_m = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]\n"
    (tmp_path / "case.toml").write_text(text[:begin] + line + text[end:])
    with pytest.raises(CaseError, match="the tool path has no wall"):
        load_case(tmp_path / "case.toml")

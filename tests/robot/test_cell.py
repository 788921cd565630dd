"""Two robots in a cell: placements, support paths, the pinch in closed form, a case by name."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from command_line import BY_MODE, FILES
from hypothesis import given
from hypothesis import strategies as st
from line_case import changed_text
from places import CASES
from reported import compensated, on_terminal
from scipy.spatial.transform import Rotation
from spring_robot import SpringPlanner, SpringRobot, upright

from coupling.case.file import load_case
from coupling.errors import BuildError, CaseError
from coupling.files.written_files import LIST
from coupling.fmu_export.ssp import SspSystem
from coupling.path.contact_spring import ContactSpring
from coupling.path.deviation import measure
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory, poses
from coupling.path.interpolation import SampledPath
from coupling.path.length_text import format_um
from coupling.process import ProcessResponse
from coupling.process.isf_force_law import DoubleSided
from coupling.report.result_page import write_report
from coupling.report.run_report import cell_head
from coupling.results.gear_result import BacklashReversal
from coupling.results.section import Table
from coupling.robot.cell import Cell, Member
from coupling.run.folder import write_run
from coupling.run.path_checks import OTHER_MODE, TOOL_GAP, UNLOADED_PATHS, OtherModePaths, tool_gap
from coupling.run.stored_run import read_run
from coupling.solve.correction import HOW
from coupling.solve.coupling import couple
from coupling.solve.fixed_point import Loop, Tolerance
from coupling.solve.schemes import SCHEMES
from coupling.toolpaths import Cone
from coupling.toolpaths.support import STRATEGIES, Pinch, SupportingTool, support_along

CASE = CASES / "two_robots.toml"
TIME = np.linspace(0.0, 1.0, 20)


def random_path(rng: np.random.Generator) -> ToolPath:
    turned = Rotation.random(len(TIME), random_state=rng.integers(2**31))
    return ToolPath(TIME, poses(rng.normal(size=(len(TIME), 3)), turned))


@given(st.integers(0, 10**6))
def test_a_wrench_and_its_spring_do_the_same_work_in_all_frames(seed):
    """A load in world axes does on motions in the world what its image does in the base."""
    rng = np.random.default_rng(seed)
    rotation = Rotation.random(random_state=rng.integers(2**31))
    world_from_base, path = Frame(rng.normal(size=3), rotation), random_path(rng)
    base_from_world = world_from_base.inverse()
    back = path.transformed(world_from_base).transformed(base_from_world)
    np.testing.assert_allclose(back.pose, path.pose, rtol=0, atol=1e-12)
    root = rng.normal(size=(1, len(TIME), 3, 3))
    spring = ContactSpring(rng.normal(size=(1, len(TIME), 3)), root @ root.swapaxes(-1, -2))
    wrench = WrenchHistory(TIME, rng.normal(size=(len(TIME), 6)), spring)
    moved = path.displaced(1e-6 * rng.normal(size=(1, len(TIME), 6)))
    in_world = [own.transformed(world_from_base) for own in (path, moved)]
    loads = wrench.on(in_world[0])
    image = wrench.transformed(base_from_world).on(path)
    work = np.sum(loads.wrench * in_world[1].deviation_from(in_world[0]), axis=2)
    own = np.sum(image.wrench * moved.deviation_from(path), axis=2)
    np.testing.assert_allclose(own, work, rtol=0, atol=1e-13)


@given(st.integers(0, 10**6))
def test_tools_side_by_side_deviate_each_for_itself(seed):
    rng = np.random.default_rng(seed)
    first, second = random_path(rng), random_path(rng)
    both = ToolPath.of_tools([first, second])
    by = 0.1 * rng.normal(size=(2, len(TIME), 6))
    moved = both.displaced(by)
    np.testing.assert_allclose(moved.deviation_from(both), by, rtol=0, atol=1e-12)
    for k, alone in enumerate((first, second)):
        expected = alone.displaced(by[k][None])
        assert np.array_equal(moved.tools[k].pose, expected.pose)
    distances = np.linalg.norm(by[..., :3], axis=2)
    np.testing.assert_allclose(moved.distance_to(both), distances.max(axis=0), atol=1e-12)
    assert measure(moved, both).maximum == pytest.approx(distances.max(), rel=1e-9)


def test_paths_of_tools_that_do_not_belong_together_are_refused():
    both = ToolPath.of_tools([ToolPath(TIME, upright(np.zeros((20, 3))))] * 2)
    with pytest.raises(ValueError, match="different times"):
        ToolPath.of_tools([both.tools[0], ToolPath(2.0 * TIME, both.tools[0].pose)])
    with pytest.raises(ValueError, match=r"values \(tools, n, 7\), .*, got shape \(20, 13\)"):
        ToolPath(TIME, np.zeros((20, 13)))


class ConstantForce:
    """A forming force of 400 N against +z, wherever the tool is."""

    identity = ""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        wrench = np.tile([0, 0, -400.0, 0, 0, 0], (len(path.time), 1))
        return ProcessResponse(WrenchHistory(path.time, wrench))


@pytest.mark.parametrize("scheme", ["aitken", "anderson"])
def test_springs_on_both_sides_of_a_sheet_rest_at_the_closed_form(scheme):
    """c (1 + k (C_f + C_s)) = -F (C_f + s C_s): both give way, the gap opens by -c.

    The supporting robot stands upside down, so that signs of its frame would show.
    """
    compliance = {"forming": 2e-6, "support": 1e-6}  # [m/N]
    force, share, stiffness = 400.0, 0.6, 1e5
    placements = {
        "forming": Frame(np.array([0.1, 0.2, 0.3]), Rotation.from_euler("z", 0.7)),
        "support": Frame(np.array([-1.0, 0.5, 2.0]), Rotation.from_euler("x", np.pi)),
    }
    cell = Cell(
        tuple(
            Member(name, placements[name], SpringRobot(c * np.eye(3)), SpringPlanner())
            for name, c in compliance.items()
        )
    )
    line = np.column_stack([0.1 * TIME, 0.0 * TIME, 0.0 * TIME])
    forming, behind = (
        ToolPath(TIME, upright(line + np.array([0.0, 0.0, height]))) for height in (0.0, 1e-3)
    )
    up = np.tile([0.0, 0.0, 1.0], (len(TIME), 1))  # from the forming tool to the sheet's back
    support = SupportingTool(forming, behind, up, gap=1e-3, tool_diameter=0.01)
    process = DoubleSided(ConstantForce(), support, share, stiffness)
    desired = ToolPath.of_tools([forming, behind])
    command = cell.plan(desired)
    start = cell.simulate(command, WrenchHistory.none(TIME, tools=2), "quasistatic")
    np.testing.assert_allclose(start.distance_to(desired), 0.0, atol=1e-12)
    tolerance = Tolerance(1e-12, 1e-12, 1e-9)
    loop = Loop(cell, process, "quasistatic", SCHEMES[scheme](1.0), tolerance, 60)
    result = couple(loop, command)
    assert result.converged, result.reason
    both = compliance["forming"] + compliance["support"]
    opening = (
        force * (compliance["forming"] + share * compliance["support"]) / (1.0 + stiffness * both)
    )
    np.testing.assert_allclose(support.opening(result.path), opening, rtol=1e-6)
    borne = share * force - stiffness * opening
    on_forming, on_support = result.response.wrench.force[..., 2]
    np.testing.assert_allclose(on_support, borne, rtol=1e-6)
    pinch = borne - share * force
    np.testing.assert_allclose(on_forming, -force - pinch, rtol=1e-6)


def cone_task() -> tuple[Frame, ToolPath]:
    part = Frame(np.array([1.0, 0.2, 0.5]), Rotation.from_euler("x", 0.3))
    cone = Cone(
        kind="cone",
        radius_m=0.03,
        wall_angle_deg=40.0,
        step_down_m=0.001,
        depth_m=0.008,
        feed_m_s=0.1,
        sample_s=0.01,
    )
    return part, cone.path(part)


R_FORMING, R_SUPPORT, GAP = 5e-3, 6e-3, 1.2e-3


def supported(strategy: str) -> tuple[np.ndarray, np.ndarray, SupportingTool]:
    part, desired = cone_task()
    pinch = Pinch(np.deg2rad(40.0), GAP, 2 * R_FORMING, 2 * R_SUPPORT)
    found = support_along(strategy, part, desired, 0.0, pinch)
    forming, behind = (part.coordinates(path.position[0]) for path in (desired, found.desired))
    return forming, behind, found


def test_a_following_support_keeps_the_gap_between_the_spheres_across_the_wall():
    """Distance of the centres less both radii, wherever the forming tool is in the sheet."""
    forming, behind, found = supported("following")
    up = np.array([0.0, 0.0, 1.0])
    centres = forming + R_FORMING * up, behind - R_SUPPORT * up
    distance = np.linalg.norm(centres[1] - centres[0], axis=1) - R_FORMING - R_SUPPORT
    end = np.argmin(forming[:, 2]) + 50  # then the tool leaves
    inside = forming[:end, 2] <= 0.0
    np.testing.assert_allclose(distance[:end][inside], GAP, rtol=0, atol=1e-12)
    assert behind[:, 2].max() <= -GAP + 1e-12  # never through the flat sheet
    part, _ = cone_task()
    across = part.rotation.inv().apply(found.direction)
    deep = forming[:, 2] < -7e-3
    np.testing.assert_allclose(across[deep, 2], -np.cos(np.deg2rad(40.0)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(across, axis=1), 1.0, atol=1e-12)


def test_a_support_at_fixed_height_stays_below_the_rim():
    forming, behind, _ = supported("fixed-height")
    inside = forming[:, 2] < 0.0
    before_leaving = np.arange(len(inside)) <= np.flatnonzero(forming[:, 2] <= -8e-3 + 1e-12)[-1]
    rim = np.linalg.norm(behind[inside & before_leaving, :2], axis=1)
    np.testing.assert_allclose(rim, 0.03, atol=1e-12)
    np.testing.assert_allclose(behind[:, 2], -GAP, rtol=0, atol=1e-12)


def test_supporting_tools_look_at_the_forming_tool():
    """Approach axes are opposite, z axes alike: a robot that stands face to face holds it upright."""
    for strategy in STRATEGIES:
        _, desired = cone_task()
        *_, found = supported(strategy)
        forming, behind = (path.rotations[0].as_matrix()[0] for path in (desired, found.desired))
        np.testing.assert_allclose(behind[:, 0], -forming[:, 0], atol=1e-12)
        np.testing.assert_allclose(behind[:, 2], forming[:, 2], atol=1e-12)


def test_opening_is_the_drift_of_the_tools_across_the_sheet():
    _, desired = cone_task()
    *_, found = supported("following")
    both = ToolPath.of_tools([desired, found.desired])
    assert np.all(found.opening(both) == 0.0)
    drift = np.zeros((2, len(desired.time), 6))
    drift[..., :3] = [1e-4 * found.direction, 3e-4 * found.direction]
    np.testing.assert_allclose(found.opening(both.displaced(drift)), 2e-4, atol=1e-12)


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
    assert np.abs(run.of(TOOL_GAP).before).max() > 5e-5
    assert np.abs(run.of(TOOL_GAP).after).max() <= 2e-5


def test_a_coupled_cell_speaks_of_no_compensation(finished, tmp_path):
    case, run, out = finished
    assert "after compensation" in (out / "report.html").read_text(encoding="utf-8")
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
        measure(path, run.desired) for path in (run.of(OTHER_MODE).before, run.of(OTHER_MODE).after)
    ]
    assert [row[1], row[4]] == [format_um(deviation.maximum) for deviation in expected]
    moving = measure(run.correction.achieved, run.desired)
    assert float(row[4]) > 5.0 * 1e6 * moving.maximum


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
    np.testing.assert_allclose(gap.before[rows], run.of(TOOL_GAP).before, rtol=0, atol=1e-12)
    findings = dict(run.findings)
    findings |= {UNLOADED_PATHS.name: None, OTHER_MODE.name: OtherModePaths(), TOOL_GAP.name: gap}
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
    np.testing.assert_allclose(cell.gap[:, 1], 1e-3 + run.of(TOOL_GAP).after, atol=1e-15)
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

"""The report of a run: what it draws and says, its size, and how it looks in a browser."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from browser import NEEDS_CHROMIUM, chromium, opened
from line_case import line_case
from pages import drawn_in
from reported import compensated

from coupling.case.case import Case
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.length_text import in_words
from coupling.report import run_figures
from coupling.report.colours import AFTER, AS_FILED, BEFORE, GREEN, ON_DARK, PLANT
from coupling.report.run_figures import deviation
from coupling.report.run_report import run_report
from coupling.report.run_tables import deviations
from coupling.report.shares import DeviationShare, DeviationShares, shares_of
from coupling.report.stored_result import write_report
from coupling.report.verdict import sentence
from coupling.results.gear_result import BacklashReversal
from coupling.results.run_result import RunResult
from coupling.results.section import Table
from coupling.robot.batch.rigid_robot import RigidRobot
from coupling.run.execute import Run
from coupling.run.folder import write_run
from coupling.run.path_checks import OTHER_MODE
from coupling.run.stored_run import StoredRobot, StoredRun, read_run
from elastic_robot.chain import build_chain
from elastic_robot.kinematics import base_from_tool

LARGEST_PAGE = 3_000_000
# Upper edge of what is seen of a box, and how many boxes of a list overlap [CSS px].
OVERLAPS = """
const boxes = [...document.querySelectorAll('.legend, .figure, h2, .verdict, .scroll')]
  .filter(own => own.offsetHeight).map(own => own.getBoundingClientRect());
const labels = [...document.querySelectorAll('#deviation .annotation-text')]
  .map(own => own.getBoundingClientRect());
const meet = (a, b) => a.left < b.right - 1 && b.left < a.right - 1
  && a.top < b.bottom - 1 && b.top < a.bottom - 1;
const pairs = list => list.flatMap((a, k) => list.slice(k + 1).filter(b => meet(a, b)));
return [pairs(boxes).length, pairs(labels).length, labels.length, boxes.length];
"""


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> tuple[Case, Run, Path]:
    """Case, run and run folder."""
    folder = tmp_path_factory.mktemp("report")
    return compensated(folder, line_case(folder, "native"))


@pytest.fixture(scope="module")
def long(finished) -> tuple[StoredRun, StoredRobot]:
    """Ten minutes of 150 001 samples, three of which are off by 1, 2 and 4 mm at backlash reversals."""
    stored = read_run(finished[2])
    time = np.linspace(0.0, 600.0, 150_001)
    rng = np.random.default_rng(1)
    pose = np.tile([1.6, 0.0, 0.8, 0.0, 0.0, 0.0, 1.0], (len(time), 1))
    pose[:, :3] += 0.1 * np.sin(np.outer(time, [0.1, 0.2, 0.3]))
    off = pose.copy()
    off[:, :3] += 1e-8 * rng.normal(size=(len(time), 3))
    changes = []
    for row, size, joint in ((20_000, 1e-3, 2), (76_543, 4e-3, 2), (140_000, 2e-3, 5)):
        off[row, 2] += size
        ends = {"begins": time[row] - 0.02, "ends": time[row] - 0.01}
        change = BacklashReversal(robot="forming", joint=joint, **ends, before=-1, after=1)
        changes.append(change)
    desired, actual = ToolPath(time, pose), ToolPath(time, off)
    before = desired.displaced(np.full(6, 1e-3))
    robot = StoredRobot(
        figures=stored.first.figures.model_copy(update={"backlash_reversals": changes}),
        desired=desired,
        uncompensated=before,
        achieved=actual,
        joints=stored.first.joints,
        command=stored.first.command,
        correction=np.zeros((len(time), 6)),
        wrench=WrenchHistory(time, rng.normal(size=(len(time), 6))),
        other={"before compensation": before.displaced(np.full(6, 2e-3))},
    )
    return replace(stored, figures=robot.figures, robots={"forming": robot}), robot


def test_pages_are_small_and_ask_for_nothing_outside(finished, long):
    for page in ((finished[2] / "report.html").read_text(), run_report(long[0]).page):
        assert len(page) < LARGEST_PAGE
        own = re.sub(r"<(script|style)[^>]*>.*?</\1>", "", page, flags=re.DOTALL)
        assert not re.search(r'(src|href)="(?!data:,")', own)
        assert "url(" not in page.split("</style>")[0]


def test_curves_of_a_run_stay_apart_on_light_and_on_dark_ground():
    for ground in ({}, ON_DARK):
        curves = [ground.get(name, name) for name in (BEFORE, AFTER, AS_FILED, GREEN, PLANT)]
        colours = [np.array([int(text[k : k + 2], 16) for k in (1, 3, 5)]) for text in curves]
        for colour, other in combinations(colours, 2):
            assert np.linalg.norm(colour - other) > 70.0


def test_a_peak_of_one_sample_in_ten_minutes_is_drawn(long):
    after = drawn_in(run_report(long[0]).page)["deviation"]["data"][2]
    assert after["name"] == "after, if the file is right, moving robot"
    assert max(after["y"]) == pytest.approx(4.0, rel=1e-4)
    assert len(after["y"]) < 4000


def test_distances_begin_at_zero_and_end_where_the_path_does(long):
    """The tolerance is drawn in, the robot in the other mode is off until its name is pressed."""
    figure = deviation(long[1], tolerance=5e-4)
    assert figure.layout.yaxis.type is None
    assert figure.layout.yaxis.range[0] == 0.0
    assert figure.layout.xaxis.range == (0.0, 600.0)
    (rule,) = figure.layout.shapes
    assert (rule.y0, rule.label.text) == (0.5, "tolerance")
    seen = {trace.name: trace.visible for trace in figure.data[:3]}
    assert seen == {
        "before compensation, moving robot": None,
        "before compensation, quasi-static robot": "legendonly",
        "after, if the file is right, moving robot": None,
    }


def test_what_is_expected_on_the_real_robot_is_drawn_beside_what_the_file_s_robot_leaves(long):
    """Half a millimetre; the file's robot leaves less."""
    away = np.array([0.0, 0.0, 5e-4, 0.0, 0.0, 0.0])
    run = replace(long[1], expected=long[1].desired.displaced(away))
    before, expected = "before compensation", "on a robot to be expected"
    after, moving = "after, if the file is right", ", moving robot"
    for figure, names in (
        (deviation(run), {before + moving, expected, after + moving}),
        (run_figures.components(run), {before, expected, after}),
    ):
        shown = {trace.name: trace for trace in reversed(figure.data) if trace.name in names}
        assert set(shown) == names
        assert 0.2 < np.abs(shown[expected].y).max() <= 0.5 + 1e-9
        assert len({trace.line.color for trace in shown.values()}) == len(names)


def test_every_gear_that_changes_its_flank_is_named_at_its_largest_spike_that_is_seen(
    finished, long
):
    """Spikes of a command's micrometre are not, beside the millimetres of the uncorrected path."""
    labels = {note.text: (note.x, note.y) for note in deviation(long[1]).layout.annotations}
    time = long[1].desired.time
    assert set(labels) == {"joint 2", "joint 5"}
    assert labels["joint 5"] == pytest.approx((time[140_000], 2.0), rel=1e-4)
    heights = {(note.text, round(note.y, 1)) for note in deviation(long[1]).layout.annotations}
    assert heights == {("joint 2", 1.0), ("joint 2", 4.0), ("joint 5", 2.0)}
    stored = read_run(finished[2]).first
    assert stored.figures.reversals
    assert not deviation(stored).layout.annotations


def test_a_name_stands_before_its_line_where_that_of_a_gear_above_follows(long):
    """Joint 5, in the lower row, spikes at 280 s, joint 2 at 306 s; labels are 40 s wide."""
    robot = long[1]
    changes = list(robot.figures.reversals)
    off = robot.achieved.pose[0].copy()
    off[70_000, 2] += 3e-3
    ends = {"begins": robot.desired.time[70_000] - 0.02, "ends": robot.desired.time[70_000] - 0.01}
    changes.append(changes[-1].model_copy(update=ends))
    figures = robot.figures.model_copy(update={"backlash_reversals": changes})
    run = replace(robot, figures=figures, achieved=ToolPath(robot.desired.time, off))
    sides = {(note.text, round(note.x)): note.xanchor for note in deviation(run).layout.annotations}
    assert sides[("joint 5", 280)] == "right"
    assert sides[("joint 2", 306)] == "left"


def test_shares_are_those_of_the_paths(long):
    """Flank changes hold the peaks, the rest only noise; the other mode is 2 mm along each axis off."""
    found = shares_of(long[1], "after compensation")
    time = long[1].desired.time
    assert found.flanks is not None
    assert found.flanks.maximum == pytest.approx(4e-3, rel=1e-4)
    assert found.flanks.time == time[76_543]
    assert found.elsewhere is not None
    assert found.elsewhere.maximum < 1e-7
    before = shares_of(long[1], "before compensation")
    assert before.motion is not None
    assert before.motion.maximum == pytest.approx(2e-3 * np.sqrt(3.0))
    assert before.other is not None
    assert before.other.maximum == pytest.approx(3e-3 * np.sqrt(3.0))
    assert found.motion is None
    assert DeviationShare.of(time[:0], time[:0]) is None


def test_every_share_has_figures_before_and_after(finished):
    """Maximum, rms and instant of both; a run of an earlier version has no gravity and process after."""
    stored = read_run(finished[2]).first
    parts = [shares_of(stored, stage) for stage in stored.actual]
    for share in ("gravity alone", "process (", "motion (", "while gears"):
        cells = share_row(stored.figures, parts, share)
        assert len(cells) == 7
        assert all(cells)
    without = {"gravity_after": None, "process_after": None}
    shares = stored.figures.shares_m.model_copy(update=without)
    old = stored.figures.model_copy(update={"shares_m": shares})
    assert share_row(old, parts, "gravity alone")[4:] == ("", "", "")


def share_row(figures: RunResult, parts: list[DeviationShares], name: str) -> Sequence[str]:
    """Return the row of a share in the table of deviations."""
    (table,) = (part for part in deviations(figures, parts).parts if isinstance(part, Table))
    (row,) = (row for row in table.rows if row[0].strip().startswith(name))
    return row


def test_the_other_mode_is_that_of_the_cell(finished):
    """The quasi-static robot under the written command rests where its FMU has it without inertia."""
    _, run, out = finished
    stored = read_run(out).first
    assert set(stored.other) == set(stored.actual)
    last = stored.other["before compensation"].position[0, -1]
    # At rest at the end the moving robot has come to where the other one is.
    np.testing.assert_allclose(last, stored.uncompensated.position[0, -1], rtol=0, atol=2e-4)
    shares = shares_of(stored, "before compensation")
    assert shares.motion is not None
    assert shares.motion.maximum > 0.0
    assert np.array_equal(
        run.finding_of(OTHER_MODE).before.position[0],
        stored.other["before compensation"].position[0],
    )


def test_links_end_at_the_tool_and_are_as_long_as_the_robot_file_says(finished):
    robot = finished[0].robots[0].description
    q = np.array([0.3, -0.2, 0.5, 1.0, -0.7, 2.0])
    points = RigidRobot(robot).points(q)
    chain = build_chain(robot)
    pose = base_from_tool(chain, chain.model.createData(), chain.theta(q))
    np.testing.assert_allclose(points[-1], pose.translation, atol=1e-12)
    lengths = [np.linalg.norm(joint.origin) for joint in robot.joints]
    lengths.append(np.linalg.norm(robot.tcp_position))
    np.testing.assert_allclose(np.linalg.norm(np.diff(points, axis=0), axis=1), lengths, atol=1e-12)


def test_the_verdict_states_its_conditions(finished):
    own = read_run(finished[2]).figures
    said = sentence(own, "elastic-wall")
    rows = [r for r in own.robustness if r.name.startswith("backlash")]
    worst = max(rows, key=lambda r: r.deviation.maximum)
    left = in_words(worst.deviation.maximum)
    for word in ("moving robot", "icme2008", "backlash", "process elastic-wall"):
        assert word in said
    assert f"with {worst.name} in all gears {left} would remain" in said
    stiff = [gear.model_copy(update={"backlash_error": 0.0}) for gear in own.gears]
    rigid = own.model_copy(update={"robustness": (), "gears": stiff})
    assert "no gear has backlash in this model" in sentence(rigid, "elastic-wall")
    slips = [rows[0].model_copy(update={"name": f"hysteresis {sign}30 %"}) for sign in "+-"]
    more = own.model_copy(update={"robustness": (*own.robustness, *slips)})
    known = in_words(rows[0].deviation.maximum)
    assert sentence(more, "elastic-wall") == (
        f"{said[:-1]}; with hysteresis +30 % in all gears {known} would remain."
    )
    coupled = sentence(own.model_copy(update={"robustness": ()}), "elastic-wall")
    assert re.search(r"\(joint 1[,)].*an error of the backlash has an effect", coupled)
    assert "um" not in coupled.partition("gears reverse")[2]  # without a replay there is no figure
    loaded = {"reversals": 0, "in_backlash": 0.0}
    gears = [gear.model_copy(update=loaded) for gear in own.gears]
    calm = own.model_copy(update={"robustness": (), "gears": gears})
    assert "no gear reverses" in sentence(calm, "elastic-wall")


def test_the_verdict_tells_a_turned_tool_where_its_position_is_off_by_less(finished):
    """246 urad are 25 um at a lever of 0.1 m: more than 0.2 um, less than 30 um."""
    own = read_run(finished[2]).figures
    assert own.deviation_after_m.largest_turn > 0.0

    def told(maximum: float, turn: float) -> str:
        left = replace(own.deviation_after_m, maximum=maximum, largest_turn=turn)
        return sentence(own.model_copy(update={"deviation_after_m": left}), "elastic-wall")

    said = "by less than 1 um and rotates by up to 246 urad (24.6 um at 0.1 m from the TCP)"
    assert said in told(2e-7, 2.46e-4)
    for maximum, turn in ((3e-5, 2.46e-4), (2e-7, 9e-5), (2e-7, 0.0)):
        assert "rotates" not in told(maximum, turn)


def test_a_robot_file_that_is_gone_at_the_end_costs_no_result(finished, tmp_path):
    case, run, _ = finished
    lost = {"robot": case.resolved["robot"] | {"description": str(tmp_path / "gone.toml")}}
    write_run(tmp_path, replace(case, resolved=case.resolved | lost), run)
    assert read_run(tmp_path).figures.robots[0].sources == {}
    assert "icme2008-example (gone.toml" in write_report(tmp_path).read_text()


def test_inputs_and_cost_are_told(finished):
    _, _, out = finished
    log = {"state": "finished", "answers": [{"key": "a" * 64, "from": "computed", "seconds": 2.5}]}
    log["answers"].append({"key": "b" * 64, "from": "store", "seconds": 0.01})
    (out / "run.json").write_text(json.dumps(log))
    page = run_report(read_run(out)).page
    assert "2 evaluations: 1 computed in 2.5 s, 2.5 s each, 1 from the store" in page
    assert "the paper [Flexible2008]" in page
    assert (out / "case.toml").read_text().split("\n")[0] in page


@NEEDS_CHROMIUM
def test_the_report_in_a_browser(finished, long, tmp_path):
    """No network, no error, nothing overlaps or is cut, wide and narrow; dark; printed; by keyboard."""
    page = finished[2] / "report.html"
    with chromium(tmp_path) as driver:
        colours = []
        (tmp_path / "long.html").write_text(run_report(long[0]).page)
        for shown, width, scheme in (
            (tmp_path / "long.html", 390, "dark"),
            (page, 1280, "light"),
        ):
            opened(driver, shown, width, scheme)
            boxes, labels, named, count = driver.execute_script(OVERLAPS)
            assert (boxes, labels) == (0, 0)
            assert (named >= 1) is (shown != page)
            assert count > 10
            assert driver.execute_script("return document.documentElement.scrollWidth") <= width
            ground = "return getComputedStyle(document.body).backgroundColor"
            ink = "return getComputedStyle(document.querySelector('.xtick text')).fill"
            colours.append((driver.execute_script(ground), driver.execute_script(ink)))
        assert colours == [
            ("rgb(20, 24, 29)", "rgb(213, 219, 225)"),
            ("rgb(255, 255, 255)", "rgb(28, 35, 41)"),
        ]
        asked = "return performance.getEntriesByType('resource').map(entry => entry.name)"
        assert [url for url in driver.execute_script(asked) if url.startswith("http")] == []
        lines = "return document.querySelectorAll('#deviation .js-line').length"
        shown = driver.execute_script(lines)
        button = driver.find_element("css selector", "#deviation").find_element(
            "xpath", "preceding-sibling::ul//button"
        )
        button.send_keys(" ")
        assert button.get_attribute("aria-pressed") == "false"
        assert driver.execute_script(lines) == shown - 1
        paper = driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})
        pages = re.findall(rb"/Type\s*/Page\b", base64.b64decode(paper["data"]))
        assert 2 <= len(pages) <= 10
        widths = "const own = document.getElementById('deviation'); return [own.clientWidth,"
        widths += " own.querySelector('.main-svg').clientWidth]"
        place, figure = driver.execute_script(widths)  # as wide as before
        assert figure == place > 800
        severe = [entry for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]
        assert severe == []

"""Scenes: the robot of a page is the robot of the run, and its meshes those of its URDF."""

from __future__ import annotations

import re
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import NEEDS_CHROMIUM, chromium, opened
from line_case import line_case
from reported import compensated

from coupling.files.urdf_visuals import read_visuals
from coupling.path.deviation import measure
from coupling.path.frame import AT_THE_ORIGIN
from coupling.path.length_text import in_words
from coupling.report.document import document
from coupling.report.meshes import robot_meshes
from coupling.report.run_scene import run_scene
from coupling.report.static_scene import links, stills
from coupling.results.scene import Scene, SceneSurface
from coupling.results.section import Answer
from coupling.run.stored_run import read_run

CASE = {"robot": {"description": "icme2008"}, "process": {"tool_diameter_m": 0.01}}
# A pendulum whose arm is a box of 0.1 x 0.2 x 0.6 m, carried by a base that is a ball.
URDF = """<robot name="pendulum">
<link name="base"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
<link name="arm"><visual><origin xyz="0 0 -0.3"/><geometry><box size="0.1 0.2 0.6"/></geometry></visual>
<visual><geometry><mesh filename="gone.stl"/></geometry></visual>
<inertial><mass value="2"/><origin xyz="0 0 -0.3"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="swing" type="revolute"><parent link="base"/><child link="arm"/>
<origin xyz="0 0 1" rpy="1.5707963267948966 0 0"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1"/></joint></robot>"""
ROBOT = """name = "pendulum"
[urdf]
file = "pendulum.urdf"
[tcp]
link = "arm"
[[joint]]
name = "swing"
stiffness = 1e5
damping = 10.0
"""
# Pixels of a page's first scene that are not its ground, by rough colour.
# Calls back when a change is drawn, however slowly: in the third frame from now.
AFTER_FRAMES = """
const [done] = [...arguments].slice(-1), later = window.requestAnimationFrame;
later(() => later(() => later(() => done())));
"""
PIXELS = """
const place = document.getElementById('first_scene'), shown = place.querySelector('canvas');
const sheet = document.createElement('canvas');
[sheet.width, sheet.height] = [shown.width, shown.height];
const picture = sheet.getContext('2d');
picture.drawImage(shown, 0, 0);
const data = picture.getImageData(0, 0, sheet.width, sheet.height).data;
let [all, blue, orange, sum] = [0, 0, 0, 0];
for (let k = 0; k < data.length; k += 4) {
  const [r, g, b, a] = data.slice(k, k + 4);
  if (!a) continue;
  all += 1;
  sum = (sum * 31 + r + 7 * g + 13 * b + k) % 1000003;
  if (b > r + 60) blue += 1;
  if (r > b + 60) orange += 1;
}
return [all, blue, orange, sum];
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory, few_drawn_robots):
    folder = tmp_path_factory.mktemp("scene")
    return read_run(compensated(folder, line_case(folder, "native"))[2])


def test_the_tool_of_a_scene_is_on_the_run_s_command(run):
    """Joint angles straight between the rows that are left move the TCP by less than a millimetre."""
    (robot,) = run_scene(run, AT_THE_ORIGIN, CASE).robots
    stored = run.first
    for time_s in np.linspace(*stored.command.time[[0, -1]], 40):
        q = [np.interp(time_s, robot.motion.time, angles) for angles in robot.motion.q.T]
        tool = links(robot, np.array(q))[-1]
        command = [
            np.interp(time_s, stored.command.time, axis) for axis in stored.command.position[0].T
        ]
        np.testing.assert_allclose(tool, command, rtol=0, atol=1e-3)


def test_gears_carry_the_robot_s_weight_and_their_flanks_change_as_the_run_says(run):
    (robot,) = run_scene(run, AT_THE_ORIGIN, CASE).robots
    gears = {gear.joint: gear for gear in run.figures.gears}
    largest = np.abs(robot.motion.torque).max(axis=0)
    for joint in (2, 3):  # inertia adds little to the weight
        assert largest[joint - 1] == pytest.approx(gears[joint].torque, rel=0.2)
    for change in run.figures.reversals:
        steps = robot.flanks[change.joint - 1]
        inside = steps[steps[:, 0] <= 0.5 * (change.begins + change.ends)][-1]
        behind = steps[steps[:, 0] <= change.ends][-1]
        assert (inside[1], behind[1]) == (0.0, change.after)


def test_the_path_with_a_wrong_backlash_is_that_of_the_worst_replay(run):
    """It stands beside before and after, and leaves what the run's table says."""
    tracks = run_scene(run, AT_THE_ORIGIN, CASE).tracks
    worst = max(
        (row for row in run.figures.robustness if row.name.startswith("backlash")),
        key=lambda row: row.deviation.maximum,
    )
    assert [track.name for track in tracks][3] == f"with {worst.name}"
    size = np.linalg.norm(tracks[3].deviation, axis=1).max()
    assert size == pytest.approx(worst.deviation.maximum, rel=1e-3)


def test_a_robot_file_that_is_gone_costs_torques_and_meshes_alone(run):
    scene = run_scene(run, AT_THE_ORIGIN, {"robot": {"description": "gone.toml"}})
    assert scene.robots[0].motion.torque is None
    assert len(scene.tracks) == 4
    robots = tuple(robot.model_copy(update={"chain": None}) for robot in run.figures.robots)
    old = replace(run, figures=run.figures.model_copy(update={"robots": robots}))
    assert run_scene(old, AT_THE_ORIGIN, CASE).robots == []


def test_the_robot_to_be_expected_is_shown_before_that_of_the_file(run):
    """By default a page shows the first two: what is off uncorrected, and what is to be expected.

    It is one of the robots that are drawn, and no better than nine in ten of them.
    """
    names = [track.name for track in run_scene(run, AT_THE_ORIGIN, CASE).tracks]
    assert names[:3] == [
        "before compensation",
        "on a robot to be expected",
        "after, if the file is right",
    ]
    drawn = run.figures.outlook.expected
    highest = max(drawn.high, drawn.with_left_out.high if drawn.with_left_out else 0.0)
    size = measure(run.first.expected, run.first.desired).maximum
    assert highest <= size < 1.3 * highest


def test_pictures_tell_the_largest_deviation_and_are_small(run):
    before, expected = stills(run_scene(run, AT_THE_ORIGIN, CASE))
    assert "before compensation: up to" in before
    assert "on a robot to be expected: up to" in expected
    size = in_words(run.figures.deviation_before_m.maximum)
    for pieces in (5, 50, 1500):
        picture = stills(run_scene(run, AT_THE_ORIGIN, CASE), pieces)[0]
        assert f"before compensation: up to {size}, drawn" in picture
    assert len(before) + len(expected) < 200_000


def test_the_shapes_of_a_urdf_stand_where_its_links_are(tmp_path):
    """The arm hangs along y, as its joint's frame is turned about x; a mesh that is gone is left out."""
    (tmp_path / "pendulum.urdf").write_text(URDF)
    (tmp_path / "robot.toml").write_text(ROBOT)
    visuals = read_visuals(tmp_path / "pendulum.urdf", None, "arm")
    assert [visual.body for visual in visuals] == [0, 1, 1]
    pytest.importorskip("trimesh")
    ball, arm = robot_meshes(str(tmp_path / "robot.toml"))
    np.testing.assert_allclose(np.abs(ball.points).max(axis=0), 0.1, atol=1e-3)
    np.testing.assert_allclose(arm.points.min(axis=0), [-0.05, 0.0, -0.1], atol=1e-3)
    np.testing.assert_allclose(arm.points.max(axis=0), [0.05, 0.6, 0.1], atol=1e-3)
    assert robot_meshes("icme2008") == ()
    assert robot_meshes(str(tmp_path / "gone.toml")) == ()


def test_a_mesh_has_the_size_that_its_file_states_and_none_hides_all(tmp_path):
    """COLLADA in inches is scaled; a box of 100 that is in millimetres by mistake is left out."""
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("collada")
    (tmp_path / "robot.toml").write_text(ROBOT)
    (tmp_path / "pendulum.urdf").write_text(URDF.replace("gone.stl", "gone.dae"))
    box = trimesh.creation.box(extents=(10.0, 10.0, 10.0))
    text = trimesh.exchange.dae.export_collada(box).decode()
    assert "<asset>" in text
    unit = '<unit name="inch" meter="0.0254"/>'
    text = (
        re.sub(r"<unit[^>]*/>", unit, text)
        if "<unit" in text
        else text.replace("</asset>", f"{unit}</asset>")
    )
    (tmp_path / "gone.dae").write_text(text)
    shapes = robot_meshes(str(tmp_path / "robot.toml"))
    assert len(shapes) == 3
    assert min(abs(float(np.ptp(shape.points[:, 0])) - 0.254) for shape in shapes) < 1e-3
    (tmp_path / "pendulum.urdf").write_text(URDF)
    trimesh.creation.box(extents=(100.0, 100.0, 100.0)).export(tmp_path / "gone.stl")
    assert len(robot_meshes(str(tmp_path / "robot.toml"))) == 2


def test_a_damaged_mesh_leaves_the_others(tmp_path):
    pytest.importorskip("trimesh")
    (tmp_path / "pendulum.urdf").write_text(URDF)
    (tmp_path / "robot.toml").write_text(ROBOT)
    for content in (b"", b"solid \xff\x00", b"\0" * 84, bytes(range(256)) * 9):
        (tmp_path / "gone.stl").write_bytes(content)
        assert len(robot_meshes(str(tmp_path / "robot.toml"))) == 2


def test_the_libraries_are_those_that_are_pinned():
    browser = Path(__file__).parents[2] / "coupling" / "report" / "browser"
    pinned = (browser.parents[2] / "web" / "package.json").read_text()
    three, plotly = (browser / name for name in ("three.min.js", "plotly-cartesian.min.js"))
    revision = pinned.split('"three": "0.')[1].partition(".")[0]
    assert f'"{revision}"' in three.read_text()
    version = pinned.split('"plotly.js-cartesian-dist-min": "')[1].partition('"')[0]
    assert f"v{version}" in plotly.read_text()[:500]


@NEEDS_CHROMIUM
def test_a_visit_scrubs_exaggerates_and_switches_sides(run, tmp_path):
    """Before is blue, into the part; after is grey on its scale; each step changes what is drawn."""
    page, scene = tmp_path / "page.html", run_scene(run, AT_THE_ORIGIN, CASE)
    names = [track.name for track in scene.tracks]
    page.write_text(document("A run", [], Answer("", scene=scene)))
    with chromium(tmp_path / "profile") as driver:
        opened(driver, page, 1440)

        def shows(change: str) -> list[int]:
            """Return the pixels after a change, once it is drawn."""
            count = driver.execute_script(
                "const place = document.getElementById('first_scene'), before = place.dataset.shown;"
                f"const scene = document.scenes.first_scene; {change}; return before;"
            )
            shown = "return document.getElementById('first_scene').dataset.shown"
            deadline = time.monotonic() + 20.0
            while driver.execute_script(shown) == count:
                assert time.monotonic() < deadline
                time.sleep(0.02)
            return driver.execute_script(PIXELS)

        def click(selector: str) -> list[int]:
            return shows(f"place.querySelector('{selector}').click()")

        both = shows("scene.look_at('part')")
        assert both[0] > 3000
        shows("place.querySelector('[data-control=apart]').click()")
        before = click('[data-track="on a robot to be expected"]')
        assert before[1] + before[2] > 200
        shows("scene.toggle('after, if the file is right')")
        after = click('[data-track="before compensation"]')
        assert after[1] + after[2] < 0.3 * (before[1] + before[2])
        larger = shows("scene.exaggerate(500)")
        wrong = shows(f"scene.toggle('{names[3]}')")
        assert wrong[0] > larger[0]
        assert names[3] in driver.find_element("css selector", ".readout").text
        shows(f"scene.toggle('{names[3]}')")
        pictures = {tuple(before), tuple(after)}
        for change in ("scene.seek(0.6)", "scene.exaggerate(2000)", "scene.look_at('robot')"):
            pictures.add(tuple(shows(change)))
        assert len(pictures) == 5
        stage = driver.find_element("css selector", ".stage")
        clock = "return document.scenes.first_scene.state.time"
        first = driver.execute_script(clock)
        stage.send_keys("\ue014")  # arrow to the right
        assert driver.execute_script(clock) > first
        readout = driver.find_element("css selector", ".readout")
        slider = driver.find_element("css selector", '[data-control="time"]')
        # What is seen is read aloud as well, but while it plays.
        assert readout.text.startswith(f"t = {slider.get_attribute('aria-valuetext')}")
        assert readout.get_attribute("aria-live") == "polite"
        keys = driver.find_element("id", stage.get_attribute("aria-describedby"))
        assert "space plays" in keys.text
        stage.send_keys(" ")
        time.sleep(0.5)
        stage.send_keys(" ")
        assert driver.execute_script(clock) != first
        choice = driver.find_element("css selector", '[data-control="gears"]')
        shown = driver.execute_script(PIXELS)
        choice.send_keys("by torque at rest")
        time.sleep(0.5)
        assert driver.execute_script(PIXELS) != shown
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
        seen = "return getComputedStyle(document.querySelector(arguments[0])).display"
        assert driver.execute_script(seen, ".stage") == "none"
        assert driver.execute_script(seen, ".stills") == "flex"
        severe = [entry for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]
        assert severe == []


@NEEDS_CHROMIUM
def test_a_visit_sees_the_part_in_the_colours_of_what_shaped_it(run, tmp_path):
    """Above it is one colour where the tool was too deep, another by a field, and it can be hidden."""
    (before, *_) = run_scene(run, AT_THE_ORIGIN, CASE).tracks
    deep = replace(before, signed=np.tile([-1e-3, 0.0, 1e-3], (len(before.time), 1)))
    far = before.desired[0] + [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.1, 0.0], [0.0, 0.1, 0.0]]
    plate = SceneSurface(
        before.name,
        far,
        np.array([[0, 1, 2], [0, 2, 3]]),
        {"thickness [mm]": np.array([0.5, 1.0, np.nan, 0.8])},
        np.full(4, before.time[5]),
    )
    page = tmp_path / "page.html"
    scene = Scene(tracks=[deep], surfaces=[plate])
    page.write_text(document("A part", [], Answer("", scene=scene)))
    with chromium(tmp_path / "profile") as driver:
        opened(driver, page, 1440)

        def pixels(change: str) -> list[int]:
            driver.execute_script(
                f"const place = document.getElementById('first_scene'); {change}; return null;"
            )
            driver.execute_async_script(AFTER_FRAMES)
            return driver.execute_script(PIXELS)

        colour = (
            "const choice = place.querySelector('[data-control=colour]'); choice.value = '{}';"
            " choice.dispatchEvent(new Event('change'))"
        )
        blue = pixels("document.scenes.first_scene.look_at('above')")
        orange = pixels(colour.format(2))
        field = pixels(colour.format("thickness [mm]"))
        assert blue[1] > 2000 > blue[2]
        assert orange[2] > 2000 > orange[1]
        assert field[3] not in (blue[3], orange[3])
        assert "mm" in driver.execute_script("return document.querySelector('.high').textContent")
        hidden = pixels("place.querySelector('[data-control=surface]').click()")
        assert hidden[0] < field[0]
        severe = [entry for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]
        assert severe == []


@NEEDS_CHROMIUM
def test_the_scale_of_colours_is_one_line_on_a_phone(run, tmp_path):
    page, scene = tmp_path / "page.html", run_scene(run, AT_THE_ORIGIN, CASE)
    page.write_text(document("A run", [], Answer("", scene=scene)))
    with chromium(tmp_path / "profile") as driver:
        opened(driver, page, 390)
        tops = [
            driver.execute_script(
                "return document.querySelector(arguments[0]).getBoundingClientRect().top", end
            )
            for end in (".bar .low", ".bar .high")
        ]
        wide = driver.execute_script("return document.documentElement.scrollWidth")
        words = driver.find_element("css selector", ".bar .low").text
    assert tops[0] == tops[1]
    assert wide == 390
    assert words.endswith("into the part")


@NEEDS_CHROMIUM
def test_a_machine_without_webgl_keeps_the_picture(run, tmp_path):
    page = tmp_path / "page.html"
    text = document("A run", [], Answer("", scene=run_scene(run, AT_THE_ORIGIN, CASE)))
    spoiled = "<script>HTMLCanvasElement.prototype.getContext = () => null;</script></head>"
    page.write_text(text.replace("</head>", spoiled))
    with chromium(tmp_path / "profile") as driver:
        opened(driver, page, 800)
        seen = "return document.querySelector('.stills svg').getBoundingClientRect().height"
        assert driver.execute_script(seen) > 100
        assert driver.execute_script("return document.documentElement.dataset.scene") == "none"


def test_a_scene_without_anything_has_no_picture():
    assert stills(Scene()) == []

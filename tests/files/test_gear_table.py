"""[joint.gear]: the loop of what is read is that of its data sheet; what no gear can be is refused."""

import math
import re
import tempfile
import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomlkit
from hypothesis import given, settings
from hypothesis import strategies as st
from places import DOCS
from scipy.optimize import brentq
from two_joint_file import HEAD, JOINT, two_joints

from coupling.files.robot_edit import RobotEdit
from coupling.files.robot_file import load_robot, parts_in_words, shipped_robots
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.index_html import index_html
from coupling.path.histories import WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.description import Joint, Robot
from elastic_robot.errors import RobotFileError

ARCMIN = math.radians(1.0 / 60.0)
K, RATED = 1.7e6, 3000.0
SHEET = "hysteresis_width_arcmin = 0.4\nlost_motion_arcmin = 0.5\nrated_torque_Nm = 3000.0\n"


def written(folder: Path, joint: str, gear: str, after: str = "") -> Path:
    """Write a robot of two joints, the second with a gear; returns the file."""
    return two_joints(folder, joint, f"[joint.gear]\n{gear}", after)


def read(joint: str, gear: str) -> Joint:
    """Return the joint with a gear as it is read, through JSON as an FMU has it."""
    with tempfile.TemporaryDirectory() as folder:
        robot = load_robot(written(Path(folder), joint, gear))
    assert Robot.from_json(robot.to_json()) == robot
    return robot.joints[1]


def sheet(width: float, rated: float, lost: float | None = None) -> str:
    lines = [f"hysteresis_width_arcmin = {width!r}", f"rated_torque_Nm = {rated!r}"]
    return "\n".join(lines + ([] if lost is None else [f"lost_motion_arcmin = {lost!r}"]))


class Branch:
    """A gear that turns one way from where it is, its elements by the recursion of the stop operator."""

    def __init__(self, joint: Joint, wind_up: float, elongation: np.ndarray) -> None:
        self.joint, self.wind_up, self.elongation = joint, wind_up, elongation
        self.angle = np.array([own.slip_angle for own in joint.hysteresis])
        self.slip_torque = np.array([own.slip_torque for own in joint.hysteresis])

    def stretched(self, wind_up: float) -> np.ndarray:
        """Return the elongations behind many steps."""
        elongation = self.elongation
        for step in np.diff(np.linspace(self.wind_up, wind_up, 12)):
            elongation = np.clip(elongation + step, -self.angle, self.angle)
        return elongation

    def torque(self, wind_up: float) -> float:
        beyond = abs(wind_up) - self.joint.backlash
        curve = math.copysign(max(beyond, 0.0), wind_up) * self.joint.stiffness
        return curve + float(self.slip_torque @ (self.stretched(wind_up) / self.angle))

    def at(self, torque: float) -> float:
        """Return the wind-up at a torque."""
        far = (
            self.joint.backlash
            + 2.0 * (abs(torque) + self.slip_torque.sum()) / self.joint.stiffness
        )
        return brentq(lambda e: self.torque(e) - torque, -far, far, xtol=1e-18, rtol=1e-14)

    def turned_at(self, torque: float) -> "Branch":
        wind_up = self.at(torque)
        return Branch(self.joint, wind_up, self.stretched(wind_up))


def loop(joint: Joint, rated: float) -> tuple[float, float]:
    """Return width and lost motion [arc minutes] of a gear that is loaded both ways, a second time."""
    unloaded = Branch(joint, 0.0, np.zeros(len(joint.hysteresis)))
    falls = unloaded.turned_at(rated)
    rises = falls.turned_at(-rated)
    falls = rises.turned_at(rated)
    middle = [0.5 * (rises.at(t) + falls.at(t)) for t in (-0.03 * rated, 0.03 * rated)]
    return (falls.at(0.0) - rises.at(0.0)) / ARCMIN, (middle[1] - middle[0]) / ARCMIN


gears = st.tuples(st.floats(4.0, 8.0), st.floats(1.0, 4.0)).map(
    lambda own: (10 ** own[0], 10 ** own[1])
)
share = st.floats(1e-3, 0.999)


@given(gears, st.floats(-1.0, 1.0), share)
def test_the_loop_of_a_gear_with_lost_motion_is_that_of_its_data_sheet(gear, wide, part):
    """Any width, and any lost motion that a gear of this stiffness can have beside it."""
    k, rated = gear
    elastic = 0.06 * rated / k / ARCMIN
    width = elastic * 10**wide
    least = max(width, elastic)
    lost = least + part * (width + elastic - least)
    joint = read(f"stiffness = {k!r}", sheet(width, rated, lost))
    assert len(joint.hysteresis) == 3
    np.testing.assert_allclose(loop(joint, rated), (width, lost), rtol=1e-9)


@given(gears, st.one_of(st.just(0.0), st.floats(-7.0, -3.0).map(lambda b: 10**b)), share)
def test_the_width_of_a_gear_with_backlash_is_that_of_its_data_sheet(gear, backlash, part):
    """From nearly the backlash alone to the widest loop whose elements slip by the rated torque."""
    k, rated = gear
    own = part * 2.0 * rated / 4.5 / k
    width = (own + 2.0 * backlash) / ARCMIN
    if width == 2.0 * backlash / ARCMIN:
        return
    joint = read(f"stiffness = {k!r}\nbacklash = {backlash!r}", sheet(width, rated))
    assert joint.backlash == backlash
    assert loop(joint, rated)[0] == pytest.approx(width, rel=1e-9)
    angles = [element.slip_angle for element in joint.hysteresis]
    np.testing.assert_allclose(angles, own * np.array([1 / 12, 1 / 4, 5 / 8]), rtol=1e-6)


@pytest.mark.parametrize(
    ("keys", "numbers"),
    [
        ("", (0.4, RATED, 0.5)),
        ("", (0.3, RATED, 0.45)),
        ("backlash = 3e-5", (0.9, RATED)),
    ],
)
def test_an_fmu_made_of_the_file_turns_along_the_loop_of_its_data_sheet(tmp_path, keys, numbers):
    """Without weight, under moments to the rated torque and back, twice; all by the native core.

    What lost motion tells where backlash is given beside the width is the elastic share alone.
    """
    file = tmp_path / "robot.toml"
    gear = f"stiffness = {K}\ndamping = 10.0\n{keys}\n[joint.gear]\n{sheet(*numbers)}\n"
    file.write_text(f"gravity = [0.0, 0.0, 0.0]\n{HEAD}{JOINT}{gear}")
    measured = 0.03 * RATED
    up = np.array([-RATED, -measured, 0.0, measured, RATED])
    moment = np.concatenate([[0.0], -up, up, -up])
    time = np.arange(float(len(moment)))
    wrench = np.zeros((len(time), 6))
    wrench[:, 4] = moment
    still = JointPath(time, (np.zeros((len(time), 1)),))
    with RobotFmu(build_fmu(load_robot(file), tmp_path / "R.fmu", BuildOptions("native"))) as fmu:
        path = fmu.simulate(still, WrenchHistory(time, wrench), "quasistatic")
    x, _, z = path.position[0].T
    rises, falls = np.arctan2(-z, x)[[6, 7, 8, 9, 10]], np.arctan2(-z, x)[[15, 14, 13, 12, 11]]
    middle = 0.5 * (rises + falls)
    lost = numbers[2] if len(numbers) == 3 else 2.0 * measured / K / ARCMIN
    told = (falls - rises)[2] / ARCMIN, (middle[3] - middle[1]) / ARCMIN
    np.testing.assert_allclose(told, (numbers[0], lost), rtol=1e-6)


def test_what_is_refused_has_another_loop():
    """Elements above 3 % hide the backlash from the lost motion; those that stick make no full width."""
    elements = "hysteresis = [{ slip_torque = 120.0, slip_angle = 2e-5 }]"
    joint = read(f"stiffness = {K}\nbacklash = 1e-4", elements)
    width, lost = loop(joint, RATED)
    assert width * ARCMIN == pytest.approx(2.0 * (120.0 / K + 1e-4), rel=1e-9)
    assert lost * ARCMIN == pytest.approx(0.06 * RATED / K, rel=1e-9)
    # A quarter of the rated torque, from which the last element turns back too late.
    slow = read(f"stiffness = {K}", sheet(0.5, RATED))
    enough = 4.5 * sum(element.slip_torque for element in slow.hysteresis)
    assert loop(slow, 1.001 * enough)[0] == pytest.approx(0.5, rel=1e-9)
    assert loop(slow, 0.98 * enough)[0] < 0.499


def test_the_loop_of_the_page_is_that_of_the_page():
    page = (DOCS / "robot_file.md").read_text()
    part = page[page.index("## Hysteresis of a gear") :]
    explicit, of_maker = re.findall(r"```toml\n(.*?)```", part, re.DOTALL)[:2]
    joints = []
    for text in (explicit, of_maker):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.toml"
            file.write_text(HEAD + text.replace("[[joint]]\n", JOINT.lstrip()))
            joints.append(load_robot(file).joints[0])
    assert [element.slip_torque for element in joints[0].hysteresis] == [40.0, 40.0, 40.0]
    told = re.search(r"has F = (\S+) N m and B = (\S+) rad", part)
    together = sum(element.slip_torque for element in joints[1].hysteresis)
    assert f"{together:.3g}" == told[1]
    assert f"{joints[1].backlash:.3g}" == told[2]
    stiff = 1.0 + sum(element.stiffness for element in joints[1].hysteresis) / joints[1].stiffness
    assert f"{stiff:.2g} times as stiff" in part
    np.testing.assert_allclose(loop(joints[1], RATED), (0.4, 0.5), rtol=1e-9)


# Keys of the joint and of its gear, and the whole sentence behind the file's name.
MISTAKES = {
    "negative slip torque": (
        f"stiffness = {K}",
        "hysteresis = [{slip_torque = 1.0, slip_angle = 1.0}, {slip_torque = -4.0, slip_angle = 1e-5}]",
        "joint 2: gear: hysteresis 2: slip_torque: expected a finite number > 0 [N m], got -4.0",
    ),
    "slip angle of zero": (
        f"stiffness = {K}",
        "hysteresis = [{slip_torque = 4.0, slip_angle = 0.0}]",
        "joint 2: gear: hysteresis 1: slip_angle: expected a finite number > 0 [rad], got 0.0",
    ),
    "no slip angle": (
        f"stiffness = {K}",
        "hysteresis = [{slip_torque = 4.0}]",
        "joint 2: gear: hysteresis 1: key 'slip_angle' is missing",
    ),
    "seven elements": (
        f"stiffness = {K}",
        f"hysteresis = [{', '.join(7 * ['{slip_torque = 1.0, slip_angle = 1e-5}'])}]",
        "joint 2: gear: hysteresis: expected at most 6 items, got 7",
    ),
    "both forms": (
        f"stiffness = {K}",
        SHEET + "hysteresis = []",
        "joint 2: gear: expected either the elements of hysteresis or the numbers of a data sheet, got"
        " hysteresis and hysteresis_width_arcmin",
    ),
    "negative width": (
        f"stiffness = {K}",
        sheet(-1.0, RATED),
        "joint 2: gear: hysteresis_width_arcmin: expected a number greater than 0, got -1.0",
    ),
    "infinite width": (
        f"stiffness = {K}",
        "hysteresis_width_arcmin = 1e400\nrated_torque_Nm = 1.0",
        "joint 2: gear: hysteresis_width_arcmin: expected a finite number, got inf",
    ),
    "no rated torque": (
        f"stiffness = {K}",
        "hysteresis_width_arcmin = 1.0",
        "joint 2: gear: rated_torque_Nm: expected a number > 0 beside hysteresis_width_arcmin, got none",
    ),
    "no width": (
        f"stiffness = {K}",
        "lost_motion_arcmin = 1.0\nrated_torque_Nm = 3e3",
        "joint 2: gear: hysteresis_width_arcmin: expected a number > 0 beside lost_motion_arcmin, got"
        " none",
    ),
    "unknown key": (
        f"stiffness = {K}",
        "hysteresis_width = 1.0",
        "joint 2: gear: expected one of hysteresis, hysteresis_width_arcmin, lost_motion_arcmin,"
        " rated_torque_Nm, kinematic_error, efficiency, got unknown key 'hysteresis_width': did you mean"
        " 'hysteresis_width_arcmin'?",
    ),
    "rigid joint": (
        "",
        "hysteresis = [{slip_torque = 4.0, slip_angle = 1e-5}]",
        "joint 2: gear: expected a stiffness beside it, got none: the joint is rigid",
    ),
    "rigid joint with a data sheet": (
        "",
        SHEET,
        "joint 2: gear: expected a stiffness beside it, got none: the joint is rigid",
    ),
    "negative stiffness": (
        "stiffness = -1.0",
        SHEET,
        "joint 2: stiffness: expected a finite number > 0 [N m/rad], got -1.0",
    ),
    "no stiffness but zero": (
        "stiffness = 0.0",
        SHEET,
        "joint 2: stiffness: expected a finite number > 0 [N m/rad], got 0.0",
    ),
    "torque table": (
        f"stiffness = {K}\n"
        "torque_table = [[-2.0, -2.0], [-1.0, -1.0], [0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]",
        SHEET,
        "joint 2: gear: hysteresis_width_arcmin: expected no torque_table beside it, as the width is"
        " that of a gear with one stiffness, got one: give the elements of hysteresis",
    ),
    "backlash beside lost motion": (
        f"stiffness = {K}\nbacklash = 1e-4",
        SHEET,
        "joint 2: gear: lost_motion_arcmin: expected no backlash beside it, as it tells the backlash,"
        " got backlash = 0.0001",
    ),
    "lost motion of less than the stiffness gives": (
        f"stiffness = {K}",
        sheet(0.2, RATED, 0.3),
        "joint 2: gear: lost_motion_arcmin: expected at least 0.363997, by which the gear winds up"
        " between +-3 % of 3000 N m with stiffness = 1.7e+06 N m/rad, got 0.3",
    ),
    "lost motion of less than the width": (
        f"stiffness = {K}",
        sheet(0.6, RATED, 0.5),
        "joint 2: gear: lost_motion_arcmin: expected at least hysteresis_width_arcmin, 0.6, got 0.5:"
        " elements that slip at more than 3 % of the rated torque hide the backlash from the lost"
        " motion: leave it out and give backlash",
    ),
    "width of less than the backlash": (
        f"stiffness = {K}\nbacklash = 1e-3",
        sheet(1.0, RATED),
        "joint 2: gear: hysteresis_width_arcmin: expected more than 6.87549, the whole backlash by"
        " backlash, got 1",
    ),
    "width of less than the lost motion's backlash": (
        f"stiffness = {K}",
        sheet(0.2, RATED, 0.6),
        "joint 2: gear: hysteresis_width_arcmin: expected more than 0.236003, the whole backlash by"
        " lost_motion_arcmin, got 0.2",
    ),
    "slip torque near the rated torque": (
        f"stiffness = {K}",
        sheet(4.0, RATED),
        "joint 2: gear: rated_torque_Nm: expected at least 4450.59, from which to zero all elements"
        " slip, 989.02 N m together by hysteresis_width_arcmin = 4 and stiffness = 1.7e+06 N m/rad,"
        " got 3000",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_what_no_gear_can_be_is_refused_in_one_sentence(tmp_path, command, mistake):
    joint, gear, sentence = MISTAKES[mistake]
    file = written(tmp_path, joint, gear)
    with pytest.raises(RobotFileError) as caught:
        load_robot(file)
    assert str(caught.value) == f"{file}: {sentence}"
    if "stiffness: " in sentence:  # of the joint, which a list of numbers does not make
        sentence = "joint 2: gear: expected a stiffness > 0 [N m/rad] beside it, got "
    done = command("robots", file)
    assert done.returncode == 2
    assert sentence in " ".join(done.stderr.split())


numbers = st.one_of(
    st.floats(1e-9, 1e9),
    st.sampled_from([0.0, -0.0, -1.0, 5e-324, 1e-300, 1e300, 1.7e308, 1, 10**30]),
)
STOP = "{slip_torque = 1.0, slip_angle = 1e-5}"
hostile = st.one_of(
    numbers.map(repr),
    st.sampled_from(
        ["nan", "inf", "-inf", "1e400", "true", '"1.0"', "[]", "[[]]", "{}", "1979-05-27"]
    ),
    st.sampled_from(["1" * 400, "1" * 5000, f"[{1000 * '1.0, '}]", "[{}]", "[1.0, {}]"]),
    st.sampled_from([f"[{STOP}]", f"[{STOP.replace('1.0', 'nan')}]", f"[{5000 * f'{STOP}, '}]"]),
)
KEYS = ("hysteresis", "hysteresis_width_arcmin", "lost_motion_arcmin", "rated_torque_Nm")
# What a gear has.
USUAL = {
    "stiffness": st.floats(1e5, 1e7).map(repr),
    "backlash": st.floats(0.0, 1e-4).map(repr),
    "damping": st.floats(0.0, 1e4).map(repr),
    "hysteresis": st.integers(1, 7).map(lambda n: f"[{n * f'{STOP}, '}]"),
    "hysteresis_width_arcmin": st.floats(0.01, 1.0).map(repr),
    "lost_motion_arcmin": st.floats(0.01, 1.0).map(repr),
    "rated_torque_Nm": st.floats(1e3, 1e4).map(repr),
}


@st.composite
def files(draw) -> dict[str, str]:
    """Keys and what stands there, of a gear in one form or both, or of none."""
    form = draw(st.sampled_from([KEYS[:1], KEYS[1:], KEYS[1::2], KEYS]))
    keys = ["stiffness", *form, *sorted(draw(st.sets(st.sampled_from(["backlash", "damping"]))))]
    own = {key: draw(USUAL[key]) for key in keys}
    strange = draw(st.sets(st.sampled_from([*USUAL, "slip_torque"]), max_size=2))
    own |= {key: draw(hostile) for key in sorted(strange)}
    missing = draw(st.none() | st.sampled_from(sorted(own)))
    return {key: value for key, value in own.items() if key != missing}


@settings(max_examples=200)
@given(files())
def test_any_file_is_read_or_refused_in_sentences_that_name_it(own):
    """Whatever stands there: one exception, and where there is none, elements that slip."""
    lines = {key: f"{key} = {value}" for key, value in own.items()}
    of_gear = [lines.pop(key) for key in ("slip_torque", *KEYS) if key in own]
    with tempfile.TemporaryDirectory() as folder:
        file = written(Path(folder), "\n".join(lines.values()), "\n".join(of_gear))
        found, refusals = [], []
        for reader in (load_robot, parts_in_words):
            try:
                found.append(reader(file))
            except RobotFileError as error:
                refusals += str(error).splitlines()
    assert [line for line in refusals if not line.startswith(f"{file}: ")] == []
    if refusals:
        return
    robot, words = found
    assert Robot.from_json(robot.to_json()) == robot
    elements = robot.joints[1].hysteresis
    assert len(elements) <= 6
    assert bool(elements) == any(own.get(key, "[]") != "[]" for key in KEYS) == bool(words)


def placed(start: Path, gear: str, target: Path) -> Path:
    """Write a shipped robot whose second joint has a gear's table in place of its backlash."""
    tables = start.read_text().split("[[joint]]")
    tables[2] = (
        re.sub(r"(?m)^backlash.*\n", "", tables[2]).rstrip() + f"\n\n[joint.gear]\n{gear}\n\n"
    )
    target.write_text("[[joint]]".join(tables))
    return target


@pytest.mark.parametrize("name", ["icme2008", "kuka_kr210"])
def test_a_gear_is_read_in_a_complete_file_and_beside_a_urdf(name, tmp_path):
    start = shipped_robots()[name]
    before, after = (
        load_robot(start),
        load_robot(placed(start, sheet(0.48, RATED, 0.5), tmp_path / "robot.toml")),
    )
    with_gear = [k for k, joint in enumerate(after.joints) if joint.hysteresis]
    assert with_gear == [1]
    assert 0.0 < after.joints[1].backlash != before.joints[1].backlash
    assert [j for j in after.joints if not j.hysteresis] == [
        j for k, j in enumerate(before.joints) if k != 1
    ]


ELEMENTS = (
    "hysteresis = [{ slip_torque = 40.0, slip_angle = 2e-5 },  # first\n"
    "  { slip_torque = 9.0, slip_angle = 1e-4 }]"
)


@pytest.mark.parametrize("name", ["icme2008", "kuka_kr210"])
def test_a_written_file_keeps_the_elements_of_a_gear(name, tmp_path):
    """Word for word, while stiffness and backlash change."""
    file = placed(shipped_robots()[name], ELEMENTS, tmp_path / "robot.toml")
    robot = load_robot(file)
    edit = RobotEdit(file, robot)
    for key, value in (("stiffness", 2e6), ("backlash", 3e-5), ("damping", 5.0)):
        edit.change(f"joint[2].{key}", value, "fitted")
    file.write_text(edit.text("Fitted.", file))
    assert f"[joint.gear]\n{ELEMENTS}\n" in file.read_text()
    own = load_robot(file).joints[1]
    assert (own.stiffness, own.backlash, own.damping) == (2e6, 3e-5, 5.0)
    assert own.hysteresis == robot.joints[1].hysteresis


FORMS = {
    "table": f"[joint.gear]  # the sheet\n{SHEET}",
    "inline": f"gear = {{ {', '.join(SHEET.split(chr(10))[:3])} }}\n",
    "dotted": "".join(f"gear.{line}\n" for line in SHEET.split("\n")[:3]),
}


@pytest.mark.parametrize("changed", ["stiffness", "backlash"])
@pytest.mark.parametrize("form", FORMS)
def test_a_fitted_gear_of_a_data_sheet_has_the_elements_that_it_was_fitted_with(
    form, changed, tmp_path
):
    """Its width would give others with another stiffness; what is not fitted stays, with its source."""
    file = tmp_path / "robot.toml"
    sources = (
        '[sources]\n"joint.gear.hysteresis_width_arcmin" = "the maker"\n"joint[1]" = "weighed"\n'
    )
    file.write_text(
        f"{HEAD}{JOINT}stiffness = 1.7e6\n{FORMS[form]}\n# the last\n{JOINT}\n{sources}"
    )
    before = load_robot(file)
    for key in ("damping", changed):
        edit = RobotEdit(file, before)
        edit.change(f"joint[1].{key}", 2e-5, "fitted")
        edit.remark(f"joint[1].{key}", "95 %")
        text = edit.text("Fitted.", file)
        assert ("width" in text.partition("[sources]")[0]) == (key == "damping")
    assert "# the last\n" in text
    file.write_text(text)
    after = load_robot(file).joints[0]
    expected = {"stiffness": before.joints[0].stiffness, "backlash": before.joints[0].backlash}
    expected[changed] = 2e-5
    assert {key: getattr(after, key) for key in expected} == expected
    assert after.hysteresis == before.joints[0].hysteresis
    said = tomllib.loads(text)["sources"]
    assert said["joint[1]"] == "weighed"
    assert said["joint[1].gear.hysteresis"] == (
        "from hysteresis_width_arcmin = 0.4, lost_motion_arcmin = 0.5, rated_torque_Nm = 3000.0;"
        " the maker; weighed"
    )
    assert "joint.gear.hysteresis_width_arcmin" not in said


def test_the_source_of_a_width_stays_while_another_gear_has_one(tmp_path):
    file = tmp_path / "robot.toml"
    gear = f"{JOINT}stiffness = 1.7e6\n[joint.gear]\n{SHEET}"
    key = "joint.gear.hysteresis_width_arcmin"
    file.write_text(f'{HEAD}{gear}{gear}[sources]\n"{key}" = "the maker"\n')
    edit = RobotEdit(file, load_robot(file))
    edit.change("joint[2].stiffness", 1.5e6)
    content = tomlkit.parse(edit.text("", file)).unwrap()
    assert content["sources"][key] == "the maker"
    assert [list(joint["gear"]) for joint in content["joint"]] == [
        ["hysteresis_width_arcmin", "lost_motion_arcmin", "rated_torque_Nm"],
        ["hysteresis"],
    ]


def test_the_list_of_numbers_has_the_elements_their_sum_and_their_sources(tmp_path, command):
    sources = '[sources]\n"joint[2].gear.lost_motion_arcmin" = "the maker"\n'
    out = command("robots", written(tmp_path, f"stiffness = {K}", SHEET, sources)).stdout
    said = " ".join(out.split())
    assert "joint[2].gear.lost_motion_arcmin = 0.5: the maker" in said
    assert "joint[2].gear.rated_torque_Nm = 3000: the file does not say" in said
    assert (
        "joint[2].gear: hysteresis 65.27 N m (21.76 N m at 6.399e-06 rad, 21.76 N m at 1.92e-05 rad,"
        " 21.76 N m at 4.8e-05 rad), backlash 1.978e-05 rad"
    ) in said
    assert "hysteresis" not in command("robots", "icme2008").stdout


def test_the_page_in_an_fmu_has_a_column_where_a_gear_has_elements(tmp_path, example):
    robot = load_robot(written(tmp_path, f"stiffness = {K}", ELEMENTS))
    page = index_html(robot, [], "2.0", "1", "")
    assert "<th>hysteresis: slip torque [N m] at slip angle [rad]</th>" in page
    assert "<td>40 at 2e-05, 9 at 0.0001</td>" in page
    plain = index_html(example, [], "2.0", "1", "")
    assert "<th>hysteresis" not in plain
    for text in (page, plain):
        joints = re.search(r"<table><caption>Origin.*?</table>", text, re.DOTALL)[0]
        head, *rows = joints.split("</tr>")[:-1]
        assert {row.count("<td>") for row in rows} == {head.count("<th>")}

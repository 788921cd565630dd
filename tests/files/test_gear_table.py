"""[joint.gear]: the loop that is read is that of its data sheet, and what no gear can be is refused."""

import math
import re
import tempfile
from pathlib import Path

import numpy as np
import pytest
from gear_file import ARCMIN, RATED, SHEET, K, sheet, written
from hypothesis import given
from hypothesis import strategies as st
from places import DOCS
from scipy.optimize import brentq
from two_joint_file import HEAD, JOINT

from coupling.files.robot_file import load_robot
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.path.histories import WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.description import Joint, Robot
from elastic_robot.errors import RobotFileError

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
        "joint 2: gear: lost_motion_arcmin: expected no backlash beside it, as it determines the"
        " backlash, got backlash = 0.0001",
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
    done = command("robots", file, exits=2)
    assert sentence in " ".join(done.stderr.split())


def read(joint: str, gear: str) -> Joint:
    """Return the joint with a gear as it is read, through JSON as an FMU has it."""
    with tempfile.TemporaryDirectory() as folder:
        robot = load_robot(written(Path(folder), joint, gear))
    assert Robot.from_json(robot.to_json()) == robot
    return robot.joints[1]


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

"""Gears with hysteresis in files that are complete, beside a URDF, written anew and listed."""

import re
import tomllib
from pathlib import Path

import pytest
import tomlkit
from gear_file import RATED, SHEET, K, sheet, written
from two_joint_file import HEAD, JOINT

from coupling.files.robot_file import load_robot, shipped_robots
from coupling.fmu_export.index_html import index_html
from coupling.robot.robot_edit import RobotEdit


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

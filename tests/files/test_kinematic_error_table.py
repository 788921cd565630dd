"""[joint.gear]: kinematic error and efficiency, as the model has them."""

from dataclasses import replace

import pytest
from two_joint_file import HEAD, JOINT, second_joint, two_joints

from coupling.files.robot_file import load_robot, parts_in_words
from coupling.fmu_export.index_html import index_html
from coupling.robot.robot_edit import RobotEdit
from elastic_robot.errors import RobotFileError
from elastic_robot.gear_parts import KinematicError

ELASTIC = "stiffness = 1e6"
DRIVE = """[joint.drive]
rotor_inertia_kg_m2 = 5e-3
gear_ratio = 200.0
servo = { position_gain = 20.0, rate_gain = 1e4 }
"""
ERRORS = """[[joint.gear.kinematic_error]]
amplitude = 5e-5
per_turn_of_motor = 2
[[joint.gear.kinematic_error]]
amplitude = 1e-4
per_turn_of_joint = 1.0
phase = 0.5
"""


def test_orders_are_periods_in_a_turn_of_the_joint():
    joint = second_joint(ELASTIC, ERRORS + DRIVE)
    assert joint.kinematic_error == (KinematicError(5e-5, 400.0), KinematicError(1e-4, 1.0, 0.5))


def test_a_rigid_joint_may_have_a_kinematic_error():
    text = "[[joint.gear.kinematic_error]]\namplitude = 1e-4\nper_turn_of_joint = 3.0\n"
    assert second_joint("", text).kinematic_error == (KinematicError(1e-4, 3.0),)


def test_what_the_gear_loses_is_friction_over_its_torque():
    """A motor that lifts gives 1 / eta of what the gear carries: mu = 1 / eta - 1."""
    joint = second_joint(ELASTIC, "[joint.gear]\nefficiency = 0.8\n" + DRIVE)
    assert joint.drive.load_friction == pytest.approx(0.25, rel=1e-15)
    assert joint.hysteresis == ()
    assert (
        second_joint(ELASTIC, "[joint.gear]\nefficiency = 1.0\n" + DRIVE).drive.load_friction == 0.0
    )


def test_beside_a_data_sheet_both_stand_and_stay_in_a_written_file(tmp_path):
    """Its elements take the place of the sheet's numbers alone, in whatever form the table has."""
    sheet = "hysteresis_width_arcmin = 0.4\nrated_torque_Nm = 3000.0\n"
    error = "{ amplitude = 1e-5, per_turn_of_joint = 8.0 }"
    forms = {
        "table": f"[joint.gear]\nefficiency = 0.8\n{sheet}kinematic_error = [{error}]\n{DRIVE}",
        "dotted": "gear.efficiency = 0.8\n"
        + "".join(f"gear.{line}\n" for line in sheet.splitlines())
        + f"gear.kinematic_error = [{error}]\n{DRIVE}",
        "array": f"[joint.gear]\nefficiency = 0.8\n{sheet}\n[[joint.gear.kinematic_error]]\n"
        f"amplitude = 1e-5\nper_turn_of_joint = 8.0\n{DRIVE}",
    }
    for name, text in forms.items():
        file = tmp_path / f"{name}.toml"
        file.write_text(f"{HEAD}{JOINT}{ELASTIC}\n{text}")
        before = load_robot(file)
        edit = RobotEdit(file, before)
        edit.change("joint[1].stiffness", 2e6, "fitted")
        file.write_text(edit.text("Fitted.", file))
        after = load_robot(file).joints[0]
        assert len(after.hysteresis) == 3
        for key in ("hysteresis", "kinematic_error", "drive"):
            assert getattr(after, key) == getattr(before.joints[0], key)
        assert after.kinematic_error == (KinematicError(1e-5, 8.0),)
        assert after.drive.load_friction == pytest.approx(0.25)


MISTAKES = {
    "no ratio": (
        ELASTIC,
        ERRORS,
        "joint 2: gear: kinematic_error 1: per_turn_of_motor: expected gear_ratio in [joint.drive]"
        " beside it, got no drive: give one, or per_turn_of_joint",
    ),
    "both": (
        ELASTIC,
        ERRORS.replace("per_turn_of_motor = 2", "per_turn_of_motor = 2\nper_turn_of_joint = 2"),
        "expected either per_turn_of_joint or per_turn_of_motor, got both",
    ),
    "neither": (
        ELASTIC,
        ERRORS.replace("per_turn_of_motor = 2", ""),
        "expected either per_turn_of_joint or per_turn_of_motor, got neither",
    ),
    "no amplitude": (
        ELASTIC,
        ERRORS.replace("5e-5", "0.0") + DRIVE,
        "gear: kinematic_error 1: amplitude: expected a finite number > 0 [rad], got 0.0",
    ),
    "turns back": (
        ELASTIC,
        ERRORS.replace("5e-5", "5e-3") + DRIVE,
        "kinematic_error: expected a sum of amplitude times order of at most 0.5",
    ),
    "too many": (
        ELASTIC,
        9 * "[[joint.gear.kinematic_error]]\namplitude = 1e-5\nper_turn_of_joint = 1.0\n",
        "gear: kinematic_error: ",
    ),
    "efficiency without motor": (
        ELASTIC,
        "[joint.gear]\nefficiency = 0.8",
        "joint 2: gear: efficiency: expected a drive beside it, whose friction grows with the load",
    ),
    "half": (ELASTIC, "[joint.gear]\nefficiency = 0.5\n" + DRIVE, "gear: efficiency: expected"),
    "more than all": (ELASTIC, "[joint.gear]\nefficiency = 1.1\n" + DRIVE, "efficiency: expected"),
    "efficiency of a rigid joint": ("", "[joint.gear]\nefficiency = 0.9", "the joint is rigid"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_what_no_gear_can_be_is_refused_in_one_sentence(tmp_path, mistake):
    joint, text, said = MISTAKES[mistake]
    file = two_joints(tmp_path, joint, text)
    with pytest.raises(RobotFileError) as caught:
        load_robot(file)
    assert str(caught.value).startswith(f"{file}: joint 2: ")
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_robots_tells_what_the_numbers_come_to(tmp_path, command):
    file = two_joints(tmp_path, ELASTIC, "[joint.gear]\nefficiency = 0.8\n" + ERRORS + DRIVE)
    errors, drive = parts_in_words(file)
    assert errors == (
        "joint[2].gear: kinematic error 5e-05 rad 400 times a turn, 0.0001 rad 1 times a turn"
    )
    assert "in motion, 0.25 of the gear's torque; servo" in drive
    told = " ".join(command("robots", file).stdout.split())
    assert errors in told
    assert "joint[2].gear.kinematic_error[1].per_turn_of_motor = 2" in told


def test_the_page_in_an_fmu_tells_of_errors_and_balancers_where_there_are_any(tmp_path):
    balancer = "[joint.balancer]\ntorque_table = [[-1.0, 50.0], [0.0, 20.0], [0.5, -30.5]]\n"
    robot = load_robot(two_joints(tmp_path, ELASTIC, ERRORS + DRIVE + balancer))
    errors = "5e-05 rad 400 times a turn, 0.0001 rad 1 times a turn"
    row = f"<td>joint[2]</td><td>{errors}</td><td>3 points, -30.5 to 50 N m</td>"
    assert row in index_html(robot, [], "2.0", "1", "")
    bare = (replace(joint, kinematic_error=(), balancer=None) for joint in robot.joints)
    page = index_html(replace(robot, joints=tuple(bare)), [], "2.0", "1", "")
    assert "balancer" not in page
    assert "kinematic" not in page

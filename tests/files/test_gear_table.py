"""[joint.gear]: what no gear can be is refused."""

import pytest
from gear_file import RATED, SHEET, K, sheet, written

from coupling.files.robot_file import load_robot
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
    done = command("robots", file)
    assert done.returncode == 2
    assert sentence in " ".join(done.stderr.split())

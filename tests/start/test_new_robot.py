"""elastic-robot init for robots that others describe: a file that runs, its stand-ins marked."""

import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from command_line import status

from coupling.case.file import load_case
from coupling.check.chain_ends import chain_ends
from coupling.check.new_case import CASE, new_case, write_case
from coupling.check.new_robot import RobotChoice, new_robot
from coupling.check.typical_gears import CLASSES
from coupling.files.foreign_description import is_foreign
from coupling.files.mjcf import read_mjcf
from coupling.files.robot_file import load_robot
from coupling.files.urdf_tree import read_tree
from coupling.run.plausibility import remarks
from elastic_robot.chain import build_chain
from elastic_robot.errors import RobotFileError
from elastic_robot.kinematics import base_from_tool

BODY = (
    '<inertial><origin xyz="{}"/><mass value="{}"/>'
    '<inertia ixx="2" iyy="2" izz="2" ixy="0" ixz="0" iyz="0"/></inertial>'
)
# Axes of an industrial robot of 165 kg stretched forward, made up: origins, axes, limits.
AXES = (
    ("0 0 0.7", "0 0 1", 3.0),
    ("0.3 0 0", "0 1 0", 1.6),
    ("0 0 1.1", "0 -1 0", 3.0),
    ("0.6 0 0.25", "-1 0 0", 6.0),
    ("0.7 0 0", "0 -1 0", 2.1),
    ("0.2 0 0", "-1 0 0", 6.0),
)


def arm(masses: bool = True, more: str = "") -> str:
    """A robot with six joints; its flange's z points out, as ROS has it."""
    links = ['<link name="base_link"/>', '<link name="tool0"/>']
    for number in range(1, 7):
        inside = BODY.format("0.1 0 0", 200 / number**2) if masses else ""
        links.append(f'<link name="l{number}">{inside}</link>')
    joints = []
    for number, (origin, axis, limit) in enumerate(AXES, start=1):
        parent = f"l{number - 1}" if number > 1 else "base_link"
        joints.append(
            f'<joint name="a{number}" type="revolute"><origin xyz="{origin}"/>'
            f'<parent link="{parent}"/><child link="l{number}"/><axis xyz="{axis}"/>'
            f'<limit lower="-{limit}" upper="{limit}" velocity="2" effort="0"/></joint>'
        )
    joints.append(
        '<joint name="flange" type="fixed"><origin rpy="3.141592653589793 1.5707963267949 0"/>'
        '<parent link="l6"/><child link="tool0"/></joint>'
    )
    return f'<robot name="arm">{"".join(links + joints)}{more}</robot>'


def write(folder: Path, text: str, name: str = "arm.urdf") -> str:
    (folder / name).write_text(text)
    return str(folder / name)


@pytest.mark.parametrize("masses", [True, False])
def test_a_case_for_a_urdf_can_be_checked_as_it_stands(tmp_path, masses):
    urdf = write(tmp_path, arm(masses))
    made = new_case(urdf, "isf-force-law", False, tmp_path / "cell")
    case = load_case(write_case(made, tmp_path / "cell"))
    (placed,) = case.robots
    low, _, high = CLASSES["heavy"].arm
    assert placed.provenance.stiffness_ranges[1] == (low, high)
    assert placed.provenance.stiffness_ranges[4] == CLASSES["heavy"].wrist[::2]
    said = "\n".join(remarks(case))
    assert "the stiffness of 6 gears is known as a range (200000 to 7600000 N m/rad)" in said
    text = (tmp_path / "cell" / "arm.toml").read_text()
    assert ("ESTIMATE" in text) == (not masses)
    head = (tmp_path / "cell" / CASE).read_text()[:400]
    assert "by the robot arm" in head
    assert "of the paper" not in head


def test_the_tool_points_along_the_last_axis_and_is_upright_when_stretched(tmp_path):
    made = new_robot(write(tmp_path, arm()), RobotChoice(), tmp_path)
    (tmp_path / made.file).write_text(made.texts[made.file])
    robot = load_robot(tmp_path / made.file)
    turn = pin.rpy.rpyToMatrix(*robot.tcp_rpy)
    np.testing.assert_allclose(turn, np.eye(3), atol=1e-9)  # of the last body, parallel to the base


def test_estimates_stand_where_masses_are_missing_only(tmp_path):
    """A chain without masses weighs what its class moves; one that has them is as it was."""
    for masses in (False, True):
        made = new_robot(write(tmp_path, arm(masses)), RobotChoice(), tmp_path)
        (tmp_path / made.file).write_text(made.texts[made.file])
        whole = sum(joint.body.mass for joint in load_robot(tmp_path / made.file).joints)
        stated = sum(200 / number**2 for number in range(1, 7))
        expected = stated if masses else CLASSES["heavy"].moving_mass
        assert whole == pytest.approx(expected, rel=1e-2)
        assert any("ESTIMATES" in text for text in made.remarks) == (not masses)


RAIL = (
    '<link name="rail"/><joint name="x" type="prismatic"><parent link="rail"/>'
    '<child link="base_link"/><origin rpy="0 0 1"/><axis xyz="1 0 0"/></joint>'
)
FINGERS = "".join(
    f'<link name="{name}"/><joint name="j_{name}" type="{kind}"><parent link="tool0"/>'
    f'<child link="{name}"/></joint>'
    for name, kind in (("left_finger", "revolute"), ("right_finger", "prismatic"))
)


VEHICLE = RAIL.replace('"x"', '"drive"') + (
    '<link name="ground"/><joint name="turn" type="continuous"><parent link="ground"/>'
    '<child link="rail"/></joint>'
)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("", ""),
        (FINGERS, ""),
        (RAIL, ", behind 'x', held at zero"),
        (VEHICLE, ", behind 'turn', 'drive', held at zero"),
        ('<frame name="grip" link="l6"/>', ""),
    ],
)
def test_base_and_tip_are_those_of_the_arm(tmp_path, more, said):
    ends = chain_ends(read_tree(Path(write(tmp_path, arm(more=more)))))
    assert (ends.base, ends.tip, ends.about) == ("base_link", "tool0", f"by its name{said}")
    assert ends.joints == tuple(f"a{number}" for number in range(1, 7))


def test_a_propeller_in_a_gripper_is_no_joint_of_the_arm(tmp_path):
    text = arm().replace("tool0", "gripper_link")
    more = '<link name="propeller"/>' + (
        '<joint name="turn" type="continuous"><parent link="gripper_link"/><child link="propeller"/>'
        "</joint>"
    )
    ends = chain_ends(read_tree(Path(write(tmp_path, text.replace("</robot>", f"{more}</robot>")))))
    assert (ends.tip, len(ends.joints)) == ("gripper_link", 6)


@pytest.mark.parametrize(
    "fingers",
    [
        (("gripper_joint", "left_outer_link"),),
        (("drive_joint", "left_outer_knuckle"),),
        (("jaw_left", "left"), ("jaw_right", "right")),
    ],
)
def test_fingers_that_turn_are_no_joints_of_an_arm_whose_flange_has_no_usual_name(
    tmp_path, fingers
):
    """The longest chain would have them as its last joint, or two fingers would be two chains."""
    text = arm().replace("tool0", "l7")
    more = "".join(
        f'<link name="{link}"/><joint name="{joint}" type="revolute"><parent link="l7"/>'
        f'<child link="{link}"/></joint>'
        for joint, link in fingers
    )
    ends = chain_ends(read_tree(Path(write(tmp_path, text.replace("</robot>", f"{more}</robot>")))))
    assert (ends.tip, ends.joints) == ("l7", tuple(f"a{number}" for number in range(1, 7)))
    assert f"6 joints, as {fingers[0][0]!r} behind it is a gripper's: it is carried" in ends.about


def test_two_arms_are_told_apart_by_tip(tmp_path):
    links = "".join(f'<link name="{name}"/>' for name in ("torso", "left_tool0", "right_tool0"))
    joints = "".join(
        f'<joint name="{side}" type="continuous"><parent link="torso"/>'
        f'<child link="{side}_tool0"/></joint>'
        for side in ("left", "right")
    )
    tree = read_tree(Path(write(tmp_path, f"<robot name='two'>{links}{joints}</robot>")))
    with pytest.raises(
        RobotFileError, match=r"left_tool0, right_tool0: choose its last link by --tip"
    ):
        chain_ends(tree)
    assert chain_ends(tree, tip="left_tool0").joints == ("left",)
    with pytest.raises(RobotFileError, match=r"--tip: .*did you mean 'left_tool0'"):
        chain_ends(tree, tip="left_tool")


def test_the_robot_file_stands_where_no_place_is_found(tmp_path, capsys):
    """A robot of two joints cannot hold a tool at any orientation; its file is of use."""
    urdf = write(tmp_path, arm())
    assert status("init", tmp_path / "cell", "--robot", urdf, "--tip", "l2") == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "No case: arm: expected a place" in said
    assert len(load_robot(tmp_path / "cell" / "arm.toml").joints) == 2


MJCF = """<mujoco model="arm"><compiler angle="radian"/><worldbody>
<body name="b1" pos="0 0 .3"><joint name="h1" axis="0 0 1" pos=".02 0 .01" range="-2 2" ref=".3"/>
<geom type="capsule" fromto="0 0 0 .4 0 0" size=".05" mass="5"/>
<body name="b2" pos=".4 0 0" quat=".9 .1 .2 .3"><joint name="h2" axis="0 1 0" range="-2 2"/>
<joint name="h3" axis="1 0 0" pos=".1 0 0"/><geom type="box" size=".1 .05 .2" pos=".05 0 .2" mass="3"/>
<site name="attachment_site" pos="0 0 .4" quat="1 0 1 0"/></body></body></worldbody></mujoco>"""


def test_an_mjcf_moves_as_mujoco_moves_it(tmp_path):
    """Two joints of one body, off its origin, one with ref: placements and gravity torques."""
    mujoco = pytest.importorskip("mujoco")
    file = write(tmp_path, MJCF, "arm.xml")
    made = new_robot(file, RobotChoice(), tmp_path)
    for name, text in made.texts.items():
        (tmp_path / name).write_text(text)
    robot = load_robot(tmp_path / made.file)
    chain = build_chain(robot)
    model = mujoco.MjModel.from_xml_path(file)
    data = mujoco.MjData(model)
    for theta in np.random.default_rng(1).uniform(-1.0, 1.0, (5, 3)):
        data.qpos[:] = model.qpos0 + theta
        mujoco.mj_forward(model, data)
        ours = base_from_tool(chain, chain.model.createData(), theta)
        np.testing.assert_allclose(ours.translation, data.site("attachment_site").xpos, atol=1e-12)
        gravity = pin.computeGeneralizedGravity(chain.model, chain.model.createData(), theta)
        np.testing.assert_allclose(gravity, data.qfrc_bias, atol=1e-12)
    assert robot.joints[0].limits == pytest.approx((-2.3, 1.7))


def test_a_body_of_an_mjcf_is_a_link_in_its_frame_wherever_its_joints_are(tmp_path):
    """The tool's place is given in the frame of the last body, whose joint is 0.1 m off it."""
    mujoco = pytest.importorskip("mujoco")
    file = write(tmp_path, MJCF, "arm.xml")
    made = new_robot(file, RobotChoice(tip="b2"), tmp_path)
    for name, text in made.texts.items():
        (tmp_path / name).write_text(text)
    chain = build_chain(load_robot(tmp_path / made.file))
    model = mujoco.MjModel.from_xml_path(file)
    data = mujoco.MjData(model)
    theta = np.array([0.3, -0.4, 0.5])
    data.qpos[:] = model.qpos0 + theta
    mujoco.mj_forward(model, data)
    tip = base_from_tool(chain, chain.model.createData(), theta).translation
    np.testing.assert_allclose(tip, data.body("b2").xpos, atol=1e-12)


def test_what_an_mjcf_says_of_drives_and_balance_is_named_where_it_is_left_out(tmp_path):
    """Rotors, friction, springs and bodies that do not weigh: each with its numbers and its key."""
    pytest.importorskip("mujoco")
    assert not any("Left out" in text for text in _remarks_of(tmp_path, MJCF))
    text = MJCF.replace(' ref=".3"', ' ref=".3" armature=".4" damping="7"')
    text = text.replace('name="h2"', 'name="h2" armature="1.5" frictionloss="3" stiffness="25"')
    text = text.replace('<body name="b2"', '<body name="b2" gravcomp="1"')
    text = text.replace("<worldbody>", '<option gravity="0 0 0"/><worldbody>')
    said = "\n".join(_remarks_of(tmp_path, text))
    for words in (
        "armature, 0.4 to 1.5 kg m^2: it is the rotor's inertia at the output",
        "damping, 7 N m s/rad: it is viscous_Nm_s of [joint.drive.friction]",
        "frictionloss, 3 N m: it is coulomb_Nm of [joint.drive.friction]",
        "stiffness, 25 N m/rad: write a spring's torque as [joint.balancer]",
        "gravcomp, 1 of the weight: the bodies weigh here what they weigh",
        "gravity, 0 m/s^2: here it is 9.81",
    ):
        assert f"Left out of the MJCF: {words}" in said


def _remarks_of(folder, text):
    made = new_robot(write(folder, text, "arm.xml"), RobotChoice(), folder)
    for remark in made.remarks:
        assert f"# {remark}" in made.texts[made.file]
    return made.remarks


TWO_BODIES = """<mujoco><worldbody><body name="b1"><joint name="h1" axis="0 0 1"/><geom size=".1"/>
<body name="b2" pos=".5 0 0"><joint name="h2" axis="0 1 0"/><geom size=".1"/><site name="end"/></body>
<body name="bar" pos=".3 0 0"><joint name="h3" axis="0 1 0"/><geom size=".1"/></body></body>
<body name="handle" mocap="true"/></worldbody><tendon><fixed name="cord"><joint joint="h1" coef="1"/>
<joint joint="h2" coef="1"/></fixed></tendon><equality>{}</equality></mujoco>"""


@pytest.mark.parametrize(
    ("constraint", "got"),
    [
        ('<joint joint1="h2" joint2="h1" polycoef="0 -1 0 0 0"/>', "'h2'.*mimic joint of 'h1'"),
        ('<joint joint1="h2"/>', "'h2'.*mimic joint"),
        ('<connect body1="b2" body2="bar" anchor="0 0 0"/>', "'h2'.*mimic joint of 'h3'"),
        ('<weld body1="b2" body2="bar"/>', "'h2'.*mimic joint of 'h3'"),
        ('<tendon tendon1="cord"/>', "'h2'.*mimic joint of 'h1'"),
    ],
)
def test_joints_that_a_constraint_of_an_mjcf_moves_are_not_driven(tmp_path, constraint, got):
    pytest.importorskip("mujoco")
    file = write(tmp_path, TWO_BODIES.format(constraint), "arm.xml")
    with pytest.raises(RobotFileError, match=got):
        new_robot(file, RobotChoice(base="b1", tip="site_end"), tmp_path)


@pytest.mark.parametrize(
    "constraint",
    ['<joint joint1="h2" joint2="h1" active="false"/>', '<weld body1="handle" body2="b2"/>'],
)
def test_constraints_that_do_not_act_on_the_robot_leave_it_free(tmp_path, constraint):
    pytest.importorskip("mujoco")
    file = write(tmp_path, TWO_BODIES.format(constraint), "arm.xml")
    assert "2 joints" in new_robot(file, RobotChoice(tip="site_end"), tmp_path).remarks[0]


def test_a_last_link_that_resists_no_turn_of_its_joint_gets_an_estimate(tmp_path):
    """A point mass on the axis, as hands of many URDFs are: the file can be loaded."""
    before, mark, last = arm().partition('<link name="l6">')
    last = last.replace('ixx="2" iyy="2" izz="2"', 'ixx="0" iyy="0" izz="0"', 1)
    text = before + mark + last
    made = new_robot(write(tmp_path, text, "arm.urdf"), RobotChoice(), tmp_path)
    (tmp_path / made.file).write_text(made.texts[made.file])
    assert load_robot(tmp_path / made.file).joints[-1].body.inertia[0] > 0.0
    assert any("resist no turn" in remark for remark in made.remarks)


def test_a_chain_that_ends_before_a_slide_says_so(tmp_path):
    text = arm().replace('name="a5" type="revolute"', 'name="a5" type="prismatic"')
    made = new_robot(write(tmp_path, text), RobotChoice(), tmp_path)
    assert "4 joints, as 'a5' behind it is prismatic: it is carried at zero" in made.remarks[0]


def test_an_mjcf_that_does_not_stand_upright_is_refused(tmp_path):
    """Bodies would hang sideways under the gravity along -z that robot files have."""
    pytest.importorskip("mujoco")
    file = write(
        tmp_path, MJCF.replace("<worldbody>", '<option gravity="0 -9.8 0"/><worldbody>'), "y.xml"
    )
    with pytest.raises(RobotFileError, match=r"gravity: expected it along -z, got 0 -9\.8"):
        read_mjcf(Path(file))


@pytest.mark.parametrize(
    ("name", "text", "got"),
    [
        ("arm.sdf", '<sdf version="1.6"/>', "<sdf>, an SDF model: convert it to URDF"),
        ("arm.dae", "<COLLADA/>", "<COLLADA>, a drawing: give the URDF"),
        ("arm.usda", "#usda 1.0", "arm.usda: expected a URDF or MJCF file"),
    ],
)
def test_a_robot_in_another_format_is_refused_by_its_name(tmp_path, name, text, got):
    assert is_foreign(name)
    with pytest.raises(RobotFileError, match=got):
        new_robot(write(tmp_path, text, name), RobotChoice(), tmp_path)


def test_an_mjcf_that_is_none_is_refused(tmp_path):
    pytest.importorskip("mujoco")
    file = write(tmp_path, "<mujoco><worldbody><body/><nonsense/></worldbody></mujoco>", "bad.xml")
    with pytest.raises(RobotFileError, match=r"bad\.xml: cannot be read as MJCF: "):
        read_mjcf(Path(file))
    part = write(tmp_path, "<mujocoinclude><body/></mujocoinclude>", "part.xml")
    with pytest.raises(RobotFileError, match=r"part\.xml: is a part of an MJCF file"):
        new_robot(part, RobotChoice(), tmp_path)


def test_a_xacro_is_converted_where_its_package_lies(tmp_path):
    pytest.importorskip("xacrodoc")
    for name in ("arm_support", "arm_resources"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "package.xml").write_text(f"<package><name>{name}</name></package>")
    head = '<robot xmlns:xacro="http://wiki.ros.org/xacro" name="arm">'
    (tmp_path / "arm_resources" / "m.xacro").write_text(
        f'{head}<xacro:property name="long" value="${{2 * 0.6}}"/></robot>'
    )
    text = arm().replace('<robot name="arm">', "", 1).replace("0 0 1.1", "0 0 ${long}")
    include = '<xacro:include filename="$(find arm_resources)/m.xacro"/>'
    file = write(tmp_path / "arm_support", f"{head}{include}{text}", "arm.urdf.xacro")
    made = new_robot(file, RobotChoice(), tmp_path)
    assert list(made.texts) == ["arm.toml", "arm.urdf"]
    assert 'xyz="0 0 1.2"' in made.texts["arm.urdf"]
    broken = write(tmp_path / "arm_support", f"{head}${{1 / 0}}</robot>", "broken.xacro")
    with pytest.raises(RobotFileError, match=r"broken\.xacro: "):
        new_robot(broken, RobotChoice(), tmp_path)


@pytest.mark.parametrize(
    ("module", "name", "extra"),
    [
        ("xacrodoc", "arm.xacro", "xacro"),
        ("mujoco", "arm.xml", "mjcf"),
        ("robot_descriptions", "panda_description", "descriptions"),
    ],
)
def test_a_package_that_is_missing_is_named(tmp_path, monkeypatch, module, name, extra):
    monkeypatch.setitem(sys.modules, module, None)
    given = name if name.endswith("description") else write(tmp_path, "<mujoco/>", name)
    with pytest.raises(RobotFileError, match=rf"pip install 'elastic-robot-fmu\[{extra}\]'"):
        new_robot(given, RobotChoice(), tmp_path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is not a URDF"),
        (
            "<robot name='a'><link name='b'/></robot>",
            "expected joints that turn behind 'b', got none",
        ),
    ],
)
def test_what_is_no_robot_is_refused_by_its_file(tmp_path, text, words):
    file = write(tmp_path, text)
    with pytest.raises(RobotFileError) as caught:
        new_robot(file, RobotChoice(), tmp_path)
    assert str(caught.value).startswith(f"{file}: ")
    assert words in str(caught.value)


def test_an_unknown_class_is_refused(tmp_path):
    with pytest.raises(RobotFileError, match=r"--payload-class: .*did you mean 'heavy'"):
        new_robot(write(tmp_path, arm()), RobotChoice(gears="heavi"), tmp_path)


def test_hostile_names_make_a_file_that_can_be_read(tmp_path):
    name = 'a"\\]\u2028#'
    text = arm().replace('"a1"', "'" + name + "'").replace('name="l1"', 'name="l1&#x7f;&quot;"')
    text = text.replace('link="l1"', 'link="l1&#x7f;&quot;"')
    made = new_robot(write(tmp_path, text), RobotChoice(), tmp_path)
    (tmp_path / made.file).write_text(made.texts[made.file], encoding="utf-8")
    assert len(load_robot(tmp_path / made.file).joints) == 6


def test_a_robot_of_a_urdf_mills_with_a_spindle_of_its_class_along_its_last_axis(tmp_path):
    """Its tip is as far before the flange as the spindle reaches, where the tool points."""
    urdf = write(tmp_path, arm())
    made = {}
    for process in ("isf-force-law", "milling-force"):
        new = new_case(urdf, process, False, tmp_path / process)
        file = write_case(new, tmp_path / process)
        made[process] = load_case(file).robots[0].description
    bare, milling = made["isf-force-law"], made["milling-force"]
    assert bare.payload is None
    approach = pin.rpy.rpyToMatrix(*bare.tcp_rpy)[:, 0]
    reach = np.array(milling.tcp_position) - bare.tcp_position
    spindle = CLASSES["heavy"].spindle
    np.testing.assert_allclose(reach, spindle.reach * approach, atol=1e-6)
    assert milling.payload is not None
    assert milling.payload.mass == spindle.mass
    arm_of_weight = np.array(milling.payload.com) - bare.tcp_position
    np.testing.assert_allclose(arm_of_weight, 0.5 * spindle.length * approach, atol=1e-6)
    # A link that the user has named as the tip is the tool's.
    named = new_case(urdf, "milling-force", False, tmp_path / "n", RobotChoice(tip="tool0"))
    assert "[payload]" not in named.texts["arm.toml"]

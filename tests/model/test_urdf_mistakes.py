"""A robot file that names a URDF: what is wrong in either is refused; where URDFs are found."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from coupling.files.robot_file import load_robot
from coupling.files.urdf import find_urdf
from elastic_robot.body import Body
from elastic_robot.chain import build_chain
from elastic_robot.errors import RobotFileError


def link(name: str) -> str:
    return (
        f'<link name="{name}"><inertial><mass value="5"/><inertia ixx="1" iyy="1" izz="1" ixy="0"'
        ' ixz="0" iyz="0"/></inertial></link>'
    )


def joint(name: str, kind: str, parent: str, child: str) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        '<origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>'
        '<limit lower="-2" upper="2" velocity="1" effort="1"/></joint>'
    )


ARM_URDF = "\n".join(
    [
        '<robot name="arm">',
        *map(link, ("base_link", "upper_arm", "forearm", "finger")),
        '<link name="tool"/>',
        joint("shoulder", "revolute", "base_link", "upper_arm"),
        joint("elbow", "revolute", "upper_arm", "forearm"),
        joint("gripper", "prismatic", "forearm", "finger"),
        joint("flange", "fixed", "forearm", "tool"),
        "</robot>",
    ]
)


ARM_FILE = """
name = "arm"
[urdf]
file = "arm.urdf"
base = "base_link"
[tcp]
link = "tool"
[[joint]]
name = "shoulder"
stiffness = 1e6
tilt = [{ axis = [1, 0, 0], stiffness = 1e7 }]
[[joint]]
name = "elbow"
stiffness = 1e6
"""


# Which file is changed and how, and what the message must contain.
MISTAKES = {
    "no such file": ("toml", '"arm.urdf"', '"leg.urdf"', ["leg.urdf", "no such file"]),
    "no such package": (
        "toml",
        '"arm.urdf"',
        '"package://no_such_robots/arm.urdf"',
        ["no_such_robots", "ROS_PACKAGE_PATH"],
    ),
    "no such file in a package": (
        "toml",
        '"arm.urdf"',
        '"package://elastic_robot/arm.urdf"',
        ["no file 'arm.urdf' in"],
    ),
    "xacro": ("toml", '"arm.urdf"', '"arm.xacro"', ["arm.xacro", "the URDF that xacro makes"]),
    "unknown tip": ("toml", '"tool"', '"tol"', ["link 'tol'", "did you mean 'tool'"]),
    "unknown base": ("toml", '"base_link"', '"base"', ["link 'base'", "'base_link'"]),
    "base beside the way": (
        "toml",
        '"base_link"',
        '"finger"',
        ["'finger'", "between the root and 'tool'"],
    ),
    "no joint between": (
        "toml",
        '"base_link"',
        '"forearm"',
        ["at least one joint", "'forearm'", "'tool'"],
    ),
    "unknown joint": ("toml", '"elbow"', '"elbows"', ["'elbows'", "did you mean 'elbow'"]),
    "joint twice": (
        "toml",
        '"elbow"',
        '"shoulder"',
        ["joint 'shoulder'", "expected one table, got two"],
    ),
    "joint of a branch": ("toml", '"elbow"', '"gripper"', ["'gripper'", "between base and TCP"]),
    "joint without a name": ("toml", 'name = "elbow"', "", ["joint 2", "'name' is missing"]),
    "negative mass in the robot file": (
        "toml",
        'name = "elbow"',
        'name = "elbow"\nmass = -1.0',
        ["joint 'elbow'", "mass", "-1.0"],
    ),
    "part of a body that the URDF has not": (
        "urdf+toml",
        link("forearm") + "\n" + link("finger"),
        '<link name="forearm"/><link name="finger"/>',
        ["joint 'elbow'", "expected mass, com and inertia", "got no com"],
    ),
    "no density": ("toml", "[tcp]", "mass_scale = 0.0\n[tcp]", ["urdf: mass_scale", "0.0"]),
    "no tip": ("toml", 'link = "tool"', "", ["tcp", "'link' is missing"]),
    "negative stiffness": ("toml", "1e6", "-1e6", ["joint 'shoulder'", "stiffness", "> 0"]),
    "long tilt axis": ("toml", "[1, 0, 0]", "[2, 0, 0]", ["'shoulder'", "tilt 1", "length 2"]),
    "tilt along the axis": (
        "toml",
        "[1, 0, 0]",
        "[0, 1, 0]",
        ["joint 1 ('shoulder')", "expected an inertia of its own to move"],
    ),
    "not XML": ("urdf", "</robot>", "", ["is not a URDF", "no element found"]),
    "two roots": (
        "urdf",
        "</robot>",
        '<link name="lost"/></robot>',
        ["one link without a joint before it", "base_link, lost"],
    ),
    "sliding joint": (
        "urdf",
        '"elbow" type="revolute"',
        '"elbow" type="prismatic"',
        [
            "joint 'elbow'",
            "between 'base_link' and 'tool'",
            "got prismatic: set [tcp] link = 'upper_arm'",
        ],
    ),
    "floating joint": (
        "urdf",
        '"elbow" type="revolute"',
        '"elbow" type="floating"',
        ["joint 'elbow'", "got floating"],
    ),
    "mimic joint": (
        "urdf",
        '<parent link="upper_arm"/>',
        '<parent link="upper_arm"/><mimic joint="shoulder"/>',
        ["joint 'elbow'", "mimic"],
    ),
    "mass that is no number": (
        "urdf",
        link("upper_arm"),
        link("upper_arm").replace('"5"', '"heavy"'),
        ["link 'upper_arm'", "mass", "'heavy'"],
    ),
    "no inertia": (
        "urdf",
        link("forearm") + "\n" + link("finger"),
        '<link name="forearm"/><link name="finger"/>',
        ["joint 2 ('elbow')", "an inertia of its own to move", "no mass behind 'elbow'"],
    ),
    "inertia of no body": (
        "urdf",
        link("forearm"),
        link("forearm").replace('ixx="1"', 'ixx="9"'),
        ["joint 'elbow'", "principal moments", "by more than 2 %"],
    ),
    "negative inertia": (
        "urdf",
        link("forearm"),
        link("forearm").replace('ixx="1"', 'ixx="-9"'),
        ["joint 'elbow'", "principal moments"],
    ),
    "no axis": ("urdf", '"0 1 0"', '"0 0 0"', ["joint 'shoulder'", "axis"]),
    "inverted limits": ("urdf", 'lower="-2"', 'lower="3"', ["'shoulder'", "limits", "low < high"]),
    "place that is no number": ("urdf", 'xyz="0 0 0.5"', 'xyz="0 0 nan"', ["nan"]),
}


def write_arm(folder: Path, toml: str = ARM_FILE, urdf: str = ARM_URDF) -> Path:
    (folder / "arm.urdf").write_text(urdf)
    (folder / "arm.xacro").write_text(urdf)
    file = folder / "arm.toml"
    file.write_text(toml)
    return file


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_refused_with_place_value_and_need(tmp_path, capfd, mistake):
    which, old, new, words = MISTAKES[mistake]
    texts = {"toml": ARM_FILE, "urdf": ARM_URDF}
    if which == "urdf+toml":
        which = "urdf"
        texts["toml"] = ARM_FILE.replace('name = "elbow"', 'name = "elbow"\nmass = 1.0')
    assert old in texts[which]
    texts[which] = texts[which].replace(old, new, 1)
    file = write_arm(tmp_path, texts["toml"], texts["urdf"])
    with pytest.raises(RobotFileError) as caught:
        load_robot(file)
    message = str(caught.value)
    assert message.startswith(f"{file}: ")
    assert [word for word in words if word not in message] == []
    assert capfd.readouterr().err == ""  # what the parser says is in the message, not beside it


def test_the_arm_without_mistakes_is_read(tmp_path):
    robot = load_robot(write_arm(tmp_path))
    assert [joint.name for joint in robot.joints] == ["shoulder", "elbow"]
    assert robot.joints[1].body.mass == 10.0  # the forearm carries the finger
    np.testing.assert_allclose(robot.tcp_position, [0.0, 0.0, 0.5], atol=1e-15)


def test_a_moment_below_zero_by_rounding_is_read(tmp_path):
    """Pinocchio's own constructor refuses it."""
    slender = link("forearm").replace('izz="1"', 'izz="-1e-12"')
    assert slender != link("forearm")
    robot = load_robot(write_arm(tmp_path, urdf=ARM_URDF.replace(link("forearm"), slender)))
    robot = replace(
        robot,
        joints=(
            replace(robot.joints[0], body=Body(1.0, (0.0,) * 3, (1.0, 1.0, -1e-12))),
            *robot.joints[1:],
        ),
    )
    build_chain(robot)


def test_urdfs_are_found_in_ros_and_python_packages(tmp_path, monkeypatch):
    for place in ("ros/arm_support", "ament/share/arm_msgs", "python/arm_py", "python/no/arm_py"):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / "arm.urdf").write_text(ARM_URDF)
    cmeel = tmp_path / "python" / "cmeel.prefix" / "share" / "arm-data"
    cmeel.mkdir(parents=True)
    (cmeel / "arm.urdf").write_text(ARM_URDF)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ros"))
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "ament"))
    monkeypatch.syspath_prepend(str(tmp_path / "python"))
    for name in ("arm_support", "arm_msgs", "arm_py", "arm-data"):
        found = find_urdf(f"package://{name}/arm.urdf", Path("elsewhere"))
        assert found.read_text() == ARM_URDF
        assert name in found.parts
    assert find_urdf("arm.urdf", cmeel) == cmeel / "arm.urdf"
    assert find_urdf(str(cmeel / "arm.urdf"), Path("elsewhere")) == cmeel / "arm.urdf"

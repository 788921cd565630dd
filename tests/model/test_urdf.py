"""A robot file that names a URDF: the same mechanics as Pinocchio's and MuJoCo's own reading of it."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from places import EXAMPLES
from random_urdfs import RandomUrdf, make_urdf

from coupling.files.robot_file import load_robot
from coupling.files.urdf import find_urdf
from elastic_robot.body import Body
from elastic_robot.chain import Chain, build_chain
from elastic_robot.description import Robot
from elastic_robot.errors import RobotFileError
from elastic_robot.kinematics import base_from_tool

SEEDS = range(25)


def robot_file(folder: Path, urdf: RandomUrdf, extra: str = "", base: str = "base_link") -> Path:
    """Write a URDF and a robot file that makes every joint of it elastic."""
    (folder / "robot.urdf").write_text(urdf.plain)
    lines = ['name = "random"', "[urdf]", 'file = "robot.urdf"', f'base = "{base}"', extra]
    lines += ["[tcp]", 'link = "tool"']
    for name, axes in zip(urdf.joints, urdf.tilts, strict=True):
        tilts = [f"{{ axis = {axis.tolist()}, stiffness = 1e7, damping = 1e3 }}" for axis in axes]
        lines += ["[[joint]]", f'name = "{name}"', "stiffness = 2e6", "damping = 1e3"]
        lines += ["backlash = 1e-4", f"tilt = [{', '.join(tilts)}]"]
    file = folder / "robot.toml"
    file.write_text("\n".join(lines))
    return file


def chain_names(urdf: RandomUrdf) -> list[str]:
    """Names of the chain's rotations in the URDF that writes the tilts out."""
    names = []
    for number, (joint, axes) in enumerate(zip(urdf.joints, urdf.tilts, strict=True), start=1):
        names += [joint, *(f"tilt{number}_{order}" for order in range(1, len(axes) + 1))]
    return names


def ours(chain: Chain, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, pin.SE3]:
    """Mass matrix, gravity torques and base_from_tool of our chain."""
    data = chain.model.createData()
    mass = pin.crba(chain.model, data, theta).reshape(len(theta), len(theta))
    mass = np.triu(mass) + np.triu(mass, 1).T
    gravity = pin.computeGeneralizedGravity(chain.model, data, theta)
    return mass, gravity, base_from_tool(chain, data, theta).copy()


def pinocchios(
    file: Path, names: list[str], theta: np.ndarray, tip: str = "tool"
) -> tuple[np.ndarray, np.ndarray, pin.SE3]:
    """The same from Pinocchio's own model of a URDF, other joints at zero."""
    model = pin.buildModelFromUrdf(str(file))
    data = model.createData()
    rows = [model.joints[model.getJointId(name)].idx_v for name in names]
    step = np.zeros(model.nv)
    step[rows] = theta
    q = pin.integrate(model, pin.neutral(model), step)
    mass = pin.crba(model, data, q)
    mass = np.triu(mass) + np.triu(mass, 1).T
    gravity = pin.computeGeneralizedGravity(model, data, q)[rows]
    pin.framesForwardKinematics(model, data, q)
    return mass[np.ix_(rows, rows)], gravity, data.oMf[model.getFrameId(tip)]


def largest_difference(a, b) -> float:
    """Largest relative difference of mass matrix, gravity torques and placement."""
    pairs = [(a[0], b[0]), (a[1], b[1]), (a[2].homogeneous, b[2].homogeneous)]
    return max(np.abs(x - y).max() / np.abs(y).max() for x, y in pairs)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_chain_is_pinocchios_model_of_the_urdf_with_its_tilts_written_out(tmp_path, seed):
    """Torsions and tilts at random: a tilt of the robot file is a joint in the URDF joint's frame."""
    urdf = make_urdf(seed, 1 + seed % 7)
    chain = build_chain(load_robot(robot_file(tmp_path, urdf)))
    (tmp_path / "tilted.urdf").write_text(urdf.with_tilts)
    rng = np.random.default_rng(seed)
    for _ in range(5):
        theta = rng.uniform(-3.0, 3.0, chain.model.nv)
        other = pinocchios(tmp_path / "tilted.urdf", chain_names(urdf), theta)
        assert largest_difference(ours(chain, theta), other) < 1e-12


@pytest.mark.parametrize("seed", SEEDS)
def test_the_rigid_chain_is_mujocos_model_of_the_urdf(tmp_path, seed):
    """A second parser: frames, branches and merged inertias as MuJoCo reads them, to 1e-10."""
    mujoco = pytest.importorskip("mujoco")
    urdf = make_urdf(seed, 1 + seed % 7)
    chain = build_chain(load_robot(robot_file(tmp_path, urdf)))
    model = mujoco.MjModel.from_xml_string(urdf.plain)
    data = mujoco.MjData(model)
    rows = [model.joint(name).dofadr[0] for name in urdf.joints]
    q = np.random.default_rng(seed).uniform(-3.0, 3.0, len(rows))
    data.qpos[rows] = q
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    for k, column in enumerate(np.eye(model.nv)):
        mujoco.mj_mulM(model, data, full[k], column)
    tool = data.body("tool")
    placement = pin.SE3(tool.xmat.reshape(3, 3).copy(), tool.xpos.copy())
    other = full[np.ix_(rows, rows)], data.qfrc_bias[rows], placement
    mass, gravity, base_from_tcp = ours(chain, chain.theta(q))
    drives = chain.drive
    mine = mass[np.ix_(drives, drives)], gravity[drives], base_from_tcp
    assert largest_difference(mine, other) < 1e-10


@pytest.mark.parametrize("seed", SEEDS)
def test_a_base_within_the_chain_leaves_out_what_is_before_it(tmp_path, seed):
    """Joints from link 1 on move as in the whole robot with joint 1 at zero, seen from link 1."""
    urdf = make_urdf(seed, 2 + seed % 6)
    file = robot_file(tmp_path, urdf)
    whole = pin.buildModelFromUrdf(str(tmp_path / "robot.urdf"))
    data = whole.createData()
    pin.framesForwardKinematics(whole, data, pin.neutral(whole))
    root_from_base = data.oMf[whole.getFrameId("link1")]
    text = file.read_text().replace('base = "base_link"', 'base = "link1"')
    first, second = (text.index(f'[[joint]]\nname = "joint{number}"') for number in (1, 2))
    gravity = (root_from_base.rotation.T @ [0.0, 0.0, -9.81]).tolist()
    file.write_text(f"gravity = {gravity}\n" + text[:first] + text[second:])
    chain = build_chain(load_robot(file))
    theta = np.zeros(chain.model.nv)
    theta[chain.drive] = np.random.default_rng(seed).uniform(-3.0, 3.0, chain.joint_count)
    mass, torque, base_from_tcp = ours(chain, theta)
    mine = mass[np.ix_(chain.drive, chain.drive)], torque[chain.drive], base_from_tcp
    other = pinocchios(tmp_path / "robot.urdf", urdf.joints[1:], theta[chain.drive])
    assert largest_difference(mine, (*other[:2], root_from_base.inverse() * other[2])) < 1e-12


def test_tcp_and_payload_are_given_in_the_tip_links_frame(tmp_path):
    """The same as a further link welded to the tip, with its own frame and mass."""
    urdf = make_urdf(4, 4)
    pose = 'xyz="0.1 -0.2 0.3" rpy="0.4 -1.1 2"'
    inertia = 'ixx="1" iyy="2" izz="2.5" ixy="0.1" ixz="-0.2" iyz="0.3"'
    welded = urdf.with_tilts.replace('"tool', '"tip').replace(
        "</robot>",
        f'<link name="spindle"><inertial><origin xyz="0.05 0.02 0.1"/><mass value="20"/>'
        f'<inertia {inertia}/></inertial></link><joint name="s" type="fixed"><parent link="tip"/>'
        f'<child link="spindle"/></joint><link name="tool"/><joint name="t" type="fixed">'
        f'<parent link="tip"/><child link="tool"/><origin {pose}/></joint></robot>',
    )
    (tmp_path / "welded.urdf").write_text(welded)
    file = robot_file(tmp_path, urdf)
    tcp = '[tcp]\nlink = "tool"\n'
    text = file.read_text().replace(
        tcp, tcp + "position = [0.1, -0.2, 0.3]\nrpy = [0.4, -1.1, 2.0]\n"
    )
    payload = "mass = 20.0\ncom = [0.05, 0.02, 0.1]\ninertia = [1.0, 2.0, 2.5, 0.1, -0.2, 0.3]\n"
    file.write_text(text + "\n[payload]\n" + payload)
    chain = build_chain(load_robot(file))
    theta = np.random.default_rng(4).uniform(-3.0, 3.0, chain.model.nv)
    other = pinocchios(tmp_path / "welded.urdf", chain_names(urdf), theta)
    assert largest_difference(ours(chain, theta), other) < 1e-12


def test_a_kuka_kr210_is_pinocchios_model_of_its_urdf(tmp_path):
    pytest.importorskip(
        "rtbdata", reason="needs the package rtb-data, which is in the extra 'test'"
    )
    # Without scale, spindle and tool length, so that only the URDF is left.
    file = EXAMPLES / "robots" / "kuka_kr210.toml"
    bare = tmp_path / "kuka.toml"
    text = file.read_text().replace("position = [0.30, 0.0, 0.0]", "").replace("= 0.27", "= 1.0")
    bare.write_text(text[: text.index("[payload]")])
    chain = build_chain(load_robot(bare))
    urdf = find_urdf(tomllib.loads(text)["urdf"]["file"], file.parent)
    names = [joint.name for joint in load_robot(bare).joints]
    rng = np.random.default_rng(0)
    for theta in rng.uniform(-3.0, 3.0, (20, 6)):
        other = pinocchios(urdf, names, theta, tip="tool0")
        assert largest_difference(ours(chain, theta), other) < 1e-12


def test_names_limits_rates_and_elasticities_arrive(tmp_path):
    urdf = make_urdf(2, 6)
    file = robot_file(tmp_path, urdf)
    own = 'name = "joint2"\nlimits = [-0.5, 0.5]\nmax_rate = 0.1'
    file.write_text(file.read_text().replace('name = "joint2"', own))
    robot = load_robot(file)
    assert [joint.name for joint in robot.joints] == urdf.joints
    assert [len(joint.tilt) for joint in robot.joints] == [len(axes) for axes in urdf.tilts]
    assert {joint.stiffness for joint in robot.joints} == {2e6}
    assert {joint.backlash for joint in robot.joints} == {1e-4}
    ranges = {
        name: (None, None) if f'"{name}" type="continuous"' in urdf.plain else ((-2.0, 2.5), 1.5)
        for name in urdf.joints
    }
    ranges["joint2"] = ((-0.5, 0.5), 0.1)  # the robot file has the last word
    assert {joint.name: (joint.limits, joint.max_rate) for joint in robot.joints} == ranges
    assert {limits for limits, _ in ranges.values()} >= {None, (-2.0, 2.5)}  # both kinds occur


def test_mass_scale_is_a_density_and_unnamed_joints_are_rigid(tmp_path):
    urdf = make_urdf(3, 3)
    robot = load_robot(robot_file(tmp_path, urdf))
    file = robot_file(tmp_path, urdf, extra="mass_scale = 0.25")
    text = file.read_text()
    file.write_text(text[: text.index('[[joint]]\nname = "joint3"')])
    light = load_robot(file)
    assert [joint.stiffness for joint in light.joints] == [2e6, 2e6, None]
    for joint, lighter in zip(robot.joints, light.joints, strict=True):
        assert lighter.body.mass == 0.25 * joint.body.mass
        assert lighter.body.com == joint.body.com
        np.testing.assert_allclose(lighter.body.inertia, 0.25 * np.array(joint.body.inertia))


def test_json_round_trip_is_exact(tmp_path):
    for seed in SEEDS:
        robot = load_robot(robot_file(tmp_path, make_urdf(seed, 6)))
        assert Robot.from_json(robot.to_json()) == robot


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

"""A robot file that names a URDF: the same mechanics as Pinocchio's and MuJoCo's own reading of it."""

import tomllib
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from places import EXAMPLES
from random_urdfs import RandomUrdf, make_urdf

from coupling.files.robot_file import load_robot
from coupling.files.urdf import find_urdf
from elastic_robot.chain import Chain, build_chain
from elastic_robot.description import Robot
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

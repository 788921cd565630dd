"""URDFs of others: read as Pinocchio reads them, or refused by the name of what is wrong."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupling.files.urdf import read_urdf
from coupling.files.urdf_tree import read_tree
from elastic_robot.errors import RobotFileError

BODY = (
    '<inertial><mass value="5"/>'
    '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def link(name: str, body: str = BODY) -> str:
    return f'<link name="{name}">{body}</link>'


def joint(name: str, parent: str, child: str, kind: str = "revolute", inside: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0.1 0.2 0.5" rpy="0.3 -0.2 0.1"/>{inside or AXIS + LIMIT}</joint>'
    )


AXIS, LIMIT = '<axis xyz="0 0 1"/>', '<limit lower="-2" upper="2" velocity="1" effort="7"/>'


def arm(*more: str) -> str:
    """Two joints from base to tool, and more."""
    parts = [link("base"), link("upper"), link("tool"), joint("j1", "base", "upper")]
    return f"<robot name='arm'>{''.join([*parts, joint('j2', 'upper', 'tool'), *more])}</robot>"


def write(folder: Path, text: str | bytes) -> Path:
    file = folder / "arm.urdf"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


def same_as_pinocchio(file: Path, tip: str = "tool") -> bool:
    """Return whether placements at zero, masses and centres are those of Pinocchio's own reading."""
    chain = read_urdf(file, "base", tip)
    model = pin.buildModelFromUrdf(str(file))
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    pin.centerOfMass(model, data, pin.neutral(model))
    moved = np.zeros(3)
    for carried, placement in zip(chain.inertias, chain.base_from_joint, strict=True):
        moved += carried.mass * (placement.translation + carried.lever)
    theirs = sum((i.mass * data.oMi[k].act(i.lever) for k, i in enumerate(model.inertias) if k), 0)
    placed = data.oMf[model.getFrameId(tip, pin.FrameType.BODY)].isApprox(chain.base_from_tip, 1e-9)
    return bool(placed and np.allclose(moved, theirs, atol=1e-9))


# What Pinocchio reads, though it is no XML of the letter or leaves something to a default.
READ = {
    "prefixes that nothing declares": arm(
        "<gazebo:plugin drake:kind='a'><drake:x/></gazebo:plugin>"
    ),
    "a blank line before the declaration": f"\n  <?xml version='1.0'?>\n{arm()}",
    "an axis against z": arm().replace("0 0 1", "0 0 -1"),
    "an axis of another length": arm().replace("0 0 1", "0 3 4"),
    "no axis: x": arm().replace(AXIS, ""),
    "no origin": arm().replace('<origin xyz="0.1 0.2 0.5" rpy="0.3 -0.2 0.1"/>', ""),
    "a joint that turns without end": arm().replace('"revolute"', '"continuous"'),
    "a branch of every kind": arm(
        *(link(kind) for kind in ("floating", "planar", "prismatic", "fixed")),
        *(joint(f"b_{k}", "upper", k, k) for k in ("prismatic", "fixed")),
        *(joint(f"b_{k}", "upper", k, k) for k in ("floating", "planar")),
    ),
    "a link without mass": arm().replace(link("upper"), link("upper", "")),
    "a finger that mimics": arm(
        link("finger"), joint("f", "tool", "finger", inside=f"{AXIS}{LIMIT}<mimic joint='j1'/>")
    ),
}


@pytest.mark.parametrize("kind", READ)
def test_a_urdf_is_read_as_pinocchio_reads_it(tmp_path, kind):
    assert same_as_pinocchio(write(tmp_path, READ[kind]))


REFUSED = {
    "a link with two parents": (
        arm(link("rod"), joint("a", "base", "rod"), joint("b", "tool", "rod")),
        "link 'rod': expected one joint before it, got 'a' and 'b': a URDF is a tree, so cut the loop",
    ),
    "a circle beside the tree": (
        arm(link("p"), link("q"), joint("a", "p", "q"), joint("b", "q", "p")),
        "joints in a circle (p, q)",
    ),
    "a circle alone": (
        f"<robot name='a'>{link('p')}{link('q')}{joint('a', 'p', 'q')}{joint('b', 'q', 'p')}</robot>",
        "joints in a circle (p, q)",
    ),
    "a joint onto itself": (
        f"<robot name='a'>{link('p')}{joint('a', 'p', 'p')}</robot>",
        "joints in a circle (p)",
    ),
    "a turn by a quaternion": (
        arm().replace("<origin ", '<origin quat_xyzw="0 0 1 0" ', 1),
        "origin: expected xyz and rpy, got 'quat_xyzw': convert",
    ),
    "an axis by letters": (
        arm().replace(AXIS, '<axis x="0" y="1" z="0"/>', 1),
        "axis: expected xyz, three numbers in one text, got none",
    ),
    "a joint that closes a loop": (
        arm('<loop_joint name="l" type="revolute"/>'),
        "got <loop_joint>: take it out if it joins no links",
    ),
    "an SDF model": ("<sdf version='1.7'><model name='a'/></sdf>", "an SDF model: convert it"),
    "two roots": (
        arm(link("lost")),
        "expected one link without a joint before it, got 2 (base, lost)",
    ),
    "a link twice": (arm(link("tool")), "link 'tool': expected it once, got it 2 times"),
    "a joint twice": (
        arm(link("x"), joint("j1", "tool", "x")),
        "joint 'j1': expected it once, got it 2 times",
    ),
    "a link that is not there": (
        arm().replace('parent link="upper"', 'parent link="uper"'),
        "did you mean 'upper'?",
    ),
    "no child": (
        arm().replace('<child link="tool"/>', ""),
        "joint 'j2': expected <child>, got none",
    ),
    "an unknown type": (
        arm().replace('"revolute"', '"hinge"'),
        "joint 'j1': type: expected one of",
    ),
    "two numbers": (arm().replace("0.1 0.2 0.5", "0.1 0.2"), "joint 'j1': origin: xyz: expected 3"),
    "degrees": (
        arm().replace("0.3 -0.2 0.1", "0 0 90"),
        "joint 'j1': origin: rpy: expected radians, 10 at most, got 90",
    ),
    "not a number": (
        arm().replace("0.1 0.2 0.5", "nan 0 0"),
        "expected a finite number, got 'nan'",
    ),
    "beyond numbers": (arm().replace("0.1 0.2 0.5", "1e300 0 0"), "finite number, got '1e300'"),
    "no direction": (arm().replace("0 0 1", "0 0 0"), "joint 'j1': axis: expected a direction"),
    "half an inertia": (
        arm().replace('iyy="1"', ""),
        "link 'upper': inertial: inertia: expected iyy",
    ),
    "negative mass": (arm().replace('"5"', '"-5"'), "link 'upper': inertial: mass: expected >= 0"),
    "limits upside down": (
        arm().replace('lower="-2"', 'lower="3"'),
        "joint 'j1': limits: expected",
    ),
    "no robot": ("<mujoco/>", "expected <robot>, got <mujoco>"),
    "nothing": ("", "is not a URDF: no element found"),
    "a xacro file": (
        arm("<xacro:gripper/>"),
        "got <xacro:gripper>: convert the file by xacro first",
    ),
    "an encoding that is unknown": (
        "<?xml version='1.0' encoding='klingon'?><robot/>",
        "is not a URDF",
    ),
    "entities that explode": (
        "<!DOCTYPE r [<!ENTITY a 'ha'><!ENTITY b '&a;&a;'>]><robot name='&b;'/>",
        "expected no entities, got a declaration of 'a'",
    ),
    "elements inside each other": (
        "<robot>" + "<a>" * 5000,
        "at most 200 elements inside each other",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_no_robot_is_refused_by_its_name(tmp_path, kind):
    text, words = REFUSED[kind]
    file = write(tmp_path, text)
    with pytest.raises(RobotFileError) as caught:
        read_urdf(file, None, "tool")
    assert str(caught.value).startswith(f"{file}: ")
    assert words in str(caught.value)


def test_limits_of_a_branch_upside_down_do_not_matter(tmp_path):
    wrong = f'{AXIS}<limit lower="3" upper="-3" velocity="1" effort="1"/>'
    text = arm(link("finger"), joint("f", "tool", "finger", inside=wrong))
    assert read_urdf(write(tmp_path, text), None, "tool").joints[0].limits == (-2.0, 2.0)


def test_a_tab_in_a_name_is_a_blank(tmp_path):
    file = write(tmp_path, arm().replace('"j1"', '"j\t1"').replace('"upper"', '"upper&#9;arm"'))
    assert list(read_tree(file).joints) == ["j 1", "j2"]
    assert [own.name for own in read_urdf(file, "upper\tarm", "tool").joints] == ["j2"]


def test_a_chain_of_thousands_of_links_is_read(tmp_path):
    """No step of it goes deeper for every link."""
    count = 3000
    links = [link(f"l{k}", "") for k in range(count)] + [link("tool")]
    fixed = [joint(f"f{k}", f"l{k}", f"l{k + 1}", "fixed") for k in range(count - 1)]
    text = "".join([*links, *fixed, joint("j", f"l{count - 1}", "tool")])
    assert (
        len(read_urdf(write(tmp_path, f"<robot name='a'>{text}</robot>"), None, "tool").joints) == 1
    )


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=12), st.integers(0, len(arm())), st.integers(0, 40))
def test_damaged_bytes_are_read_or_refused(tmp_path_factory, put, at, less):
    whole = arm().encode()
    file = write(tmp_path_factory.mktemp("damaged"), whole[:at] + put + whole[at + less :])
    with suppress(RobotFileError):
        read_urdf(file, None, "tool")


# A rail, and the quill of a SCARA.
SLIDING = (
    f"<robot name='r'>{''.join(map(link, ('floor', 'base', 'upper', 'arm', 'quill', 'flange')))}"
    + joint("rail", "floor", "base", "prismatic")
    + joint("j1", "base", "upper")
    + joint("j2", "upper", "arm")
    + joint("j3", "arm", "quill", "prismatic")
    + joint("j4", "quill", "flange", "continuous")
    + "</robot>"
)


def test_the_remedy_for_a_joint_that_slides_is_one(tmp_path):
    """The rail's carriage as base, and the link before the quill as tip: two rotations, all masses."""
    file = write(tmp_path, SLIDING)
    with pytest.raises(RobotFileError, match=r"'rail'.* got prismatic: set \[urdf\] base = 'base'"):
        read_urdf(file, None, "flange")
    with pytest.raises(RobotFileError, match=r"'j3'.* got prismatic: set \[tcp\] link = 'arm'"):
        read_urdf(file, "base", "flange")
    chain = read_urdf(file, "base", "arm")
    assert [own.name for own in chain.joints] == ["j1", "j2"]
    assert [body.mass for body in chain.inertias] == [5.0, 15.0]

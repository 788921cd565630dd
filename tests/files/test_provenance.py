"""Numbers on top of a URDF: what the robot file replaces, what cannot matter, what is remarked."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from coupling.cli.robots import robots
from coupling.files.provenance import load_provenance, urdf_numbers
from coupling.files.robot_file import load_robot
from coupling.run.plausibility import remarks_on_robot
from elastic_robot.body import Body
from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Robot
from elastic_robot.errors import RobotFileError

_INERTIA = '<inertia ixx="{}" iyy="{}" izz="{}" ixy="0" ixz="0" iyz="0"/>'
URDF = """<robot name="arm"><link name="base"/>
<link name="l1">{first}</link><link name="l2">{second}</link><link name="tool"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" velocity="1" effort="{effort}"/></joint>
<joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/><axis xyz="0 1 0"/>
<origin xyz="0.4 0 0.3" rpy="0.5 0 0"/><limit lower="-2" upper="2" velocity="1" effort="50"/></joint>
<joint name="f" type="fixed"><parent link="l2"/><child link="tool"/><origin xyz="0.5 0 0"/></joint>
</robot>"""
TOML = """name = "arm"
[urdf]
file = "arm.urdf"
[tcp]
link = "tool"
[[joint]]
name = "j1"
stiffness = 1e5
{first}
[[joint]]
name = "j2"
stiffness = 1e5
{second}
"""


def body(mass: float, *moments: float) -> str:
    origin = '<origin xyz="0.2 0 0.1"/>'
    return f'<inertial>{origin}<mass value="{mass}"/>{_INERTIA.format(*moments)}</inertial>'


def write(folder: Path, first="", second="", effort=100.0, toml=("", "")) -> Path:
    (folder / "arm.urdf").write_text(
        URDF.format(
            first=first or body(20, 1, 1, 1), second=second or body(10, 1, 1, 1), effort=effort
        )
    )
    file = folder / "arm.toml"
    file.write_text(TOML.format(first=toml[0], second=toml[1]))
    return file


def remarks(file: Path) -> str:
    return "\n".join(load_provenance(file, load_robot(file)).remarks)


def test_mass_centre_and_inertia_of_the_robot_file_replace_those_of_the_urdf(tmp_path):
    """In the joint's frame, which is turned by 0.5 rad about x against the base."""
    own = "mass = 3.0\ncom = [0.0, 1.0, 0.0]\ninertia = [0.1, 0.2, 0.25]"
    for second in ("", "<visual/>"):
        second_body = load_robot(write(tmp_path, second=second, toml=("", own))).joints[1].body
        assert second_body.mass == 3.0
        np.testing.assert_allclose(second_body.com, [0.0, np.cos(0.5), np.sin(0.5)], atol=1e-15)
        turned = np.linalg.eigvalsh(second_body.inertia_matrix)
        np.testing.assert_allclose(turned, [0.1, 0.2, 0.25], atol=1e-15)
        assert abs(second_body.inertia_matrix[1, 2]) > 0.01
    assert load_robot(write(tmp_path, toml=("mass = 7.0", ""))).joints[0].body.com == (
        0.2,
        0.0,
        0.1,
    )


def test_only_the_moment_about_its_axis_matters_of_a_first_body(tmp_path):
    """A first link with izz alone moves as one with any xx and yy; the second one is refused with it."""
    chains = [
        build_chain(load_robot(write(tmp_path, first=body(20, *moments))))
        for moments in ((0, 0, 5), (4, 3, 5))
    ]
    for chain in chains:
        assert chain.model.inertias[1].inertia[2, 2] == pytest.approx(5.0, rel=1e-14)
    q = np.array([0.3, -0.7])
    rates = np.array([1.2, -0.4])
    torques = [
        pin.rnea(c.model, c.model.createData(), c.theta(q), c.theta(rates), c.theta(rates))
        for c in chains
    ]
    np.testing.assert_allclose(torques[0], torques[1], rtol=1e-13)
    file = write(tmp_path, first=body(20, 0, 0, 5))
    assert "only the 5 kg m2 about the joint's axis matter" in remarks(file)
    with pytest.raises(RobotFileError, match=r"joint 'j2'.*principal moments"):
        load_robot(write(tmp_path, second=body(20, 0, 0, 5)))
    tilted = "tilt = [{ axis = [1, 0, 0], stiffness = 1e6 }]"
    with pytest.raises(RobotFileError, match=r"joint 'j1'.*principal moments"):
        load_robot(write(tmp_path, first=body(20, 0, 0, 5), toml=(tilted, "")))


def test_moments_0_7_percent_beyond_the_triangle_are_remarked_and_3_percent_refused(tmp_path):
    robot = load_robot(write(tmp_path, second=body(10, 1, 1, 2.014)))
    (text,) = remarks_on_robot(robot)
    assert "joint 2: inertia over the sum of the others" in text
    assert "0.695" in text
    with pytest.raises(RobotFileError, match="by more than 2 %"):
        load_robot(write(tmp_path, second=body(10, 1, 1, 2.06)))


def test_an_effort_is_a_limit_where_it_is_positive(tmp_path):
    for effort, limits in ((100.0, {1: 100.0, 2: 50.0}), (0.0, {2: 50.0}), (-1.0, {2: 50.0})):
        file = write(tmp_path, effort=effort)
        assert load_provenance(file, load_robot(file)).ratings.efforts == limits
        assert ("effort: expected >= 0 N m, got -1" in remarks(file)) == (effort < 0.0)
    rated = write(tmp_path, toml=("gear_torque_Nm = { peak = 70.0 }", ""))
    assert load_provenance(rated, load_robot(rated)).ratings.efforts == {2: 50.0}


def test_placeholders_and_missing_masses_are_remarked(tmp_path):
    assert "no mass behind joint 'j1'" in remarks(write(tmp_path, first="<visual/>"))
    text = URDF.replace('<link name="tool"/>', f'<link name="tool">{body(2, 1, 1, 1)}</link>')
    file = write(tmp_path)
    (tmp_path / "arm.urdf").write_text(
        text.format(first=body(2, 1, 1, 1), second=body(2, 1, 1, 1), effort=1)
    )
    assert "all 3 links that move have the same mass, 2 kg" in remarks(file)


def test_an_elastic_joint_without_mass_says_what_to_write(tmp_path):
    with pytest.raises(
        RobotFileError, match="no mass behind 'j2' in the URDF: write mass, com and"
    ):
        load_robot(write(tmp_path, second="<visual/>"))


def test_a_revolute_joint_without_a_range_is_remarked(tmp_path):
    file = write(tmp_path)
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(urdf.read_text().replace('lower="-2" upper="2"', "", 1))
    assert load_robot(file).joints[0].limits is None
    assert "joint 'j1': limits: expected a range of a revolute joint" in remarks(file)


def test_robots_tells_what_is_from_where(tmp_path, capsys):
    file = write(tmp_path, first="<visual/>", toml=("limits = [-1.0, 1.0]", "max_rate = 0.5"))
    numbers = {number.place: number.source for number in urdf_numbers(file)}
    assert numbers["joint 'j1': mass"] == "not in the URDF arm.urdf"
    assert numbers["joint 'j2': mass"] == "URDF arm.urdf"
    assert "joint 'j1': limits" not in numbers
    robots([str(file)])
    said = " ".join(capsys.readouterr().out.split())
    assert "joint[1].limits = [-1, 1]" in said
    assert "joint 'j2': limits = [-2, 2]: URDF arm.urdf" in said
    assert "Remark: arm.urdf: no mass behind joint 'j1'" in said


def test_millimetres_and_degrees_are_remarked():
    """Links of 500 and limits of 170 are neither metres nor radians."""
    link = Body(10.0, (0.2, 0.0, 0.0), (1.0, 1.0, 1.0))
    first = Joint((0.0, 0.0, 300.0), (0.0, 0.0, 1.0), link, limits=(-170.0, 170.0))
    second = Joint((500.0, 0.0, 0.0), (0.0, 1.0, 0.0), link)
    said = "\n".join(remarks_on_robot(Robot("mm", (first, second), tcp_position=(400.0, 0.0, 0.0))))
    assert "length of its links" in said
    assert "did you mean 0.9 m (900 mm)?" in said
    assert "2.967 rad (170 deg)" in said


def test_a_range_holds_its_stiffness(tmp_path):
    file = write(tmp_path, toml=("stiffness_range = [5e4, 3e5]", ""))
    provenance = load_provenance(file, load_robot(file))
    assert provenance.stiffness_ranges == {1: (5e4, 3e5)}
    assert provenance.stiffness_range == (5e4, 3e5)
    for wrong in ("[2e5, 3e5]", "[0.0, 3e5]", "[5e4, 5e4]"):
        with pytest.raises(RobotFileError, match="stiffness_range: expected"):
            load_robot(write(tmp_path, toml=(f"stiffness_range = {wrong}", "")))


def test_checksums_name_the_files_that_change(tmp_path):
    file = write(tmp_path)
    before = load_provenance(file, load_robot(file)).files
    write(tmp_path, second=body(11, 1, 1, 1))
    after = load_provenance(file, load_robot(file)).files
    assert [name for name in before if before[name] != after[name]] == ["arm.urdf"]

"""Modes against closed forms, measured responses from files, state spaces for other tools."""

import json

import numpy as np
import pytest
from command_line import status
from places import CASES
from scipy.io import loadmat

from coupling.case.file import load_case
from coupling.errors import StabilityError
from coupling.files.robot_file import find_robot, load_robot
from coupling.modes.locked_robot import LockedRobot
from coupling.modes.measured_response import read_responses
from coupling.modes.posture_modes import PostureModes
from coupling.modes.state_space import MAT, NPZ, NamedStateSpace
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot

STIFFNESS, INERTIA, ARM, DAMPING = 2.0e5, 12.0, 1.5, 30.0
POSTURE = np.array([0.0, 0.2, 0.3, 0.0, 1.0, 0.0])
LOAD = np.array([80.0, 60.0, -40.0, 5.0, 5.0, 5.0])


def swing_arm(backlash: float = 0.0) -> Robot:
    """Return one joint about z with its TCP at x = ARM, its weight balanced."""
    link = Body(mass=2.0, com=(0.0, 0.0, 0.0), inertia=(INERTIA, INERTIA, INERTIA))
    joint = Joint(
        (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), link, stiffness=STIFFNESS, damping=DAMPING,
        backlash=backlash,
    )  # fmt: skip
    return Robot("swing", joints=(joint,), tcp_position=(ARM, 0.0, 0.0))


def modes_of(robot: Robot, wrench: np.ndarray, contact: np.ndarray | None = None) -> PostureModes:
    locked = LockedRobot(robot, "backlash")
    return PostureModes.of(locked, np.zeros(len(robot.joints)), wrench, contact)


def test_one_joint_has_the_mode_and_the_compliance_of_a_torsion_spring():
    modes = modes_of(swing_arm(), np.zeros(6))
    omega = np.sqrt(STIFFNESS / INERTIA)
    np.testing.assert_allclose(modes.frequency, [omega / (2.0 * np.pi)], rtol=1e-9)
    np.testing.assert_allclose(modes.damping_ratio, [0.5 * DAMPING / (INERTIA * omega)], rtol=1e-9)
    np.testing.assert_allclose(modes.tcp, [[0.0, 1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(modes.energy, [[1.0]])
    assert modes.compliance is not None
    size, direction = modes.softest(modes.compliance)
    assert size == pytest.approx(ARM**2 / STIFFNESS, rel=1e-9)
    np.testing.assert_allclose(direction, [0.0, 1.0, 0.0], atol=1e-12)
    at_resonance = modes.response(np.array([omega / (2.0 * np.pi)]))[0, 1, 1]
    assert at_resonance == pytest.approx(ARM**2 / (1j * omega * DAMPING), rel=1e-9)


def test_a_contact_shares_the_force_with_the_robot_as_springs_side_by_side():
    wall = 3.0e4
    modes = modes_of(swing_arm(), np.zeros(6), np.diag([0.0, wall, 0.0]))
    assert modes.compliance_in_contact is not None
    own = ARM**2 / STIFFNESS
    assert modes.compliance_in_contact[1, 1] == pytest.approx(own / (1.0 + own * wall), rel=1e-9)


def test_a_gear_in_its_backlash_is_named_and_a_force_presses_it_to_its_flank():
    free = modes_of(swing_arm(1e-3), np.zeros(6))
    assert free.unloaded == (1,)
    assert free.compliance is None
    pressed = modes_of(swing_arm(1e-3), np.array([0.0, 5.0, 0.0, 0.0, 0.0, 0.0]))
    assert pressed.unloaded == ()
    np.testing.assert_allclose(pressed.frequency, modes_of(swing_arm(), np.zeros(6)).frequency)


def test_the_largest_dynamic_compliance_is_at_a_mode():
    locked = LockedRobot(load_robot(find_robot("fanuc_r2000ic")), "backlash")
    modes = PostureModes.of(locked, np.array([0.0, 0.2, -0.2, 0.0, -1.2, 0.0]), LOAD)
    size, frequency = modes.peak
    assert np.abs(modes.frequency - frequency).min() < 0.02 * frequency
    assert modes.compliance is not None
    assert size > modes.softest(modes.compliance)[0]


def test_the_state_space_stands_in_both_files_with_names_and_units(tmp_path):
    locked = LockedRobot(load_robot(find_robot("icme2008")), "backlash")
    space = NamedStateSpace.of(locked.linear(POSTURE, LOAD))
    space.write(tmp_path)
    npz, mat = np.load(tmp_path / NPZ), loadmat(tmp_path / MAT)
    for name in "ABCD":
        np.testing.assert_array_equal(npz[name], getattr(space, name))
        np.testing.assert_array_equal(mat[name], getattr(space, name))
    for kind, size in (("states", len(space.A)), ("inputs", 24), ("outputs", 12)):
        assert len(npz[kind]) == len(mat[kind]) == size
        assert len(getattr(space, f"{kind.removesuffix('s')}_units")) == size
    units = dict(zip(space.outputs, space.output_units, strict=True))
    assert [units[f"tcp.{name}"] for name in ("x", "rx", "vx", "wx")] == [
        *("m", "rad", "m/s", "rad/s")
    ]


def test_python_control_has_the_same_frequency_response():
    pytest.importorskip("control")
    locked = LockedRobot(load_robot(find_robot("icme2008")), "linear")
    linear = locked.linear(POSTURE, LOAD)
    system = NamedStateSpace.of(linear).system()
    frequency = 17.0
    response = system(2j * np.pi * frequency)
    expected = linear.dynamic_compliance(np.array([frequency]))[0]
    np.testing.assert_allclose(response[:6, :6], expected, rtol=1e-8, atol=1e-16)


def test_a_csv_of_real_and_imaginary_parts_is_read(tmp_path):
    file = tmp_path / "hammer.csv"
    file.write_text("frequency_Hz,xx_real_m_N,xx_imag_m_N,xy_imag_m_N,xy_real_m_N\n"
                    "10,1e-6,-2e-6,4,3\n20,5e-7,-1e-7,6,5\n")  # fmt: skip
    direct, cross = read_responses(file)
    assert (direct.name, cross.name) == ("xx", "xy")
    np.testing.assert_allclose(direct.compliance, [1e-6 - 2e-6j, 5e-7 - 1e-7j])
    np.testing.assert_allclose(cross.compliance, [3 + 4j, 5 + 6j])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("frequency_Hz,xx_real_m_N\n1,2\n2,3\n", "xx_imag_m_N"),
        ("frequency_Hz,xx_real_um_N,xx_imag_m_N\n1,2,3\n", "'xx_real_um_N'"),
        ("frequency_Hz,xx_real_m_N,xx_imag_m_N\n2,2,3\n1,2,3\n", "rise"),
        ("frequency_Hz,xx_real_m_N,xx_imag_m_N\n0,2,3\n1,2,3\n", "above 0 Hz"),
        ("frequency_Hz,xx_real_m_N,xx_imag_m_N\n1,nan,3\n2,2,3\n", "finite"),
        ("frequency_Hz\n1\n2\n", "got none"),
        ("", "frequency_Hz"),
    ],
)
def test_another_csv_is_refused_by_its_column(tmp_path, text, said):
    file = tmp_path / "hammer.csv"
    file.write_text(text)
    with pytest.raises(StabilityError, match=said):
        read_responses(file)


def hammer_file(folder, **changed: object):
    """Write a UFF58 file of accelerance, y by x, and return it with the compliance."""
    pyuff = pytest.importorskip("pyuff")
    frequency = np.arange(1.0, 60.0)
    compliance = 1e-6 / (1.0 - (frequency / 20.0) ** 2 + 0.1j)
    content = {
        "func_type": 4, "rsp_dir": -2, "ref_dir": 1, "rsp_node": 1, "ref_node": 1,
        "num_pts": len(frequency), "ord_data_type": 6, "abscissa_min": 1.0, "abscissa_inc": 1.0,
        "abscissa_spacing": 1, "ordinate_spec_data_type": 12, "orddenom_spec_data_type": 13,
        "abscissa_spec_data_type": 18, "data": -((2.0 * np.pi * frequency) ** 2) * compliance,
        "x": frequency, "id1": "hammer",
    }  # fmt: skip
    file = folder / "hammer.uff"
    pyuff.UFF(str(file)).write_sets(pyuff.prepare_58(**(content | changed)), mode="overwrite")
    return file, compliance


@pytest.mark.parametrize("unit", ["", "m/s^2", "(m/s**2)/N", "(1/N)*(m/s2)"])
def test_a_uff58_of_acceleration_becomes_compliance(tmp_path, unit):
    file, compliance = hammer_file(tmp_path, ordinate_axis_units_lab=unit)
    (response,) = read_responses(file)
    assert response.name == "yx"
    # The file holds single precision at best.
    np.testing.assert_allclose(response.compliance, -compliance, rtol=1e-5)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"ordinate_spec_data_type": 1}, r"set 1: .* got the codes 1 over 13: set them"),
        ({"orddenom_spec_data_type": 12}, "got the codes 12 over 12"),
        ({"ref_dir": 0}, "expected directions .* got -2 and 0"),
        ({"rsp_dir": 5}, "got 5 and 1"),
        ({"ordinate_axis_units_lab": "g"}, "expected values in m, .* got 'g': convert them"),
        ({"ordinate_axis_units_lab": "mm/s^2"}, "got 'mm/s.2'"),
        ({"orddenom_axis_units_lab": "lbf"}, "got 'lbf'"),
        ({"func_type": 6}, "got none"),
    ],
)
def test_a_uff58_that_cannot_be_compliance_is_refused_by_what_it_has(tmp_path, changed, said):
    file, _ = hammer_file(tmp_path, **changed)
    with pytest.raises(StabilityError, match=said):
        read_responses(file)


def test_a_uff_file_in_other_units_is_refused(tmp_path):
    file, _ = hammer_file(tmp_path)
    pyuff = pytest.importorskip("pyuff")
    units = pyuff.prepare_164(
        units_code=5, units_description="mm", temp_mode=1, length=1e3, force=1e3, temp=1.0,
        temp_offset=0.0,
    )  # fmt: skip
    pyuff.UFF(str(file)).write_sets(units, mode="add")
    with pytest.raises(StabilityError, match=r"units code 1 of its set 164\), got \[5\]"):
        read_responses(file)


@pytest.mark.parametrize("content", [b"", b"\x00\xff" * 100, b"    -1\n    58\n\n\n"])
def test_a_broken_uff58_is_refused(tmp_path, content):
    pytest.importorskip("pyuff")
    file = tmp_path / "hammer.uff"
    file.write_bytes(content)
    with pytest.raises(StabilityError, match=r"hammer\.uff"):
        read_responses(file)


def test_the_command_tells_whose_modes_they_are_and_writes_its_files(tmp_path, capsys):
    folder = tmp_path / "modes"
    words = ["modes", "examples/cases/milling_20000.toml", "-o", str(folder)]
    assert status(*words) == 0
    said = capsys.readouterr().out
    assert said.startswith("100 N move the tool by up to ")
    assert len(said.splitlines()) <= 15
    result = json.loads((folder / "modes.json").read_text())
    first = result["places"][0]
    assert first["unloaded_joints"] == []
    assert first["softest_m_N"] == max(place["softest_m_N"] or 0.0 for place in result["places"])
    names = {file.name for file in folder.iterdir()}
    assert {NPZ, MAT, "modes.json", "report.html"} <= names
    assert status(*words) == 2
    assert "--overwrite" in capsys.readouterr().err


def test_a_robot_alone_needs_a_posture_of_its_joints(tmp_path, capsys):
    for more, said in (
        ([], "--posture-deg"),
        (["--posture-deg", "1,2"], "expected 6 angles"),
        (["--posture-deg", "a,b"], "numbers between commas"),
        (["--posture-deg", "nan,0,0,0,0,0"], "finite"),
        (["--force-n", "1,0,0"], "--posture-deg"),
        (
            ["--posture-deg", "0,0,0,0,0,0", "--force-n", "1e308,0,0"],
            "at most 1e+09 N, got 1e308,0,0",
        ),
    ):
        assert status("modes", "icme2008", *more, "-o", tmp_path / "m") == 2
        assert said in capsys.readouterr().err
    assert not (tmp_path / "m").exists()


def test_both_robots_of_a_cell_are_told(tmp_path, monkeypatch, capsys):
    for name, value in (("_PLACES", 3), ("_GRID", 2)):
        monkeypatch.setattr(f"coupling.modes.analysis.{name}", value)
    case = CASES / "two_robots.toml"
    assert status("modes", case, "-v", "-o", tmp_path / "cell") == 0
    assert capsys.readouterr().out.count("Static compliance") == 2
    support = load_case(case).robots[1]
    place = json.loads((tmp_path / "cell" / "support" / "modes.json").read_text())["places"][0]
    locked = LockedRobot(support.description, support.torque_curve)
    force = np.append(place["force_N"], np.zeros(3))
    modes = PostureModes.of(locked, np.deg2rad(place["posture_deg"]), force)
    expected = [mode["frequency_Hz"] for mode in place["modes"]]
    np.testing.assert_allclose(modes.frequency[:4], expected[:4], rtol=1e-3)
    # The process presses the tools against each other.
    first = json.loads((tmp_path / "cell" / "modes.json").read_text())["places"][0]
    assert np.linalg.norm(place["force_N"]) > 0.05 * np.linalg.norm(first["force_N"]) > 0.0


def test_check_has_two_lines_of_modes(tmp_path, capsys):
    case = "examples/cases/milling_20000.toml"
    assert status("check", "-v", case, "-o", tmp_path / "c.html") == 0
    lines = capsys.readouterr().out.splitlines()
    place = lines.index("Modes")
    assert lines[place + 1].startswith("Lowest modes with locked motors")
    assert "Static compliance up to" in lines[place + 2]

"""Wrenches as functions of time: straight between their rows, with jumps where a time stands twice."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from coupling.errors import ProcessError
from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.inverse.smooth_wrench import SmoothWrench
from coupling.path.contact_spring import ContactSpring
from coupling.path.deviation import measure
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.process.external import ExternalProgram
from coupling.robot.robot_fmu import RobotFmu

REFERENCE = Path(__file__).parents[1] / "reference"


def pushes(time, z) -> WrenchHistory:
    force = np.column_stack([np.zeros((len(z), 2)), z])
    return WrenchHistory.of_forces(np.asarray(time, dtype=float), [force])


def test_a_jump_has_two_sides():
    load = pushes([0.0, 1.0, 1.0, 3.0], [0.0, 2.0, 6.0, 10.0])
    np.testing.assert_array_equal(load.instants, [0.0, 1.0, 3.0])
    np.testing.assert_array_equal(load.jumps, [1.0])
    np.testing.assert_array_equal(load.before[0, :, 2], [0.0, 2.0, 10.0])
    np.testing.assert_array_equal(load.behind[0, :, 2], [0.0, 6.0, 10.0])
    np.testing.assert_allclose(load.at(np.array([0.5, 1.0, 2.0]))[0, :, 2], [1.0, 2.0, 8.0])


@given(st.integers(2, 12), st.integers(0, 2**32 - 1))
def test_more_rows_tell_the_same_force(count, seed):
    """Random corners and jumps: any refined history has the same values and sides, and again."""
    rng = np.random.default_rng(seed)
    corners = np.cumsum(rng.uniform(0.1, 1.0, count))
    time = np.sort(np.concatenate([corners, corners[rng.random(count) < 0.4]]))
    load = pushes(time, rng.normal(size=len(time)))
    more = np.unique(np.concatenate([corners, rng.uniform(corners[0], corners[-1], 30)]))
    fine = load.refined(more)
    np.testing.assert_array_equal(fine.instants, more)
    np.testing.assert_array_equal(fine.jumps, load.jumps)
    rows = np.searchsorted(more, corners)
    np.testing.assert_allclose(fine.before[:, rows], load.before, atol=1e-12)
    np.testing.assert_allclose(fine.behind[:, rows], load.behind, atol=1e-12)
    some = rng.uniform(corners[0], corners[-1], 50)
    np.testing.assert_allclose(fine.at(some), load.at(some), atol=1e-12)
    again = fine.refined(more)
    np.testing.assert_array_equal(again.wrench, fine.wrench)


def test_means_over_steps_keep_their_impulse():
    rng = np.random.default_rng(5)
    time, means = np.cumsum(rng.uniform(0.01, 0.03, 40)), rng.normal(size=(40, 6))
    load = WrenchHistory.of_means(time, means)
    np.testing.assert_array_equal(load.before[0], means)
    steps = np.diff(load.time)[:, None]
    impulse = (0.5 * steps * (load.wrench[0, 1:] + load.wrench[0, :-1])).sum(axis=0)
    np.testing.assert_allclose(
        impulse, (np.diff(time)[:, None] * means[1:]).sum(axis=0), atol=1e-14
    )


@pytest.mark.parametrize(
    ("time", "says"),
    [
        ([0.0, 1.0, 1.0, 1.0], "got 1 s after 1 s in row 4"),
        ([0.0, 2.0, 1.0, 3.0], "got 1 s after 2 s"),
    ],
)
def test_a_time_may_stand_twice_and_never_falls(time, says):
    with pytest.raises(ValueError, match=says):
        pushes(time, np.zeros(4))


def test_a_slope_is_smoothed_to_itself():
    """A straight force has no corner, so that what the links feel is the force: to rounding."""
    smooth = SmoothWrench(pushes([0.0, 1.0], [0.0, 50.0]), 0.004)
    inside = np.linspace(0.05, 0.95, 101)
    np.testing.assert_allclose(smooth(inside)[:, 2], 50.0 * inside, rtol=0, atol=1e-9)


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    robot = load_robot(find_robot("icme2008", Path()))
    return build_fmu(robot, tmp_path_factory.mktemp("fmu") / "R.fmu", BuildOptions("native"))


@pytest.mark.parametrize("curve", ["linear", "backlash"])
def test_a_force_that_jumps_moves_the_robot_as_the_reference_has_it(fmu, curve):
    """2000 N down from 0.1 to 0.3 s, told by six rows: solutions of MuJoCo and a second engine."""
    name = "c_step_nobacklash.csv" if curve == "linear" else "c_step_backlash.csv"
    table = np.genfromtxt(REFERENCE / name, delimiter=",", names=True)
    time = table["time"] if "time" in table.dtype.names else table["t"]
    end = float(time[-1])
    load = pushes([0.0, 0.1, 0.1, 0.3, 0.3, end], [0.0, 0.0, -2000.0, -2000.0, 0.0, 0.0])
    drives = np.tile([0.0, -0.3, 0.5, 0.0, 0.6, 0.0], (2, 1))
    with RobotFmu(fmu, curve) as robot:
        command = JointPath(np.array([0.0, end]), (drives,))
        found = robot.simulate(command, load.refined(time), "dynamic").position[0]
    expected = np.column_stack([table[axis] for axis in "xyz"])
    assert np.abs(found - expected).max() < 1e-7
    assert np.ptp(expected[:, 2]) > 1e-3


def test_a_moving_robot_does_not_ask_how_many_rows_tell_a_force(fmu):
    """A force of corners, 50 ms apart and every 2 ms: the same path to the FMU's tolerance."""
    rng = np.random.default_rng(3)
    corners = np.linspace(0.0, 1.0, 21)
    load = pushes(corners, 400.0 * rng.random(21))
    drives = np.tile([0.0, -0.3, 0.5, 0.0, 0.6, 0.0], (2, 1))
    command = JointPath(np.array([0.0, 1.0]), (drives,))
    with RobotFmu(fmu, "backlash") as robot:
        few = robot.simulate(command, load, "dynamic")
        many = robot.simulate(command, load.refined(np.linspace(0.0, 1.0, 501)), "dynamic")
    # Steps end at other times, and the tolerance of 1e-8 m is one of each.
    assert np.abs(many.position[0, ::25] - few.position[0]).max() < 1e-7
    assert np.ptp(few.position[0, :, 2]) > 1e-4


def test_a_program_says_where_its_force_jumps(tmp_path):
    """Two rows of one time; a third one of it is refused."""
    program = tmp_path / "jumps.py"
    text = (
        "import numpy as np\n"
        "path = np.genfromtxt('path.csv', delimiter=',', names=True)\n"
        "t = np.insert(path['time'], 1, [path['time'][1]] * {extra})\n"
        "z = np.where(np.arange(len(t)) < 2, 0.0, 70.0)\n"
        "rows = np.column_stack([t, 0*z, 0*z, z, 0*z, 0*z, 0*z])\n"
        "np.savetxt('wrench.csv', rows, delimiter=',', header='time,fx,fy,fz,mx,my,mz', comments='')\n"
    )
    pose = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (3, 1))
    path = ToolPath(np.array([0.0, 0.5, 1.0]), pose)
    part = Frame(np.zeros(3), Rotation.from_euler("y", 180.0, degrees=True))
    process = ExternalProgram(
        (sys.executable, str(program)), 60.0, part, "part", tmp_path / "evaluations"
    )
    program.write_text(text.format(extra=1))
    found = process.evaluate(path).wrench
    np.testing.assert_array_equal(found.time, [0.0, 0.5, 0.5, 1.0])
    np.testing.assert_allclose(found.force[0, :, 2], [0.0, 0.0, -70.0, -70.0], atol=1e-12)
    program.write_text(text.format(extra=2))
    with pytest.raises(ProcessError, match=r"two rows of the same time .* got more of 0\.5 s"):
        process.evaluate(path)


def _sprung() -> WrenchHistory:
    """A jump at once, from 1 N to 3 N, beside a spring of 1e5 N/m whose place rises by 2 mm."""
    forces = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 3.0], [0.0, 0.0, 7.0]])
    anchor = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 2e-3]]])
    spring = ContactSpring(anchor, np.tile(1e5 * np.eye(3), (1, 2, 1, 1)))
    plain = WrenchHistory.of_forces(np.array([0.0, 0.0, 1.0]), [forces])
    return replace(plain, spring=spring)


def test_forces_are_added_at_instants_on_both_sides_of_a_jump():
    more = np.array([[[10.0, 0.0, 0.0], [20.0, 0.0, 0.0]]])
    found = _sprung().plus(more).force[0]
    np.testing.assert_allclose(found, [[10, 0, 1], [10, 0, 3], [20, 0, 7]])


def test_springs_told_from_elsewhere_carry_the_same_and_then_nothing():
    pose = np.array([[0.0, 0, 1e-3, 0, 0, 0, 1], [0.0, 0, 1e-3, 0, 0, 0, 1]])
    path = ToolPath(np.array([0.0, 1.0]), pose)
    found = _sprung().on(path)
    # K (anchor - position) = -100 N at first, 100 N at the end.
    np.testing.assert_allclose(found.force[0, :, 2], [1 - 100, 3 - 100, 7 + 100])
    assert found.spring is not None
    np.testing.assert_allclose(found.spring.force(path.position), 0.0)


def test_springs_are_given_at_more_rows_and_cut_with_their_wrenches():
    found = _sprung().refined(np.array([0.0, 0.25, 1.0]))
    assert found.spring is not None
    np.testing.assert_allclose(found.spring.anchor[0, :, 2], [0.0, 5e-4, 2e-3])
    np.testing.assert_allclose(found.force[0, :, 2], [1.0, 3.0, 4.0, 7.0])
    cut = found.until(0.25)
    assert cut.spring is not None
    np.testing.assert_array_equal(cut.time, [0.0, 0.0, 0.25])
    assert cut.spring.anchor.shape == (1, 2, 3)


def test_a_change_counts_what_is_behind_a_jump_too():
    """The same before the jump, 2 N apart behind it, over the larger peak of 7 N."""
    one = replace(_sprung(), spring=None)
    other = WrenchHistory(np.array([0.0, 1.0]), one.wrench[:, [0, 2]])
    assert one.change_from(other) == pytest.approx(2.0 / 7.0)
    assert one.change_from(one) == 0.0
    assert one.scaled(2.0).change_from(one) == pytest.approx(0.5)


def test_the_largest_turn_of_a_deviation_is_the_angle_between_orientations():
    """Of two tools the larger one; about any axis."""
    time, held = np.array([0.0, 1.0, 2.0]), Rotation.from_euler("xyz", [0.3, -1.0, 2.0])
    desired = ToolPath.with_rotation(time, np.zeros((3, 3)), held)
    turned = Rotation.from_rotvec(np.array([0.0, 2.5e-4, 1e-4])[:, None] * [0.6, 0.0, 0.8])
    moved = ToolPath(time, np.hstack([np.zeros((3, 3)), (turned * held).as_quat()]))
    assert measure(moved, desired).largest_turn == pytest.approx(2.5e-4, rel=1e-9)
    both = ToolPath.of_tools([desired, moved])
    other = ToolPath.of_tools([desired, desired])
    assert measure(both, other).largest_turn == pytest.approx(2.5e-4, rel=1e-9)

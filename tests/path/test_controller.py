"""The controller's rows: their times, the motion that they stand for, what the drives can do."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import reference
from hypothesis import given
from hypothesis import strategies as st
from line_case import changed_text
from places import LINE_CASE
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation
from spring_robot import SpringPlanner, SpringRobot, upright

from coupling.case.file import load_case
from coupling.errors import CaseError
from coupling.inverse.joint_limits import JointLimits
from coupling.path.controller import INTERPOLATIONS, Controller, on_cycle
from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath
from coupling.process import ProcessResponse
from coupling.robot.cell import Cell, Member
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.solve.correction import Uncorrected
from coupling.solve.fixed_point import Loop


@given(
    st.floats(-10.0, 1e3),
    st.floats(1e-4, 0.1),
    st.integers(1, 20_000),
    st.sampled_from([0.0, 0.3, 0.999]),
)
def test_rows_cover_the_path_with_one_more_at_most(start, cycle, count, part):
    """Durations of whole cycles get no row more, however they are rounded."""
    end = start + (count + part) * cycle
    rows = Controller(cycle).rows(start, end)
    assert len(rows) == count + 1 + (part > 0.0)
    assert rows[0] == start
    assert rows[-1] >= end
    np.testing.assert_allclose(np.diff(rows), cycle, rtol=1e-6)


def test_sums_of_sample_periods_do_not_add_a_row():
    controller = Controller(0.004)
    assert 0.02 * 1601 / 0.004 > 5 * 1601  # by rounding alone
    for samples in range(1, 8000):
        assert len(controller.rows(0.0, 0.02 * samples)) == 5 * samples + 1
    longer = 1000 * 0.004 * (1.0 + 5e-10)  # taken for rounding, and covered all the same
    assert len(controller.rows(0.0, longer)) == 1001
    assert controller.rows(0.0, longer)[-1] >= longer


@pytest.mark.parametrize("wrong", [{"cycle": 0.0}, {"cycle": np.nan}, {"interpolation": "linear"}])
def test_a_controller_that_cannot_be_is_refused(wrong):
    (key,) = wrong
    with pytest.raises(ValueError, match=f"{key}: expected .*, got"):
        Controller(**wrong)


def sampled(rng: np.random.Generator, period: float) -> JointPath:
    """Return two robots' angles at even samples."""
    time = 1.0 + period * np.arange(20)
    return JointPath(time, (rng.normal(size=(20, 6)), rng.normal(size=(20, 3))))


@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
@given(seed=st.integers(0, 10**6), parts=st.integers(1, 5))
def test_rows_are_the_spline_through_the_angles_where_the_cycle_divides_their_steps(
    interpolation, seed, parts
):
    """Angles, rates and accelerations between the rows, as SciPy has them from the angles alone."""
    rng = np.random.default_rng(seed)
    given_ = sampled(rng, 0.02)
    rows = on_cycle(given_, Controller(0.02 / parts, interpolation))
    assert bool(rows.qd) == (interpolation == "quintic")
    assert len(rows.time) == 19 * parts + 1
    times = np.sort(rng.uniform(given_.time[0], given_.time[-1], 50))
    for own, angles in zip(rows.robots, given_.q, strict=True):
        spline = CubicSpline(given_.time, angles, bc_type="clamped")
        for order, values in enumerate(own.trajectory.at(times)):
            expected = spline(times, order)
            np.testing.assert_allclose(values, expected, atol=1e-9 * np.abs(expected).max())


@given(seed=st.integers(0, 10**6))
def test_samples_closer_than_the_cycle_are_one_motion_whatever_the_interpolation(seed):
    """That through the angles at the rows; what is faster is not in it."""
    rng = np.random.default_rng(seed)
    close = sampled(rng, 0.001)
    cubic, quintic = (on_cycle(close, Controller(0.004, name)) for name in INTERPOLATIONS)
    assert np.array_equal(cubic.q[0], quintic.q[0])
    at_rows = CubicSpline(close.time, close.q[0], bc_type="clamped")(cubic.time)
    np.testing.assert_allclose(cubic.q[0], at_rows, rtol=0, atol=1e-14)
    times = np.linspace(close.time[0], close.time[-1], 50)
    one, two = (rows.robots[0].trajectory.at(times) for rows in (cubic, quintic))
    for a, b in zip(one, two, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9 * np.abs(a).max())


def test_a_row_behind_the_end_leaves_the_motion_before_it_as_it_is():
    time = np.linspace(0.0, 1.0, 11)
    angles = (np.sin(np.pi * time) ** 2)[:, None]
    rows = on_cycle(JointPath(time, (angles,)), Controller(0.03))
    assert rows.time[-1] == pytest.approx(1.02)
    spline = CubicSpline(time, angles, bc_type="clamped")
    late = np.linspace(0.99, 1.0, 20)  # behind the last row but one
    np.testing.assert_allclose(rows.trajectory.at(late)[0], spline(late), rtol=0, atol=1e-14)


def test_forward_kinematics_are_those_of_another_engine(example):
    """MuJoCo's poses without gravity, in the robot's base and in the world of a cell."""
    postures, expected = reference("poses")[:, 1:], reference("a_fk")[:, 1:]
    time = np.arange(float(len(postures)))
    joints = JointPath(time, (postures,))
    planner = InverseKinematics(example, np.zeros(6))
    between = np.sort(np.append(time, time[:-1] + 0.5))
    pose = planner.forward(joints, between).pose[0, ::2]
    np.testing.assert_allclose(pose, expected[:, :7], rtol=0, atol=1e-13)
    turned = Frame(np.array([1.0, 2.0, 3.0]), Rotation.from_euler("z", 0.5 * np.pi))
    cell = Cell((Member("turned", turned, None, planner),))
    x, y, z = expected[:, :3].T
    np.testing.assert_allclose(
        cell.forward(joints, time).position[0],
        np.column_stack([1.0 - y, 2.0 + x, 3.0 + z]),
        rtol=0,
        atol=1e-13,
    )


class NoForce:
    """A process that does nothing."""

    identity = ""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        return ProcessResponse(WrenchHistory.none(path.time))


def test_what_rows_leave_out_of_a_path_is_in_its_correction():
    """A stiff tool that is asked to shake within the cycle goes where its rows say, and says so."""
    time = 0.001 * np.arange(200)
    shake = 1e-3 * np.sin(2.0 * np.pi * time / 0.005) * (time * (0.199 - time)) ** 2 / 0.1**4
    desired = ToolPath(time, upright(np.column_stack([0.1 * time, shake, 0.0 * time])))
    springs = Member("springs", AT_THE_ORIGIN, SpringRobot(np.zeros((3, 3))), SpringPlanner())
    loop = Loop(Cell((springs,)), NoForce(), "quasistatic", controller=Controller(0.004))
    found = Uncorrected().correct(loop, SampledPath.of(desired))
    assert found.converged
    motion = found.joints.trajectory
    np.testing.assert_allclose(found.achieved.position[0], motion.at(time)[0], rtol=0, atol=1e-15)
    missed = found.achieved.position - desired.position
    np.testing.assert_allclose(found.correction[..., :3], missed, rtol=0, atol=1e-15)
    assert np.abs(missed).max() > 1e-4
    assert np.array_equal(found.command.time, Controller(0.004).rows(0.0, time[-1]))


def test_limits_are_the_robots_and_the_controller_lowers_them(example):
    first = replace(example.joints[0], limits=(-1.0, 2.0), max_rate=1.5, max_acceleration=4.0)
    robot = replace(example, joints=(first, *example.joints[1:]))
    own, lowered = JointLimits.of(robot), JointLimits.of(robot, max_acceleration=3.0)
    assert (own.lower[0], own.upper[0], own.rate[0], own.acceleration[0]) == (-1.0, 2.0, 1.5, 4.0)
    for values in (own.upper, -own.lower, own.rate, own.acceleration):
        assert np.all(np.isinf(values[1:]) & (values[1:] > 0.0))
    assert np.array_equal(lowered.acceleration, np.full(6, 3.0))
    assert JointLimits.of(robot, max_acceleration=5.0).acceleration[0] == 4.0


def case_with(tmp_path, *changes: tuple[str, str], tail: str = ""):
    (tmp_path / "case.toml").write_text(changed_text(LINE_CASE, *changes) + tail)
    return load_case(tmp_path / "case.toml")


def test_a_case_says_what_its_controller_takes(tmp_path):
    told = 'cycle_s = 0.012\ninterpolation = "cubic"\nmax_acceleration_rad_s2 = 5.0\n'
    case = case_with(tmp_path, tail=f"\n[controller]\n{told}")
    assert case.controller == Controller(0.012, "cubic", 5.0)
    assert case.resolved["controller"]["max_acceleration_rad_s2"] == 5.0
    assert case_with(tmp_path).controller == Controller(0.004, "quintic")


def test_a_case_that_says_nothing_simulates_the_moving_robot_in_the_native_fmu(tmp_path):
    """Wherever it is: whether there is a compiler makes no difference to what a case means."""
    case = case_with(tmp_path, ('mode         = "quasistatic"\n', ""))
    assert case.mode == "dynamic"
    assert case.fmu == "native" == case.resolved["robot"]["fmu"]


@pytest.mark.parametrize("cycle", ["1e-9", "1e9", "0.0", "nan"])
def test_a_cycle_that_no_controller_has_is_refused(tmp_path, cycle):
    """A mistaken unit would otherwise fill the memory with rows."""
    text = LINE_CASE.read_text() + f"\n[controller]\ncycle_s = {cycle}\n"
    file = tmp_path / "line.toml"
    file.write_text(text)
    with pytest.raises(CaseError, match="controller: cycle_s: expected a"):
        load_case(file)

"""The smooth characteristic curve: shape, monotony, tables, equilibrium and motion."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.interpolate import Akima1DInterpolator
from scipy.optimize import brentq

from coupling.files.robot_file import load_robot, shipped_robots
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot
from elastic_robot.errors import RobotFileError
from elastic_robot.parameters import Parameters
from elastic_robot.robot import ElasticRobot
from elastic_robot.spline_curve import SplineCurve, akima
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand


@given(st.floats(1e3, 1e8), st.floats(1e-6, 1e-2))
def test_default_curve_is_a_dead_band_with_rounded_corners(k, b):
    """0 to B/2, k (|x| - B/2)^2 / (2 B) to 3B/2, then k (|x| - B): rises, and equal to 1e-12 k B."""
    x = np.linspace(-4 * b, 4 * b, 801)
    y = np.abs(x) - b / 2
    shape = np.where(y < 0, 0.0, np.where(y < b, k * y**2 / (2 * b), k * (np.abs(x) - b)))
    parameters = Parameters(
        np.zeros(3), np.array([k]), np.zeros(1), np.array([b]), np.zeros(1), (None,)
    )
    torque = SplineCurve.build(parameters).torque(x[:, None])[:, 0]
    np.testing.assert_allclose(torque, np.sign(x) * shape, rtol=0, atol=1e-12 * k * b)
    assert np.diff(torque).min() >= -1e-12 * k * b


def test_knots_on_the_sharp_corners_are_refused_with_the_angles():
    """The naive choice dips to -0.037 k B beside the corner."""
    b = 1e-4
    angle = b * np.array([-10, -5, -3, -2, -1.5, -1, -0.5, 0, 0.5, 1, 1.5, 2, 3, 5, 10])
    torque = 1e6 * np.sign(angle) * np.maximum(np.abs(angle) - b, 0.0)
    inner = np.linspace(0.5 * b, b, 200)
    assert Akima1DInterpolator(angle, torque)(inner).min() == pytest.approx(
        -0.037 * 1e6 * b, rel=0.01
    )
    with pytest.raises(ValueError, match=r"got a slope of -.* between -0\.0001 and -5e-05 rad"):
        akima(angle, torque)


# A gear that stiffens: soft in the middle, 2.5e6 N m/rad at the ends.
TABLE = (
    "torque_table = [[-3e-3, -6e3], [-1e-3, -1000.0], [-5e-4, -200.0], [-2.5e-4, -60.0], [0.0, 0.0],"
    " [2.5e-4, 60.0], [5e-4, 200.0], [1e-3, 1000.0], [3e-3, 6e3]]"
)


def robot_with(table: str, tmp_path):
    text = shipped_robots()["icme2008"].read_text()
    file = tmp_path / "table.toml"
    first = "origin    = [0.0, 0.0, 0.0]"
    file.write_text(text.replace(first, f"{first}\n{table}", 1))
    return load_robot(file)


def test_a_users_table_is_interpolated(tmp_path):
    robot = robot_with(TABLE, tmp_path)
    assert Robot.from_json(robot.to_json()) == robot
    curve = SplineCurve.build(Parameters.of(robot))
    for angle, torque in robot.joints[0].torque_table:
        x = np.zeros(11)
        x[0] = angle
        assert curve.torque(x)[0] == pytest.approx(torque, rel=1e-12)
    loads = np.zeros(11)
    loads[0] = 523.0
    assert curve.torque(curve.deflection(loads))[0] == pytest.approx(523.0, rel=1e-12)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("torque_table = [[-1.0, -1.0], [0.0, 0.0], [1.0, 1.0]]", ["at least 5"]),
        (TABLE.replace(" 1000.0], [3e-3", " 100.0], [3e-3"), ["0.0005 and 0.001 rad", "rising"]),
        (TABLE.replace("[-5e-4, -2", "[-5e-3, -2"), ["got no rise between -0.001 and -0.005 rad"]),
        (TABLE.replace("-6e3", "-600.0"), ["-0.003 and -0.001 rad"]),
        (TABLE.replace("-1000.0", '"x"'), ["torque_table 2 2", "'x'"]),
    ],
)
def test_a_table_that_does_not_rise_is_refused_with_the_angles(tmp_path, table, words):
    with pytest.raises(RobotFileError) as caught:
        robot_with(table, tmp_path)
    message = str(caught.value)
    assert "joint 1" in message
    assert [word for word in words if word not in message] == []


def arm(**joint) -> Robot:
    link = Body(mass=50.0, com=(1.0, 0.0, 0.0), inertia=(0.0, 0.0, 0.0))
    values = {"stiffness": 1e4, "backlash": 2e-3, "damping": 20.0, **joint}
    axis = Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), link, **values)
    return Robot("arm", (axis,), gravity=(0.0, 0.0, 0.0), tcp_position=(1.0, 0.0, 0.0))


REST = HeldCommand(0.0, np.zeros(1), np.zeros(1), np.zeros(1))


def moment(value: float) -> np.ndarray:
    return np.array([0.0, 0.0, 0.0, 0.0, value, 0.0])


def test_equilibrium_on_the_rounded_corner_is_its_closed_form():
    """k (e - B/2)^2 / (2 B) = M for moments below k B / 2, e = B + M / k above; 0 without load."""
    robot = ElasticRobot(arm(), "spline")
    for value in (1e-3, 1.0, 9.9, -5.0):
        robot.reset(0.0, REST, Load(moment(value)))
        expected = np.sign(value) * (1e-3 + np.sqrt(2 * 2e-3 * abs(value) / 1e4))
        assert robot.deflection()[0] == pytest.approx(expected, rel=1e-9)
    robot.reset(0.0, REST, Load(moment(50.0)))
    assert robot.deflection()[0] == pytest.approx(2e-3 + 50.0 / 1e4, rel=1e-12)
    robot.reset(0.0, REST, Load(moment(0.0)))
    assert robot.deflection()[0] == 0.0


def test_an_arm_that_almost_hangs_in_its_backlash_finds_its_rest_on_the_corner():
    """k (e - B/2)^2 / (2 B) = m g l sin(delta - e) with delta just beyond B/2: a nearly flat curve."""
    hanging = replace(arm(), gravity=(0.0, 0.0, -9.81))
    robot, delta = ElasticRobot(hanging, "spline"), 1.05e-3
    q = np.array([np.pi / 2 - delta])
    robot.reset(0.0, HeldCommand(0.0, q, 0 * q, 0 * q), Load())
    corner, weight = 1e4 / (2 * 2e-3), 50 * 9.81
    expected = brentq(
        lambda e: corner * (e - 1e-3) ** 2 - weight * np.sin(delta - e), 1e-3, delta, xtol=1e-16
    )
    assert robot.deflection()[0] == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("table", [None, "own"])
def test_motion_through_the_gap_agrees_with_another_integrator(table):
    """A swinging moment drives the arm from flank to flank; SciPy's DOP853 at 1e-12 on the same law."""
    points = ((-6e-3, -60.0), (-2e-3, -5.0), (-1e-3, -1.0), (1e-3, 1.0), (2e-3, 5.0), (6e-3, 60.0))
    described = arm(torque_table=points) if table else arm()
    robot = ElasticRobot(described, "spline", tolerance=1e-9)
    curve = SplineCurve.build(Parameters.of(described))
    robot.reset(0.0, REST, Load(moment(0.0)))
    state, step, largest = np.zeros(2), 0.02, 0.0
    for k in range(100):
        load = 30.0 * np.sin(2 * np.pi * 1.5 * k * step)
        robot.step((k + 1) * step, REST, Load(moment(load)))
        state = solve_ivp(
            lambda t, y, load=load: [y[1], (load - 20.0 * y[1] - curve.torque(y[:1])[0]) / 50.0],
            (0.0, step),
            state,
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
        ).y[:, -1]
        largest = max(largest, abs(state[0]))
        assert robot.deflection()[0] == pytest.approx(state[0], abs=1e-8)
    assert largest > 3e-3  # it went well beyond the gap


def test_spline_lies_between_line_and_sharp_corner(example):
    """Sag of the example robot: the smooth gap gives way less than the sharp one, more than none."""
    q = HeldCommand(0.0, np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0]), np.zeros(6), np.zeros(6))
    sag = {}
    for name in ("linear", "spline", "backlash"):
        robot = ElasticRobot(replace(example), name)
        robot.reset(0.0, q, Load())
        sag[name] = robot.deviation()[2]
    assert sag["backlash"] <= sag["spline"] < sag["linear"]

"""The contact that lifts off, in Python and in the C core alike: closed forms, an independent
integrator, and that nothing ever pulls."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from pendulum import held, pendulum
from random_robots import make_robot
from scipy.optimize import brentq
from touching import KINDS, Independent, Touching, onto

from elastic_robot.errors import ElasticRobotError, ParameterError
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load

MASS = 50.0  # [kg], of the pendulum, 1 m from its axis
GEAR = 1e4  # [N m/rad]
FREE = {"gravity": (0.0, 0.0, 0.0), "stiffness": 1e-6}


def run(robot: Touching, load: Load, length: float, steps: int, moves=True) -> list[np.ndarray]:
    """Rows time, x, vz, fx, fy, fz, gap at the ends of equal steps; the plane goes on evenly."""
    rows = []
    for k in range(1, steps + 1):
        robot.step(k * length, load)
        if moves:
            place = load.spring.position + length * load.spring.velocity
            load = replace(load, spring=replace(load.spring, position=place))
        row = [k * length, robot.x()[0], robot.velocity()[2], *robot.force(), robot.gap()]
        rows.append(np.array(row))
    return rows


# Closed forms.


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stiffness", [1e5, 1e7, 1e9])
def test_a_free_mass_is_touched_for_half_a_period_and_leaves_as_fast_as_it_came(kind, stiffness):
    """A plane hits 50 kg at 0.1 m/s: no damping; pi sqrt(m / k) later it has 0.2 m/s."""
    robot, speed, way = Touching(kind, pendulum(**FREE), [0.0], tolerance=1e-9), 0.1, 1e-4
    load = onto(PlaneContact(stiffness), (0.0, 0.0, -way), (0.0, 0.0, speed))
    robot.reset(load)
    half = np.pi * np.sqrt(MASS / stiffness)
    begin, end = way / speed, way / speed + half
    # In the middle of the contact the mass moves with the plane and the spring has all of the energy.
    robot.step(begin + half / 2.0, load)
    deepest = speed * np.sqrt(MASS / stiffness)
    assert -robot.gap() == pytest.approx(deepest, rel=1e-5)
    assert robot.force()[2] == pytest.approx(stiffness * deepest, rel=1e-5)
    place = (0.0, 0.0, -way + speed * (begin + half / 2.0))
    robot.step(end + 1e-3, onto(PlaneContact(stiffness), place, (0.0, 0.0, speed)))
    assert not robot.force().any()
    assert robot.velocity()[2] / np.cos(robot.x()[0]) == pytest.approx(2.0 * speed, rel=2e-5)
    # The mass was met by the plane when it had gone s: z = s + 2 v (t - end) tells when that was.
    met = robot.tcp()[2] - 2.0 * speed * 1e-3
    assert met == pytest.approx(speed * half, rel=2e-5)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("dissipation", "stiffness"), [(0.5, 1e6), (3.0, 1e6), (3.0, 1e9), (30.0, 1e7)]
)
def test_restitution_is_hunts_and_crossleys(kind, dissipation, stiffness):
    """m v v' = -k d (1 + c v) gives c v + c e v = ln(1 + c v) - ln(1 - c e v), whatever m and k.

    What is lost is m v^2 (1 - e^2) / 2.
    """
    speed = 0.1
    robot = Touching(kind, pendulum(**FREE), [0.0], tolerance=1e-9)
    load = onto(PlaneContact(stiffness, dissipation), (0.0, 0.0, -1e-5), (0.0, 0.0, speed))
    robot.reset(load)
    rows = run(robot, load, 1e-3, 60)
    v = dissipation * speed

    def left(e):
        return v + e * v - np.log1p(v) + np.log1p(-e * v)

    restitution = brentq(left, 1e-9, min(1.0, 1.0 / v) * (1.0 - 1e-12), xtol=1e-14)
    _, x, vz, *_ = rows[-1]
    assert vz / np.cos(x) == pytest.approx((1.0 + restitution) * speed, rel=1e-5)
    assert restitution < 0.98


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("quasistatic", [True, False])
def test_static_indentation_shares_the_weight_with_the_gear(kind, quasistatic):
    """k d cos x + c x = m g cos x, the tip at -sin x, the plane 2 mm below the undeflected tip."""
    robot = Touching(kind, pendulum(), [0.0], quasistatic=quasistatic)
    for stiffness in (1e4, 1e6, 1e9):
        for radius in (0.0, 0.05):
            plane = PlaneContact(stiffness, 1.0, radius, 0.3)
            load = onto(plane, (0.0, 0.0, -2e-3 - radius))
            robot.reset(load)

            def torque(x, k=stiffness):
                return (MASS * 9.81 - k * (np.sin(x) - 2e-3)) * np.cos(x) - GEAR * x

            x = brentq(torque, 0.0, 0.1, xtol=1e-16)
            assert robot.x()[0] == pytest.approx(x, abs=1e-13)
            assert robot.force()[2] == pytest.approx(stiffness * (np.sin(x) - 2e-3), rel=1e-6)
            robot.step(0.01, load)  # and stays there
            assert robot.x()[0] == pytest.approx(x, abs=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_a_plane_that_is_not_reached_changes_nothing(kind):
    """Rest and motion are those without a contact, to the tolerance; compliance too."""
    far = onto(PlaneContact(1e8, 1.0, 0.01, 0.3), (0.0, 0.0, -1.0), force=(0.0, 0.0, -100.0))
    found = []
    for load in (far, Load(far.wrench)):
        robot = Touching(kind, pendulum(), [0.0], tolerance=1e-8)
        robot.reset(load)
        start = robot.x()
        robot.step(0.3, replace(load, wrench=np.zeros(6)))
        found.append((start, robot.x()))
    assert found[0][0].tobytes() == found[1][0].tobytes()
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_below_the_friction_limit_the_tool_creeps_and_above_it_it_slides(kind):
    """A plate presses along the arm with N = k d; across it a push F.

    Below mu N the speed goes to v r / sqrt(1 - r^2), r = F / mu N; above, the mass gains F - mu N.
    The gear carries what N turns the arm by.
    """
    slip = 1e-3
    plate = PlaneContact(1e6, 0.0, 0.0, 0.3, slip, np.array([-1.0, 0.0, 0.0]))
    pressure = 1e6 * 1e-4
    limit = plate.friction * pressure
    arm = pendulum(gravity=(0.0, 0.0, 0.0), stiffness=pressure)
    for part in (0.2, 0.9):
        robot = Touching(kind, arm, [0.0], tolerance=1e-10)
        load = onto(plate, (1.0 - 1e-4, 0.0, 0.0), force=(0.0, 0.0, -part * limit))
        robot.reset(Load())
        robot.step(60.0 * MASS * slip / limit, load)
        creep = slip * part / np.sqrt(1.0 - part * part)
        assert robot.velocity()[2] == pytest.approx(-creep, rel=2e-3)
    robot = Touching(kind, arm, [0.0], tolerance=1e-10)
    robot.reset(Load())
    load = onto(plate, (1.0 - 1e-4, 0.0, 0.0), force=(0.0, 0.0, -3.0 * limit))
    speeds = []
    for end in (0.02, 0.04):
        robot.step(end, load)
        speeds.append(robot.velocity()[2])
    gained = -(speeds[1] - speeds[0]) / 0.02
    assert gained == pytest.approx((3.0 * limit - limit) / MASS, rel=2e-2)


# An independent integrator.


@pytest.mark.parametrize("stiffness", [1e5, 1e7, 1e9])
@pytest.mark.parametrize(("dissipation", "friction", "radius"), [(0.0, 0.0, 0.0), (0.5, 0.3, 0.05)])
def test_a_falling_arm_bounces_as_in_an_independent_integrator(
    stiffness, dissipation, friction, radius
):
    """10 mm down on a wall of 1e5 to 1e9 N/m, seen every millisecond: as DOP853 has it, to 1e-6 m."""
    plane = PlaneContact(stiffness, dissipation, radius, friction)
    load, independent = (
        onto(plane, (0.0, 0.0, -0.01 - radius)),
        Independent(pendulum(), np.zeros(1)),
    )
    expected = independent.run(load, np.zeros(1), np.arange(1, 81) * 1e-3)
    assert len(independent.events) == (1 if stiffness == 1e5 else 2)
    for kind in KINDS:
        robot = Touching(kind, pendulum(), [0.0])
        robot.reset(onto(plane, (0.0, 0.0, -0.01 - radius), force=(0.0, 0.0, MASS * 9.81)))
        rows = np.array(run(robot, load, 1e-3, 80))
        np.testing.assert_allclose(rows[:, 1], expected[:, 0], rtol=0, atol=1e-6, err_msg=kind)
        assert rows[:, 5].max() > 1e3


@pytest.mark.parametrize("seed", range(3))
def test_random_robots_touch_and_leave_as_in_an_independent_engine(seed):
    """Three joints, a sphere with friction on a plane that comes and goes: to 1e-9 rad at 1e-10 m."""
    described, rng = make_robot(seed + 20, 3, backlash=0.0), np.random.default_rng(seed)
    q = rng.uniform(-1.0, 1.0, len(described.joints))
    robots = [Touching(kind, described, q, tolerance=1e-10) for kind in KINDS]
    for robot in robots:
        robot.reset(Load())
    normal, start = rng.normal(size=3), robots[0].x()
    n = normal / np.linalg.norm(normal)
    plane = PlaneContact(10.0 ** rng.uniform(5.0, 6.5), 0.5, 0.04, 0.2, 1e-2, normal)
    load = onto(plane, robots[0].tcp() - (0.04 + 2e-5) * n, 0.05 * n + 0.02 * rng.normal(size=3))
    independent = Independent(described, q)
    (expected,) = independent.run(load, start, np.array([0.02]))
    assert independent.events
    for kind, robot in zip(KINDS, robots, strict=True):
        robot.step(0.02, load)
        np.testing.assert_allclose(robot.x(), expected[: robot.m], rtol=0, atol=1e-9, err_msg=kind)


def test_both_kinds_agree_with_backlash():
    """Random robots of 1 to 5 joints with backlash, pressed on a plane and let go: 1e-9 m of each other.

    Every other one is on a spring to the plane's anchor as well.
    """
    touched = 0
    for seed in range(10):
        rng, described = np.random.default_rng(seed), make_robot(seed, 1 + seed % 5)
        q = rng.uniform(-1.0, 1.0, len(described.joints))
        robots = [Touching(kind, described, q, "backlash", tolerance=1e-9) for kind in KINDS]
        for robot in robots:
            robot.reset(Load())
        n = rng.normal(size=3)
        plane = PlaneContact(10.0 ** rng.uniform(5, 7), 0.3, 0.01, 0.2, 1e-2, n)
        n /= np.linalg.norm(n)
        place = robots[0].tcp() - (0.01 + 1e-5) * n
        for end, speed in ((0.004, 0.03), (0.009, -0.02), (0.02, 0.0)):
            length = end - robots[0].python.time
            for robot in robots:
                robot.step(end, onto(plane, place, speed * n, spring=1e4 * (seed % 2)))
            place = place + length * speed * n
            np.testing.assert_allclose(robots[0].tcp(), robots[1].tcp(), rtol=0, atol=1e-9)
            touched += bool(robots[0].force().any())
    assert touched > 10


# What never happens, and what is kept.


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stiffness", [1e5, 1e7, 1e9])
def test_nothing_pulls_and_energy_only_falls(kind, stiffness):
    """Bounces on a floor at steps of 2 and 10 ms, with damping and friction, seen at every step."""
    plane, largest = PlaneContact(stiffness, 0.2, 0.0, 0.2), 0.0
    for length in (2e-3, 1e-2):
        robot = Touching(kind, pendulum(), [0.0], tolerance=1e-9)
        robot.reset(onto(plane, (0.0, 0.0, -5e-3), force=(0.0, 0.0, MASS * 9.81)))
        rows = np.array(run(robot, onto(plane, (0.0, 0.0, -5e-3)), length, int(0.3 / length)))
        _, x, vz, _, _, normal, gap = rows.T
        assert (normal >= 0.0).all()
        assert not normal[gap > 0.0].any()
        depth = np.maximum(0.0, -gap)
        energy = 0.5 * MASS * (vz / np.cos(x)) ** 2 + 0.5 * GEAR * x * x - MASS * 9.81 * np.sin(x)
        energy += 0.5 * stiffness * depth**2
        assert np.diff(np.append(0.0, energy)).max() < 1e-5
        largest = max(largest, normal.max())
    assert largest > 100.0


def test_a_tool_that_is_torn_off_feels_nothing():
    """Faster than 1 / c apart the body springs back more slowly than the tool leaves."""
    plane = PlaneContact(1e6, 2.0)
    gap, fast, slow = np.array([0.0, 0.0, 1e-4]), np.array([0, 0, 0.6]), np.array([0, 0, 0.4])
    assert not plane.force(gap, fast).any()
    assert plane.force(gap, slow)[2] == pytest.approx(1e6 * 1e-4 * 0.2)
    by_place, by_velocity = plane.force_gradient(gap, fast)
    assert not by_place.any()
    assert not by_velocity.any()


def test_error_over_bounces_falls_with_the_tolerance():
    """Five bounces on 1e8 N/m in steps of 10 ms, cut by events: below the tolerance at the TCP."""
    plane, load = PlaneContact(1e8, 0.1), onto(PlaneContact(1e8, 0.1), (0.0, 0.0, -2e-3))
    times = np.arange(1, 21) * 1e-2
    expected = Independent(pendulum(), np.zeros(1)).run(load, np.zeros(1), times)[:, 0]
    for kind, tolerance in itertools.product(KINDS, (1e-6, 1e-8)):
        robot = Touching(kind, pendulum(), [0.0], tolerance=tolerance)
        robot.reset(onto(plane, (0.0, 0.0, -2e-3), force=(0.0, 0.0, MASS * 9.81)))
        rows = np.array(run(robot, load, 1e-2, 20))
        assert np.abs(rows[:, 1] - expected).max() < tolerance, kind


def _slopes(function, at: np.ndarray) -> np.ndarray:
    """Columns of a derivative by differences of four points, of loads of one state."""
    h, columns = 1e-5, []
    for e in h * np.eye(len(at)):
        near, far = function(at + e) - function(at - e), function(at + 2 * e) - function(at - 2 * e)
        columns.append((8.0 * near - far) / (12.0 * h))
    return np.array(columns).T


@pytest.mark.parametrize("seed", range(5))
def test_loads_in_contact_have_the_slopes_that_are_told(seed):
    """By angles and rates, with a moving sphere that presses and rubs: differences of four points."""
    described, rng = make_robot(seed + 40, 2 + seed), np.random.default_rng(seed)
    robot, q = ElasticRobot(described, "linear"), rng.uniform(-1.0, 1.0, 2 + seed)
    normal, speed = rng.normal(size=3), rng.normal(size=3)
    plane = PlaneContact(1e6, 0.5, 0.05, 0.3, 0.1, normal)
    robot.reset(0.0, held(q), Load())
    place = robot.tcp()[:3] + plane.offset + 1e-3 * plane.unit
    dynamics, theta = robot._dynamics, robot.chain.theta(q)
    acting = onto(plane, place, speed).at(0.0)
    rate, still = rng.normal(size=len(theta)), np.zeros((1, len(theta)))
    by = dynamics.load_derivatives(theta[None], rate[None], still, acting)
    by_angle = _slopes(lambda at: dynamics.loads(at[None], rate[None], still, acting)[0], theta)
    by_rate = _slopes(lambda at: dynamics.loads(theta[None], at[None], still, acting)[0], rate)
    for found, slope in ((by.angle[0], by_angle), (by.rate[0], by_rate)):
        scale = np.abs(slope).max(axis=0)
        np.testing.assert_allclose(found / scale, slope / scale, rtol=0, atol=1e-6)


# Refusals.


@pytest.mark.parametrize(
    ("numbers", "said"),
    [
        ({"stiffness": -1.0}, r"contact\.stiffness: expected a number >= 0, got -1\.0"),
        ({"stiffness": np.nan}, r"contact\.stiffness: expected a number >= 0, got nan"),
        ({"stiffness": np.inf}, r"contact\.stiffness: expected a number >= 0, got inf"),
        ({"dissipation": -0.1}, r"contact\.dissipation: expected a number >= 0"),
        ({"radius": -0.1}, r"contact\.radius: expected a number >= 0"),
        ({"friction": -0.1}, r"contact\.friction: expected a number >= 0"),
        ({"slip_speed": -0.1}, r"contact\.slip_speed: expected a number >= 0"),
        (
            {"friction": 0.1, "slip_speed": 0.0},
            r"contact\.slip_speed: expected a number > 0 m/s where",
        ),
        ({"normal": np.zeros(3)}, r"normal of the contact .* not zero, .* got 0, 0, 0"),
    ],
)
def test_numbers_that_are_none_are_refused(numbers, said):
    with pytest.raises(ParameterError, match=said):
        PlaneContact(**({"stiffness": 1e6} | numbers))


@pytest.mark.parametrize("quasistatic", [True, False])
def test_absurd_contacts_are_errors_and_leave_the_state(quasistatic, example):
    """Deep in a wall beyond all measure: a sentence, not a crash, and the robot is where it was."""
    q = held([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
    robot = ElasticRobot(example, "backlash", quasistatic)
    robot.reset(0.0, q, Load())
    before = robot.tcp()
    for height, stiffness in ((1e6, 1e12), (1e200, 1e200), (1e150, 1e300)):
        load = onto(PlaneContact(stiffness), (0.0, 0.0, height))
        with pytest.raises(ElasticRobotError, match=r"contact of"), np.errstate(all="ignore"):
            robot.step(0.01, q, load)
        assert np.array_equal(robot.tcp(), before)

"""A contact spring, and a contact that lifts off, in the native FMU and its core."""

import contextlib

import numpy as np
import pytest
from exchange import exchange_of
from fmpy.fmi1 import FMICallException
from native_core import CURVES, LANES, Core, CoreError, with_settings
from native_derivatives import random_stiffness
from native_fmu import NativeFmu
from pendulum import pendulum
from random_robots import hardly_loaded, make_robot
from scipy.integrate import solve_ivp
from touching import Independent, onto

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.exchange_blocks import all_blocks
from elastic_robot.chain import build_chain
from elastic_robot.dynamics import Dynamics
from elastic_robot.kinematics import base_from_tool, tcp_jacobian
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import ContactSpring, Load, symmetric

KNOWNS = ("wrench", "q_cmd", "qd_cmd", "anchor", "anchor_velocity", "contact", "contact_normal")
KNOWNS = (*KNOWNS, "wrench_rate", "gravity", "stiffness")
OUTPUTS = (
    "velocity",
    "deflection",
    "deflection_rate",
    "contact_force",
    "contact_gap",
    "compliance",
)
# Changes that move a tool in contact by some micrometres in 2 ms.
SIZES = {"wrench": 10.0, "q_cmd": 1e-6, "qd_cmd": 1e-3, "anchor": 1e-6, "anchor_velocity": 1e-3}
POSTURE = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
NONE = np.zeros(6)
UPPER = np.triu_indices(3)
SIZES |= {"contact_normal": 1e-3, "wrench_rate": 100.0, "gravity": 0.1}
CONTACT_SIZES = np.array([1e4, 1e-2, 1e-6, 1e-2, 1e-4])
LENGTH = 0.002


@pytest.mark.parametrize("number", range(12))
def test_derivatives_in_contact_are_slopes(tmp_path, number):
    """By inputs and parameters, of a sphere that strikes a plane or is in it: four-point differences."""
    robot, rng = make_robot(number + 300, 2 + number % 5), np.random.default_rng(number)
    fmu = NativeFmu(build_fmu(robot, tmp_path / "R.fmu", BuildOptions("native")), tmp_path / "fmu")
    of = {
        name: fmu.of([v.name for v in block.variables]) for name, block in all_blocks(robot).items()
    }
    curve = ("linear", "backlash", "spline")[number % 3]
    mode = "quasistatic" if number % 4 == 3 else "dynamic"
    slave = fmu.start(
        fmu.slave(),
        rng.uniform(-1.0, 1.0, len(robot.joints)),
        1e-10,
        torque_curve=curve,
        mode=mode,
    )
    normal, speed = rng.normal(size=3), 0.02 * rng.normal(size=3)
    n = normal / np.linalg.norm(normal)
    numbers = [10.0 ** rng.uniform(5.0, 7.5), 0.5, 0.03, 0.01 + 0.3 * (number % 3 > 0), 1e-3]
    place = np.array(slave.getReal(of["tcp"][:3])) + n * (-0.03 + (1e-5, -1e-5)[number % 2])
    given = {"contact": numbers, "contact_normal": normal, "anchor": place}
    given |= {"anchor_velocity": 0.1 * n + speed, "wrench": np.append(-200.0 * n, np.zeros(3))}
    for name, values in given.items():
        slave.setReal(of[name], [float(value) for value in values])
    start = slave.getFMUState()
    knowns = [k for name in KNOWNS for k in of[name]]
    unknowns = [k for name in OUTPUTS for k in of[name]]
    at_start = np.array(slave.getReal(knowns))

    def outputs(inputs: np.ndarray) -> np.ndarray:
        slave.setFMUState(start)
        slave.setReal(knowns, inputs.tolist())
        slave.doStep(0.0, LENGTH)
        return np.array(slave.getReal(unknowns))

    for name in KNOWNS:
        size = SIZES.get(name, 0.0)
        if name == "contact":
            size = CONTACT_SIZES * [numbers[0] / 1e6, 1.0, 1.0, 1.0, 1.0]
        elif name == "stiffness":
            size = 1e-3 * np.array(slave.getReal(of[name]))
        seed = np.concatenate(
            [rng.normal(size=len(of[k])) * (size if k == name else 0.0) for k in KNOWNS]
        )
        outputs(at_start)
        found = np.array(slave.getDirectionalDerivative(unknowns, knowns, seed.tolist()))
        e = 0.02
        near = outputs(at_start + e * seed) - outputs(at_start - e * seed)
        far = outputs(at_start + 2 * e * seed) - outputs(at_start - 2 * e * seed)
        slopes, first = (8.0 * near - far) / (12.0 * e), 0
        for block in OUTPUTS:
            rows = slice(first, first + len(of[block]))
            first = rows.stop
            scale = np.abs(slopes[rows]).max() + 1e-12
            if block == "contact_gap" and name == "wrench_rate":
                continue  # hardly anything: rounding of the TCP's place
            wrong = np.abs(found[rows] - slopes[rows]).max()
            assert wrong < 3e-5 * scale, (name, block, wrong / scale)
    outputs(at_start)
    assert np.linalg.norm(slave.getReal(of["contact_force"])) > 1.0
    slave.freeInstance()


def _contact(**values: float) -> dict[str, float]:
    return {f"contact.{name}": value for name, value in values.items()}


def test_model_exchange_bounces_as_the_independent_integrator(tmp_path):
    """SciPy integrates the FMU's derivatives and ends at the sign of contact.gap: the same bounce."""
    robot = pendulum(damping=5.0)
    ex = exchange_of(robot, tmp_path).start(
        [0.0], torque_curve="linear", initial_state="undeflected"
    )
    plane, height = PlaneContact(1e6, 0.3, 0.05, 0.2, 1e-2), -0.06
    ex.fmu.enterEventMode()
    ex.set("anchor", [0.0, 0.0, height])
    ex.set("contact", [1e6, 0.3, 0.05, 0.2, 1e-2])
    ex.fmu.newDiscreteStates()
    ex.fmu.enterContinuousTimeMode()

    def motion(t, y):
        ex.fmu.setTime(t)
        ex.state = y
        return ex.derivatives()

    def gap(t, y):
        ex.fmu.setTime(t)
        ex.state = y
        return ex.event_indicators()[-1]

    times, load = np.linspace(0.01, 0.12, 12), onto(plane, (0.0, 0.0, height))
    gap.terminal = True
    y, t, found, events = np.zeros(2), 0.0, [], []
    while True:
        due = times[times > t]
        gap.direction = 1.0 if len(events) % 2 else -1.0
        run = solve_ivp(
            motion,
            (t, times[-1]),
            y,
            "DOP853",
            due,
            events=gap,
            rtol=1e-10,
            atol=1e-12,
            max_step=1e-3,
        )
        found += list(np.array(run.y).T)
        if run.status != 1:
            break
        t, y = float(run.t_events[0][0]), run.y_events[0][0]
        events.append(t)
    independent = Independent(robot, np.zeros(1))
    expected = independent.run(load, np.zeros(1), times)
    assert len(events) == len(independent.events) == 2
    np.testing.assert_allclose(events, independent.events, rtol=0, atol=1e-8)
    np.testing.assert_allclose(np.array(found), expected, rtol=0, atol=1e-7)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("stiffness", -1.0),
        ("stiffness", np.nan),
        ("dissipation", -1e-9),
        ("radius", -0.01),
        ("friction", -0.3),
        ("slip_speed", -0.1),
        ("nz", np.inf),
    ],
)
def test_numbers_out_of_their_range_are_discarded_where_they_are_set(native, capfd, name, value):
    slave = native.started()
    with pytest.raises(FMICallException) as raised:
        native.set(slave, _contact(**{name: value}))
    assert raised.value.status == 2
    assert f"contact.{name}: expected a" in capfd.readouterr().err


def test_absurd_contacts_are_refused_with_a_sentence_and_change_nothing(native, capfd):
    slave = native.started()
    before = slave.getReal(native.outputs)
    for values, said in (
        (_contact(stiffness=1e6, nz=0.0), "normal of the contact"),
        (_contact(stiffness=1e6, friction=0.3, slip_speed=0.0), "where there is friction"),
        (_contact(stiffness=1e300) | {"anchor.z": 1e150}, "a contact of 1e+300 N/m"),
        (_contact(stiffness=1e12) | {"anchor.z": 1e6}, "a contact of 1e+12 N/m"),
    ):
        state = slave.getFMUState()
        native.set(slave, values)
        with pytest.raises(FMICallException):
            slave.doStep(0.0, 0.01)
        assert said in capfd.readouterr().err
        assert slave.getReal(native.outputs) == before
        slave.setFMUState(state)


def test_a_master_that_sets_every_input_to_zero_has_no_contact(native):
    """PathSim and CoFMUPy do so with what is not connected; what is off asks for no normal or speed."""
    zeros = dict.fromkeys(_contact(), 0.0)
    ends = []
    for values in ({}, zeros):
        slave = native.started()
        native.set(slave, values)
        slave.doStep(0.0, 0.01)
        ends.append(slave.getReal(native.outputs))
    assert ends[0] == ends[1]


def test_without_friction_the_slip_speed_does_nothing(native):
    slave, other = native.started(), native.started()
    (height,) = native.get(slave, "tcp.z")
    for one, speed in ((slave, 0.0), (other, 0.1)):
        native.set(one, _contact(stiffness=1e6, slip_speed=speed) | {"anchor.z": height + 1e-5})
        for k in range(3):
            one.doStep(0.01 * k, 0.01)
    assert native.get(slave, "contact.fz")[0] > 1.0
    assert slave.getReal(native.outputs) == other.getReal(native.outputs)


def as_core(load: Load) -> np.ndarray:
    spring = load.spring
    return np.concatenate([load.wrench, spring.position, spring.velocity, spring.stiffness[UPPER]])


@pytest.mark.parametrize("plain", [True, False])
def test_places_and_pulls_are_those_of_pinocchio(plain):
    """The TCP of four states and what a wrench on it adds to their loads, 1 to 8 joints: to 1e-12."""
    rng = np.random.default_rng(0)
    for seed in range(100):
        robot = make_robot(seed + 100 * plain, 1 + seed % 8)
        core, chain = Core(robot, plain), build_chain(robot)
        dynamics = Dynamics(chain, np.array(robot.gravity))
        theta, wrench = rng.normal(size=(LANES, chain.model.nv)), 1e3 * rng.normal(size=(LANES, 6))
        tcp, load = core.pull(theta, wrench, chain.elastic_count)
        for k in range(LANES):
            place = base_from_tool(chain, dynamics.data, theta[k]).translation
            lever = tcp_jacobian(chain, dynamics.data, theta[k])[:, chain.elastic]
            np.testing.assert_allclose(tcp[k], place, rtol=0, atol=1e-13)
            np.testing.assert_allclose(load[k], -wrench[k] @ lever, rtol=0, atol=1e-8)


@pytest.mark.parametrize("kind", ["backlash", "spline"])
def test_lined_up_robots_rest_on_springs_of_all_sizes(example, kind):
    """From 1e-2 to 3e9 N/m: left is an edge's 1e-6 N m, or rounding of the spring's torque."""
    rng, core = np.random.default_rng(1), Core(example)  # some start at a rounded flank's foot
    python = ElasticRobot(example, kind, quasistatic=True)
    dynamics, curve = python._dynamics, python._curve
    for _ in range(1000):
        q, wrench = hardly_loaded(rng, 6)
        with contextlib.suppress(CoreError):  # without a spring not every one has a rest
            core.reset(kind, 0.0, q, wrench, quasistatic=True)
        anchor = core.outputs(11)["tcp"][:3] + 10.0 ** rng.uniform(-6.0, -2.5) * rng.normal(size=3)
        k = random_stiffness(rng) * 10.0 ** rng.uniform(-2.0, 1.5)
        load = Load(wrench, ContactSpring(anchor, np.zeros(3), symmetric(k)))
        core.reset(kind, 0.0, q, as_core(load), quasistatic=True)
        x = core.outputs(11)["x"]
        left = dynamics.static_torque(python.chain.theta(q, x), load.at(0.0)) - curve.torque(x)
        assert np.abs(left).max() < 2e-6 + 1e-13 * np.abs(k).max()


def _spring(core: Core, stiffness: float) -> np.ndarray:
    """A load: a spring in all directions, its anchor above the tool by 10 um."""
    x, y, z = core.outputs(11)["tcp"][:3]
    spring = [
        x,
        y,
        z + 1e-5,
        0.0,
        0.0,
        0.0,
        *(stiffness * np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0])),
    ]
    return np.append(NONE, spring)


def test_newtons_matrices_are_those_of_the_present_spring(example):
    """In steps of one length, whose matrices would serve on."""
    core = Core(example)
    core.reset("linear", 0.0, POSTURE, NONE)
    springs = [_spring(core, k) for k in (0.0, 1e5, 1e5, 1.001e5, 1e8, 0.0)]
    for number in range(60):
        spring = springs[number // 10]
        core.step(0.004 * (number + 1), POSTURE, spring)
        np.testing.assert_array_equal(core.spring_of_matrices(), spring[-6:])


@pytest.mark.parametrize("held_before", [True, False])
def test_a_stiff_spring_takes_steps_as_long_as_a_soft_one(example, held_before):
    """60 ms on 1e8 N/m, at 1e-4 m, in 9 tries; with matrices that leave it out it takes 23."""
    core = with_settings(example, most_tries=9.0, most_tries_per_longest=1e-9)
    core.reset("linear", 0.0, POSTURE, NONE, tolerance=1e-4)
    stiff = _spring(core, 1e8)
    for number, holds in enumerate((held_before, True, True, held_before, True)):
        core.step(0.06 * (number + 1), POSTURE, stiff if holds else NONE)


@pytest.mark.parametrize("plain", [True, False])
@pytest.mark.parametrize("quasistatic", [True, False])
@pytest.mark.parametrize("kind", CURVES)
def test_without_stiffness_an_anchor_changes_no_bit(example, kind, quasistatic, plain):
    rng = np.random.default_rng(2)
    cores, loads = (Core(example, plain), Core(example, plain)), []
    for core in cores:
        core.reset(kind, 0.0, POSTURE, NONE, quasistatic=quasistatic)
    for number in range(40):
        wrench = 300.0 * rng.normal(size=6) * (number % 5 < 3)
        anchor = np.concatenate([rng.normal(size=6), np.copysign(NONE, rng.normal(size=6))])
        q, end = POSTURE + 1e-3 * rng.normal(size=6), 0.004 * (number + 1)
        found = []
        for core, load in zip(cores, (wrench, np.append(wrench, anchor)), strict=True):
            core.step(end, q, load)
            found.append(b"".join(values.tobytes() for values in core.outputs(11).values()))
        assert found[0] == found[1]
        loads.append(found[0])
    assert len(set(loads)) == 40

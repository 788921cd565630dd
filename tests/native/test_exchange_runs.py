"""The robot under FMPy's CVode: references of other engines, closed forms, events."""

import re
from dataclasses import replace

import numpy as np
import pytest
from conftest import reference
from exchange import Exchange, exchange_of
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
from native_pair import Pair
from places import DOCS, REFERENCE

from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot
from elastic_robot.gear_parts import StopElement

TCP = {"2": ["tcp.x", "tcp.y", "tcp.z"], "3": ["tcp.position"]}
CURVES = {"nobacklash": "linear", "backlash": "backlash"}


def _positions(result, fmi: str) -> np.ndarray:
    if fmi == "3":
        return result["tcp.position"]
    return np.column_stack([result[name] for name in TCP["2"]])


def _simulate(pair: Pair, fmi: str, **options):
    folder = pair.folder2 if fmi == "2" else pair.folder3
    return simulate_fmu(
        str(folder),
        fmi_type="ModelExchange",
        solver="CVode",
        output=TCP[fmi],
        record_events=False,
        **options,
    )


@pytest.mark.parametrize(
    ("fmi", "curve", "tolerance"), [("2", "backlash", 1e-9), ("3", "nobacklash", 1e-7)]
)
def test_cvode_follows_the_iso_path_to_1e_6_m(pair, fmi, curve, tolerance):
    """With backlash errors grow 480 times after 9 s, so the solver's tolerance is tighter."""
    expected = reference(f"d_iso_{curve}_10ms")
    motion = str(REFERENCE / "iso_path_joints.npz")
    result = _simulate(
        pair,
        fmi,
        stop_time=float(expected[-1, 0]),
        output_interval=0.01,
        relative_tolerance=tolerance,
        start_values={"trajectory": motion, "torque_curve": CURVES[curve]},
    )
    error = np.abs(_positions(result, fmi) - expected[:, 1:4])
    assert error.max() < 1e-6
    assert error[expected[:, 0] <= 9.0].max() < 3e-7


def test_the_snippet_of_the_page_runs_in_fmpy(pair, monkeypatch, tmp_path, example):
    """An undeflected robot falls into its springs: the same as by co-simulation."""
    build_fmu(example, tmp_path / "ElasticRobot.fmu", BuildOptions("native"))
    monkeypatch.chdir(tmp_path)
    page = (DOCS / "model_exchange.md").read_text()
    names: dict[str, object] = {}
    exec(re.findall(r"```python\n(.*?)```", page, re.DOTALL)[0], names)
    options = {"q_cmd[2]": 0.3, "q_cmd[5]": 0.6, "initial_state": "undeflected"}
    expected = simulate_fmu(
        "ElasticRobot.fmu",
        fmi_type="CoSimulation",
        stop_time=0.5,
        output_interval=0.01,
        start_values=options,
        output=["tcp.z", "deflection[2]"],
    )
    for name in ("tcp.z", "deflection[2]"):
        np.testing.assert_allclose(names["result"][name], expected[name], rtol=0, atol=1e-6)
    assert np.ptp(expected["tcp.z"]) > 1e-3


def test_cvode_follows_the_response_to_a_step_of_the_force(pair):
    """-2000 N on 0.1 <= t < 0.3 s, an input that jumps: with backlash to 1e-8 m."""
    expected = reference("c_step_backlash")
    force = np.array(
        [(0.0, 0.0), (0.1, 0.0), (0.1, -2000.0), (0.3, -2000.0), (0.3, 0.0), (1.0, 0.0)],
        dtype=[("time", float), ("force.z", float)],
    )
    posture = [0.0, -0.3, 0.5, 0.0, 0.6, 0.0]
    start = {f"q_cmd[{i}]": q for i, q in enumerate(posture, start=1)}
    result = _simulate(
        pair,
        "2",
        stop_time=float(expected[-1, 0]),
        output_interval=1e-3,
        relative_tolerance=1e-9,
        start_values=start,
        input=force,
    )
    assert len(result) == len(expected)
    np.testing.assert_allclose(_positions(result, "2"), expected[:, 1:4], rtol=0, atol=1e-8)


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_a_rigid_robot_has_no_states_and_is_moved_all_the_same(example, tmp_path, fmi):
    """Its description is valid without derivatives, and the tool is where the drives put it."""
    rigid = {"stiffness": None, "damping": 0.0, "backlash": 0.0, "tilt": ()}
    robot = replace(example, joints=tuple(replace(joint, **rigid) for joint in example.joints))
    fmu = build_fmu(robot, tmp_path / "Rigid.fmu", BuildOptions("native", fmi=fmi))
    assert validate_fmu(str(fmu)) == []
    options = {"stop_time": 0.02, "output": TCP["2"]}
    one, two = (
        _positions(simulate_fmu(str(fmu), fmi_type=kind, **options), "2")
        for kind in ("ModelExchange", "CoSimulation")
    )
    np.testing.assert_array_equal(one[-1], two[-1])


INERTIA, STIFFNESS, BACKLASH, MOMENT = 2.0, 1e4, 1e-3, 0.5  # [kg m^2, N m/rad, rad, N m]


def _gear() -> Robot:
    """One gear with backlash, without damping and weight."""
    body = Body(mass=10.0, com=(0.0, 0.0, 0.0), inertia=(1.0, 1.5, INERTIA))
    axis = (0.0, 0.0, 1.0)
    joint = Joint((0.0, 0.0, 0.0), axis, body, stiffness=STIFFNESS, backlash=BACKLASH)
    return Robot("gear", joints=(joint,), gravity=(0.0, 0.0, 0.0), tcp_position=(1.0, 0.0, 0.0))


@pytest.fixture
def gear(tmp_path) -> Exchange:
    return exchange_of(_gear(), tmp_path)


def test_a_gear_reaches_and_leaves_its_flank_when_the_closed_form_says(gear):
    """From the middle of the backlash under a moment T: the flank at sqrt(2 I B / T), then a sine."""
    reached = np.sqrt(2.0 * INERTIA * BACKLASH / MOMENT)
    speed, omega = MOMENT / INERTIA * reached, np.sqrt(STIFFNESS / INERTIA)
    sag = MOMENT / STIFFNESS
    # sag (1 - cos) + speed / omega sin is zero again after 2 (pi - atan(speed / (omega sag))).
    left = reached + 2.0 * (np.pi - np.arctan2(speed / omega, sag)) / omega
    result = simulate_fmu(
        str(gear.folder),
        fmi_type="ModelExchange",
        stop_time=left + 0.02,
        output_interval=(left + 0.02) / 50,
        relative_tolerance=1e-10,
        start_values={"moment.z": MOMENT, "initial_state": "undeflected"},
        output=["deflection[1]", "deflection_rate[1]", "joint[1].bend.above"],
    )
    time, x = result["time"], result["deflection[1]"]
    events = np.unique(time[np.isclose(x, BACKLASH, rtol=0, atol=1e-8)])
    np.testing.assert_allclose(events, [reached, left], rtol=1e-6)
    on = (time > reached) & (time < left)
    phase = omega * (time[on] - reached)
    expected = BACKLASH + sag * (1.0 - np.cos(phase)) + speed / omega * np.sin(phase)
    np.testing.assert_allclose(x[on], expected, rtol=0, atol=1e-9)
    assert np.count_nonzero(on) > 10


def test_event_indicators_are_the_ways_to_the_bends_of_the_piece_at_the_last_event(gear):
    """They change sign where a gear leaves its piece, and belong to the next after the event only."""
    exchange = gear.start([0.0], initial_state="undeflected")
    slack = exchange.event_indicators()[0] - BACKLASH
    assert 0.0 < slack < 1e-2 * BACKLASH

    def at(x: float) -> list[float]:
        exchange.state = np.array([x, 0.0])
        *ways, contact = exchange.event_indicators().tolist()
        assert contact == 1.0  # there is none
        return ways

    def completed() -> bool:
        wants_event, terminates = exchange.fmu.completedIntegratorStep()
        assert not terminates
        return wants_event

    assert at(0.4 * BACKLASH) == pytest.approx([1.4 * BACKLASH + slack, 0.6 * BACKLASH + slack])
    assert not completed()
    assert at(BACKLASH + 0.5 * slack)[1] > 0.0
    assert not completed()
    assert at(1.1 * BACKLASH) == pytest.approx([2.1 * BACKLASH + slack, slack - 0.1 * BACKLASH])
    assert completed()
    exchange.fmu.enterEventMode()
    needs, terminates, nominals, values, has_next, _ = exchange.fmu.newDiscreteStates()
    assert not any((needs, terminates, nominals, values, has_next))
    exchange.fmu.enterContinuousTimeMode()
    assert at(1.1 * BACKLASH) == pytest.approx([0.1 * BACKLASH + slack, 1.0])
    assert at(-3.0 * BACKLASH)[0] < 0.0
    exchange.fmu.enterEventMode()  # through the whole backlash at once
    exchange.fmu.newDiscreteStates()
    exchange.fmu.enterContinuousTimeMode()
    assert at(-3.0 * BACKLASH) == pytest.approx([1.0, 2.0 * BACKLASH + slack])
    # The torque is that of the curve wherever the state is, whatever the events were.
    assert at(2.0 * BACKLASH)[1] < 0.0
    np.testing.assert_allclose(exchange.derivatives()[1], -STIFFNESS * BACKLASH / INERTIA)


def test_the_spline_bends_where_its_curvature_jumps(gear):
    """At +-B/2 and +-3B/2 of the rounded backlash; linear nowhere."""
    exchange = gear.start([0.0], torque_curve="spline")
    slack = exchange.event_indicators()[0] - 0.5 * BACKLASH
    assert 0.0 < slack < 1e-2 * BACKLASH
    ways = {0.0: (0.5, 0.5), 1.0: (0.5, 0.5), -1.25: (0.25, 0.75), 2.0: (0.5, None)}
    for x, expected in ways.items():
        exchange.state = np.array([x * BACKLASH, 0.0])
        exchange.fmu.enterEventMode()
        exchange.fmu.newDiscreteStates()
        exchange.fmu.enterContinuousTimeMode()
        said = [1.0 if way is None else way * BACKLASH + slack for way in (*expected, None)]
        assert exchange.event_indicators().tolist() == pytest.approx(said, abs=1e-9)
    linear = Exchange(gear.robot, gear.folder).start([0.0], torque_curve="linear")
    assert linear.event_indicators().tolist() == [1.0, 1.0, 1.0]


def test_kinks_of_a_trajectory_are_time_events(gear, tmp_path):
    """A cubic spline bends at its inner samples; none without a trajectory, or on one parabola."""
    time = [0.0, 0.2, 0.5, 0.6, 1.0]
    rows = np.column_stack([time, [0.0, 0.1, 0.05, 0.2, 0.3]])
    path = tmp_path / "motion.csv"
    np.savetxt(path, rows, delimiter=",", header="time,q1", comments="", fmt="%.17g")
    exchange = gear.start([0.0], trajectory=str(path))
    found, now = [], 0.0
    while True:
        exchange.fmu.enterEventMode()
        *_, has_next, now = exchange.fmu.newDiscreteStates()
        exchange.fmu.enterContinuousTimeMode()
        if not has_next:
            break
        found.append(now)
        exchange.fmu.setTime(now)
    assert found == time[1:-1]


@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.parametrize("curve", ["linear", "backlash"])
def test_cvode_follows_gears_that_slip_and_stick(example, tmp_path, fmi, curve):
    """-2000 N on 0.05 <= t < 0.15 s on a robot with hysteresis: as by co-simulation to 1e-9 m."""
    stops = tuple(StopElement(40.0, angle) for angle in (2e-5, 6e-5, 1.5e-4))
    joints = tuple(replace(j, hysteresis=stops if j.stiffness else ()) for j in example.joints)
    fmu = build_fmu(
        replace(example, joints=joints), tmp_path / "R.fmu", BuildOptions("native", fmi=fmi)
    )
    force = np.array(
        [(0.0, 0.0), (0.05, 0.0), (0.05, -2000.0), (0.15, -2000.0), (0.15, 0.0), (0.3, 0.0)],
        dtype=[("time", float), ("force.z", float)],
    )
    posture = [0.0, -0.3, 0.5, 0.0, 0.6, 0.0]
    start = {f"q_cmd[{i}]": q for i, q in enumerate(posture, start=1)}
    elongations = [f"elongation[{k}]" for k in range(1, 16)]
    found = [
        simulate_fmu(
            str(fmu),
            fmi_type=kind,
            stop_time=0.3,
            output_interval=1e-3,
            relative_tolerance=1e-9,
            start_values={**start, **own, "torque_curve": curve},
            input=force,
            output=["tcp.x", "tcp.z", *elongations],
            record_events=False,
        )
        for kind, own in (("ModelExchange", {}), ("CoSimulation", {"tcp_tolerance": 1e-9}))
    ]
    for name in ("tcp.x", "tcp.z", *elongations):
        np.testing.assert_allclose(found[0][name], found[1][name], rtol=0, atol=1e-9)
    assert np.ptp(found[1]["tcp.z"]) > 1e-3
    assert sum(np.ptp(found[1][name]) > 3e-5 for name in elongations) > 5

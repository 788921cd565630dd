"""Motors in model exchange: their equation, its derivatives, events, CVode against co-simulation."""

import numpy as np
import pytest
from exchange import exchange_of
from exchanged_robot import ExchangedRobot
from fmpy import simulate_fmu
from random_robots import driven, limited, make_robot

from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.fmi.outputs import STATES
from elastic_robot.motion import State
from elastic_robot.motors import MotorState
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

WRENCH = np.array([300.0, -200.0, -400.0, 30.0, 10.0, -20.0])
NAMES = ("tcp.x", "tcp.z", "deflection[1]", "elongation[1]", "motor_angle[3]", "motor_torque[3]")


def rates(rng: np.random.Generator, count: int) -> np.ndarray:
    """Rates that an event takes for motion, [rad/s]."""
    return rng.choice([-1.0, 1.0], count) * rng.uniform(0.05, 0.2, count)


class Setting:
    """A random robot at a random state under random inputs: in the FMU and in the model in Python."""

    def __init__(self, seed: int, joints: int, drive: str, folder, most: float = 1e6) -> None:
        rng = np.random.default_rng(seed)
        self.robot = limited(driven(make_robot(seed, joints), rng), most)
        q, qd = rng.uniform(-1.0, 1.0, (2, joints)) * [[1.0], [0.2]]
        self.exchange = exchange_of(self.robot, folder)
        strings = {"torque_curve": "linear", "initial_state": "undeflected", "drive": drive}
        self.exchange.start(q, **strings)
        torque = rng.normal(size=len(self.exchange.references["torque_cmd"])) * 100.0
        command = {"q_cmd": q, "qd_cmd": qd, "qdd_cmd": rng.normal(size=joints)}
        for name, values in {**command, "wrench": WRENCH, "torque_cmd": torque}.items():
            self.exchange.set(name, values)
        self.model = ExchangedRobot(self.robot, "linear", drive=drive)
        held = HeldCommand(0.0, command["q_cmd"], command["qd_cmd"], command["qdd_cmd"])
        self.model.reset(0.0, held, Load(WRENCH), undeflected=True)
        chain, motors = (
            self.model.chain,
            [joint.drive for joint in self.robot.joints if joint.drive],
        )
        whole = chain.elements.slip_angle, np.array([drive.slip_angle for drive in motors])
        # Some elements are beyond their slip angles: the event takes them back.
        stop, presliding = (angle * rng.uniform(-2.0, 2.0, len(angle)) for angle in whole)
        x, v = 3e-4 * rng.normal(size=chain.elastic_count), rates(rng, chain.elastic_count)
        moving = [i for i, joint in enumerate(self.robot.joints) if joint.drive]
        angle = q[moving] + 1e-3 * rng.normal(size=len(moving))
        rate, integral = rates(rng, len(moving)), 100.0 * rng.normal(size=len(moving))
        self.exchange.state = np.concatenate([x, v, stop, angle, rate, integral, presliding])
        self.settle()
        stop, presliding = (
            np.clip(s, -a, a) for s, a in zip((stop, presliding), whole, strict=True)
        )
        if drive != "ideal":
            state = State(0.0, x, v, stop, MotorState(angle, rate, integral, presliding))
            self.model.put(state, torque)

    def settle(self) -> None:
        """Let elements slip, and stick where they go back, as two events do; stay in event mode."""
        self.exchange.fmu.enterEventMode()
        for _ in range(2):
            self.exchange.fmu.newDiscreteStates()

    def rates(self) -> np.ndarray:
        """What Python has for the derivatives, in the order of the FMU's states."""
        found = [getattr(self.model, state.derivative)() for state in STATES.values()]
        return np.concatenate(found)


@pytest.mark.parametrize("drive", ["servo", "torque"])
@pytest.mark.parametrize(("seed", "joints", "most"), [(3, 2, 1e6), (5, 3, 1e6), (8, 4, 60.0)])
def test_derivatives_are_those_of_python(tmp_path, seed, joints, most, drive):
    """At random states, some of whose elements slip, some of whose servos are at their limit."""
    case = Setting(seed, joints, drive, tmp_path, most)
    expected, found = case.rates(), case.exchange.derivatives()
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12 * scale)
    room = case.exchange.get("torque_room")
    if drive == "servo":
        wanted = case.exchange.get("motor_torque")[: len(room)]
        assert np.all(np.abs(wanted[room < 0.0]) == most)
    else:
        assert np.all(room == 1.0)


def pushed(fmu, kind: str, relative: float, drive: str, curve: str, names):
    """Results of a robot at rest under -400 N along z from 20 to 60 ms."""
    force = np.array(
        [(0.0, 0.0), (0.02, 0.0), (0.02, -400.0), (0.06, -400.0), (0.06, 0.0), (0.15, 0.0)],
        dtype=[("time", float), ("force.z", float)],
    )
    strings = {"drive": drive, "torque_curve": curve}
    return simulate_fmu(
        str(fmu),
        fmi_type=kind,
        stop_time=0.15,
        output_interval=1e-3,
        relative_tolerance=relative,
        start_values={f"q_cmd[{i}]": 0.2 for i in (1, 2, 3)} | {"tcp_tolerance": 1e-11, **strings},
        input=force,
        output=list(names),
        record_events=False,
    )


@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.parametrize("drive", ["servo", "torque"])
@pytest.mark.parametrize("curve", ["linear", "backlash"])
def test_cvode_follows_motors_that_slip_and_stick(tmp_path, fmi, drive, curve):
    """As by co-simulation to 2e-11 rad and m, torques and integrals to 1e-5 N m."""
    robot = driven(make_robot(5, 3), np.random.default_rng(5))
    fmu = build_fmu(robot, tmp_path / "R.fmu", BuildOptions("native", fmi=fmi))
    kinds = ("ModelExchange", "CoSimulation")
    names = (*NAMES, "presliding[3]", "servo_integral[3]")
    found = [pushed(fmu, kind, 1e-11, drive, curve, names) for kind in kinds]
    for name in names:
        limit = 1e-5 if name.startswith(("motor_torque", "servo")) else 2e-11
        np.testing.assert_allclose(found[0][name], found[1][name], rtol=0, atol=limit)
    assert np.ptp(found[1]["presliding[3]"]) > 1e-5
    assert np.ptp(found[1]["elongation[1]"]) > 1e-5


def test_a_servo_at_its_limit_and_along_it_is_followed(tmp_path):
    """Its torque stays at 181 N m, leaves and slides along it; CVode's solutions meet to 1e-10 rad.

    Co-simulation, whose steps do not end where the limit is reached, is 2e-8 rad from them, of 6e-5.
    """
    robot = limited(driven(make_robot(5, 3), np.random.default_rng(5)), 181.0)
    exchange, q = exchange_of(robot, tmp_path), np.full(3, 0.2)
    exchange.start(q, drive="servo", torque_curve="linear")
    for factor in (0.5, 1.5, -1.5):
        exchange.set("servo_integral", [factor * 181.0])
        assert exchange.get("torque_room")[0] == pytest.approx((1.0 - abs(factor)) * 181.0)
    found = [
        pushed(tmp_path / "Robot.fmu", kind, relative, "servo", "linear", NAMES)
        for kind, relative in (
            ("ModelExchange", 1e-9),
            ("ModelExchange", 1e-11),
            ("CoSimulation", 1e-10),
        )
    ]
    assert np.count_nonzero(found[1]["motor_torque[3]"] == 181.0) > 3
    assert np.ptp(found[1]["motor_angle[3]"]) > 6e-5
    for name in ("motor_angle[3]", "deflection[1]"):
        np.testing.assert_allclose(found[0][name], found[1][name], rtol=0, atol=1e-10)
        np.testing.assert_allclose(found[2][name], found[1][name], rtol=0, atol=5e-8)


@pytest.mark.parametrize("drive", ["servo", "torque"])
def test_events_are_where_friction_slips_and_turns_back(tmp_path, drive):
    """Its way to the slip angle changes its sign, the event brings it there; so does a reversal."""
    robot = driven(make_robot(5, 3), np.random.default_rng(5))
    exchange, whole = exchange_of(robot, tmp_path), robot.joints[2].drive.slip_angle
    exchange.start(np.zeros(3), initial_state="undeflected", drive=drive)

    def event(name: str, value: float) -> float:
        exchange.fmu.enterContinuousTimeMode()
        exchange.set(name, [value])
        way = float(exchange.get("motor_slip")[0])
        wanted, _ = exchange.fmu.completedIntegratorStep()
        assert wanted == (way <= 0.0)
        exchange.fmu.enterEventMode()
        exchange.fmu.newDiscreteStates()
        return way

    exchange.fmu.enterEventMode()
    assert event("presliding", 0.5 * whole) == pytest.approx(0.5 * whole, rel=0.03)
    exchange.set("rotor_rate", [0.1])
    assert event("presliding", 1.1 * whole) == pytest.approx(-0.1 * whole, rel=0.1)
    assert exchange.get("presliding")[0] == whole
    assert exchange.get("presliding_derivative")[0] == 0.0
    assert event("rotor_rate", -0.1) < 0.0
    assert exchange.get("presliding_derivative")[0] == -0.1

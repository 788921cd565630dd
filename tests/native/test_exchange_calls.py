"""Calls of model exchange: when they may be made, what is refused, states that go back bit for bit."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from exchange import Exchange
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model, FMU3Slave
from native_fmu import POSTURE
from native_pair import Pair

Model = FMU2Model | FMU3Model
Call = Callable[[Model], Any]
STATES = 22  # of the example robot
INDICATORS = 11  # two of each gear, one of the contact


def _vector(count: int):
    return np.ctypeslib.as_ctypes(np.zeros(count))


def _update(model: Model) -> Any:
    return (
        model.newDiscreteStates() if isinstance(model, FMU2Model) else model.updateDiscreteStates()
    )


def _derivatives(model: Model) -> Any:
    two = isinstance(model, FMU2Model)
    getter = model.getDerivatives if two else model.getContinuousStateDerivatives
    return getter(_vector(STATES), STATES)


# The modes in which the standards allow each call (FMI 2.0.5, 3.2.3; FMI 3.0.2, 3.2); more masters than
# one read nominals in initialisation mode, which changes nothing.  FMI 2 has event mode entered from
# event mode as well, FMI 3 from continuous-time mode alone.
AFTER, SHOWN = {"event", "continuous"}, {"initialising", "event", "continuous", "terminated"}
ALL = SHOWN | {"instantiated"}
CALLS: dict[str, tuple[Call, set[str]]] = {
    "enter event mode": (lambda m: m.enterEventMode(), AFTER),
    "update discrete states": (_update, {"event"}),
    "enter continuous-time mode": (lambda m: m.enterContinuousTimeMode(), {"event"}),
    "complete a step": (lambda m: m.completedIntegratorStep(), {"continuous"}),
    "set the time": (lambda m: m.setTime(0.0), AFTER),
    "set states": (lambda m: m.setContinuousStates(_vector(STATES), STATES), {"continuous"}),
    "get states": (lambda m: m.getContinuousStates(_vector(STATES), STATES), SHOWN),
    "get derivatives": (_derivatives, SHOWN),
    "get event indicators": (
        lambda m: m.getEventIndicators(_vector(INDICATORS), INDICATORS),
        SHOWN,
    ),
    "get nominals": (lambda m: m.getNominalsOfContinuousStates(_vector(STATES), STATES), ALL),
    "enter initialisation mode": (lambda m: m.enterInitializationMode(), {"instantiated"}),
    "exit initialisation mode": (lambda m: m.exitInitializationMode(), {"initialising"}),
}
MODES: dict[str, list[Call]] = {
    "instantiated": [],
    "initialising": [lambda m: m.enterInitializationMode()],
    "event": [lambda m: m.enterInitializationMode(), lambda m: m.exitInitializationMode()],
}
MODES["continuous"] = [*MODES["event"], _update, lambda m: m.enterContinuousTimeMode()]
MODES["terminated"] = [*MODES["continuous"], lambda m: m.terminate()]


def _model(pair: Pair, fmi: str) -> Model:
    two = fmi == "2"
    folder = pair.folder2 if two else pair.folder3
    model = (FMU2Model if two else FMU3Model)(
        guid=pair.guid2 if two else pair.description.guid,
        unzipDirectory=str(folder),
        modelIdentifier="ElasticRobot",
        instanceName="robot",
    )
    model.instantiate()
    return model


def _bytes(model: Model) -> bytes:
    if isinstance(model, FMU3Model):
        return bytes(model.serializeFMUState(model.getFMUState()))
    return bytes(model.serializeFMUstate(model.getFMUstate()))


def _refused(capfd, sentence: str, call: Callable[[], Any]) -> None:
    with pytest.raises(FMICallException):
        call()
    assert sentence in capfd.readouterr().err


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_calls_are_allowed_where_the_standard_says_so(pair, capfd, fmi, mode):
    """And else refused with a sentence, and nothing changed."""
    for name, (call, modes) in CALLS.items():
        model = _model(pair, fmi)
        for step in MODES[mode]:
            step(model)
        if mode in modes - ({"event"} if (fmi, name) == ("3", "enter event mode") else set()):
            call(model)
        else:
            before = _bytes(model)
            with pytest.raises(FMICallException):
                call(model)
            assert "expected" in capfd.readouterr().err, name
            assert _bytes(model) == before, name
        model.freeInstance()


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_an_instance_is_of_one_kind(pair, capfd, fmi):
    """No steps in model exchange, no integration in co-simulation; nor do states change their kind."""
    slave, model = pair.fmi2() if fmi == "2" else pair.fmi3(), _model(pair, fmi)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    for step in MODES["continuous"]:
        step(model)
    model.component, slave.component = slave.component, model.component
    for name, (call, _) in CALLS.items():
        if "initialisation" not in name:
            _refused(capfd, "this instance was made for co-simulation", partial(call, model))
    _refused(capfd, "this instance was made for model exchange", lambda: slave.doStep(0.0, 0.01))
    data = _bytes(model)
    _refused(
        capfd,
        "expected one of model exchange, got one of co-simulation",
        lambda: _restore(slave, data),
    )


def _restore(model: Any, data: bytes) -> None:
    if isinstance(model, FMU3Slave):
        model.setFMUState(model.deserializeFMUState(data))
    else:
        model.setFMUstate(model.deSerializeFMUstate(data))


@pytest.fixture
def exchange(example, pair) -> Exchange:
    return Exchange(example, pair.folder2)


def test_quasistatic_mode_has_no_states_and_is_refused(exchange, capfd):
    _refused(
        capfd,
        "mode: expected dynamic in model exchange, got quasistatic",
        lambda: exchange.start(mode="quasistatic"),
    )
    exchange.fmu.reset()
    exchange.start()
    assert np.abs(exchange.derivatives()).max() < 1e-6


def test_what_cannot_be_is_refused_and_changes_nothing(exchange, capfd):
    exchange.start()
    state, fmu = exchange.state, exchange.fmu
    for sentence, call in (
        ("continuous states: expected 22 values, got 21", lambda: _set(exchange, state[:21])),
        ("continuous state 5: expected a finite", lambda: _set(exchange, _with_nan(state, 4))),
        ("time: expected a finite number, got nan s", lambda: fmu.setTime(float("nan"))),
        ("event indicators: expected 11 values", lambda: fmu.getEventIndicators(_vector(9), 9)),
        ("derivatives of continuous states: expected", lambda: fmu.getDerivatives(_vector(1), 1)),
        ("tcp.x is an output and cannot be set", lambda: exchange.set("tcp", [0.0] * 7)),
        (
            "der(deflection[1]) is computed and cannot be set",
            lambda: exchange.set("deflection_derivative", [0.0] * 11),
        ),
        (
            "expected event mode before a parameter changes, got continuous-time mode",
            lambda: exchange.set("gravity", [0.0, 0.0, -1.62]),
        ),
        ("force.x: expected a finite number", lambda: exchange.set("wrench", [np.nan] * 6)),
        (
            "derivative: expected an input, a tunable parameter, time or, behind initialisation, a",
            lambda: exchange.jacobian(["tcp"], "tcp"),
        ),
    ):
        _refused(capfd, sentence, call)
    np.testing.assert_array_equal(exchange.state, state)
    exchange.set("anchor_stiffness", [-1e5, 0.0, 0.0, 0.0, 0.0, 0.0])
    _refused(capfd, "contact spring (anchor.kxx to anchor.kzz): expected no", exchange.derivatives)
    exchange.set("anchor_stiffness", [0.0] * 6)
    assert np.abs(exchange.derivatives()).max() < 1e-6


def _set(exchange: Exchange, values: np.ndarray) -> None:
    exchange.state = values


def _with_nan(values: np.ndarray, place: int) -> np.ndarray:
    changed = values.copy()
    changed[place] = np.nan
    return changed


def test_parameters_change_at_events_and_act_at_once(exchange, capfd):
    """Weight that vanishes leaves the springs' torque: x'' jumps; a stiffness of zero is refused."""
    exchange.start()
    exchange.fmu.enterEventMode()
    exchange.set("gravity", [0.0, 0.0, 0.0])
    assert np.abs(exchange.derivatives()).max() > 1.0
    exchange.set("gravity", [0.0, 0.0, -9.81])
    assert np.abs(exchange.derivatives()).max() < 1e-6
    stiffness = exchange.get("stiffness")
    _refused(
        capfd,
        "joint[1].stiffness: expected a number > 0",
        lambda: exchange.set("stiffness", [0.0, *stiffness[1:]]),
    )
    np.testing.assert_array_equal(exchange.get("stiffness"), stiffness)
    assert np.abs(exchange.derivatives()).max() < 1e-6


def test_states_and_time_may_be_set_as_variables_too(exchange):
    """As CasADi does, in event mode, where it stays."""
    exchange.start()
    exchange.fmu.enterEventMode()
    rng = np.random.default_rng(0)
    x, v = 1e-3 * rng.normal(size=11), 0.1 * rng.normal(size=11)
    exchange.set("deflection", x)
    exchange.set("deflection_rate", v)
    np.testing.assert_array_equal(exchange.state, [*x, *v])
    found = exchange.get("deflection_derivative", "rate_derivative")
    exchange.fmu.enterContinuousTimeMode()
    exchange.state = np.zeros(22)
    exchange.state = np.array([*x, *v])
    np.testing.assert_array_equal(exchange.derivatives(), found)


def test_saved_states_go_back_bit_for_bit_within_and_between_instances(example, pair):
    one, other = (Exchange(example, pair.folder2).start() for _ in range(2))
    rng = np.random.default_rng(0)
    one.fmu.setTime(0.25)
    one.set("wrench", 1e3 * rng.normal(size=6))
    one.state = 1e-3 * rng.normal(size=22)
    one.fmu.enterEventMode()
    one.fmu.newDiscreteStates()

    def everything(exchange: Exchange) -> list[float]:
        shown = exchange.get("time", "q_cmd", "wrench", "tcp", "velocity", "bend")
        return [*shown, *exchange.state, *exchange.derivatives(), *exchange.event_indicators()]

    saved, expected = one.fmu.getFMUstate(), everything(one)
    data = one.fmu.serializeFMUstate(saved)
    one.fmu.enterContinuousTimeMode()
    one.state = np.zeros(22)
    one.fmu.setTime(0.5)
    one.set("wrench", [0.0] * 6)
    one.fmu.enterEventMode()
    one.fmu.newDiscreteStates()
    assert everything(one) != expected
    one.fmu.setFMUstate(saved)
    assert everything(one) == expected
    other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(data))
    assert everything(other) == expected
    one.fmu.freeFMUstate(saved)


def test_a_step_past_the_trajectory_is_refused_but_an_integrator_may_look_there(
    exchange, capfd, tmp_path
):
    path = tmp_path / "motion.csv"
    rows = np.column_stack([[0.0, 0.5, 1.0], *np.tile(POSTURE, (3, 1)).T])
    header = "time,q1,q2,q3,q4,q5,q6"
    np.savetxt(path, rows, delimiter=",", header=header, comments="")
    exchange.start(trajectory=str(path))
    exchange.fmu.setTime(1.0)
    assert exchange.fmu.completedIntegratorStep() == (False, False)
    exchange.fmu.setTime(1.001)
    assert np.abs(exchange.derivatives()).max() < 1e-6
    _refused(
        capfd,
        "time: expected 0 to 1 s, the trajectory's, got 1.001 s",
        exchange.fmu.completedIntegratorStep,
    )


def test_both_versions_of_fmi_say_the_same(example, pair):
    """States, derivatives, indicators and a directional derivative, bit for bit."""
    two, three = Exchange(example, pair.folder2), _model(pair, "3")
    two.start(np.zeros(6))
    for step in MODES["continuous"]:
        step(three)
    rng = np.random.default_rng(1)
    state, wrench = 1e-3 * rng.normal(size=22), 1e3 * rng.normal(size=6)
    two.state = state
    two.set("wrench", wrench)
    three.setContinuousStates(np.ctypeslib.as_ctypes(state), STATES)
    names = [pair.references[name] for name in ("force", "moment")]
    three.setFloat64(names, wrench.tolist())
    for getter, count, expected in (
        (three.getContinuousStates, STATES, two.state),
        (three.getContinuousStateDerivatives, STATES, two.derivatives()),
        (three.getEventIndicators, INDICATORS, two.event_indicators()),
        (three.getNominalsOfContinuousStates, STATES, two.nominals()),
    ):
        values = np.zeros(count)
        getter(np.ctypeslib.as_ctypes(values), count)
        np.testing.assert_array_equal(values, expected)
    unknown = [pair.references["der(deflection_rate)"]]
    found = three.getDirectionalDerivative(
        unknown, [pair.references["deflection"]], [1.0, *[0.0] * 10], 11
    )
    expected = two.jacobian(["rate_derivative"], "deflection")[:, 0]
    np.testing.assert_array_equal(found, expected)

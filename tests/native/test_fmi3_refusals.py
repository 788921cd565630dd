"""What FMI 3.0 alone has to refuse; the rest: test_life_cycle.py and tests/fmu/hosts/clauses.py."""

from __future__ import annotations

import pytest
from fmpy.fmi1 import FMICallException

STEP = 0.004  # [s]
NAN = float("nan")

REFUSED = {
    "too few values": (
        lambda p, s: s.setFloat64([p.references["force"]], [1.0, 2.0]),
        "values: expected one for each of 3 elements, got 2",
    ),
    "too many values": (
        lambda p, s: s.setFloat64([p.references["force"], p.references["q_cmd"]], [0.0] * 10),
        "expected one for each of 9 elements, got 10",
    ),
    "no room": (
        lambda p, s: s.getFloat64([p.references["tcp.position"]]),
        "expected one for each of 3 elements, got 1",
    ),
    "element of an array": (
        lambda p, s: s.getFloat64([p.references["force"] + 1]),
        "the value reference 1 is asked for as a Float64 variable; this FMU has none there",
    ),
    "behind all variables": (
        lambda p, s: s.getFloat64([p.references["time"] + 1]),
        "asked for as a Float64 variable; this FMU has none there",
    ),
    "often the same": (
        lambda p, s: s.setFloat64([p.references["q_cmd"]] * 200, [0.0] * 1200),
        "in one call, got 1200",
    ),
    "spring": (
        lambda p, s: p.set(s, "anchor.stiffness", [1e5, NAN, 0.0, 1e5, 0.0, 0.0]),
        "anchor.kxy: expected a finite number, got nan N/m",
    ),
    "time": (lambda p, s: p.set(s, "time", [1.0]), "value reference of a real variable: expected"),
    "event mode": (
        lambda p, s: s.enterEventMode(),
        "model exchange is asked for; this instance was made for co-simulation",
    ),
    "derivative's seed": (
        lambda p, s: s.getDirectionalDerivative(*p.pick("tcp.position", "force"), [1.0], 3),
        "expected one for each of 3 elements, got 1",
    ),
    "derivative of an input": (
        lambda p, s: s.getDirectionalDerivative(*p.pick("force", "force"), [1.0] * 3, 3),
        "expected an output",
    ),
    "adjoint derivative": (
        lambda p, s: s.getAdjointDerivative(*p.pick("tcp.position", "force"), [1.0] * 3),
        "this FMU has directional ones",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_refused_call_says_why_and_changes_nothing(pair, capfd, name):
    call, sentence = REFUSED[name]
    slave = pair.started()
    before = pair.everything(slave)
    with pytest.raises(FMICallException):
        call(pair, slave)
    assert sentence in capfd.readouterr().err
    assert pair.everything(slave) == before
    slave.doStep(0.0, STEP)


def test_a_spring_that_pushes_away_is_refused_at_the_step(pair, capfd):
    """And only there, since the six entries may be set one after another."""
    slave, twin = pair.started(), pair.started()
    pair.set(slave, "anchor.stiffness", [0.0, 0.0, 2e5, 0.0, 0.0, 0.0])
    with pytest.raises(FMICallException):
        slave.doStep(0.0, STEP)
    said = capfd.readouterr().err
    assert "(anchor.kxx to anchor.kzz): expected no eigenvalue below 0, got -200000" in said
    assert pair.get(slave, "tcp.position") == pair.get(twin, "tcp.position")
    # Rounding is no matter: a spring along one axis.
    axis = [0.1, 0.7, -0.3]
    entries = [1e5 * axis[i] * axis[j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))]
    for one in (slave, twin):
        pair.set(one, "anchor.stiffness", entries)
        one.doStep(0.0, STEP)
    assert pair.everything(slave) == pair.everything(twin)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"token": "{0}"}, "GUID: expected that of this FMU's modelDescription.xml, {"),
        ({"eventModeUsed": True}, "event mode is asked for; this FMU has none"),
        ({"requiredIntermediateVariables": [0]}, "intermediate variables are asked for"),
    ],
)
def test_an_instance_that_cannot_be_is_refused_with_a_sentence(pair, capfd, options, sentence):
    with pytest.raises(Exception, match="Failed to instantiate"):
        pair.fmi3(**options)
    assert sentence in capfd.readouterr().err


def test_sentences_go_to_the_masters_log_where_it_is_on(pair, capfd):
    said = []
    slave = pair.fmi3(loggingOn=True, logMessage=lambda *message: said.append(message))
    with pytest.raises(FMICallException):
        slave.doStep(0.0, STEP)
    assert len(said) == 1
    assert said[0][2] == b"logStatusError"
    assert b"expected initialisation's end before a step" in said[0][3]
    assert "initialisation" not in capfd.readouterr().err

"""What FMI 3.0 alone has to refuse; what both refuse stands in tests/fmu."""

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

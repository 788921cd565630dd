"""The native FMU of FMI 3.0, arrays or scalars, is the one of FMI 2.0; what it alone has to refuse."""

import re
from operator import attrgetter
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelVariable
from native_derivatives import random_stiffness
from native_pair import make_pair
from places import DOCS
from random_robots import make_robot

from build_fmu import main
from coupling.errors import BuildError
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.exchange_blocks import all_blocks
from coupling.fmu_export.grouping import arrays

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


def test_variables_are_those_of_fmi2_with_arrays(pair):
    found = {v.name: (v.shape or (), v.unit) for v in pair.description.modelVariables}
    expected = {
        "force": ((3,), "N"),
        "moment": ((3,), "N.m"),
        "q_cmd": ((6,), "rad"),
        "qd_cmd": ((6,), "rad/s"),
        "qdd_cmd": ((6,), "rad/s2"),
        "anchor.position": ((3,), "m"),
        "anchor.velocity": ((3,), "m/s"),
        "anchor.stiffness": ((6,), "N/m"),
        "tcp.position": ((3,), "m"),
        "tcp.orientation": ((4,), "1"),
        "tcp.velocity": ((3,), "m/s"),
        "rigid.position": ((3,), "m"),
        "rigid.orientation": ((4,), "1"),
        "deviation.position": ((3,), "m"),
        "deviation.rotation": ((3,), "rad"),
        "compliance": ((6,), "m/N"),
        "deflection": ((11,), "rad"),
        "gravity": ((3,), "m/s2"),
        "joint[3].tilt[2].stiffness": ((), "N.m/rad"),
        "time": ((), "s"),
        "trajectory": ((), None),
    }
    assert {name: found[name] for name in expected} == expected


@pytest.mark.parametrize("joints", [1, 3, 7])
def test_each_element_is_in_one_array_with_one_range_unit_and_nominal(joints):
    """What an array states once must hold for all of its elements, on any robot."""
    table = all_blocks(make_robot(4, joints))
    groups = [group for block in arrays(table).values() for group in block]
    elements = [v for group in groups for v in group.elements]
    assert elements == [v for block in table.values() for v in block.variables]
    for group in groups:
        assert elements[group.reference] is group.elements[0]
        assert len({(v.unit, v.nominal, v.start is None) for v in group.elements}) == 1


def test_start_values_are_those_of_fmi2(pair):
    """Read from a fresh instance, as the core has them, and from both descriptions."""
    slave = pair.fmi3()
    scalars = fmpy.read_model_description(str(pair.folder2)).modelVariables
    stated = {v.valueReference: float(v.start) for v in scalars if v.type == "Real" and v.start}
    for variable in pair.description.modelVariables:
        if variable.type != "Float64" or variable.start is None:
            continue
        text = variable.start if isinstance(variable.start, str) else " ".join(variable.start)
        start = [float(value) for value in text.split()]
        first = variable.valueReference
        assert start == [stated[first + k] for k in range(len(start))]
        assert start == pair.get(slave, variable.name)


@pytest.mark.parametrize("arrays", [False, True])
@pytest.mark.parametrize(("seed", "joints"), [(2, 1), (5, 3), (8, 7)])
def test_all_reals_and_derivatives_are_bit_for_bit_those_of_fmi2(tmp_path, seed, joints, arrays):
    """Random robots under random commands, loads and springs; gravity changes, a step is taken back."""
    robot, rng = make_robot(seed, joints), np.random.default_rng(seed)
    pair = make_pair(robot, tmp_path, arrays)
    table = {
        name: [pair.scalars[v.name] for v in block.variables]
        for name, block in all_blocks(robot).items()
    }
    inputs = [
        name
        for name, block in all_blocks(robot).items()
        if block.causality == "input" and not name.startswith("contact")  # there is none
    ]
    two, three = pair.fmi2(), pair.fmi3()

    def put(name: str, values: np.ndarray) -> None:
        two.setReal(table[name], values.tolist())
        three.setFloat64(pair.arrays_of(table[name])[0], values.tolist())

    two.setupExperiment(startTime=0.5, tolerance=1e-7)
    two.enterInitializationMode()
    three.enterInitializationMode(startTime=0.5, tolerance=1e-7)
    q, time = 0.3 * rng.normal(size=joints), 0.5
    put("q_cmd", q)
    for slave in (two, three):
        slave.exitInitializationMode()
    tool = np.array(two.getReal(table["tcp"][:3]))
    for k in range(12):
        rate = rng.normal(size=joints)
        q = q + STEP * rate
        put("wrench", 100.0 * rng.normal(size=6))
        put("wrench_rate", 1e4 * rng.normal(size=6))
        put("q_cmd", q)
        put("qd_cmd", rate)
        put("qdd_cmd", rng.normal(size=joints))
        put("anchor", tool + 1e-3 * rng.normal(size=3))
        put("anchor_velocity", 0.1 * rng.normal(size=3))
        put("anchor_stiffness", random_stiffness(rng) * (k % 3 > 0))
        if k == 6:
            put("gravity", np.array([3.0, 1.0, -9.0]))
            state = three.getFMUState()
            three.doStep(time, 0.5 * STEP)
            three.setFMUState(state)
        two.doStep(time, STEP)
        assert three.doStep(time, STEP) == (False, False, False, time + STEP)
        time += STEP
        assert pair.everything(three) == two.getReal(list(range(pair.scalars["trajectory"])))
    assert three.getFloat64([pair.references["time"]]) == [time]
    outputs, knowns = (
        [k for name in names for k in table[name]]
        for names in (("tcp", "velocity", "deflection"), inputs)
    )
    along = rng.normal(size=len(knowns)).tolist()
    expected = two.getDirectionalDerivative(outputs, knowns, along)
    unknowns, count = pair.arrays_of(outputs)
    found = three.getDirectionalDerivative(unknowns, pair.arrays_of(knowns)[0], along, count)
    assert found == expected
    assert np.count_nonzero(expected) > 6


def test_the_snippet_of_the_page_runs_in_fmpy(pair, example, tmp_path, monkeypatch):
    """As stepped by hand with the force at each step's start, to the rounding of FMPy's times."""
    options = BuildOptions("native", fmi="3", arrays=True)
    build_fmu(example, tmp_path / "ElasticRobot3.fmu", options)
    monkeypatch.chdir(tmp_path)
    page = (DOCS / "native.md").read_text()
    (snippet,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict[str, np.ndarray] = {}
    exec(snippet, names)
    result, slave, size = names["result"], pair.started(), 1 / 128
    assert result["tcp.position"].shape == (129, 3)
    for k in range(128):
        pair.set(slave, "force", [0.0, 0.0, -1000.0 * k * size])
        slave.doStep(k * size, size)
        found = [*result["tcp.position"][k + 1], *result["tcp.orientation"][k + 1]]
        expected = pair.get(slave, "tcp.position", "tcp.orientation")
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


@pytest.fixture(scope="module")
def described(example, tmp_path_factory) -> dict[str, Path]:
    """Folders of the robot in both versions of FMI."""
    pair = make_pair(example, tmp_path_factory.mktemp("scalars"), arrays=False)
    return {"2": pair.folder2, "3": pair.folder3}


def variables(folder: Path) -> list[ModelVariable]:
    return fmpy.read_model_description(str(folder)).modelVariables


def test_variables_are_those_of_fmi2_to_the_reference_unit_and_start(described):
    """Time, the independent variable, is the last one."""

    def told(fmi: str) -> dict[str, tuple]:
        common = attrgetter(
            *("valueReference", "causality", "variability", "initial", "unit", "min", "max"),
            *("nominal", "description"),
        )
        kinds = {"Real": "Float64"}  # by their names in FMI 3
        return {
            v.name: (*common(v), kinds.get(v.type, v.type), str(v.start), v.shape or None)
            for v in variables(described[fmi])
        }

    two, three = told("2"), told("3")
    assert three["time"][:2] == (len(two) - 1, "independent")
    assert three == two
    text = (described["3"] / "modelDescription.xml").read_text()
    assert "<Dimension" not in text


def test_what_outputs_and_derivatives_follow_is_as_in_fmi2(described):
    """FMI 2 counts variables from one, FMI 3 names value references, which count from zero.

    Parameters are knowns of outputs and derivatives in FMI 3 alone (FMI 3.0.2, 2.4.8).
    """
    reals = [v for v in variables(described["2"]) if v.type == "Real"]
    parameters = {v.valueReference for v in reals if v.causality == "parameter"}

    def structure(fmi: str, elements: tuple[str, ...], key: str, first: int) -> list[list[int]]:
        root = ElementTree.parse(described[fmi] / "modelDescription.xml").getroot()
        found = [e for name in elements for e in root.findall(f"ModelStructure/{name}")]
        return [
            [int(k) - first for k in (e.get(key), *e.get("dependencies").split())] for e in found
        ]

    lists = [f"{name}/Unknown" for name in ("Outputs", "Derivatives", "InitialUnknowns")]
    two = structure("2", tuple(lists), "index", 1)
    names = ("Output", "ContinuousStateDerivative", "InitialUnknown")
    three = structure("3", names, "valueReference", 0)
    tuned = len(two) - len(structure("2", (lists[-1],), "index", 1))
    three[:tuned] = [[k for k in row if k not in parameters] for row in three[:tuned]]
    assert three == two
    states = [v for v in reals if v.derivative is not None]
    assert len(two) == 2 * (sum(v.causality == "output" for v in reals) + len(states))


def test_arrays_are_for_fmi3(tmp_path, capsys):
    assert main(["-o", str(tmp_path / "R.fmu"), "--arrays"]) == 2
    assert "arrays: expected FMI 3, got FMI 2: add --fmi 3" in capsys.readouterr().err
    with pytest.raises(BuildError, match="arrays"):
        BuildOptions("python", arrays=True)


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

"""The native FMU of FMI 3.0 with arrays is the one of FMI 2.0."""

from __future__ import annotations

import re

import fmpy
import numpy as np
import pytest
from native_derivatives import random_stiffness
from native_pair import make_pair
from places import DOCS
from random_robots import make_robot

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.exchange_blocks import all_blocks
from coupling.fmu_export.grouping import arrays

STEP = 0.004  # [s]


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

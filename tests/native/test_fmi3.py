"""The native FMU of FMI 3.0 with arrays is the one of FMI 2.0."""

from __future__ import annotations

import re

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from native_derivatives import random_stiffness
from native_fmu import POSTURE
from native_pair import Pair, make_pair
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


@pytest.mark.parametrize(("seed", "joints"), [(2, 1), (5, 3), (8, 7)])
def test_all_reals_are_bit_for_bit_those_of_fmi2(tmp_path, seed, joints):
    """Random robots under random commands, loads and springs, a parameter changed on the way."""
    pair = make_pair(make_robot(seed, joints), tmp_path)
    rng = np.random.default_rng(seed)
    two, three = pair.fmi2(), pair.fmi3()
    q = 0.3 * rng.normal(size=joints)
    drives = pair.scalars["q_cmd[1]"]
    two.setupExperiment(startTime=0.5, tolerance=1e-7)
    two.enterInitializationMode()
    two.setReal(list(range(drives, drives + joints)), q.tolist())
    two.exitInitializationMode()
    three.enterInitializationMode(startTime=0.5, tolerance=1e-7)
    pair.set(three, "q_cmd", q.tolist())
    three.exitInitializationMode()
    tool, anchor = np.array(pair.get(three, "tcp.position")), pair.scalars["anchor.x"]
    time = 0.5
    for k in range(12):
        wrench, rate = 100.0 * rng.normal(size=6), rng.normal(size=joints)
        q = q + STEP * rate
        inputs = [*wrench, *q, *rate, *rng.normal(size=joints)]
        two.setReal(list(range(len(inputs))), inputs)
        growth = 1e4 * rng.normal(size=6)
        two.setReal(
            [pair.scalars[f"{n}_rate.{c}"] for n in ("force", "moment") for c in "xyz"], growth
        )
        three.setFloat64(
            [pair.references[n] for n in ("force_rate", "moment_rate")], growth.tolist()
        )
        spring = [*(tool + 1e-3 * rng.normal(size=3)), *(0.1 * rng.normal(size=3))]
        spring += list(random_stiffness(rng) * (k % 3 > 0))
        two.setReal(list(range(anchor, anchor + 12)), spring)
        parts = [pair.references[f"anchor.{x}"] for x in ("position", "velocity", "stiffness")]
        three.setFloat64(parts, spring)
        names = ("force", "moment", "q_cmd", "qd_cmd", "qdd_cmd")
        references = [pair.references[name] for name in names]
        three.setFloat64(references, inputs)
        if k == 6:
            gravity = [3.0, 1.0, -9.0]
            two.setReal([pair.scalars[f"gravity.{c}"] for c in "xyz"], gravity)
            pair.set(three, "gravity", gravity)
        two.doStep(time, STEP)
        assert three.doStep(time, STEP) == (False, False, False, time + STEP)
        time += STEP
        assert pair.everything(three) == two.getReal(list(range(pair.scalars["trajectory"])))
    assert pair.get(three, "time") == [time]


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


def _advance(pair: Pair, slave: FMU3Slave, begin: int) -> list[list[float]]:
    rows = []
    for k in range(begin, begin + 10):
        pair.set(slave, "force", [0.0, 0.0, -400.0 * (k % 7 < 3)])
        slave.doStep(STEP * k, STEP)
        rows.append(pair.everything(slave))
    return rows


def test_states_go_back_bit_for_bit_within_and_between_instances(pair):
    slave, other = pair.started(), pair.started()
    _advance(pair, slave, 0)
    state = slave.getFMUState()
    data = slave.serializeFMUState(state)
    expected = _advance(pair, slave, 10)
    slave.setFMUState(state)
    assert _advance(pair, slave, 10) == expected
    other.setFMUState(other.deserializeFMUState(data))
    assert _advance(pair, other, 10) == expected
    slave.freeFMUState(state)


def test_a_damaged_state_is_refused_and_changes_nothing(pair, capfd):
    slave = pair.started()
    _advance(pair, slave, 0)
    before = pair.everything(slave)
    data = bytearray(slave.serializeFMUState(slave.getFMUState()))
    data[len(data) // 2] ^= 1
    with pytest.raises(FMICallException):
        slave.deserializeFMUState(bytes(data))
    assert "state: expected an unchanged copy, got" in capfd.readouterr().err
    with pytest.raises(FMICallException):
        slave.deserializeFMUState(bytes(data[:-1]))
    assert "state: expected one that this FMU has saved" in capfd.readouterr().err
    assert pair.everything(slave) == before


def test_reset_begins_again(pair):
    slave = pair.started()
    first = _advance(pair, slave, 0)
    slave.reset()
    slave.enterInitializationMode(startTime=0.0)
    pair.set(slave, "q_cmd", POSTURE)
    slave.exitInitializationMode()
    assert _advance(pair, slave, 0) == first


def test_directional_derivatives_are_those_of_fmi2_by_element(pair):
    """On a spring, by force, drives and the three parts of the spring."""
    two, three = pair.fmi2(), pair.started()
    two.setupExperiment(startTime=0.0)
    two.enterInitializationMode()
    drives = [pair.scalars[f"q_cmd[{i}]"] for i in range(1, 7)]
    two.setReal(drives, POSTURE)
    two.exitInitializationMode()
    spring = [1.8, 0.1, 0.9, 0.1, -0.1, 0.2, 1e5, 1e4, 0.0, 2e5, 0.0, 3e5]
    anchor = list(range(pair.scalars["anchor.x"], pair.scalars["anchor.x"] + 12))
    two.setReal(anchor, spring)
    for name, part in (("position", [0, 3]), ("velocity", [3, 6]), ("stiffness", [6, 12])):
        pair.set(three, f"anchor.{name}", spring[slice(*part)])
    two.doStep(0.0, STEP)
    three.doStep(0.0, STEP)
    seed = [1.0, -2.0, 3.0, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0]
    seed += [1e-3, 2e-3, 3e-3, 0.1, 0.2, 0.3, 1e3, 2e3, 3e3, 4e3, 5e3, 6e3]
    tcp, velocity = pair.scalars["tcp.x"], pair.scalars["tcp.vx"]
    scalars = [*range(tcp, tcp + 3), *range(velocity, velocity + 3)]
    expected = two.getDirectionalDerivative(
        scalars, [*(pair.scalars[f"force.{c}"] for c in "xyz"), *drives, *anchor], seed
    )
    unknowns = [pair.references[name] for name in ("tcp.position", "tcp.velocity")]
    names = ("force", "q_cmd", "anchor.position", "anchor.velocity", "anchor.stiffness")
    knowns = [pair.references[name] for name in names]
    assert three.getDirectionalDerivative(unknowns, knowns, seed, 6) == expected
    assert np.all(np.abs(expected) > 0.0)

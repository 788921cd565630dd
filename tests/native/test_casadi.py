"""CasADi imports the FMU in model exchange: the same derivatives and Jacobians, one optimal control."""

import re
import runpy

import numpy as np
import pytest
from exchange import DERIVATIVES, STATES, Exchange
from places import DOCS, EXAMPLES

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.exchange_blocks import all_blocks

casadi = pytest.importorskip("casadi", reason="needs CasADi (pip install casadi)")

INPUTS = ("wrench", "q_cmd", "qd_cmd", "qdd_cmd", "anchor", "anchor_velocity", "anchor_stiffness")
OUTPUTS = ("tcp", "velocity", "rigid", "deviation", "compliance", *STATES, "contact_force")
OUTPUTS += ("gear_torque", "motor_torque", "motor_angle", "motor_rate")


@pytest.mark.parametrize("curve", ["linear", "backlash", "spline"])
def test_its_values_and_jacobians_are_ours(pair, example, curve):
    """At random states, gears in backlash and on flanks, under all inputs: to 1e-8 of each block."""
    exchange = Exchange(example, pair.folder2).start(torque_curve=curve)
    robot = casadi.DaeBuilder("robot", str(pair.folder2))
    robot.set("torque_curve", curve)
    function = robot.create("function", ["x", "u"], ["ode", "y"])
    jacobian = function.jacobian()
    all_inputs = [name for name, block in all_blocks(example).items() if block.causality == "input"]
    rng = np.random.default_rng(0)
    for _ in range(3):
        exchange.state = np.concatenate([3e-4 * rng.normal(size=11), 0.1 * rng.normal(size=11)])
        sizes = (300.0, 1.0, 0.5, 2.0, 1.0, 0.1)
        for name, size in zip(INPUTS[:6], sizes, strict=True):
            exchange.set(name, size * rng.normal(size=len(exchange.references[name])))
        exchange.set("anchor_stiffness", [1e6, 1e5, 0.0, 2e6, 0.0, 1e4])
        state, inputs = exchange.state, exchange.get(*all_inputs)
        ode, outputs = (np.array(value).ravel() for value in function(state, inputs))
        np.testing.assert_allclose(ode, exchange.derivatives(), rtol=1e-14)
        np.testing.assert_allclose(outputs, exchange.get(*OUTPUTS), rtol=1e-14)
        found = [np.array(value) for value in jacobian(state, inputs, ode, outputs)]
        expected = [
            np.hstack([exchange.jacobian(unknowns, name) for name in knowns])
            for unknowns in (DERIVATIVES, OUTPUTS)
            for knowns in (STATES, all_inputs)
        ]
        for one, two in zip(found, expected, strict=True):
            np.testing.assert_allclose(one, two, rtol=1e-8, atol=1e-8 * np.abs(two).max())
            assert np.any(two)


def test_the_snippet_of_the_page_runs(example, tmp_path, monkeypatch):
    build_fmu(example, tmp_path / "ElasticRobot.fmu", BuildOptions("native"))
    monkeypatch.chdir(tmp_path)
    page = (DOCS / "model_exchange.md").read_text()
    names: dict[str, object] = {}
    exec(re.findall(r"```python\n(.*?)```", page, re.DOTALL)[1], names)
    assert names["jacobian"].size_out(0) == (22, 22)


def test_the_example_brings_the_robot_to_rest():
    """Its shaped swing leaves less than a thousandth of the quintic's vibration, and moves as far."""
    names = runpy.run_path(str(EXAMPLES / "least_vibration.py"))
    ways = names["compare"]()
    plain, shaped = (ways[name][1].max() for name in ("quintic", "shaped"))
    assert plain > 1e-3
    assert shaped < 1e-3 * plain
    end = np.array(names["drives"]()(names["LASTS"], np.ones(names["SHAPES"])))
    np.testing.assert_allclose(end[0], [names["SWING"], 0.0, 0.0], rtol=0, atol=1e-12)

"""The spring at the TCP through the FMU: as the model has it, held over a step but for its anchor."""

from __future__ import annotations

import numpy as np
import pytest

from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import ContactSpring, Load, symmetric
from elastic_robot.trajectory import HeldCommand

REST = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
POSTURE = {f"q_cmd[{i}]": q for i, q in enumerate(REST, start=1)}
OUTPUTS = [f"tcp.{c}" for c in ("x", "y", "z", "vx", "vy", "vz")]
OUTPUTS += [f"compliance.{c}" for c in ("xx", "xy", "xz", "yy", "yz", "zz")]
TIME = np.array([0.0, 0.004, 0.02, 0.03, 0.05, 0.07])
ENTRIES = ("xx", "xy", "xz", "yy", "yz", "zz")


def springs() -> tuple[dict[str, np.ndarray], list[ContactSpring]]:
    """A contact that comes, moves, changes its stiffness and goes: the FMU's inputs, and the model's."""
    size = np.array([0.0, 0.0, 1e5, 4e6, 4e6, 0.0])
    axis = np.array([0.6, -0.3, 0.7])
    entries = size[:, None] * (np.outer(axis, axis) + 0.1 * np.eye(3))[np.triu_indices(3)]
    velocity = np.array([[0.05, -0.02, 0.03]]) * np.array([[0, 1, 1, -1, 0, 0]]).T
    position = np.array([1.8, 0.02, 0.9]) + 1e-3 * np.arange(6)[:, None]
    inputs = {f"anchor.{c}": position[:, k] for k, c in enumerate("xyz")}
    inputs |= {f"anchor.v{c}": velocity[:, k] for k, c in enumerate("xyz")}
    inputs |= {f"anchor.k{c}": entries[:, k] for k, c in enumerate(ENTRIES)}
    rows = zip(position, velocity, entries, strict=True)
    return inputs, [ContactSpring(a, v, symmetric(k)) for a, v, k in rows]


@pytest.mark.parametrize("mode", ["dynamic", "quasistatic"])
@pytest.mark.parametrize("curve", ["linear", "backlash", "spline"])
def test_fmu_is_the_model_on_a_spring(example, example_fmu, run_fmu, mode, curve):
    """In a process that has not imported the model; path and compliance at every communication point."""
    inputs, held = springs()
    job = {
        "settings": {"mode": mode, "torque_curve": curve},
        "start": POSTURE,
        "tolerance": 1e-9,
        "time": TIME,
        "inputs": inputs | {"force.z": np.full(6, -200.0)},
        "outputs": OUTPUTS,
    }
    (answer,) = run_fmu(example_fmu, job)
    robot = ElasticRobot(example, curve, mode == "quasistatic", tolerance=1e-9)
    drives, wrench = HeldCommand(0.0, REST, 0 * REST, 0 * REST), np.array([0, 0, -200.0, 0, 0, 0])
    robot.reset(0.0, drives, Load(wrench, held[0]))
    for k, values in enumerate(answer["values"]):
        if k:
            robot.step(TIME[k], drives, Load(wrench, held[k]))
        compliance = robot.compliance()[:3, :3][np.triu_indices(3)]
        np.testing.assert_allclose(values[:3], robot.tcp()[:3], rtol=0, atol=2e-9)
        np.testing.assert_allclose(values[3:6], robot.velocity(), rtol=0, atol=1e-6)
        np.testing.assert_allclose(values[6:], compliance, rtol=1e-6, atol=1e-14)
    moved = answer["values"][1:, :3] - answer["values"][:-1, :3]
    assert np.abs(moved).max() > 1e-4


def test_the_start_is_on_the_spring_and_stays_there(example_fmu, run_fmu):
    """An anchor that stands: the initial equilibrium is that of the steps, in both modes."""
    spring = {"anchor.x": 1.8, "anchor.z": 0.9, "anchor.kxx": 1e5, "anchor.kzz": 1e6}
    modes = ("dynamic", "quasistatic")
    common = {"start": POSTURE | spring, "time": [0.0, 0.05, 0.1], "outputs": OUTPUTS[:3]}
    jobs = [{**common, "settings": {"mode": mode}} for mode in modes]
    dynamic, quasistatic = (answer["values"] for answer in run_fmu(example_fmu, *jobs))
    np.testing.assert_allclose(dynamic, quasistatic, rtol=0, atol=1e-11)
    np.testing.assert_allclose(quasistatic[1:], quasistatic[:-1], rtol=0, atol=1e-14)


@pytest.mark.parametrize("mode", ["dynamic", "quasistatic"])
def test_an_anchor_without_stiffness_is_none_bit_for_bit(example_fmu, run_fmu, mode):
    inputs, _ = springs()
    nowhere = {name: v for name, v in inputs.items() if not name.startswith("anchor.k")}
    jobs = [
        {
            "settings": {"mode": mode},
            "start": POSTURE,
            "time": TIME,
            "inputs": {"force.y": np.linspace(0.0, 900.0, 6)} | anchor,
            "outputs": OUTPUTS,
        }
        for anchor in ({}, nowhere)
    ]
    plain, anchored = (answer["values"] for answer in run_fmu(example_fmu, *jobs))
    assert plain.tobytes() == anchored.tobytes()

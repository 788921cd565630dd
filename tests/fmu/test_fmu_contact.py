"""Spring and contact at the TCP through FMUs of both kinds: as in the model, or none bit for bit."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from exchanged_robot import ExchangedRobot

from elastic_robot.plane_contact import PlaneContact
from elastic_robot.tool_load import ContactSpring, Load, symmetric
from elastic_robot.trajectory import HeldCommand

REST = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
POSTURE = {f"q_cmd[{i}]": q for i, q in enumerate(REST, start=1)}
DRIVES = HeldCommand(0.0, REST, 0 * REST, 0 * REST)
ENTRIES = ("xx", "xy", "xz", "yy", "yz", "zz")
TOOL = [f"tcp.{c}" for c in ("x", "y", "z", "vx", "vy", "vz")]
OUTPUTS = [*TOOL, *(f"compliance.{c}" for c in ENTRIES)]
OUTPUTS += ["contact.fx", "contact.fy", "contact.fz", "contact.gap"]
TIME = np.array([0.0, 0.004, 0.02, 0.03, 0.05, 0.07])
PLANE = PlaneContact(1e7, 0.5, 0.02, 0.3, 1e-2, np.array([0.2, 0.0, 2.0]))
NUMBERS = ("stiffness", "dissipation", "radius", "friction", "slip_speed")
MODES = ("dynamic", "quasistatic")
WRENCH = np.array([0.0, 0.0, -200.0, 0.0, 0.0, 0.0])


def springs() -> tuple[dict[str, np.ndarray], list[Load]]:
    """A spring that comes, moves, stiffens and goes: inputs of the FMU, loads of the model."""
    size = np.array([0.0, 0.0, 1e5, 4e6, 4e6, 0.0])
    axis = np.array([0.6, -0.3, 0.7])
    entries = size[:, None] * (np.outer(axis, axis) + 0.1 * np.eye(3))[np.triu_indices(3)]
    velocity = np.array([[0.05, -0.02, 0.03]]) * np.array([[0, 1, 1, -1, 0, 0]]).T
    position = np.array([1.8, 0.02, 0.9]) + 1e-3 * np.arange(6)[:, None]
    inputs = {f"anchor.{c}": position[:, k] for k, c in enumerate("xyz")}
    inputs |= {f"anchor.v{c}": velocity[:, k] for k, c in enumerate("xyz")}
    inputs |= {f"anchor.k{c}": entries[:, k] for k, c in enumerate(ENTRIES)}
    rows = zip(position, velocity, entries, strict=True)
    loads = [Load(WRENCH, ContactSpring(a, v, symmetric(k))) for a, v, k in rows]
    return inputs | {"force.z": np.full(6, WRENCH[2])}, loads


def planes(height: float) -> tuple[dict[str, np.ndarray], list[Load]]:
    """A plane below the tool that comes up, strikes it and goes."""
    speed = np.array([0.0, 0.1, 0.1, 0.05, -0.2, -0.2])
    z = height - 1e-4 + np.append(0.0, np.cumsum(speed[1:] * np.diff(TIME)))
    z[1:] -= speed[1:] * np.diff(TIME)
    inputs = {f"contact.{name}": np.full(6, getattr(PLANE, name)) for name in NUMBERS}
    inputs |= {f"contact.n{c}": np.full(6, PLANE.normal[k]) for k, c in enumerate("xyz")}
    inputs |= {"anchor.x": np.full(6, 1.4), "anchor.z": z, "anchor.vz": speed}
    rows = [
        ContactSpring(np.array([1.4, 0.0, a]), np.array([0.0, 0.0, v]), np.zeros((3, 3)))
        for a, v in zip(z, speed, strict=True)
    ]
    return inputs, [Load(spring=spring, contact=PLANE) for spring in rows]


def modelled(example, mode: str, curve: str) -> ExchangedRobot:
    return ExchangedRobot(example, curve, mode == "quasistatic", tolerance=1e-9)


def job(mode: str, curve: str, inputs: dict[str, np.ndarray]) -> dict:
    common = {"start": POSTURE, "tolerance": 1e-9, "time": TIME, "outputs": OUTPUTS}
    return {"settings": {"mode": mode, "torque_curve": curve}, "inputs": inputs, **common}


def assert_as_in_the_model(robot: ExchangedRobot, loads: list[Load], answer: dict) -> None:
    """Path, compliance and force at every communication point."""
    robot.reset(0.0, DRIVES, loads[0])
    for k, values in enumerate(answer["values"]):
        if k:
            robot.step(TIME[k], DRIVES, loads[k])
        compliance = robot.compliance()[:3, :3][np.triu_indices(3)]
        touched = robot.contact_force().any()
        np.testing.assert_allclose(values[:3], robot.tcp()[:3], rtol=0, atol=2e-9)
        np.testing.assert_allclose(values[3:6], robot.velocity()[:3], rtol=0, atol=2e-6)
        np.testing.assert_allclose(
            values[6:12], compliance, rtol=1e-6, atol=1e-14 + touched * 1e-12
        )
        np.testing.assert_allclose(values[12:15], robot.contact_force()[:3], rtol=0, atol=3e-2)
        np.testing.assert_allclose(values[15], robot.contact_gap()[0], rtol=0, atol=2e-9)


def test_fmu_is_the_model_on_a_spring(example, example_fmu, run_fmu):
    """In a process that has not imported the model."""
    inputs, loads = springs()
    cases = list(product(MODES, ("linear", "backlash", "spline")))
    answers = run_fmu(example_fmu, *(job(*case, inputs) for case in cases))
    for case, answer in zip(cases, answers, strict=True):
        assert_as_in_the_model(modelled(example, *case), loads, answer)
        moved = answer["values"][1:, :3] - answer["values"][:-1, :3]
        assert np.abs(moved).max() > 1e-4


def test_fmu_is_the_model_in_contact(example, example_fmu, run_fmu):
    cases, jobs, known = list(product(MODES, ("linear", "backlash"))), [], []
    for case in cases:
        robot = modelled(example, *case)
        robot.reset(0.0, DRIVES, Load())
        lowest = robot.tcp()[:3] + PLANE.offset
        slope = PLANE.unit[0] / PLANE.unit[2]
        inputs, loads = planes(lowest[2] + slope * (lowest[0] - 1.4))
        jobs.append(job(*case, inputs))
        known.append((robot, loads))
    for (robot, loads), answer in zip(known, run_fmu(example_fmu, *jobs), strict=True):
        assert_as_in_the_model(robot, loads, answer)
        assert 0 < np.count_nonzero(answer["values"][:, 14] > 10.0) < 5
        assert np.ptp(answer["values"][:, 2]) > 1e-4


def test_the_start_is_on_the_spring_and_stays_there(example_fmu, run_fmu):
    """An anchor that stands: the initial equilibrium is that of the steps, in both modes."""
    spring = {"anchor.x": 1.8, "anchor.z": 0.9, "anchor.kxx": 1e5, "anchor.kzz": 1e6}
    common = {"start": POSTURE | spring, "time": [0.0, 0.05, 0.1], "outputs": OUTPUTS[:3]}
    jobs = [{**common, "settings": {"mode": mode}} for mode in MODES]
    dynamic, quasistatic = (answer["values"] for answer in run_fmu(example_fmu, *jobs))
    np.testing.assert_allclose(dynamic, quasistatic, rtol=0, atol=1e-11)
    np.testing.assert_allclose(quasistatic[1:], quasistatic[:-1], rtol=0, atol=1e-14)


@pytest.mark.parametrize("mode", MODES)
def test_neither_is_there_without_stiffness_bit_for_bit(example_fmu, run_fmu, mode):
    off = ("anchor.k", "contact.stiffness", "force")
    nowhere = [
        {name: values for name, values in inputs.items() if not name.startswith(off)}
        for inputs, _ in (springs(), planes(1.4))
    ]
    force = {"force.y": np.linspace(0.0, 900.0, 6)}
    jobs = [job(mode, "backlash", force | inputs) for inputs in ({}, *nowhere)]
    plain, *others = (answer["values"] for answer in run_fmu(example_fmu, *jobs))
    assert [other.tobytes() for other in others] == [plain.tobytes()] * 2
    assert not plain[:, 12:15].any()
    assert (plain[:, 15] == 1.0).all()

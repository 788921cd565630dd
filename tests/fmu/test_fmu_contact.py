"""The contact at the TCP through the FMU: as in the model."""

from __future__ import annotations

from itertools import product

import numpy as np
from exchanged_robot import ExchangedRobot

from elastic_robot.plane_contact import PlaneContact
from elastic_robot.tool_load import ContactSpring, Load
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

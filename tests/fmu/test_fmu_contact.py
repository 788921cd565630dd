"""The contact that lifts off through both kinds of FMU: as in the model, none without a stiffness."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import ContactSpring, Load
from elastic_robot.trajectory import HeldCommand

REST = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
POSTURE = {f"q_cmd[{i}]": q for i, q in enumerate(REST, start=1)}
OUTPUTS = [f"tcp.{c}" for c in ("x", "y", "z", "vx", "vy", "vz")]
OUTPUTS += ["contact.fx", "contact.fy", "contact.fz", "contact.gap", "compliance.zz"]
TIME = np.array([0.0, 0.004, 0.02, 0.03, 0.05, 0.07])
PLANE = PlaneContact(1e7, 0.5, 0.02, 0.3, 1e-2, np.array([0.2, 0.0, 2.0]))
NUMBERS = ("stiffness", "dissipation", "radius", "friction", "slip_speed")


@pytest.fixture(scope="module", params=["python", "native"])
def fmu(request, example, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    return build_fmu(example, folder / "ElasticRobot.fmu", BuildOptions(request.param))


def planes(height: float) -> tuple[dict[str, np.ndarray], list[Load]]:
    """A plane below the tool that comes up, strikes it and goes: the FMU's inputs, the model's loads."""
    speed = np.array([0.0, 0.1, 0.1, 0.05, -0.2, -0.2])
    z = height - 1e-4 + np.append(0.0, np.cumsum(speed[1:] * np.diff(TIME)))
    z[1:] -= speed[1:] * np.diff(TIME)
    inputs = {f"contact.{name}": np.full(6, getattr(PLANE, name)) for name in NUMBERS}
    inputs |= {f"contact.n{c}": np.full(6, PLANE.normal[k]) for k, c in enumerate("xyz")}
    inputs |= {"anchor.x": np.full(6, 1.4), "anchor.z": z, "anchor.vz": speed}
    springs = [
        ContactSpring(np.array([1.4, 0.0, a]), np.array([0.0, 0.0, v]), np.zeros((3, 3)))
        for a, v in zip(z, speed, strict=True)
    ]
    return inputs, [Load(spring=spring, contact=PLANE) for spring in springs]


@pytest.mark.parametrize("mode", ["dynamic", "quasistatic"])
@pytest.mark.parametrize("curve", ["linear", "backlash"])
def test_fmu_is_the_model_in_contact(example, fmu, run_fmu, mode, curve):
    """In a process of its own; path, force, gap and compliance at every communication point."""
    robot = ElasticRobot(example, curve, mode == "quasistatic", tolerance=1e-9)
    drives = HeldCommand(0.0, REST, 0 * REST, 0 * REST)
    robot.reset(0.0, drives, Load())
    lowest = robot.tcp()[:3] + PLANE.offset
    slope = PLANE.unit[0] / PLANE.unit[2]
    inputs, loads = planes(lowest[2] + slope * (lowest[0] - 1.4))
    job = {
        "settings": {"mode": mode, "torque_curve": curve},
        "start": POSTURE,
        "tolerance": 1e-9,
        "time": TIME,
        "inputs": inputs,
        "outputs": OUTPUTS,
    }
    (answer,) = run_fmu(fmu, job)
    robot.reset(0.0, drives, loads[0])
    touched = 0
    for k, values in enumerate(answer["values"]):
        if k:
            robot.step(TIME[k], drives, loads[k])
        force = robot.contact_force()
        np.testing.assert_allclose(values[:3], robot.tcp()[:3], rtol=0, atol=2e-9)
        np.testing.assert_allclose(values[3:6], robot.velocity(), rtol=0, atol=2e-6)
        np.testing.assert_allclose(values[6:9], force, rtol=0, atol=3e-2)
        np.testing.assert_allclose(values[9], robot.contact_gap()[0], rtol=0, atol=2e-9)
        np.testing.assert_allclose(values[10], robot.compliance()[2, 2], rtol=1e-6)
        touched += force[2] > 10.0
    assert 0 < touched < 5
    assert np.ptp(answer["values"][:, 2]) > 1e-4


@pytest.mark.parametrize("mode", ["dynamic", "quasistatic"])
def test_a_contact_without_stiffness_is_none_bit_for_bit(fmu, run_fmu, mode):
    inputs, _ = planes(1.4)
    nowhere = {name: values for name, values in inputs.items() if name != "contact.stiffness"}
    jobs = [
        {
            "settings": {"mode": mode},
            "start": POSTURE,
            "time": TIME,
            "inputs": {"force.y": np.linspace(0.0, 900.0, 6)} | contact,
            "outputs": OUTPUTS,
        }
        for contact in ({}, nowhere)
    ]
    plain, touched = (answer["values"] for answer in run_fmu(fmu, *jobs))
    assert plain.tobytes() == touched.tobytes()
    assert not plain[:, 6:9].any()
    assert (plain[:, 9] == 1.0).all()

"""Hysteresis of the gears through the FMU: its variables, starts, a parameter that changes, states."""

from dataclasses import replace

import fmpy
import numpy as np
import pytest
from pendulum import pendulum
from places import REFERENCE

from coupling.fmu_export.build import build_fmu
from elastic_robot.description import Robot
from elastic_robot.gear_parts import StopElement

ELEMENTS = (StopElement(40.0, 2e-5), StopElement(50.0, 6e-5), StopElement(30.0, 15e-5))
FORCE, ANGLE = (
    np.array([getattr(element, key) for element in ELEMENTS])
    for key in ("slip_torque", "slip_angle")
)
STIFFNESS = 1e6
OUTPUTS = [
    *["deflection[1]", "deflection_rate[1]", "gear_torque[1]"],
    *[f"elongation[{k}]" for k in (1, 2, 3)],
    *[f"der(elongation[{k}])" for k in (1, 2, 3)],
    *[f"joint[1].slip[{k}]" for k in (1, 2, 3)],
]
QUASISTATIC = {"torque_curve": "linear", "mode": "quasistatic"}


def gear(**joint) -> Robot:
    values = {"stiffness": STIFFNESS, "hysteresis": ELEMENTS, **joint}
    return pendulum(gravity=(0.0, 0.0, 0.0), **values)


@pytest.fixture(scope="module")
def gear_fmu(tmp_path_factory):
    return build_fmu(gear(), tmp_path_factory.mktemp("fmu") / "R.fmu")


@pytest.fixture(scope="module")
def worn(example) -> Robot:
    """The example robot with elements in its first three gears, three, none and one of them."""
    first, second, third, *rest = example.joints
    worn = [replace(first, hysteresis=ELEMENTS), second, replace(third, hysteresis=ELEMENTS[:1])]
    return replace(example, joints=(*worn, *rest))


@pytest.fixture(scope="module")
def worn_fmu(worn, tmp_path_factory):
    return build_fmu(worn, tmp_path_factory.mktemp("fmu") / "R.fmu")


def test_only_gears_with_elements_have_their_variables(worn_fmu):
    described = fmpy.read_model_description(str(worn_fmu)).modelVariables
    names = {variable.name: variable for variable in described}
    new = [name for name in names if any(word in name for word in ("elong", "hyst", ".slip["))]
    assert new == [
        *[f"elongation[{k}]" for k in range(1, 5)],
        *["joint[1].hysteresis", "joint[3].hysteresis"],
        *[f"der(elongation[{k}])" for k in range(1, 5)],
        *["joint[1].slip[1]", "joint[1].slip[2]", "joint[1].slip[3]", "joint[3].slip[1]"],
    ]
    slip = names["joint[1].hysteresis"]
    assert (slip.causality, slip.variability, slip.unit) == ("parameter", "tunable", "N.m")
    assert (float(slip.start), float(slip.min)) == (FORCE.sum(), 0.0)
    assert names["elongation[4]"].causality == "output"
    elongation = "Elongation in the gears' hysteresis: element 1 of joint[3]"
    assert names["elongation[4]"].description == elongation


@pytest.mark.parametrize("torque", [0.0, 250.0, -80.0])
def test_a_robot_starts_from_no_load_from_below_or_from_above(gear_fmu, run_fmu, torque):
    states = ("equilibrium", "undeflected", "equilibrium_from_below", "equilibrium_from_above")
    jobs = [
        {
            "settings": {**QUASISTATIC, "initial_state": state},
            "start": {"moment.y": torque},
            "time": [0.0],
            "outputs": OUTPUTS[:6],
        }
        for state in states
    ]
    middle, undeflected, below, above = (answer["values"][0] for answer in run_fmu(gear_fmu, *jobs))
    lost = FORCE.sum()
    np.testing.assert_allclose(below[[0, 2]], [(torque - lost) / STIFFNESS, -torque], atol=1e-12)
    np.testing.assert_allclose(above[[0, 2]], [(torque + lost) / STIFFNESS, -torque], atol=1e-12)
    np.testing.assert_array_equal(below[3:], ANGLE)
    np.testing.assert_array_equal(above[3:], -ANGLE)
    np.testing.assert_allclose(middle[3:], np.clip(middle[0], -ANGLE, ANGLE), rtol=0, atol=1e-18)
    assert not undeflected.any()


def test_a_slip_torque_may_change_while_the_robot_is_loaded(gear_fmu, run_fmu):
    """All elements slip; those of twice the torque push the gear back, and stick meanwhile."""
    job = {
        "settings": QUASISTATIC,
        "time": [0.0, 1.0, 2.0],
        "inputs": {
            "moment.y": [500.0] * 3,
            "joint[1].hysteresis": [FORCE.sum(), FORCE.sum(), 2.0 * FORCE.sum()],
        },
        "outputs": OUTPUTS[:6],
    }
    (answer,) = run_fmu(gear_fmu, job)
    back = FORCE.sum() / (STIFFNESS + 2.0 * np.sum(FORCE / ANGLE))
    (_, before, after) = answer["values"]
    assert after[0] == pytest.approx(before[0] - back, abs=1e-15)
    np.testing.assert_allclose(after[3:], ANGLE - back, rtol=0, atol=1e-16)
    refused = {**job, "inputs": {"joint[1].hysteresis": [-1.0] * 3}}
    (answer,) = run_fmu(gear_fmu, refused)
    assert "joint[1].hysteresis: expected a number >= 0, got -1.0 N.m" in answer["stderr"]


def test_a_state_in_the_middle_of_a_loop_goes_on_bit_for_bit(worn_fmu, run_host, tmp_path):
    path = REFERENCE / "iso_path_joints.npz"
    cases = ("backlash,dynamic,,0,0", f"backlash,quasistatic,{path},1e6,0")
    for what in ("save", "load"):
        run_host("state", worn_fmu, tmp_path, what, *cases)

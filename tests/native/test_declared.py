"""What modelDescription.xml declares to follow something has derivatives, and they are right."""

from __future__ import annotations

import fmpy
import numpy as np
import pytest
from random_robots import driven, with_gear_parts

from coupling.fmu_export.build import BuildOptions, build_fmu

TUNABLE = {"gravity.z", "joint[2].stiffness", "joint[1].tilt[2].damping", "joint[3].backlash"}


@pytest.mark.parametrize("use", ["cs", "me"])
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_every_declared_dependency_is_answered_with_the_slope_of_the_values(
    example, tmp_path, run_host, fmi, use
):
    """In initialisation mode, at communication points and in event mode, on all torque curves, along
    commands and a trajectory; and what is not declared has none, where that is asked for over a step."""
    options = BuildOptions("native", fmi=fmi, dependencies="step")
    file = build_fmu(example, tmp_path / "R.fmu", options)
    run_host("declared", file, use)


@pytest.mark.parametrize(
    ("fmi", "use", "drive"),
    [("2", "cs", "servo"), ("3", "cs", "servo"), ("2", "me", "servo"), ("3", "me", "torque")],
)
def test_so_it_is_with_motors(example, tmp_path, run_host, fmi, use, drive):
    """The same of a robot whose motors, friction and hysteresis move, behind errors and balancers."""
    options = BuildOptions("native", fmi=fmi, dependencies="step")
    robot = driven(with_gear_parts(example, 1), np.random.default_rng(5))
    run_host("declared", build_fmu(robot, tmp_path / "R.fmu", options), use, drive)


@pytest.mark.parametrize(("fmi", "use"), [("2", "me"), ("3", "me"), ("2", "cs")])
def test_so_it_is_with_kinematic_errors_and_balancers(example, tmp_path, run_host, fmi, use):
    """Without motors: what drives feel of a gear's torque follows where they are."""
    robot = with_gear_parts(example, 1)
    options = BuildOptions("native", fmi=fmi, dependencies="step")
    run_host("declared", build_fmu(robot, tmp_path / "R.fmu", options), use)


@pytest.mark.parametrize("arrays", [False, True])
def test_parameters_and_the_time_of_the_start_are_declared(example, tmp_path, arrays):
    """FMI 3.0.2, 2.4.8: "parameters (variables with causality = parameter)" are knowns of outputs and
    state derivatives, in FMI 2 of initial unknowns alone; so is "the independent variable" of
    these."""
    options = [BuildOptions("native", fmi="3", arrays=arrays), BuildOptions("native")]
    three, two = (
        fmpy.read_model_description(str(build_fmu(example, tmp_path / f"{k}.fmu", option)))
        for k, option in enumerate(options)
    )
    tcp, gravity = ("tcp.position", "gravity") if arrays else ("tcp.x", "gravity.z")
    tunable = TUNABLE - {"gravity.z"} | {gravity}
    for listed, wanted in (
        (three.outputs, tunable),
        (three.derivatives, tunable),
        (three.initialUnknowns, tunable - {"joint[1].tilt[2].damping"} | {"time"}),
    ):
        declared = {u.variable.name: {d.name for d in u.dependencies} for u in listed}
        accelerations = [name for name in declared if name.startswith("der(deflection_rate")]
        for name in [tcp] if tcp in declared else accelerations:
            assert wanted <= declared[name], name
    assert not any(d.causality == "parameter" for u in two.outputs for d in u.dependencies)
    for unknown in two.initialUnknowns:
        if unknown.variable.name.startswith(("tcp", "rigid")):
            assert "time" in {d.name for d in unknown.dependencies}

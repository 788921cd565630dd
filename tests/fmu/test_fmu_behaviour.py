"""How the FMU behaves among others, when misused, in the long run, and as its dependencies declare."""

import os
import re
import subprocess
import sys

import fmpy
import pytest
from fmpy.validation import validate_fmu
from places import HOSTS, REFERENCE
from random_robots import make_robot

from coupling.errors import BuildError
from coupling.fmu_export.build import BuildOptions, build_fmu

KINDS = {
    "native-2": BuildOptions("native"),
    "native-3": BuildOptions("native", fmi="3"),
}


def test_instances_do_not_mix(example_fmu, run_host, tmp_path):
    run_host("instances", example_fmu, build_fmu(make_robot(5, 6), tmp_path / "Other.fmu"))


def test_a_host_without_pinocchio_is_told_what_to_install(example, tmp_path):
    fmu = build_fmu(example, tmp_path / "Robot.fmu", BuildOptions("python"))
    tmp_path.joinpath("pinocchio.py").write_text(
        "raise ImportError(\"No module named 'pinocchio'\")"
    )
    script = f"""
import sys
sys.path.append({str(HOSTS)!r})
from fmu import Fmu
try:
    Fmu({str(fmu)!r}).instance()
except Exception as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "Failed to instantiate" in done.stdout
    # To stderr, and to the log, which FMPy prints.
    for told in (done.stderr, done.stdout):
        assert told.count("expected Python 3.11 or newer with numpy scipy pin, got") == 1
        assert f"{sys.executable} -m pip install numpy scipy pin" in told
        assert "ImportError(" not in told
    assert "externalDependencies.txt" in done.stderr


ISO_PATH = REFERENCE / "iso_path_joints.npz"
# Curve, mode, trajectory, stiffness of a spring and of a plane [N/m].
CASES = (
    "linear,dynamic,,0,0",
    "backlash,dynamic,,0,0",
    f"backlash,dynamic,{ISO_PATH},0,0",
    f"spline,dynamic,{ISO_PATH},0,0",
    f"backlash,quasistatic,{ISO_PATH},0,0",
    "backlash,dynamic,,1e6,0",
    "spline,dynamic,,1e4,0",
    "backlash,quasistatic,,1e7,0",
    "backlash,dynamic,,0,1e7",
    "spline,quasistatic,,0,1e6",
)


def test_a_state_goes_on_bit_for_bit(example_fmu, run_host, tmp_path):
    for what in ("save", "load"):
        run_host("state", example_fmu, tmp_path, what, *CASES)


def test_a_state_of_another_motion_is_refused(example_fmu, run_host, tmp_path):
    """The same file name with other contents."""
    file = tmp_path / "motion.csv"
    line = "{0},0,-0.3,0.5,0,{1},0\n"
    file.write_text("time,q1,q2,q3,q4,q5,q6\n" + line.format(0, 0.6) + line.format(10, 0.7))
    case = f"linear,quasistatic,{file},0,0"
    run_host("state", example_fmu, tmp_path, "save", case)
    file.write_text("time,q1,q2,q3,q4,q5,q6\n" + line.format(0, 0.6) + line.format(10, 0.71))
    said = run_host("state", example_fmu, tmp_path, "load", case, succeeds=False)
    assert "expected the motion that the state was saved with, got another" in said


def test_damaged_and_foreign_states_are_refused(example_fmu, run_host, tmp_path):
    other = build_fmu(make_robot(4, 6), tmp_path / "Other.fmu")
    said = run_host("foreign_states", example_fmu, other)
    for text in ("damaged bytes", "state: expected one that", "with fingerprint"):
        assert text in said


SAID = {
    "force": r"needs more than \d+ tries of a step at \S+ m/s, under 1e\+12 N, 0 N m, drives of 0 rad/s"
    r"|bends deflection\[\d+\] beyond 3.14 rad, under 1e\+12 N, 0 N m, drives of 0 rad/s",
    "enormous force": r"0 s into a step of .*, needs steps below \S+ s, under 1e\+300 N",
    "moment": r"under 0 N, 1e\+14 N m",
    "acceleration": r"drives of \S+e\+1\d rad/s and \S*e\+12 rad/s2: one of these is too large",
    "enormous acceleration": r"and \S*e\+300 rad/s2: one of these is too large",
    "rate": r"drives of 1e\+09 rad/s and 0 rad/s2",
    "spring": r"a spring of 1e\+12 N/m",
    "enormous spring": r"a spring of 1e\+300 N/m",
    "long step": r"step size: expected at most 3600 s at a time, got 1e\+09 s|got 1000000000 s",
}


def _sections(said: str) -> list[tuple[str, str]]:
    return re.findall(r"^## (.*)\n((?:(?!## ).*\n)*)", said, re.MULTILINE)


def test_absurd_values_are_refused_in_time_and_leave_no_trace(example_fmu, run_host):
    """The same twice: with backlash, and linear."""
    sections = _sections(run_host("hard_cases", example_fmu, "absurd"))
    dynamic, quasistatic = sections[:-3], sections[-3:]
    assert {name for name, _ in dynamic} == set(SAID)
    for name, text in dynamic:
        assert re.search(SAID[name], text), text
    for _, text in quasistatic:
        assert "no static equilibrium found at q = " in text
    assert not any("Warning" in text for _, text in sections)


def test_a_run_that_starts_late_is_that_from_zero(example_fmu, run_host):
    said = run_host("hard_cases", example_fmu, "late")
    assert "step start: expected the last step's end, 1000000000.0 s, got" in said


def test_drives_follow_commands(example_fmu, run_host):
    """Errors and their order against the trajectory, steps of any length, noise, jumps, states."""
    run_host("commanded", example_fmu)


def test_the_wrench_is_a_ramp_where_its_rate_is_told(example_fmu, run_host):
    """And derivatives that are none are refused, each with its sentence."""
    said = run_host("ramps", example_fmu)
    texts = {part.partition("\n")[0]: part for part in said.split("## ")}
    for name, expected in {
        "unknown": "value reference of a real variable: expected",
        "beyond": "value reference of a real variable: expected",
        "output": "derivative: expected that of an input, got tcp.x",
        "parameter": "derivative: expected that of an input, got gravity.z",
        "not a number": "derivative of force.y: expected a finite number, got nan",
        "order 2": "expected order 1, got 2",
        "order 0": "expected order 1, got 0",
    }.items():
        assert expected in texts[name], (name, texts)


def test_the_description_says_that_inputs_are_interpolated(example_fmu):
    assert fmpy.read_model_description(str(example_fmu)).coSimulation.canInterpolateInputs


def test_angles_that_jump_without_rates_are_said_in_the_log_once(example_fmu, run_host):
    run_host("rates", example_fmu)


@pytest.mark.parametrize("dependencies", ["point", "step"])
@pytest.mark.parametrize("kind", KINDS)
def test_no_output_follows_an_input_at_once_and_the_derivative_over_the_step_answers(
    example, tmp_path, run_host, kind, dependencies
):
    """In both modes; the list says so, or on request what outputs follow over a step."""
    known = KINDS[kind]
    options = BuildOptions(known.kind, fmi=known.fmi, dependencies=dependencies)
    file = build_fmu(example, tmp_path / "R.fmu", options)
    assert validate_fmu(str(file)) == []
    run_host("feedthrough", file, int(dependencies == "step"))


def test_a_force_on_the_tool_closes_no_loop_in_what_importers_read(example, tmp_path):
    """Outputs that a process or a display takes follow no load; FMIKit reads lists with kinds only."""
    file = build_fmu(example, tmp_path / "R.fmu", KINDS["native-2"])
    description = fmpy.read_model_description(str(file))
    for unknown in description.outputs:
        name, depends = unknown.variable.name, unknown.dependencies
        assert len(unknown.dependenciesKind or []) == len(depends), name
        if not name.startswith(("compliance", "contact.f")):
            assert not any(d.name.startswith(("force", "moment", "anchor")) for d in depends), name


def test_other_words_for_dependencies_are_refused():
    with pytest.raises(BuildError, match="dependencies: expected one of point, step, got 'none'"):
        BuildOptions(dependencies="none")

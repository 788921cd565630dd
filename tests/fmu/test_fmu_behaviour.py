"""How the FMU behaves among others, when misused, and in the long run."""

from __future__ import annotations

import os
import re
import subprocess
import sys

from places import HOSTS
from random_robots import make_robot

from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.description import Body, Joint, Robot


def test_instances_do_not_mix(example_fmu, run_host, tmp_path):
    run_host("instances", example_fmu, build_fmu(make_robot(5, 6), tmp_path / "Other.fmu"))


SAID = {
    "NaN": "force.x: expected a finite number, got nan N",
    "infinite": "moment.y: expected a finite number, got inf N.m",
    "output": "tcp.x is an output",
    "negative stiffness": "joint[2].stiffness: expected a number > 0, got -1.0 N.m/rad",
    "zero stiffness": "joint[1].tilt[1].stiffness: expected a number > 0, got 0.0 N.m/rad",
    "negative damping": "joint[3].damping: expected a number >= 0, got -1.0 N.m.s/rad",
    "negative backlash": "joint[4].backlash: expected a number >= 0, got -1e-09 rad",
    "unknown real": ", got 5000",
    "string as real": "value reference of a real variable: expected 0 to",
    "integer": "this FMU has real and string variables only",
    "string too late": "set them before initialisation ends",
    "negative step": "step size: expected a finite number >= 0, got -0.01 s",
    "NaN step": "step size: expected a finite number >= 0, got nan s",
    "step elsewhere": "step start: expected the last step's end, 0.0 s, got 3.0 s",
}


def test_wrong_calls_are_refused_with_a_sentence_and_change_nothing(example_fmu, run_host):
    said = run_host("errors", example_fmu)
    sections = dict(re.findall(r"^## (.*)\n((?:(?!## ).*\n)*)", said, re.MULTILINE))
    for name, sentence in SAID.items():
        assert sentence in sections[name], sections[name]
    assert all(text.startswith("robot") for text in sections.values()), sections


def test_memory_stays_flat(run_host, tmp_path):
    """A rigid robot of one joint, so that nearly all that runs is the FMU's interface."""
    run_host("memory", build_fmu(rigid_robot(), tmp_path / "Rigid.fmu"), 20_000)


def rigid_robot() -> Robot:
    link = Body(mass=10.0, com=(0.5, 0.0, 0.0), inertia=(0.1, 1.0, 1.0))
    joint = Joint(origin=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), body=link)
    return Robot("rigid", joints=(joint,), tcp_position=(1.0, 0.0, 0.0))


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

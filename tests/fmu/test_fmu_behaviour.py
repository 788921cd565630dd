"""How the FMU behaves among others, when misused, and in the long run."""

from __future__ import annotations

import os
import subprocess
import sys

from places import HOSTS
from random_robots import make_robot

from coupling.fmu_export.build import BuildOptions, build_fmu


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

"""The memory that instances and refused calls of an FMU of FMI 2.0 leave behind, in a C host."""

import subprocess
import sys
from pathlib import Path

from native_fmu import NativeFmu, build_master


def left_behind(file: Path, folder: Path, *flags: str) -> None:
    """200 instances one after another; Python uses the allocator that is asked."""
    fmu = NativeFmu(file, folder / "fmu")
    host = build_master("instances", folder / "instances", *flags)
    done = subprocess.run(
        [host, fmu.library, fmu.guid, fmu.resources, "200"],
        env={"ELASTIC_ROBOT_PYTHON": sys.executable, "PYTHONMALLOC": "malloc"},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    of_instance, of_refusal = map(float, done.stdout.split())
    assert abs(of_instance) < 1000, of_instance
    assert abs(of_refusal) < 10, of_refusal

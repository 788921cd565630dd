"""Ecos's own program, in C++ with no Python in it, takes the native FMU in an empty environment."""

import csv
import importlib.metadata
import os
import shutil
import subprocess
import sys
from pathlib import Path

import fmpy
import numpy as np
import pytest

from coupling.fmu_export.build import BuildOptions, build_fmu


@pytest.mark.skipif(sys.platform != "linux", reason="the program is taken from the Linux wheel")
def test_the_native_fmu_runs_where_there_is_no_python(example, tmp_path):
    """At rest under gravity; the program writes all steps but the last, to six digits."""
    try:
        shipped = importlib.metadata.distribution("ecospy").locate_file("ecospy/binaries/ecos")
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("ecospy is not installed: make masters")
    program = shutil.copy(str(shipped), tmp_path)
    os.chmod(program, 0o755)  # the wheel ships it without
    file = build_fmu(example, tmp_path / "Native.fmu", BuildOptions("native"))
    done = subprocess.run(
        [program, "simulate", "--path", file.name, "--stepSize", "0.004", "--stopTime", "0.4"],
        cwd=tmp_path,
        env={"LD_LIBRARY_PATH": str(Path(sys.prefix, "lib"))},  # of libtbb
        text=True,
        capture_output=True,
        timeout=300,
    )
    with (tmp_path / "Native.csv").open() as table:
        header, *rows = csv.reader(table, skipinitialspace=True)
    assert len(rows) == 100, done.stdout + done.stderr
    names = [*(f"tcp.{axis}" for axis in "xyz"), "deviation.z"]
    columns = [header.index(f"instance::{name}[REAL]") for name in names]
    written = np.array(rows)[1:, columns].astype(float)
    answer = fmpy.simulate_fmu(str(file), stop_time=0.4, step_size=0.004, output=names)
    expected = np.array([[row[name] for name in names] for row in answer])[-1]
    assert expected[-1] < -1e-3
    np.testing.assert_allclose(written, np.tile(expected, (99, 1)), rtol=1e-5, atol=1e-6)

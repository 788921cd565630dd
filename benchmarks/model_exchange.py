"""The ISO 9283 reference path in model exchange: FMPy's CVODE integrates the native FMU.

    python benchmarks/model_exchange.py      half a minute; the table of docs/model_exchange.md

Errors are those of the TCP against tests/reference, made with other engines; one run, one core.
"""

import os

for _library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_library] = "1"

import tempfile
import time
from pathlib import Path

import numpy as np
from fmpy import simulate_fmu

from benchmarks.task import CURVES, EARLY, ROBOT, TRAJECTORY, Task
from coupling.fmu_export.build import BuildOptions, build_fmu

END = 22.84  # [s]
# Relative tolerances of the solver; FMPy multiplies them by the states' nominals for the absolute ones.
TOLERANCES = {"linear": (1e-5, 1e-6, 1e-7, 1e-8), "backlash": (1e-6, 1e-7, 1e-8, 1e-9, 1e-10)}


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        fmu = build_fmu(ROBOT, Path(folder, "Robot.fmu"), BuildOptions("native"))
        print("| curve | solver's tolerance | TCP error (m) | up to 9 s (m) | wall (s) |")
        print("|---|---|---|---|---|")
        for curve in CURVES:
            task = Task.load(curve, END)
            for tolerance in TOLERANCES[curve]:
                error, wall = _run(fmu, task, tolerance)
                early = error[task.times <= EARLY].max()
                print(
                    f"| {curve} | {tolerance:.0e} | {error.max():.1e} | {early:.1e} | {wall:.1f} |"
                )


def _run(fmu: Path, task: Task, tolerance: float) -> tuple[np.ndarray, float]:
    """Return the errors at the task's times [m] and the wall time [s]."""
    start = time.perf_counter()
    result = simulate_fmu(
        str(fmu),
        fmi_type="ModelExchange",
        solver="CVode",
        stop_time=float(task.times[-1]),
        output_interval=0.01,
        relative_tolerance=tolerance,
        start_values={"trajectory": str(TRAJECTORY), "torque_curve": task.curve},
        output=["tcp.x", "tcp.y", "tcp.z"],
        record_events=False,
    )
    wall = time.perf_counter() - start
    found = np.column_stack([result[name] for name in ("tcp.x", "tcp.y", "tcp.z")])
    error: np.ndarray = np.abs(found - task.expected).max(axis=1)
    return error, wall


if __name__ == "__main__":
    main()

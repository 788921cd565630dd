"""The masters' scripts of examples/masters, run as they stand.

A script runs alone in a process of its own, in a folder that holds ElasticRobot.fmu and motion.csv, or
system.ssp, and leaves tcp.csv: time, TCP pose and, of a system, the wrench.
"""

from __future__ import annotations

import importlib.metadata
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np

from coupling.path.histories import ToolPath

EXAMPLES = Path(__file__).parents[2] / "examples" / "masters"
REFERENCE = Path(__file__).parent / "masters_reference.py"
# CoFMUPy and what it needs in other versions than the rest: `make masters`.
OVERLAY = Path(sys.prefix, "cofmupy")
# What a system's script steps by, to be replaced by other steps.
_STEPS = "STEP, STOP = 0.01, 1.1"
# Seconds after which a master counts as stuck.
_PATIENCE = 300


class MasterError(Exception):
    """A master did not run the FMU to the end."""


# Runs a script with its arguments in a folder, in a process of its own with this environment.
Start = Callable[[Sequence[str], Path, Mapping[str, str]], CompletedProcess[str]]


def start_anew(
    command: Sequence[str], folder: Path, environment: Mapping[str, str]
) -> CompletedProcess[str]:
    """Start Python, as `Start` asks for.

    Raises:
        MasterError: If it counts as stuck.
    """
    try:
        return subprocess.run(
            [sys.executable, *command],
            cwd=folder,
            env=environment,
            text=True,
            capture_output=True,
            timeout=_PATIENCE,
        )
    except subprocess.TimeoutExpired as cause:
        raise MasterError(f"still running after {_PATIENCE} s") from cause


# Versions of FMI that the FMUs have; all offer co-simulation and model exchange.
VERSIONS = ("2", "3")


@dataclass(frozen=True)
class Master:
    """A master.

    Attributes:
        name: Its name, and that of its script.
        distribution: Its package.
        by_inputs: The script drives the robot by its inputs, not by `trajectory`.
        how: How to run it, in a few words for the table.
        overlay: Folder of packages that only this master sees.
        versions: Versions of FMI that it opens.
        interface: What it runs: "CS" or "ME".
        within: Largest difference from single calls of the same FMU that its runs may show [m]:
            rounding, or what its own solver leaves.
    """

    name: str
    distribution: str
    how: str
    by_inputs: bool = False
    overlay: Path | None = None
    versions: tuple[str, ...] = VERSIONS
    interface: str = "CS"
    within: float = 1e-12

    @property
    def environment(self) -> dict[str, str]:
        """Environment of its process."""
        overlay = {} if self.overlay is None else {"PYTHONPATH": str(self.overlay)}
        return {**os.environ, **overlay}

    @property
    def driven_by(self) -> str:
        """What drives the robot in the script."""
        return "inputs" if self.by_inputs else "`trajectory`"

    @property
    def version(self) -> str | None:
        """Version that is installed here, or None."""
        path = sys.path if self.overlay is None else [str(self.overlay)]
        found = next(
            iter(importlib.metadata.distributions(name=self.distribution, path=path)), None
        )
        return None if found is None else found.version


MASTERS = (
    Master("FMPy", "fmpy", "`simulate_fmu`, or `fmpy simulate`; input file and plot"),
    Master(
        "FMPy-CVode", "fmpy", "`simulate_fmu`, its own solver at 1e-8", interface="ME", within=1e-7
    ),
    # It crashes while it opens any FMU of FMI 3.
    Master(
        "libcosimpy",
        "libcosimpy",
        "`CosimExecution`, inputs by an override manipulator",
        versions=("2",),
    ),
    Master("ecospy", "ecospy", "`EcosSimulation`; load `libtbb` first"),
    Master(
        "CoFMUPy",
        "cofmupy",
        "`Coordinator`, drives as CSV streams; an environment of its own",
        by_inputs=True,
        overlay=OVERLAY,
    ),
    Master(
        "PathSim", "pathsim-fmi", "`CoSimulationFMU`, drives as `Source` blocks", by_inputs=True
    ),
    Master(
        "FMU-Manipulation-Toolbox",
        "fmu-manipulation-toolbox",
        "`AssemblyNode.make_fmu`; the container runs in FMPy",
    ),
)


def script_of(master: str) -> str:
    """Return the script of a master, "prepare", or "SSP-" and a master, by its name."""
    file = EXAMPLES / f"{master.lower().replace('-', '_')}_task.py"
    return file.read_text(encoding="utf-8")


def prepare(folder: Path, fmu: Path, start: Start = start_anew) -> None:
    """Put into a folder what the scripts share."""
    shutil.copy(fmu, folder / "ElasticRobot.fmu")
    _run(script_of("prepare"), folder, "motion.csv", start)


def run(master: Master, folder: Path, start: Start = start_anew) -> np.ndarray:
    """Run a master's script in a prepared folder.

    Returns:
        Time and TCP pose x, y, z, qx, qy, qz, qw at the communication points, (n, 8).

    Raises:
        MasterError: If it does not come to its end, with what it said last.
    """
    return _run(script_of(master.name), folder, "tcp.csv", start, master.environment)


def run_system(master: str, folder: Path, step: float, stop: float) -> np.ndarray:
    """Run a master's script on a folder's system.ssp, with other steps.

    Returns:
        Time, TCP pose (7 columns) and wrench (6) after each step, (n, 14).

    Raises:
        MasterError: If it does not come to its end, with what it said last.
    """
    code = script_of(f"SSP-{master}")
    assert _STEPS in code, master
    return _run(code.replace(_STEPS, f"STEP, STOP = {step}, {stop}"), folder, "tcp.csv")


def run_reference(by_inputs: bool, folder: Path, start: Start = start_anew) -> np.ndarray:
    """Run the same task through FMPy's single FMI calls; returns as `run`."""
    kind = "inputs" if by_inputs else "trajectory"
    return _run(
        REFERENCE.read_text(encoding="utf-8"), folder, "reference.csv", start, arguments=[kind]
    )


def differences(poses: np.ndarray, reference: np.ndarray) -> tuple[float, float]:
    """Return the largest differences of positions [m] and quaternions after each of the steps.

    Raises:
        MasterError: If the times are not those of the reference.
    """
    steps = len(reference) - 1
    if len(poses) < steps or np.abs(poses[-steps:, 0] - reference[1:, 0]).max() > 1e-9:
        raise MasterError(f"expected times {reference[1:, 0]}, got {poses[:, 0]}")
    apart = np.abs(poses[-steps:, 1:] - reference[1:, 1:])
    return float(apart[:, :3].max()), float(apart[:, 3:].max())


def distance_at_samples(poses: np.ndarray, coupled: ToolPath) -> np.ndarray:
    """Return the distances [m] of co-simulated positions from a coupled path, at its samples.

    Args:
        poses: From `run_system`, with a whole number of steps between two samples.
        coupled: From 0 to the last step's end.
    """
    rows = np.searchsorted(poses[:, 0], coupled.time[1:] - 1e-9)
    assert np.abs(poses[rows, 0] - coupled.time[1:]).max() < 1e-9
    distance: np.ndarray = np.linalg.norm(poses[rows, 1:4] - coupled.position[0, 1:], axis=1)
    return distance


def _run(
    code: str,
    folder: Path,
    leaves: str,
    start: Start = start_anew,
    environment: Mapping[str, str] = os.environ,
    arguments: Sequence[str] = (),
) -> np.ndarray:
    """Run Python code in a folder and return the table that it leaves."""
    script, table = folder / "task.py", folder / leaves
    script.write_text(code, encoding="utf-8")
    table.unlink(missing_ok=True)
    done = start([script.name, *arguments], folder, environment)
    said = (done.stdout + done.stderr)[-2000:]
    if not table.is_file():
        raise MasterError(f"it leaves no {leaves}; it said: {said}")
    if done.returncode != 0:
        raise MasterError(f"it ends with status {done.returncode}; it said: {said}")
    return np.genfromtxt(table, delimiter=",")

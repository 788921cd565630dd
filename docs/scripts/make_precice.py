"""Write the table of docs/precice.md from coupled runs: make precice, with preCICE and fmiprecice."""

from __future__ import annotations

import contextlib
import re
import shutil
import subprocess
import sys
import tempfile
from operator import itemgetter
from pathlib import Path

import numpy as np
from fmpy import simulate_fmu

from coupling.fmu.precice_robot import CoupledMotion, PreciceNames, run_robot
from docs.scripts.experiment import Page, results
from examples.precice.press_with_precice import CONFIGURATION, WALL_STIFFNESS, prepare, start_wall

WINDOWS = (0.001, 0.002, 0.005, 0.01, 0.4)  # [s]; the last is the whole stroke
STOP = 0.4  # [s]
PAGE = Page("precice")
FORCE_ALONE = CONFIGURATION.with_name("runner-config.xml")


def configured(folder: Path, template: Path, window: float) -> Path:
    """Write a configuration with another time window [s]."""
    text, found = re.subn(
        r'(<time-window-size value=)"[^"]*"',
        rf'\1"{window!r}"',
        template.read_text(encoding="utf-8"),
    )
    assert found == 1
    file = folder / template.name
    file.write_text(text, encoding="utf-8")
    return file


def in_one_fmu(
    fmu: Path, parameters: dict[str, float | str], height: float, step: float
) -> np.ndarray:
    """Return the tool's heights [m] where the wall is the contact inside the robot's FMU."""
    wall = {"contact.stiffness": WALL_STIFFNESS, "anchor.z": height, "tcp_tolerance": 1e-9}
    found = simulate_fmu(
        str(fmu),
        stop_time=STOP,
        step_size=step,
        output_interval=step,
        start_values={**parameters, **wall},
        output=["tcp.z"],
    )
    heights: np.ndarray = np.array(found["tcp.z"])
    return heights


def by_runner(folder: Path, height: float, window: float) -> np.ndarray:
    """Return the tool's heights [m] from fmiprecice's runner."""
    configuration = configured(folder, FORCE_ALONE, window)
    for name in ("fmi-settings.json", "precice-settings.json"):
        shutil.copy(CONFIGURATION.with_name(name), folder)
    partner = start_wall(height, configuration, False)
    command = [
        sys.executable,
        "-m",
        "fmiprecice.runner",
        "fmi-settings.json",
        "precice-settings.json",
    ]
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
    partner.join()
    rows = np.genfromtxt(folder / "results" / "robot.csv", delimiter=",", names=True)
    heights: np.ndarray = rows["tcpz"][: round(STOP / window) + 1]
    return heights


def by_adapter(
    fmu: Path, parameters: dict[str, float | str], height: float, configuration: Path, spring: bool
) -> CoupledMotion:
    """Return the motion from `run_robot`, with the spring or under ramps of the force alone."""
    names = PreciceNames() if spring else PreciceNames(stiffness=())
    partner = start_wall(height, configuration, spring)
    tool = run_robot(fmu, configuration, parameters, names)
    partner.join()
    return tool


def deviations(window: float) -> list[str]:
    """Return the largest errors [um], and iterations, of the runner and both ways of the adapter."""
    with tempfile.TemporaryDirectory() as place, contextlib.chdir(place):
        folder = Path(place)
        fmu, parameters, height = prepare(folder, "dynamic")
        expected = in_one_fmu(fmu, parameters, height, window)
        cells = [shown(by_runner(folder, height, window), expected)]
        for template, spring in ((FORCE_ALONE, False), (CONFIGURATION, True)):
            configuration = configured(folder, template, window)
            tool = by_adapter(fmu, parameters, height, configuration, spring)
            mean = float(np.mean(tool.iterations[1:]))
            cells.append(f"{shown(tool.pose[:, 2], expected)} ({mean:.1f})")
    return cells


def shown(heights: np.ndarray, expected: np.ndarray) -> str:
    """Return the largest difference in um."""
    return f"{1e6 * np.abs(heights - expected).max():.2g}"


@PAGE.part
def errors() -> str:
    """Return the table of what is left by window."""
    heads = ("runner, force held", "`run_robot`, force alone", "`run_robot`, with the spring")
    return results(
        ("window (ms)",),
        {f"{1e3 * window:g}": window for window in WINDOWS},
        deviations,
        {head: itemgetter(k) for k, head in enumerate(heads)},
    )


if __name__ == "__main__":
    PAGE.write()

"""What noise in a measured force costs, for docs/inverse.md."""

from __future__ import annotations

import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomlkit

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.files.csv_table import write_table
from coupling.path.deviation import Deviation, measure
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.run.execute import run_compensation
from coupling.run.models import Models, cell_of
from docs.scripts.page import table
from docs.scripts.runs import CASES, example

ROBOTS = ("icme2008", "abb_irb7600", "fanuc_r2000ic")
LEVELS = (0, 5, 15, 50)  # [N]
_CONE = {"depth_m": 0.003}
_SEED = 1


@dataclass(frozen=True)
class Heard:
    """A command that was made for a record with noise.

    Attributes:
        left: What it leaves under the force without the noise.
        estimated: What its run estimates that noise leaves; None where it finds none.
    """

    left: Deviation
    estimated: Deviation | None


def significant(robot: str, level: float, cutoff: dict[str, str]) -> tuple[Heard, Deviation]:
    """Return a command for the cone's force with white noise, and what no correction leaves.

    Args:
        robot: Name of a robot.
        level: Standard deviation of the noise [N].
        cutoff: The key of [process], or none.
    """
    clean = example("cone", robot={"description": robot}, tool_path=_CONE)
    force = clean.process.evaluate(clean.desired).wrench
    drawn = np.random.default_rng(_SEED).normal(0.0, 1.0, force.force[0].shape)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "record.csv")
        rows = np.column_stack([force.time, force.force[0] + level * drawn])
        write_table(file, ("time", "fx", "fy", "fz"), rows)
        case = _measured(robot, {"file": str(file), **cutoff})
        run = run_compensation(case)
    found = run.correction
    rows_of = {replay.name: replay.deviation for replay in run.robustness}
    left = _under(case, found.joints, force, found.desired)
    nothing = _under(case, found.before.joints, force, found.desired)
    return Heard(left, rows_of.get("noise")), nothing


def _measured(robot: str, keys: dict[str, str]) -> Case:
    """Return the cone's case with a record in place of its law."""
    data = tomllib.loads((CASES / "cone.toml").read_text(encoding="utf-8"))
    data["robot"]["description"] = robot
    data["tool_path"] |= _CONE
    data["process"] = {"model": "measured", "frame": "base", **keys}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "case.toml")
        file.write_text(tomlkit.dumps(data), encoding="utf-8")
        return load_case(file)


def _under(case: Case, joints: JointPath, force: WrenchHistory, desired: ToolPath) -> Deviation:
    with Models(case.fmu) as fmus:
        cell, _ = cell_of(case.robots, fmus)
        path = cell.simulate(joints, force.refined(desired.time), "dynamic")
    return measure(path, desired)


def noises() -> str:
    """Return the table."""
    rows = []
    for robot in ROBOTS:
        for level in LEVELS:
            quiet, nothing = significant(robot, level, {})
            loud, _ = significant(robot, level, {"cutoff_Hz": "none"})
            cells = [_figures(one) for one in (quiet.left, quiet.estimated, loud.left, nothing)]
            rows.append([f"`{robot}`", f"{level} N", *cells])
            print(*rows[-1], flush=True)
    head = ("robot", "noise", "filtered by default", "estimated", "unfiltered", "no correction")
    return table(head, rows)


def _figures(deviation: Deviation | None) -> str:
    if deviation is None:
        return ""
    figures = (deviation.maximum_less_constant, deviation.rms_less_constant)
    return " / ".join(f"{float(f'{1e6 * figure:.2g}'):g}" for figure in figures)

"""Write docs/milling.md and its figures from runs of both milling cases: make milling."""

from __future__ import annotations

import sys
import tempfile
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import tomli_w
from plotly.subplots import make_subplots

from coupling.case import Case, load_case
from coupling.fmu_export.build import build_fmu
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process.milling_force import MeanMilling, ToothPassing
from coupling.robot.inverse_kinematics import Planner
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.study import run_compensation
from coupling.solve.fixed_point import couple
from docs.scripts.picture_style import styled
from docs.scripts.screenshot import NoBrowserError, save_side_by_side

DOCS = Path(__file__).parents[1]
CASES = DOCS.parent / "examples" / "cases"
TEMPLATE, PAGE = DOCS / "scripts" / "milling.md.in", DOCS / "milling.md"
PICTURES = DOCS / "figures"
SPEEDS = (20000, 40000)  # [1/min]
COLORS = {20000: "#D55E00", 40000: "#0072B2"}
MEAN = "#333333"
# Samples of the static run [s]: the mean force has no ripple to resolve.
STATIC_SAMPLE = 0.005
# Above half the rate of these samples nothing is left to cut off [Hz].
HIGHEST = 0.5 / STATIC_SAMPLE
# Shown of the forces, in the middle of the slot [s]: two turns of the slower spindle.
SHOWN = 6e-3
_UM = 1e6


@dataclass(frozen=True)
class Milled:
    """A case, simulated with and without its process.

    Attributes:
        case: The case.
        unloaded, loaded: Paths of the tool under the same command.
        wrench: Along the loaded one.
        evaluations: Of the process.
    """

    case: Case
    unloaded: ToolPath
    loaded: ToolPath
    wrench: WrenchHistory
    evaluations: int

    @property
    def in_cut(self) -> np.ndarray:
        """Samples in the slot at full feed."""
        speed = np.gradient(self.case.desired.position[:, 0], self.case.desired.time)
        depth = -self.case.part.coordinates(self.case.desired)[:, 2]
        slot: np.ndarray = (depth > depth.max() - 1e-9) & (speed > 0.9999 * speed.max())
        return slot

    @property
    def given_way(self) -> np.ndarray:
        """How far the process pushes the tool, base axes [m], (n, 3)."""
        return self.loaded.position - self.unloaded.position


def variant(speed: int, **changes: Mapping[str, Any]) -> Case:
    """Return the case of a speed with keys of its tables changed."""
    data = tomllib.loads((CASES / f"milling_{speed}.toml").read_text(encoding="utf-8"))
    for table, keys in changes.items():
        data[table].update(keys)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "case.toml")
        file.write_text(tomli_w.dumps(data), encoding="utf-8")
        return load_case(file)


def milled(case: Case) -> Milled:
    """Couple a case with its process."""
    joints = Planner(case.robot, case.home).plan(case.desired)
    with tempfile.TemporaryDirectory() as folder:
        fmu = build_fmu(case.robot, Path(folder, "Robot.fmu"))
        with RobotFmu(fmu, case.settings.torque_curve) as robot:
            unloaded = robot.simulate(joints, WrenchHistory.none(joints.time), case.settings.mode)
            result = couple(
                robot,
                case.process,
                joints,
                case.scheme(),
                case.coupling.tolerance(),
                case.coupling.max_evaluations,
                unloaded,
                mode=case.settings.mode,
            )
    if not result.converged:
        raise RuntimeError(result.reason)
    return Milled(case, unloaded, result.path, result.wrench, len(result.evaluations))


def quasistatic(speed: int) -> Case:
    """Return the case of a speed for the quasi-static robot under the mean force."""
    return variant(
        speed,
        robot={"mode": "quasistatic"},
        process={"force": "mean"},
        tool_path={"sample_s": STATIC_SAMPLE},
        compensation={"tolerance_m": 1e-5, "cutoff_Hz": HIGHEST},
    )


def dynamic(speed: int) -> Milled:
    """Return the dynamic robot under the force of every tooth: the case as it stands."""
    return milled(variant(speed))


def rigid_forces(speed: int) -> tuple[ToolPath, np.ndarray, np.ndarray]:
    """Return the desired path, and along it the forces of teeth and mean [N], (n, 3) each."""
    case = variant(speed)
    assert isinstance(case.process, ToothPassing)
    teeth = case.process.wrench(case.desired)
    mean = MeanMilling(case.process.milling).wrench(case.desired)
    return case.desired, teeth.wrench[:, :3], mean.wrench[:, :3]


def forces() -> go.Figure:
    """Draw the forces at both speeds over the same time, teeth and mean."""
    titles = [f"{speed:,} 1/min" for speed in SPEEDS]
    figure = make_subplots(
        rows=2, cols=2, shared_xaxes=True, shared_yaxes=True, column_titles=titles,
        horizontal_spacing=0.04, vertical_spacing=0.06,
    )  # fmt: skip
    for column, speed in enumerate(SPEEDS, start=1):
        path, teeth, mean = rigid_forces(speed)
        begin = np.searchsorted(path.time, 0.5 * path.time[-1])
        rows = slice(begin, begin + round(SHOWN / (path.time[1] - path.time[0])) + 1)
        time = 1e3 * (path.time[rows] - path.time[begin])
        for row, axis in enumerate((1, 0), start=1):
            # A sample is the mean over the step that ends there.
            line = {"color": COLORS[speed], "width": 2, "shape": "vh"}
            figure.add_scatter(
                x=time, y=teeth[rows, axis], line=line, name="tooth by tooth", row=row, col=column,
                mode="lines", showlegend=row == 1,
            )  # fmt: skip
            figure.add_scatter(
                x=time, y=mean[rows, axis], line={"color": MEAN, "dash": "dash"}, name="mean",
                row=row, col=column, mode="lines", showlegend=row == 1 and column == 2,
            )  # fmt: skip
    figure.update_xaxes(title="time [ms]", row=2)
    figure.update_yaxes(title="across the feed [N]", row=1, col=1)
    figure.update_yaxes(title="along the feed [N]", row=2, col=1)
    return styled(figure, 1000, 560)


def deviations(still: Mapping[int, Milled], moving: Mapping[int, Milled]) -> go.Figure:
    """Draw how far the process pushes the tool across the feed, static and dynamic."""
    figure = go.Figure()
    for speed in SPEEDS:
        for run, name, width, opacity in (
            (moving[speed], "dynamic, tooth by tooth", 1, 0.6),
            (still[speed], "static, mean force", 3, 1.0),
        ):
            line = {"color": COLORS[speed], "width": width}
            figure.add_scatter(
                x=run.loaded.time, y=_UM * run.given_way[:, 1], line=line, opacity=opacity,
                name=f"{speed:,} 1/min, {name}", mode="lines",
            )  # fmt: skip
    figure.update_xaxes(title="time [s]")
    figure.update_yaxes(title="pushed across the feed [um]")
    return styled(figure, 1000, 460)


def close_up(moving: Mapping[int, Milled]) -> go.Figure:
    """Draw the dynamic robot's answer to single teeth, less its mean."""
    figure = go.Figure()
    for speed in SPEEDS:
        run = moving[speed]
        begin = np.searchsorted(run.loaded.time, 0.5 * run.loaded.time[-1])
        rows = slice(begin, begin + round(SHOWN / 1e-4) + 1)
        time, pushed = run.loaded.time[rows], run.given_way[rows, 1]
        trend = np.polynomial.Polynomial.fit(time, pushed, 2)(time)
        figure.add_scatter(
            x=1e3 * (time - time[0]), y=_UM * (pushed - trend), mode="lines",
            line={"color": COLORS[speed], "width": 2}, name=f"{speed:,} 1/min",
        )  # fmt: skip
    figure.update_xaxes(title="time [ms]")
    figure.update_yaxes(title="ripple across the feed [um]")
    return styled(figure, 1000, 340)


def force_table(moving: Mapping[int, Milled]) -> str:
    """Return mean and range of the forces on the desired path, as Markdown."""
    rows = [
        "| spindle | chip | force | mean [N] | from [N] | to [N] |",
        "|---|---|---|---|---|---|",
    ]
    for speed in SPEEDS:
        _, teeth, mean = rigid_forces(speed)
        slot = moving[speed].in_cut
        chip = 8000.0 / (2.0 * speed)
        for axis, name in ((1, "across"), (0, "along"), (2, "axial (up)")):
            lowest, highest = teeth[slot, axis].min(), teeth[slot, axis].max()
            rows.append(
                f"| {speed:,} 1/min | {chip:g} mm | {name} | {mean[slot, axis].mean():.0f}"
                f" | {lowest:.0f} | {highest:.0f} |"
            )
    return "\n".join(rows)


def deviation_table(still: Mapping[int, Milled], moving: Mapping[int, Milled]) -> str:
    """Return how far the process pushes the tool in the slot, as Markdown."""
    rows = [
        "| spindle | robot | across, mean [um] | across, from [um] | to [um] | along, mean [um]"
        " | up, mean [um] | evaluations |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for speed in SPEEDS:
        for name, run in (("static", still[speed]), ("dynamic", moving[speed])):
            pushed = _UM * run.given_way[run.in_cut]
            rows.append(
                f"| {speed:,} 1/min | {name} | {pushed[:, 1].mean():.0f} | {pushed[:, 1].min():.0f}"
                f" | {pushed[:, 1].max():.0f} | {pushed[:, 0].mean():.0f}"
                f" | {pushed[:, 2].mean():.0f} | {run.evaluations} |"
            )
    return "\n".join(rows)


def of_whole_case(speed: int) -> str:
    """Return what compensation does for the dynamic robot under the force of every tooth."""
    run = run_compensation(variant(speed))
    if not run.converged:
        raise RuntimeError(run.reason)
    return (
        f"from {_UM * run.before.maximum:.0f} to {_UM * run.after.maximum:.0f} um at {speed:,} 1/min"
        f" ({run.process_evaluations} evaluations)"
    )


def page(still: Mapping[int, Milled], moving: Mapping[int, Milled]) -> str:
    """Return the page: the template with its tables and figures."""
    across = {}
    pushed = {}
    for speed in SPEEDS:
        _, _, mean = rigid_forces(speed)
        across[speed] = mean[moving[speed].in_cut, 1].mean()
        pushed[speed] = still[speed].given_way[still[speed].in_cut, 1].mean()
    slow, fast = SPEEDS
    corrected = run_compensation(quasistatic(slow))
    assert corrected.shares.dynamic is not None
    return TEMPLATE.read_text(encoding="utf-8").format(
        forces=force_table(moving),
        deviations=deviation_table(still, moving),
        fall=100.0 * (1.0 - across[fast] / across[slow]),
        before=_UM * corrected.before.maximum,
        after=_UM * corrected.after.maximum,
        after_dynamic=_UM * corrected.shares.dynamic.maximum,
        corrected_evaluations=corrected.process_evaluations,
        whole=" and ".join(of_whole_case(speed) for speed in SPEEDS),
        fall_of_deviation=100.0 * (1.0 - pushed[fast] / pushed[slow]),
    )


def main() -> int:
    """Write page and pictures; return the exit status."""
    still = {speed: milled(quasistatic(speed)) for speed in SPEEDS}
    moving = {speed: dynamic(speed) for speed in SPEEDS}
    try:
        save_side_by_side([forces()], PICTURES / "milling_forces.png")
        save_side_by_side([deviations(still, moving)], PICTURES / "milling_deviations.png")
        save_side_by_side([close_up(moving)], PICTURES / "milling_ripple.png")
    except NoBrowserError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    PAGE.write_text(page(still, moving), encoding="utf-8")
    print(f"{PAGE}: written")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Write docs/milling.md and its figures from runs of both milling cases: make milling."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from coupling.case import Case
from coupling.path.histories import ToolPath
from coupling.process.milling_force import FORCES, MillingForce
from coupling.run.study import Deviations, Run
from docs.scripts.page import fill, finish, table
from docs.scripts.pictures import save, styled
from docs.scripts.runs import compensated, coupled, example

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
    """A case and its run, coupled and not corrected."""

    case: Case
    run: Run

    @property
    def in_cut(self) -> np.ndarray:
        """Samples in the slot at full feed."""
        speed = np.gradient(self.case.desired.position[0, :, 0], self.case.desired.time)
        depth = -self.case.task.part.coordinates(self.case.desired.position[0])[:, 2]
        slot: np.ndarray = (depth > depth.max() - 1e-9) & (speed > 0.9999 * speed.max())
        return slot

    @property
    def given_way(self) -> np.ndarray:
        """How far the process pushes the tool, base axes [m], (n, 3)."""
        found = self.run.correction
        return found.achieved.position[0] - found.unloaded.position[0]


def dynamic(speed: int) -> Case:
    """Return the case of a speed as it stands: the dynamic robot under the force of every tooth."""
    return example(f"milling_{speed}")


def quasistatic(speed: int) -> Case:
    """Return the case of a speed for the quasi-static robot under the mean force."""
    return example(
        f"milling_{speed}",
        robot={"mode": "quasistatic"},
        process={"force": "mean"},
        tool_path={"sample_s": STATIC_SAMPLE},
        compensation={"tolerance_m": 1e-5, "cutoff_Hz": HIGHEST},
    )


def milled(case: Case) -> Milled:
    """Couple a case with its process."""
    return Milled(case, coupled(case))


def rigid_forces(speed: int) -> tuple[ToolPath, np.ndarray, np.ndarray]:
    """Return the desired path, and along it the forces of teeth and mean [N], (n, 3) each."""
    case = dynamic(speed)
    assert isinstance(case.process, MillingForce)
    teeth = case.process.evaluate(case.desired)
    mean = replace(case.process, force=FORCES["mean"]).evaluate(case.desired)
    return case.desired, teeth.wrench.force[0], mean.wrench.force[0]


def forces() -> go.Figure:
    """Draw the forces at both speeds over the same time, teeth and mean."""
    titles = [_spindle(speed) for speed in SPEEDS]
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
                x=run.case.desired.time, y=_UM * run.given_way[:, 1], line=line, opacity=opacity,
                name=f"{_spindle(speed)}, {name}", mode="lines",
            )  # fmt: skip
    figure.update_xaxes(title="time [s]")
    figure.update_yaxes(title="pushed across the feed [um]")
    return styled(figure, 1000, 460)


def close_up(moving: Mapping[int, Milled]) -> go.Figure:
    """Draw the dynamic robot's answer to single teeth, less its mean."""
    figure = go.Figure()
    for speed in SPEEDS:
        time = moving[speed].case.desired.time
        begin = np.searchsorted(time, 0.5 * time[-1])
        rows = slice(begin, begin + round(SHOWN / 1e-4) + 1)
        time, pushed = time[rows], moving[speed].given_way[rows, 1]
        trend = np.polynomial.Polynomial.fit(time, pushed, 2)(time)
        figure.add_scatter(
            x=1e3 * (time - time[0]), y=_UM * (pushed - trend), mode="lines",
            line={"color": COLORS[speed], "width": 2}, name=_spindle(speed),
        )  # fmt: skip
    figure.update_xaxes(title="time [ms]")
    figure.update_yaxes(title="ripple across the feed [um]")
    return styled(figure, 1000, 340)


def force_table(moving: Mapping[int, Milled]) -> str:
    """Return mean and range of the forces on the desired path, as Markdown."""
    rows = []
    for speed in SPEEDS:
        _, teeth, mean = rigid_forces(speed)
        slot = moving[speed].in_cut
        chip = 8000.0 / (2.0 * speed)
        for axis, name in ((1, "across"), (0, "along"), (2, "axial (up)")):
            figures = (mean[slot, axis].mean(), teeth[slot, axis].min(), teeth[slot, axis].max())
            rows.append((_spindle(speed), f"{chip:g} mm", name, *(f"{f:.0f}" for f in figures)))
    return table(("spindle", "chip", "force", "mean [N]", "from [N]", "to [N]"), rows)


def deviation_table(still: Mapping[int, Milled], moving: Mapping[int, Milled]) -> str:
    """Return how far the process pushes the tool in the slot, as Markdown."""
    rows = []
    for speed in SPEEDS:
        for name, cut in (("static", still[speed]), ("dynamic", moving[speed])):
            along, across, up = _UM * cut.given_way[cut.in_cut].T
            figures = (across.mean(), across.min(), across.max(), along.mean(), up.mean())
            evaluations = str(cut.run.correction.evaluations)
            rows.append((_spindle(speed), name, *(f"{f:.0f}" for f in figures), evaluations))
    head = ("spindle", "robot", "across, mean [um]", "across, from [um]", "to [um]")
    return table((*head, "along, mean [um]", "up, mean [um]", "evaluations"), rows)


def _spindle(speed: int) -> str:
    return f"{speed:,} 1/min"


def of_whole_case(speed: int) -> str:
    """Return what compensation does for the dynamic robot under the force of every tooth."""
    run = compensated(dynamic(speed))
    deviations = Deviations.of(run)
    return (
        f"from {_UM * deviations.before.maximum:.0f} to {_UM * deviations.after.maximum:.0f} um"
        f" at {_spindle(speed)} ({run.correction.evaluations} evaluations)"
    )


def write() -> None:
    """Run everything, and write page and pictures."""
    still = {speed: milled(quasistatic(speed)) for speed in SPEEDS}
    moving = {speed: milled(dynamic(speed)) for speed in SPEEDS}
    save("milling_forces", forces())
    save("milling_deviations", deviations(still, moving))
    save("milling_ripple", close_up(moving))
    across = {}
    pushed = {}
    for speed in SPEEDS:
        _, _, mean = rigid_forces(speed)
        across[speed] = mean[moving[speed].in_cut, 1].mean()
        pushed[speed] = still[speed].given_way[still[speed].in_cut, 1].mean()
    slow, fast = SPEEDS
    corrected = compensated(quasistatic(slow))
    left = Deviations.of(corrected)
    assert left.dynamic is not None
    fill(
        "milling",
        forces=force_table(moving),
        deviations=deviation_table(still, moving),
        fall=100.0 * (1.0 - across[fast] / across[slow]),
        before=_UM * left.before.maximum,
        after=_UM * left.after.maximum,
        after_dynamic=_UM * left.dynamic.maximum,
        corrected_evaluations=corrected.correction.evaluations,
        whole=" and ".join(of_whole_case(speed) for speed in SPEEDS),
        fall_of_deviation=100.0 * (1.0 - pushed[fast] / pushed[slow]),
    )


if __name__ == "__main__":
    sys.exit(finish(write))

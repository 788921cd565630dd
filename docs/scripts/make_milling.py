"""Write docs/milling.md and its figures from runs of both milling cases: make milling."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from coupling.case.case import Case
from coupling.path.histories import ToolPath
from coupling.process.milling_force import MeanForce, MillingForce
from coupling.run.execute import Run
from coupling.run.tooth_passing import DeviationParts
from coupling.stability.case_cut import CaseCuts
from coupling.stability.chart import speed_chart
from coupling.stability.path_stability import PathStability
from docs.scripts.experiment import Curve, add_curves, results
from docs.scripts.page import fill, finish, table
from docs.scripts.pictures import save, styled
from docs.scripts.runs import compensated, coupled, example
from docs.scripts.stability_judge import COEFFICIENTS, MATERIALS, judged_cuts

SPEEDS = (20000, 40000)  # [1/min]
COLORS = {20000: "#D55E00", 40000: "#0072B2"}
MEAN = "#333333"
# Samples of the static run [s]: the mean force has no ripple to resolve.
STATIC_SAMPLE = 0.005
# Shown of the forces, in the middle of the slot [s]: two turns of the slower spindle.
SHOWN = 6e-3
# Shown of what is left after compensation [s].
SHOWN_AFTER = 0.048
_UM = 1e6


@dataclass(frozen=True)
class Milled:
    """A case and its run."""

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
    """Return the case of a speed with linear joints: the moving robot under the force of every tooth."""
    return example(f"milling_{speed}", robot={"torque_curve": "linear"})


def quasistatic(speed: int) -> Case:
    """Return the case of a speed for the quasi-static robot under the mean force, linear joints."""
    return example(
        f"milling_{speed}",
        robot={"mode": "quasistatic", "torque_curve": "linear"},
        process={"force": "mean"},
        tool_path={"sample_s": STATIC_SAMPLE},
    )


def milled(case: Case) -> Milled:
    """Couple a case with its process."""
    return Milled(case, coupled(case))


def whole(speed: int) -> Milled:
    """Correct the case of a speed as it stands: with backlash, under the force of every tooth."""
    case = example(f"milling_{speed}")
    return Milled(case, compensated(case))


def rigid_forces(speed: int) -> tuple[ToolPath, np.ndarray, np.ndarray]:
    """Return the desired path, and along it the forces of teeth and mean [N], (n, 3) each."""
    case = dynamic(speed)
    assert isinstance(case.process, MillingForce)
    teeth = case.process.evaluate(case.desired)
    mean = MeanForce(case.process.milling).evaluate(case.desired)
    return case.desired, teeth.wrench.before[0, :, :3], mean.wrench.before[0, :, :3]


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
            first, last = row == 1, row == 1 and column == 2
            steps = [
                Curve(
                    "tooth by tooth" * first, time, teeth[rows, axis], COLORS[speed], 2, shape="vh"
                ),
                Curve("mean" * last, time, mean[rows, axis], MEAN, 2, "dash"),
            ]
            add_curves(figure, steps, row=row, col=column)
    figure.update_xaxes(title="time [ms]", row=2)
    figure.update_yaxes(title="across the feed [N]", row=1, col=1)
    figure.update_yaxes(title="along the feed [N]", row=2, col=1)
    return styled(figure, 1000, 560)


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
    robots = {
        (_spindle(speed), name): runs[speed]
        for speed in SPEEDS
        for name, runs in (("static", still), ("dynamic", moving))
    }

    def pushed(cut: Milled) -> tuple[np.ndarray, ...]:
        return tuple(_UM * cut.given_way[cut.in_cut].T)

    return results(
        ("spindle", "robot"),
        robots,
        lambda cut: (cut, *pushed(cut)),
        {
            "across, mean [um]": lambda found: f"{found[2].mean():.0f}",
            "across, from [um]": lambda found: f"{found[2].min():.0f}",
            "to [um]": lambda found: f"{found[2].max():.0f}",
            "along, mean [um]": lambda found: f"{found[1].mean():.0f}",
            "up, mean [um]": lambda found: f"{found[3].mean():.0f}",
            "evaluations": lambda found: str(found[0].run.correction.evaluations),
        },
    )


def _spindle(speed: int) -> str:
    return f"{speed:,} 1/min"


def teeth_apart(case: Case) -> float:
    """Return the time between two teeth [s]."""
    table = case.resolved["process"]
    return 60.0 / (table["teeth"] * table["spindle_speed_rpm"])


def left(run: Milled) -> DeviationParts:
    """Return the parts of the deviation after compensation, part axes."""
    found = run.run.correction
    off = found.achieved.position[0] - found.desired.position[0]
    off = run.case.task.part.rotation.inv().apply(off)
    return DeviationParts.of(found.desired.time, off, teeth_apart(run.case))


def compensation_table(corrected: Mapping[int, Milled]) -> str:
    """Return what the inverse of the moving robot leaves, as Markdown."""
    rows = []
    for speed, run in corrected.items():
        parts = left(run)
        slot = run.in_cut
        across = parts.highest[slot, 1].max(), parts.lowest[slot, 1].min()
        rows.append(
            (
                _spindle(speed),
                f"{_UM * run.run.deviation(run.run.before).maximum:.0f}",
                f"{_UM * run.run.deviation(run.run.correction.achieved).maximum:.2f}",
                f"{_UM * np.linalg.norm(parts.slow, axis=1).max():.2f}",
                f"{_UM * np.linalg.norm(parts.ripple, axis=1).max():.2f}",
                f"{_UM * across[1]:+.2f} to {_UM * across[0]:+.2f}",
                f"{_UM * parts.lowest[slot, 2].min():+.2f}",
                str(run.run.correction.evaluations),
            )
        )
    head = ("spindle", "before [um]", "after [um]", "slow part [um]", "ripple [um]")
    return table((*head, "walls [um]", "floor [um]", "evaluations"), rows)


def after(corrected: Mapping[int, Milled]) -> go.Figure:
    """Draw what is left across the feed in the middle of the slot, and its slow part."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.05)
    for row, (speed, run) in enumerate(corrected.items(), start=1):
        parts, time = left(run), 1e3 * run.run.correction.desired.time
        begin = np.searchsorted(time, 0.5 * time[-1])
        rows = slice(begin, np.searchsorted(time, time[begin] + 1e3 * SHOWN_AFTER))
        whole = parts.slow + parts.ripple
        moment = time[rows] - time[begin]
        curves = [
            Curve(f"{_spindle(speed)}, {name}", moment, _UM * values[rows, 1], color, width)
            for values, name, color, width in (
                (whole, "tooth by tooth", COLORS[speed], 1),
                (parts.slow, "slow part", MEAN, 2),
            )
        ]
        add_curves(figure, curves, row=row, col=1)
        figure.update_yaxes(title="across the feed [um]", row=row, col=1)
    figure.update_xaxes(title="time [ms]", row=2, col=1)
    return styled(figure, 1000, 560)


# The cut of the lobes: a slot in titanium with another robot, 2 mm deep at 3000 1/min.
SLOW: dict[str, dict[str, Any]] = {
    "robot": {"description": "fanuc_r2000ic", "home_deg": [0.0, 10.0, -10.0, 0.0, -70.0, 0.0]},
    "part": {"position_m": [1.6, 0.0, 0.6]},
    "tool_path": {
        "points_m": [
            [0.0, 0.0, 0.001],
            [0.01, 0.0, -0.002],
            [0.03, 0.0, -0.002],
            [0.04, 0.0, 0.001],
        ],
        "feed_m_s": 0.02,
        "sample_s": 0.001,
    },
    "process": {
        "spindle_speed_rpm": 3000.0,
        **dict(zip(COEFFICIENTS, MATERIALS[2], strict=True)),
    },
}
# Speeds of both charts [1/min], and the tool of the second.
SLOW_SPEEDS, ALL_SPEEDS = [1500.0, 6000.0], [2000.0, 30000.0]
TOOL = {"frequency_Hz": 1200.0, "damping_ratio": 0.03, "stiffness_N_m": 2.0e7}


def slow_slot(speeds: list[float], **stability: Any) -> PathStability:
    """Return the stability of the slot along its path."""
    case = example("milling_20000", **SLOW, stability={"spindle_rpm": speeds, **stability})
    path = PathStability.of(CaseCuts(case), 8)
    assert path is not None
    return path


def lobes(path: PathStability) -> go.Figure:
    """Draw limiting depth over speed, and the frequency below it."""
    worst = path.worst
    chart = speed_chart(worst, lambda what, done, total: None)
    frequency = {"color": COLORS[20000], "size": 5}
    figure = make_subplots(
        rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.05, row_heights=[0.62, 0.38]
    )
    shown = [("limit", chart.limit, COLORS[40000], "solid", 3)]
    if worst.cuts.tool:
        shown.append(("robot alone, zero order", chart.robot_alone, "#999999", "dash", 2))
    else:
        shown.append(("zero order", chart.zero_order, COLORS[20000], "dot", 2))
    for name, depth, color, dash, width in shown:
        line = {"color": color, "dash": dash, "width": width}
        figure.add_scatter(
            x=chart.rpm, y=1e3 * np.where(np.isfinite(depth), depth, np.nan), line=line, name=name,
            mode="lines", row=1, col=1,
        )  # fmt: skip
    cut = worst.placed.cut
    figure.add_scatter(
        x=[cut.rpm], y=[1e3 * cut.depth], mode="markers", name="the slot", row=1, col=1,
        marker={"symbol": "x", "size": 12, "color": MEAN},
    )  # fmt: skip
    figure.add_scatter(
        x=chart.rpm, y=chart.frequency, mode="markers", marker=frequency, name="frequency",
        row=2, col=1,
    )  # fmt: skip
    top = 1.25e3 * float(np.max(chart.limit[np.isfinite(chart.limit)]))
    figure.update_yaxes(title="depth [mm]", range=[0.0, top], row=1, col=1)
    figure.update_yaxes(title="frequency [Hz]", row=2, col=1)
    figure.update_xaxes(title="spindle [1/min]", row=2, col=1)
    if worst.cuts.tool:
        figure.update_xaxes(type="log")
        figure.update_yaxes(type="log", range=[-0.3, 2.0], row=1, col=1)
        figure.update_yaxes(type="log", row=2, col=1)
    return styled(figure, 1000, 560)


def stability_table(path: PathStability) -> str:
    """Return verdicts along the path of the slot, as Markdown."""
    rows = [
        (
            f"{judgement.placed.time:.2f}",
            f"{1e3 * judgement.placed.cut.depth:.2f}",
            "stable" if judgement.is_stable else "chatters",
            f"{judgement.vibration.growth:+.1f}",
            f"{judgement.vibration.frequency:.1f}",
            f"{1e3 * judgement.limit:.2f}",
            f"{1e3 * judgement.zero_order:.2f}",
        )
        for judgement in path.judgements
    ]
    head = ("t [s]", "depth [mm]", "verdict", "growth [1/s]", "frequency [Hz]", "limit [mm]")
    return table((*head, "zero order [mm]"), rows)


def stability_values() -> dict[str, object]:
    """Return what the page tells of stability, and save its pictures."""
    slow = slow_slot(SLOW_SPEEDS)
    save("milling_lobes", lobes(slow))
    save("milling_lobes_tool", lobes(slow_slot(ALL_SPEEDS, tool_mode=[TOOL])))
    tool = f"{TOOL['frequency_Hz']:.0f} Hz, {100.0 * TOOL['damping_ratio']:.0f} %,"
    tool += f" {TOOL['stiffness_N_m']:.0e} N/m".replace("e+07", "e7")
    cuts = judged_cuts(50)
    return {
        "stability": stability_table(slow),
        "tool": tool,
        "marched_of": len(cuts),
        "marched_right": sum(cut.agrees for cut in cuts),
    }


def write() -> None:
    """Run everything, and write page and pictures."""
    still = {speed: milled(quasistatic(speed)) for speed in SPEEDS}
    moving = {speed: milled(dynamic(speed)) for speed in SPEEDS}
    save("milling_forces", forces())
    across = {}
    pushed = {}
    for speed in SPEEDS:
        _, _, mean = rigid_forces(speed)
        across[speed] = mean[moving[speed].in_cut, 1].mean()
        pushed[speed] = still[speed].given_way[still[speed].in_cut, 1].mean()
    corrected = {speed: whole(speed) for speed in SPEEDS}
    save("milling_after", after(corrected))
    slow, fast = SPEEDS
    fill(
        "milling",
        **stability_values(),
        forces=force_table(moving),
        deviations=deviation_table(still, moving),
        fall=100.0 * (1.0 - across[fast] / across[slow]),
        compensation=compensation_table(corrected),
        fall_of_deviation=100.0 * (1.0 - pushed[fast] / pushed[slow]),
    )


if __name__ == "__main__":
    sys.exit(finish(write))

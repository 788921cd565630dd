"""Write the tables and pictures of docs/milling.md: make milling."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from coupling.case.case import Case
from coupling.path.deviation_parts import DeviationParts
from coupling.process.milling_force import MeanForce, MillingForce
from coupling.run.cut_check import CUT_STABILITY
from coupling.run.execute import Run
from coupling.stability.case_cut import CaseCuts
from coupling.stability.chart import speed_chart
from coupling.stability.path_stability import PathStability
from docs.scripts.experiment import Curve, Page, add_curves, results
from docs.scripts.page import table
from docs.scripts.pictures import save, styled
from docs.scripts.runs import compensated, coupled, example
from docs.scripts.stability_judge import COEFFICIENTS, MATERIALS, judged_cuts

PAGE = Page("milling")
SPEEDS = (20000, 40000)  # [1/min]
# Mean force across the feed in the paper's experiment at both speeds [N], ratio K_te/K_tc of the review
# for 7075-T6 [mm], and chips at both speeds [mm].
MEASURED, REVIEWED, CHIPS = (334.1, 209.6), 27.7 / 767.0, (0.2, 0.1)
COLORS = {20000: "#D55E00", 40000: "#0072B2"}
MEAN = "#333333"
# Samples of the static run [s]: the mean force has no ripple to resolve.
STATIC_SAMPLE = 0.005
# Shown of the forces, in the middle of the slot [s]: two turns of the slower spindle.
SHOWN = 6e-3
# Shown of what is left after compensation [s].
SHOWN_AFTER = 0.048
_UM = 1e6


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


ROBOTS = {"static": quasistatic, "dynamic": dynamic}


@cache
def pushed(robot: str, speed: int) -> Run:
    """Return the coupled run of a robot at a speed."""
    return coupled(ROBOTS[robot](speed))


def is_in_slot(case: Case) -> np.ndarray:
    """Return which samples are in the slot at full feed."""
    speed = np.gradient(case.desired.position[0, :, 0], case.desired.time)
    depth = -case.task.part.coordinates(case.desired.position[0])[:, 2]
    slot: np.ndarray = (depth > depth.max() - 1e-9) & (speed > 0.9999 * speed.max())
    return slot


def rigid_forces(speed: int) -> tuple[Case, np.ndarray, np.ndarray]:
    """Return the case of a speed, and on its desired path the forces of teeth and mean [N], (n, 3)."""
    case = dynamic(speed)
    assert isinstance(case.process, MillingForce)
    teeth = case.process.evaluate(case.desired)
    mean = MeanForce(case.process.milling).evaluate(case.desired)
    return case, teeth.wrench.before[0, :, :3], mean.wrench.before[0, :, :3]


def _spindle(speed: int) -> str:
    return f"{speed:,} 1/min"


def drawn_forces() -> go.Figure:
    """Draw the forces at both speeds over the same time, teeth and mean."""
    titles = [_spindle(speed) for speed in SPEEDS]
    figure = make_subplots(
        rows=2, cols=2, shared_xaxes=True, shared_yaxes=True, column_titles=titles,
        horizontal_spacing=0.04, vertical_spacing=0.06,
    )  # fmt: skip
    for column, speed in enumerate(SPEEDS, start=1):
        case, teeth, mean = rigid_forces(speed)
        path = case.desired
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


@PAGE.part
def forces() -> str:
    """Draw the forces on the desired path, and return their mean and range."""
    save("milling_forces", drawn_forces())
    rows = []
    for speed in SPEEDS:
        case, teeth, mean = rigid_forces(speed)
        slot = is_in_slot(case)
        chip = 8000.0 / (2.0 * speed)
        for axis, name in ((1, "across"), (0, "along"), (2, "axial (up)")):
            figures = (mean[slot, axis].mean(), teeth[slot, axis].min(), teeth[slot, axis].max())
            rows.append((_spindle(speed), f"{chip:g} mm", name, *(f"{f:.0f}" for f in figures)))
    return table(("spindle", "chip", "force", "mean [N]", "from [N]", "to [N]"), rows)


@PAGE.part
def deviations() -> str:
    """Return how far the process pushes the tool in the slot."""

    def pushes(case: tuple[str, int]) -> np.ndarray:
        robot, speed = case
        done = pushed(robot, speed).correction
        push = done.achieved.position[0] - done.unloaded.position[0]
        way: np.ndarray = _UM * push[is_in_slot(ROBOTS[robot](speed))].T
        return way

    return results(
        ("spindle", "robot"),
        {(_spindle(speed), robot): (robot, speed) for speed in SPEEDS for robot in ROBOTS},
        pushes,
        {
            "across, mean [um]": lambda way: f"{way[1].mean():.0f}",
            "across, from [um]": lambda way: f"{way[1].min():.0f}",
            "to [um]": lambda way: f"{way[1].max():.0f}",
            "along, mean [um]": lambda way: f"{way[0].mean():.0f}",
            "up, mean [um]": lambda way: f"{way[2].mean():.0f}",
        },
    )


@PAGE.part
def fall() -> str:
    """Return how far the mean force across falls with the speed, by its parts."""
    of_review = [chip / 4.0 + REVIEWED / np.pi for chip in CHIPS]
    scale = MEASURED[0] / of_review[0]
    across = {}
    for robot in ROBOTS:
        found = [pushed(robot, speed).of(CUT_STABILITY).force for speed in SPEEDS]
        across[robot] = [force for force in found if force is not None]
    pairs = {
        "measured [Flexible2008]": MEASURED,
        "rigid tool, K_te/K_tc of the review, scaled": [scale * force for force in of_review],
        "rigid tool, K_te/K_tc of the cases": [force.rigid_N for force in across["static"]],
        "robot that gives way, mean force": [force.robot_N for force in across["static"]],
        "robot that vibrates, every tooth": [force.robot_N for force in across["dynamic"]],
    }
    rows = (
        (name, f"{slow:.1f} N", f"{fast:.1f} N", f"{100.0 * (1.0 - fast / slow):.1f} %")
        for name, (slow, fast) in pairs.items()
    )
    return table(("", *map(_spindle, SPEEDS), "fall"), rows)


def teeth_apart(case: Case) -> float:
    """Return the time between two teeth [s]."""
    table = case.resolved["process"]
    return 60.0 / (table["teeth"] * table["spindle_speed_rpm"])


def parts_after(case: Case, run: Run) -> DeviationParts:
    """Return the parts of the deviation after compensation, part axes."""
    done = run.correction
    off = done.achieved.position[0] - done.desired.position[0]
    off = case.task.part.rotation.inv().apply(off)
    return DeviationParts.of(done.desired.time, off, teeth_apart(case))


@PAGE.part
def compensation() -> str:
    """Correct the cases as they stand, draw what remains across the feed, and return it."""
    cases = {speed: example(f"milling_{speed}") for speed in SPEEDS}
    runs = {speed: compensated(case) for speed, case in cases.items()}
    parts_by_speed = {speed: parts_after(cases[speed], run) for speed, run in runs.items()}
    save("milling_after", drawn_after(runs, parts_by_speed))
    rows = []
    for speed, run in runs.items():
        parts, slot = parts_by_speed[speed], is_in_slot(cases[speed])
        across = parts.highest[slot, 1].max(), parts.lowest[slot, 1].min()
        rows.append(
            (
                _spindle(speed),
                f"{_UM * run.deviation(run.before).maximum:.0f}",
                f"{_UM * run.deviation(run.correction.achieved).maximum:.2f}",
                f"{_UM * np.linalg.norm(parts.slow, axis=1).max():.2f}",
                f"{_UM * np.linalg.norm(parts.ripple, axis=1).max():.2f}",
                f"{_UM * across[1]:+.2f} to {_UM * across[0]:+.2f}",
                f"{_UM * parts.lowest[slot, 2].min():+.2f}",
            )
        )
    head = ("spindle", "before [um]", "after [um]", "slow part [um]", "ripple [um]")
    return table((*head, "walls [um]", "floor [um]"), rows)


def drawn_after(runs: Mapping[int, Run], parts_by_speed: Mapping[int, DeviationParts]) -> go.Figure:
    """Draw what remains across the feed in the middle of the slot, and its slow part."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.05)
    for row, (speed, run) in enumerate(runs.items(), start=1):
        parts, time = parts_by_speed[speed], 1e3 * run.correction.desired.time
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
        speeds, depths = [2e3, 3e3, 5e3, 1e4, 2e4, 3e4], [0.5, 1, 2, 5, 10, 20, 50]
        figure.update_xaxes(
            type="log", tickvals=speeds, ticktext=[f"{speed:.0f}" for speed in speeds]
        )
        figure.update_yaxes(type="log", range=[-0.3, 1.5], tickvals=depths, row=1, col=1)
        figure.update_yaxes(type="log", tickvals=[20, 50, 100, 200, 500, 1000], row=2, col=1)
    return styled(figure, 1000, 560)


@PAGE.part
def stability() -> str:
    """Draw the limits of the slot over the speed, and return the verdicts along its path."""
    path = slow_slot(SLOW_SPEEDS)
    save("milling_lobes", lobes(path))
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


@PAGE.part
def tool() -> str:
    """Draw the limits with a mode of the tool, and return the picture's caption."""
    save("milling_lobes_tool", lobes(slow_slot(ALL_SPEEDS, tool_mode=[TOOL])))
    frequency, ratio = f"{TOOL['frequency_Hz']:.0f} Hz", f"{100.0 * TOOL['damping_ratio']:.0f} %"
    return f"*Grey: the robot alone. Blue: with a tool of {frequency}, {ratio}, 2e7 N/m in series.*"


@PAGE.part
def marched() -> str:
    """Return how many random cuts marching in time judges alike."""
    cuts = judged_cuts(50)
    right = sum(cut.agrees for cut in cuts)
    judged = f"Of {len(cuts)} cuts of six robots, 15 % off the border"
    return f"{judged}, marching in time judges {right} alike."


if __name__ == "__main__":
    PAGE.write()

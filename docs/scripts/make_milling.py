"""Write the tables and pictures of docs/milling.md: make milling."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from coupling.case.case import Case
from coupling.path.deviation import DeviationParts
from coupling.run.cut_check import CUT_STABILITY
from coupling.run.execute import Run
from coupling.stability.case_cut import CaseCuts
from coupling.stability.chart import speed_chart
from coupling.stability.path_stability import PathStability
from docs.scripts.experiment import Curve, Page, add_curves, results
from docs.scripts.pictures import save, styled
from docs.scripts.runs import compensated, coupled, example
from docs.scripts.stability_judge import COEFFICIENTS, MATERIALS, judged_cuts

PAGE = Page("milling")
SPEEDS = {20000: "20,000 1/min", 40000: "40,000 1/min"}
# Mean force across the feed in the paper's experiment at both speeds [N], ratio K_te/K_tc of the review
# for 7075-T6 [mm], and chips at both speeds [mm].
MEASURED, REVIEWED, CHIPS = (334.1, 209.6), 27.7 / 767.0, (0.2, 0.1)
SLOW_COLOR, FAST_COLOR, MEAN, QUIET = "#D55E00", "#0072B2", "#333333", "#999999"
# Changes of the cases, linear joints: a quasi-static robot under the mean force, which has no ripple to
# resolve, and the moving robot under the force of every tooth.
ROBOTS: dict[str, dict[str, dict[str, Any]]] = {
    "static": {
        "robot": {"mode": "quasistatic", "torque_curve": "linear"},
        "process": {"force": "mean"},
        "tool_path": {"sample_s": 0.005},
    },
    "dynamic": {"robot": {"torque_curve": "linear"}},
}
# Shown of what is left after compensation [s].
SHOWN = 0.048
_UM = 1e6


@cache
def pushed(robot: str, speed: int) -> tuple[Case, Run]:
    """Return the case of a speed with one of `ROBOTS`, and its coupled run."""
    case = example(f"milling_{speed}", **ROBOTS[robot])
    return case, coupled(case)


@cache
def corrected(speed: int) -> tuple[Run, DeviationParts, np.ndarray]:
    """Return the corrected run of a speed, its deviation's parts, part axes, and what is in the slot."""
    case = example(f"milling_{speed}")
    run, process = compensated(case), case.resolved["process"]
    path = run.correction.desired
    off = case.task.part.rotation.inv().apply(
        run.correction.achieved.position[0] - path.position[0]
    )
    between_teeth = 60.0 / (process["teeth"] * process["spindle_speed_rpm"])
    return run, DeviationParts.of(path.time, off, between_teeth), is_in_slot(case)


def is_in_slot(case: Case) -> np.ndarray:
    """Return which samples are in the slot at full feed."""
    speed = np.gradient(case.desired.position[0, :, 0], case.desired.time)
    depth = -case.task.part.coordinates(case.desired.position[0])[:, 2]
    slot: np.ndarray = (depth > depth.max() - 1e-9) & (speed > 0.9999 * speed.max())
    return slot


@PAGE.part
def deviations() -> str:
    """Return how far the process pushes the tool in the slot."""

    def pushes(titles: tuple[int, str]) -> np.ndarray:
        speed, robot = titles
        case, run = pushed(robot, speed)
        push = run.correction.achieved.position[0] - run.correction.unloaded.position[0]
        way: np.ndarray = _UM * push[is_in_slot(case)].T
        return way

    return results(
        ("spindle", "robot"),
        {(words, robot): (speed, robot) for speed, words in SPEEDS.items() for robot in ROBOTS},
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
    across = {}
    for robot in ROBOTS:
        forces = [pushed(robot, speed)[1].finding_of(CUT_STABILITY).force for speed in SPEEDS]
        across[robot] = [force for force in forces if force is not None]
    return results(
        ("",),
        {
            "measured [Flexible2008]": MEASURED,
            "rigid tool, K_te/K_tc of the review, scaled": [
                MEASURED[0] / of_review[0] * force for force in of_review
            ],
            "rigid tool, K_te/K_tc of the cases": [force.rigid_N for force in across["static"]],
            "robot that gives way, mean force": [force.robot_N for force in across["static"]],
            "robot that vibrates, every tooth": [force.robot_N for force in across["dynamic"]],
        },
        tuple,
        {
            SPEEDS[20000]: lambda pair: f"{pair[0]:.1f} N",
            SPEEDS[40000]: lambda pair: f"{pair[1]:.1f} N",
            "fall": lambda pair: f"{100.0 * (1.0 - pair[1] / pair[0]):.1f} %",
        },
    )


@PAGE.part
def compensation() -> str:
    """Correct the cases as they stand, draw what remains across the feed, and return it."""

    def walls(titles: tuple[Run, DeviationParts, np.ndarray]) -> str:
        _, parts, slot = titles
        return (
            f"{_UM * parts.lowest[slot, 1].min():+.2f} to {_UM * parts.highest[slot, 1].max():+.2f}"
        )

    save("milling_after", drawn_after())
    return results(
        ("spindle",),
        {words: speed for speed, words in SPEEDS.items()},
        corrected,
        {
            "before [um]": lambda c: f"{_UM * c[0].deviation(c[0].before).maximum:.0f}",
            "after [um]": lambda c: f"{_UM * c[0].deviation(c[0].correction.achieved).maximum:.2f}",
            "slow part [um]": lambda c: f"{_UM * np.linalg.norm(c[1].slow, axis=1).max():.2f}",
            "ripple [um]": lambda c: f"{_UM * np.linalg.norm(c[1].ripple, axis=1).max():.2f}",
            "walls [um]": walls,
            "floor [um]": lambda c: f"{_UM * c[1].lowest[c[2], 2].min():+.2f}",
        },
    )


def drawn_after() -> go.Figure:
    """Draw what remains across the feed in the middle of the slot, and its slow part."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.05)
    colors = (SLOW_COLOR, FAST_COLOR)
    for row, (speed, color) in enumerate(zip(SPEEDS, colors, strict=True), start=1):
        run, parts, _ = corrected(speed)
        time = run.correction.desired.time
        begin = np.searchsorted(time, 0.5 * time[-1])
        rows = slice(begin, np.searchsorted(time, time[begin] + SHOWN))
        moment, slow = 1e3 * (time[rows] - time[begin]), _UM * parts.slow[rows, 1]
        whole = slow + _UM * parts.ripple[rows, 1]
        curves = [
            Curve(f"{SPEEDS[speed]}, tooth by tooth", moment, whole, color, 1),
            Curve(f"{SPEEDS[speed]}, slow part", moment, slow, MEAN, 2),
        ]
        add_curves(figure, curves, row=row, col=1)
        figure.update_yaxes(title="across the feed [um]", row=row, col=1)
    figure.update_xaxes(title="time [ms]", row=2, col=1)
    return styled(figure, 1000, 560)


# The cut of the lobes: a slot in titanium with another robot, 2 mm deep at 3000 1/min.
SLOT: dict[str, dict[str, Any]] = {
    "robot": {"description": "fanuc_r2000ic", "home_deg": [0.0, 10.0, -10.0, 0.0, -70.0, 0.0]},
    "part": {"position_m": [1.6, 0.0, 0.6]},
    "tool_path": {
        "points_m": [[0.0, 0.0, 1e-3], [0.01, 0.0, -2e-3], [0.03, 0.0, -2e-3], [0.04, 0.0, 1e-3]],
        "feed_m_s": 0.02,
        "sample_s": 0.001,
    },
    "process": {
        "spindle_speed_rpm": 3000.0,
        **dict(zip(COEFFICIENTS, MATERIALS[2], strict=True)),
    },
}
# A mode of tool, holder and spindle, told in the picture's caption.
TOOL = {"frequency_Hz": 1200.0, "damping_ratio": 0.03, "stiffness_N_m": 2.0e7}


def slot_stability(speeds: list[float], **keys: Any) -> PathStability:
    """Return the stability of the slot along its path, over speeds [1/min]."""
    case = example("milling_20000", **SLOT, stability={"spindle_rpm": speeds, **keys})
    path = PathStability.of(CaseCuts(case), 8)
    assert path is not None
    return path


def lobes(path: PathStability) -> go.Figure:
    """Draw limiting depth over speed, and the frequency below it."""
    worst = path.worst
    chart = speed_chart(worst, lambda what, done, total: None)
    rpm, limit, zero_order, robot_alone = (
        factor * np.array(values, dtype=float)
        for factor, values in (
            (1.0, chart.rpm),
            (1e3, chart.limit_m),
            (1e3, chart.zero_order_m),
            (1e3, chart.robot_alone_m),
        )
    )
    figure = make_subplots(
        rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.05, row_heights=[0.62, 0.38]
    )
    quick = (
        Curve("robot alone, zero order", rpm, robot_alone, QUIET, 2, "dash")
        if worst.cuts.tool
        else Curve("zero order", rpm, zero_order, SLOW_COLOR, 2, "dot")
    )
    add_curves(figure, [Curve("limit", rpm, limit, FAST_COLOR, 3), quick], row=1, col=1)
    cut = worst.placed.cut
    marks = {
        "the slot": ([cut.rpm], [1e3 * cut.depth], {"symbol": "x", "size": 12, "color": MEAN}),
        "frequency": (rpm, chart.frequency_Hz, {"color": SLOW_COLOR, "size": 5}),
    }
    for row, (name, (x, y, marker)) in enumerate(marks.items(), start=1):
        figure.add_scatter(x=x, y=y, mode="markers", name=name, marker=marker, row=row, col=1)
    figure.update_yaxes(title="depth [mm]", range=[0.0, 1.25 * np.nanmax(limit)], row=1, col=1)
    figure.update_yaxes(title="frequency [Hz]", row=2, col=1)
    figure.update_xaxes(title="spindle [1/min]", row=2, col=1)
    if worst.cuts.tool:
        speeds = [2000, 3000, 5000, 10000, 20000, 30000]
        figure.update_xaxes(type="log", tickvals=speeds, ticktext=[f"{speed}" for speed in speeds])
        depths, frequencies = [0.5, 1, 2, 5, 10, 20, 50], [20, 50, 100, 200, 500, 1000]
        figure.update_yaxes(type="log", range=[-0.3, 1.5], tickvals=depths, row=1, col=1)
        figure.update_yaxes(type="log", tickvals=frequencies, row=2, col=1)
    return styled(figure, 1000, 560)


@PAGE.part
def stability() -> str:
    """Draw the limits of the slot over the speed, and return the verdicts along its path."""
    path = slot_stability([1500.0, 6000.0])
    save("milling_lobes", lobes(path))
    return results(
        ("t [s]",),
        {f"{judgement.placed.time:.2f}": judgement for judgement in path.judgements},
        lambda judgement: judgement,
        {
            "depth [mm]": lambda j: f"{1e3 * j.placed.cut.depth:.2f}",
            "verdict": lambda j: "stable" if j.is_stable else "chatters",
            "growth [1/s]": lambda j: f"{j.vibration.growth:+.1f}",
            "frequency [Hz]": lambda j: f"{j.vibration.frequency:.1f}",
            "limit [mm]": lambda j: f"{1e3 * j.limit:.2f}",
            "zero order [mm]": lambda j: f"{1e3 * j.zero_order:.2f}",
        },
    )


@PAGE.part
def tool() -> str:
    """Draw the limits with a mode of the tool, and return the picture's caption."""
    save("milling_lobes_tool", lobes(slot_stability([2000.0, 30000.0], tool_mode=[TOOL])))
    return "*Grey: the robot alone. Blue: with a tool of 1200 Hz, 3 %, 2e7 N/m in series.*"


@PAGE.part
def marched() -> str:
    """Return how many random cuts marching in time judges alike."""
    right = sum(cut.agrees for cut in judged_cuts(50))
    return f"Of 50 cuts of six robots, 15 % off the border, marching in time judges {right} alike."


if __name__ == "__main__":
    PAGE.write()

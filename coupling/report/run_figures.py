"""Figures along the path: how far the tool is off, and which gear reverses there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from coupling.path.deviation import shares_of_time
from coupling.path.histories import ToolPath
from coupling.path.length_text import length_unit
from coupling.report.colours import AFTER, AS_FILED, BEFORE, DESIRED, GREEN, PLANT, QUIET
from coupling.report.part_deviation import signed_deviation
from coupling.report.run_scene import EXPECTED
from coupling.report.run_tables import mode_names
from coupling.report.shares import spike
from coupling.report.style import FLOOR_UM, Keys, curve, drawn, log_axis, row, rows, rule
from coupling.results.gear_result import BacklashReversal
from coupling.results.run_result import shown_name
from coupling.results.section import UM
from coupling.run.stored_run import StoredRobot

# Height of a row of labels, of the curves and of a gear's row below them [px].
_LABEL, _CURVES, _GEAR = 20, 300, 26
# Directions of a deviation on the part, and teeth that pass in a figure of them.
_DIRECTIONS, _PASSINGS = ("normal", "along", "across"), 4
# Labels of one gear at most, how far they are apart, as a part of the path's time, and the height of a
# spike that is seen, as a part of the axis.
_LABELS, _APART, _VISIBLE = 4, 0.2, 0.03
# Behind this part of the path's time labels stand before their lines, and where that of a gear above
# would pass through them: of a label's width, as a part of that time.
_LATE, _WIDTH = 0.9, 0.07


def _colored_paths(run: StoredRobot) -> list[tuple[str, str, ToolPath]]:
    """Return name, color and path: before, on a robot to be expected, and if the file is right."""
    (first, before), *others = run.actual.items()
    paths = [(shown_name(first), BEFORE, before)]
    if run.expected is not None:
        paths.append((EXPECTED, AFTER, run.expected))
    color = AFTER if run.expected is None else AS_FILED
    return [*paths, *((shown_name(stage), color, path) for stage, path in others)]


def deviation(run: StoredRobot, tolerance: float | None = None) -> go.Figure:
    """Distance of the actual paths to the desired one, with the gears that reverse.

    Args:
        tolerance: Deviation that the part allows [m]; None where it is not stated.
    """
    changes = run.figures.reversals
    gears = sorted({change.joint for change in changes})
    below = _GEAR * len(gears)
    height = _CURVES + _LABEL * len(gears) + below
    mode, other_mode = mode_names(run.figures.mode)
    paths: list[tuple[str, ToolPath, Keys]] = []
    others = {shown_name(stage): path for stage, path in run.other.items()}
    for name, color, path in _colored_paths(run):
        shown = name if name == EXPECTED else f"{name}, {mode}"
        paths.append((shown, path, {"color": color, "width": 1.5}))
        if name in others:
            line = {"color": color, "dash": "dot", "width": 1.0}
            paths.append((f"{name}, {other_mode}", others[name], line))
    if run.plant is not None:
        paths.append(("on the plant", run.plant, {"color": PLANT, "width": 1.5}))
    distances = [path.distance_to(run.desired) for _, path, _ in paths]
    factor, unit = length_unit(*(float(distance.max()) for distance in distances))
    traces: list[Keys] = [
        {
            **curve(path.time, factor * distance),
            "name": name,
            "mode": "lines",
            "line": line,
            # The robot in the other mode answers another question: it is shown when asked for.
            **({"visible": "legendonly"} if line.get("dash") else {}),
            **row(1),
        }
        for (name, path, line), distance in zip(paths, distances, strict=True)
    ]
    visible_maxima = [
        float(factor * d.max())
        for (_, _, line), d in zip(paths, distances, strict=True)
        if not line.get("dash")
    ]
    top, labels = _labels(max(visible_maxima), factor, run, gears)
    upright: list[Keys] = [{"title": f"distance [{unit}]", "range": [0.0, top]}]
    shares = [1.0]
    if gears:
        traces += _gears(changes, gears)
        upright.append(_gear_axis(gears))
        shares = [height - below, below]
    axes = rows(shares, 0.06, upright)
    end = float(run.desired.time[-1])
    for k in range(len(upright)):
        axes[f"xaxis{k + 1 if k else ''}"]["range"] = [float(run.desired.time[0]), end]
    allowed = [] if tolerance is None else [tolerance_rule(factor * tolerance)]
    return drawn(
        traces, height + 74, annotations=labels, shapes=allowed, meta={"log": True}, **axes
    )


def tolerance_rule(height: float) -> Keys:
    """Return the line of the part's tolerance at a height in the unit of the axis."""
    return {
        **rule("y", height, color=GREEN, dash="dash", width=1.5),
        "label": {"text": "tolerance", "textposition": "end", "font": {"color": GREEN}},
    }


def _labels(
    largest: float, factor: float, run: StoredRobot, gears: list[int]
) -> tuple[float, list[Keys]]:
    """Name the gears at the largest spikes of their reversals, each in a row above the curves.

    Args:
        largest: Largest distance that is visible_maxima, in the unit of the axis.
        factor: Number of its units in a metre.

    Returns:
        Upper end of the axis, and the labels.
    """
    span = max(largest, 1e-9)
    high = _LABEL * span / _CURVES
    top = 1.05 * span
    duration = float(np.ptp(run.desired.time))
    late = float(run.desired.time[0]) + _LATE * duration
    spikes = [
        (number, joint, time, factor * distance)
        for number, joint in enumerate(reversed(gears))
        for time, distance in labelled(run, joint)
        if factor * distance > _VISIBLE * top
    ]

    def is_before(number: int, time: float) -> bool:
        behind = [at - time for above, _, at, _ in spikes if above > number]
        return time >= late or any(0.0 < apart < _WIDTH * duration for apart in behind)

    return top + high * (len(gears) + 0.3), [
        {
            "x": time,
            "y": height,
            "ax": time,
            "ay": top + high * (number + 0.5),
            "axref": "x",
            "ayref": "y",
            "text": f"joint {joint}",
            "font": {"size": 11},
            # Beside its line, which passes the names of gears below.
            "xanchor": "right" if is_before(number, time) else "left",
            "showarrow": True,
            "arrowhead": 6,
            "arrowsize": 0.6,
            "arrowwidth": 1,
            "arrowcolor": QUIET,
            "standoff": 2,
        }
        for number, joint, time, height in spikes
    ]


def labelled(run: StoredRobot, joint: int) -> list[tuple[float, float]]:
    """Return times [s] and heights [m] of the largest spikes where a gear reverses."""
    *_, last = run.actual.values()
    path = last if run.expected is None else run.expected
    distance = path.distance_to(run.desired)
    reversals = [c for c in run.figures.reversals if c.joint == joint]
    spikes = sorted(
        (spike(path.time, distance, change) for change in reversals), key=lambda s: -s[1]
    )
    apart = _APART * float(np.ptp(path.time))
    spans: list[tuple[float, float]] = []
    for time, height in spikes:
        if len(spans) < _LABELS and all(abs(time - other) > apart for other, _ in spans):
            spans.append((time, height))
    return spans


def _gears(changes: Sequence[BacklashReversal], gears: list[int]) -> list[Keys]:
    """Return when which gear is in its backlash, and which flank it reaches."""
    heights = {joint: number for number, joint in enumerate(gears)}
    in_backlash = {
        "x": [time for c in changes for time in (c.begins, c.ends, None)],
        "y": [heights[c.joint] for c in changes for _ in range(3)],
        "mode": "lines",
        "name": "gear in its backlash",
        "line": {"color": QUIET, "width": 6},
        "hoverinfo": "skip",
        **row(2),
    }
    traces: list[Keys] = [in_backlash]
    for side, symbol, color in ((1, "triangle-up", BEFORE), (-1, "triangle-down", AFTER)):
        changes_to_side = [c for c in changes if c.after == side]
        reached = {
            "x": [c.ends for c in changes_to_side],
            "y": [heights[c.joint] for c in changes_to_side],
            "mode": "markers",
            "name": f"reaches its {'upper' if side > 0 else 'lower'} flank",
            "marker": {"symbol": symbol, "color": color, "size": 7},
            "text": [_hint(c) for c in changes_to_side],
            "hoverinfo": "text",
            **row(2),
        }
        traces.append(reached)
    return traces


def _gear_axis(gears: list[int]) -> Keys:
    return {
        "tickvals": list(range(len(gears))),
        "ticktext": [f"joint {joint}" for joint in gears],
        "range": [-0.7, len(gears) - 0.3],
        "zeroline": False,
    }


def _hint(change: BacklashReversal) -> str:
    return f"joint {change.joint}, {change.begins:.4f} to {change.ends:.4f} s"


def components(run: StoredRobot, tolerance: float | None = None) -> go.Figure:
    """Deviation of the actual paths normal to the part, along the feed and across, on one scale.

    Args:
        tolerance: Deviation that the part allows [m]; None where it is not stated.
    """
    signed = [
        (name, color, signed_deviation(run.desired, path))
        for name, color, path in _colored_paths(run)
    ]
    largest = max(float(np.abs(values).max()) for _, _, values in signed)
    factor, unit = length_unit(largest)
    traces = [
        {
            **curve(run.desired.time, factor * values[:, k]),
            "name": name,
            "legendgroup": name,
            "showlegend": k == 0,
            "mode": "lines",
            "line": {"color": color, "width": 1.3},
            **row(k + 1),
        }
        for k in range(len(_DIRECTIONS))
        for name, color, values in signed
    ]
    end = 1.05 * factor * largest
    ends = [-max(end, 1e-9), max(end, 1e-9)]
    axes = rows(
        [1.0] * 3, 0.05, [{"title": f"{name} [{unit}]", "range": ends} for name in _DIRECTIONS]
    )
    shapes = []
    if tolerance is not None and factor * tolerance < ends[1]:
        for side in (-1.0, 1.0):
            shapes.append(rule("y", side * factor * tolerance, color=GREEN, dash="dash", width=1))
    return drawn(traces, 520, shapes=shapes, **axes)


def wrench(run: StoredRobot) -> go.Figure:
    """Force and moment on the tool over time, with their means."""
    time = run.wrench.time
    return _wrenches(run, np.ones(len(time), dtype=bool))


def tooth_passings(run: StoredRobot) -> list[go.Figure]:
    """Force and moment where the force is largest, as long as a few teeth pass; none without teeth."""
    teeth = run.figures.tooth_passing
    if teeth is None:
        return []
    time = run.wrench.time
    largest = time[np.linalg.norm(run.wrench.wrench[0][:, :3], axis=1).argmax()]
    half = 0.5 * _PASSINGS * teeth.period_s
    middle = np.clip(largest, time[0] + half, max(time[-1] - half, time[0] + half))
    return [_wrenches(run, np.abs(time - middle) <= half)]


def _wrenches(run: StoredRobot, chosen: np.ndarray) -> go.Figure:
    """Draw force and moment at chosen samples, a mask (n,)."""
    time, values = run.wrench.time[chosen], run.wrench.wrench[0][chosen]
    moments = bool(np.any(values[:, 3:]))
    kinds = (("f", "force [N]"), ("m", "moment [N m]"))[: 1 + moments]
    traces: list[Keys] = []
    for number, (letter, _) in enumerate(kinds):
        for k, (axis, color) in enumerate(zip("xyz", (AFTER, GREEN, BEFORE), strict=True)):
            line = values[:, k + 3 * number]
            mean = float(shares_of_time(time) @ line) if len(time) > 1 else float(line.mean())
            group = {"legendgroup": f"{letter}{axis}", **row(number + 1), "mode": "lines"}
            shown = {**curve(time, line), "name": f"{letter}{axis}", **group}
            traces.append({**shown, "line": {"color": color, "width": 1.3}})
            level = {"x": [float(time[0]), float(time[-1])], "y": [mean, mean], **group}
            dashed = {"color": color, "width": 1.2, "dash": "dash"}
            traces.append({**level, "showlegend": False, "line": dashed})
    axes = rows([1.0] * len(kinds), 0.08, [{"title": title} for _, title in kinds])
    return drawn(traces, 300 + 180 * moments, **axes)


def convergence(run: StoredRobot) -> go.Figure:
    """Path change of every process evaluation and deviation of every iteration, logarithmic."""
    traces: list[Keys] = []
    count = 0
    ends: list[tuple[int, float]] = []
    for entry in run.figures.iterations:
        numbers = [count + k + 1 for k in range(len(entry.evaluations))]
        for name, changes, dash in (
            ("max", [evaluation.path_change for evaluation in entry.evaluations], "solid"),
            ("rms", [evaluation.path_change_rms for evaluation in entry.evaluations], "dot"),
        ):
            change = {
                "x": numbers,
                "y": [max(UM * change, FLOOR_UM) for change in changes],
                "mode": "lines+markers",
                "name": f"path change, {name}",
                "legendgroup": f"path_change_{name}_m",
                "showlegend": count == 0,
                "line": {"color": DESIRED, "dash": dash, "width": 1.5},
            }
            traces.append(change)
        count += len(numbers)
        ends.append((count, UM * entry.deviation.maximum))
    corrections = {
        "x": [number for number, _ in ends],
        "y": [max(value, FLOOR_UM) for _, value in ends],
        "mode": "lines+markers",
        "name": "deviation from the desired path, max",
        "line": {"color": AFTER, "width": 3},
        "marker": {"size": 10},
    }
    across = {"title": "evaluation of the process", "dtick": max(count // 12, 1)}
    return drawn([*traces, corrections], 300, xaxis=across, yaxis=log_axis(title="distance [um]"))

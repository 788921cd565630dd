"""Write tables and picture of docs/comparison.md from runs of both implementations: make comparison."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from functools import cache
from operator import itemgetter

import numpy as np
import plotly.graph_objects as go

from coupling.path.histories import ToolPath
from docs.scripts.experiment import Curve, Page, add_curves, results
from docs.scripts.page import table
from docs.scripts.pictures import save, styled
from examples.compare_implementations import (
    CURVES,
    LOAD,
    NO_LOAD,
    STEPS,
    Both,
    at_rest,
    desired,
    iso_path,
    kinematics,
    release,
    rest_at_start,
    rms,
    robot,
    settling_time,
)

PAGE = Page("comparison")
# Colours that stay apart for colour-blind eyes (Okabe and Ito).
COLORS = {"linear": "#0072B2", "backlash": "#D55E00", "spline": "#009E73"}
# A blend [s] with which sharp backlash amplifies errors far more.
SENSITIVE_BLEND = 0.25
# Distances below this [m] are rounding; the logarithmic axis ends there.
_ROUNDING = 1e-15
_UM, _MM = 1e6, 1e3


def differences(paths: Mapping[str, Both]) -> go.Figure:
    """Draw the distance between the implementations over time."""
    figure = add_curves(
        go.Figure(),
        (
            Curve(
                CURVES[curve],
                both.ours.time,
                np.maximum(both.distance, _ROUNDING),
                COLORS[curve],
                1.3,
            )
            for curve, both in paths.items()
        ),
    )
    figure.update_xaxes(title="time [s]")
    figure.update_yaxes(
        title="distance of the two tools [m]", type="log", dtick=2, exponentformat="power"
    )
    return styled(figure, 1000, 360)


@PAGE.part
def statics() -> str:
    """Return the differences of kinematics and rest between the implementations."""
    cases = {"(a) neither gravity nor load": kinematics()}
    for curve, name in CURVES.items():
        cases[f"(b) gravity, {name}"] = at_rest(robot, curve, NO_LOAD)
        cases[f"(b) gravity and load, {name}"] = at_rest(robot, curve, LOAD)
    columns = {
        "position [m]": lambda both: f"{both.distance.max():.1e}",
        "orientation [rad]": lambda both: f"{both.angle.max():.1e}",
    }
    return results(("largest difference over ten postures",), cases, lambda both: both, columns)


@PAGE.part
def sag_and_settling() -> str:
    """Return sag and settling time of the robot where the path begins."""
    height = desired().position[0, 0, 2]

    def figures(curve: str) -> list[str]:
        rest, fall = rest_at_start(curve), release(curve).both()
        paths = ((rest.ours, fall.ours), (rest.mujoco, fall.mujoco))
        sags = (f"{_MM * (path.position[0, 0, 2] - height):.6f}" for path, _ in paths)
        return [*sags, *(f"{settling_time(path):.3f}" for _, path in paths)]

    heads = ("sag [mm]", "by MuJoCo", "settling time [s]", "by MuJoCo ")
    columns = {head: itemgetter(k) for k, head in enumerate(heads)}
    return results(("",), {name: curve for curve, name in CURVES.items()}, figures, columns)


@cache
def followed() -> Mapping[str, Both]:
    """Return the path as both implementations follow it, by torque curve."""
    return {curve: iso_path(curve).both() for curve in CURVES}


@PAGE.part
def between_implementations() -> str:
    """Draw their differences along the path, and return them beside what MuJoCo's step is worth."""
    save("comparison_differences", differences(followed()))
    rows = []
    for curve, both in followed().items():
        change = iso_path(curve).mujoco(2.0 * STEPS[curve]).distance_to(both.mujoco)
        figures = (both.distance.max(), rms(both.distance), change.max())
        cells = (f"{figure:.1e}" for figure in figures)
        rows.append((CURVES[curve], *cells, f"{_MM * STEPS[curve]:g}"))
    head = ("", "max [m]", "rms [m]", "MuJoCo with half the step, max [m]", "that step [ms]")
    return table(head, rows)


@PAGE.part
def between_torque_curves() -> str:
    """Return the differences of the paths from the rigid one and from each other."""

    def row(name: str, pairs: Iterable[tuple[ToolPath, ToolPath]]) -> list[str]:
        distances = [_UM * first.distance_to(second) for first, second in pairs]
        largest = [f"{distance.max():.3f}" for distance in distances]
        return [name, *largest, *(f"{rms(distance):.3f}" for distance in distances)]

    rigid, paths = desired(), followed()
    rows = [
        row(f"rigid / {CURVES[curve]}", ((both.ours, rigid), (both.mujoco, rigid)))
        for curve, both in paths.items()
    ]
    for (one, first), (other, second) in itertools.combinations(paths.items(), 2):
        pairs = ((first.ours, second.ours), (first.mujoco, second.mujoco))
        rows.append(row(f"{CURVES[one]} / {CURVES[other]}", pairs))
    return table(("between", "max [um]", "by MuJoCo", "rms [um]", "by MuJoCo"), rows)


@PAGE.part
def sensitive() -> str:
    """Return how far the implementations differ where sharp backlash amplifies errors."""
    sharp = iso_path("backlash", blend=SENSITIVE_BLEND)
    parted = sharp.both()
    half = len(parted.distance) // 2
    coarse = sharp.mujoco(2.0 * STEPS["backlash"])
    rounded = iso_path("spline", blend=SENSITIVE_BLEND).both()
    return (
        f"With the speed rising within {SENSITIVE_BLEND:g} s the implementations differ by"
        f" {parted.distance[:half].max():.1e} m in the first half of the path and by"
        f" {parted.distance.max():.1e} m at the end, MuJoCo's paths with full and half step by"
        f" {parted.mujoco.distance_to(coarse).max():.1e} m; with rounded corners by"
        f" {rounded.distance.max():.1e} m."
    )


if __name__ == "__main__":
    PAGE.write()

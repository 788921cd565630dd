"""Draw the README's picture from results/cone (make run): make figures."""

import sys
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from coupling.path.histories import ToolPath
from coupling.report.colours import AFTER, BEFORE, DESIRED
from coupling.report.views import rows_in_space
from coupling.run.stored_run import StoredRobot, read_run
from docs.scripts.experiment import Curve, add_curves
from docs.scripts.page import finish
from docs.scripts.pictures import save

RESULT = Path(__file__).parents[2] / "results" / "cone"
HEIGHT = 460


def cone() -> list[go.Figure]:
    """Return the path in space and the deviation along it."""
    run = read_run(RESULT).first
    space = paths(run, amplification(run))
    states = (("before", run.uncompensated, BEFORE), ("after", run.achieved, AFTER))
    curves = (
        Curve(name, path.time, 1e6 * path.distance_to(run.desired), color, 1)
        for name, path, color in states
    )
    along = add_curves(go.Figure(), curves)
    along.update_yaxes(title="deviation of the tool [um]", type="log", range=[-3.6, 3.8], dtick=1)
    along.update_xaxes(title="time [s]")
    along.update_layout(template="plotly_white", height=HEIGHT, width=560)
    along.update_layout(margin={"t": 40, "b": 50, "r": 20}, legend={"orientation": "h", "y": 1.1})
    return [space, along]


def amplification(run: StoredRobot) -> int:
    """Return a round factor that makes the first deviation about a tenth of the path's size."""
    largest = run.uncompensated.distance_to(run.desired).max()
    size = np.ptp(run.desired.position[0], axis=0).max()
    factor = max(0.1 * size / largest, 1.0)
    digit = 10.0 ** np.floor(np.log10(factor))
    return int(digit * max(d for d in (1, 2, 5) if d * digit <= factor))


def paths(run: StoredRobot, factor: int) -> go.Figure:
    """Draw the desired path and the actual ones in space, deviations amplified."""
    figure = go.Figure()
    rows = rows_in_space(run.desired.time)

    def add(path: ToolPath, name: str, color: str, width: float) -> None:
        desired = run.desired.position[0, rows]
        x, y, z = 1e3 * (desired + factor * (path.position[0, rows] - desired)).T
        figure.add_scatter3d(
            x=x, y=y, z=z, mode="lines", name=name, line={"color": color, "width": width}
        )

    add(run.desired, "desired", DESIRED, 2)
    for (name, path), color in zip(run.actual.items(), (BEFORE, AFTER), strict=False):
        add(path, f"{name}, deviation x {factor}", color, 3)
    axes: dict[str, dict[str, object]] = {
        f"{axis}axis": {"title": f"{axis} [mm]"} for axis in "xyz"
    }
    axes["zaxis"]["nticks"] = 3
    eye, center = {"x": 1.95, "y": 1.95, "z": 1.1}, {"x": 0.0, "y": 0.0, "z": -0.05}
    camera = {"eye": eye, "center": center}
    figure.update_layout(scene={**axes, "aspectmode": "data", "camera": camera})
    return figure.update_layout(
        template="plotly_white",
        height=HEIGHT,
        width=540,
        margin={"l": 0, "r": 0, "t": 30, "b": 0},
        legend={"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        font={"family": "system-ui, sans-serif", "size": 13},
    )


if __name__ == "__main__":
    sys.exit(finish(lambda: save("cone", *cone())))

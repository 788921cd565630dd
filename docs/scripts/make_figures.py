"""Draw the README's picture from results/cone (make run): make figures."""

import sys
from pathlib import Path

import plotly.graph_objects as go

from coupling.report import figures
from coupling.run.stored_run import read_run
from docs.scripts.page import finish
from docs.scripts.pictures import save

RESULT = Path(__file__).parents[2] / "results" / "cone"
HEIGHT = 460


def cone() -> list[go.Figure]:
    """Return the path in space and the deviation along it."""
    run = read_run(RESULT).first
    factor = figures.amplification(run)
    space = figures.paths(run, factor)
    space.update_layout(
        height=HEIGHT,
        width=540,
        scene_camera_eye={"x": 1.6, "y": 1.6, "z": 0.9},
        margin={"l": 0, "r": 0, "t": 30, "b": 0},
    )
    along = go.Figure()
    for path, name, color in (
        (run.uncompensated, "before", figures.BEFORE),
        (run.achieved, "after", figures.AFTER),
    ):
        distance = path.distance_to(run.desired)
        along.add_scatter(
            x=path.time, y=1e6 * distance, name=name, line={"color": color, "width": 1}
        )
    along.update_yaxes(title="deviation of the tool [um]", type="log", range=[-3.6, 3.8], dtick=1)
    along.update_xaxes(title="time [s]")
    along.update_layout(template="plotly_white", height=HEIGHT, width=560)
    along.update_layout(margin={"t": 40, "b": 50, "r": 20}, legend={"orientation": "h", "y": 1.1})
    return [space, along]


if __name__ == "__main__":
    sys.exit(finish(lambda: save("cone", *cone())))

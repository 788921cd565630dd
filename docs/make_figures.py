"""Draw the README's picture from results/cone (make run) with headless Chromium: make figures."""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import plotly.graph_objects as go
from plotly.io import to_html
from plotly.offline import get_plotlyjs

from coupling.report import figures
from coupling.results import read_run

DOCS = Path(__file__).parent
RESULT = DOCS.parent / "results" / "cone"
PICTURE = DOCS / "figures" / "cone.png"
WIDTH, HEIGHT = 1100, 460


def page() -> str:
    """Return a page with the path in space beside the deviation along it."""
    run = read_run(RESULT)
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
        along.add_scatter(x=path.time, y=1e6 * distance, name=name, line={"color": color})
    along.update_yaxes(title="deviation of the tool [um]", type="log", range=[-2.5, 3.8])
    along.update_xaxes(title="time [s]")
    along.update_layout(template="plotly_white", height=HEIGHT, width=560)
    along.update_layout(margin={"t": 40, "b": 50, "r": 20}, legend={"orientation": "h", "y": 1.1})
    quiet = {"displayModeBar": False}
    parts = [
        to_html(f, include_plotlyjs=False, full_html=False, config=quiet) for f in (space, along)
    ]
    return (
        f"<html><meta charset='utf-8'><script>{get_plotlyjs()}</script>"
        f"<body style='margin:0;display:flex'>{''.join(parts)}</body></html>"
    )


def main() -> int:
    """Write the picture; return the exit status."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        print("error: chromium is not installed; needed to draw the picture", file=sys.stderr)
        return 2
    PICTURE.parent.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "page.html")
        file.write_text(page(), encoding="utf-8")
        command = [
            chromium,
            *("--headless", "--no-sandbox", "--disable-quic", "--no-first-run"),
            *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
            *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars"),
            f"--user-data-dir={folder}/profile",
            f"--window-size={WIDTH},{HEIGHT}",
            "--virtual-time-budget=8000",
            f"--screenshot={PICTURE}",
            file.as_uri(),
        ]
        subprocess.run(command, check=True, capture_output=True)
    print(f"{PICTURE}: drawn")
    return 0


if __name__ == "__main__":
    sys.exit(main())

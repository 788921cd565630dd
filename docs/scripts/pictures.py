"""The pages' pictures: Plotly figures with one look, drawn as PNG by headless Chromium."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

import plotly.graph_objects as go
from plotly.io import to_html
from plotly.offline import get_plotlyjs

PICTURES = Path(__file__).parents[1] / "figures"


class NoBrowserError(RuntimeError):
    """There is no Chromium to draw with."""


def styled(figure: go.Figure, width: int, height: int) -> go.Figure:
    """Return the figure with the pages' look and a size in pixels."""
    figure.update_layout(
        template="plotly_white",
        width=width,
        height=height,
        margin={"l": 70, "r": 20, "t": 50, "b": 50},
        legend={"orientation": "h", "y": 1.14, "x": 0.5, "xanchor": "center"},
        font={"family": "system-ui, sans-serif", "size": 14},
    )
    return figure


def save(name: str, *figures: go.Figure) -> None:
    """Write figures beside each other as docs/figures/<name>.png; their layouts tell the size.

    Raises:
        NoBrowserError: If Chromium is not installed.
    """
    width = sum(int(figure.layout.width) for figure in figures)
    height = max(int(figure.layout.height) for figure in figures)
    quiet = {"displayModeBar": False}
    parts = [to_html(f, include_plotlyjs=False, full_html=False, config=quiet) for f in figures]
    photograph(
        name,
        f"<html><meta charset='utf-8'><script>{get_plotlyjs()}</script>"
        f"<body style='margin:0;display:flex'>{''.join(parts)}</body></html>",
        width,
        height,
    )


def photograph(name: str, page: str, width: int, height: int) -> None:
    """Write what a window of this size [px] shows of a page as docs/figures/<name>.png.

    Raises:
        NoBrowserError: If Chromium is not installed.
    """
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        raise NoBrowserError("expected chromium to draw the pictures with, got none: install it")
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        html = Path(folder, "page.html")
        html.write_text(page, encoding="utf-8")
        command = [
            chromium,
            *("--headless", "--no-sandbox", "--disable-quic", "--no-first-run"),
            *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
            *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars"),
            f"--user-data-dir={folder}/profile",
            f"--window-size={width},{height}",
            "--virtual-time-budget=8000",
            f"--screenshot={PICTURES / name}.png",
            html.as_uri(),
        ]
        subprocess.run(command, check=True, capture_output=True)

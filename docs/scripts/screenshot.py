"""Plotly figures as a PNG, drawn by headless Chromium."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import plotly.graph_objects as go
from plotly.io import to_html
from plotly.offline import get_plotlyjs


class NoBrowserError(RuntimeError):
    """There is no Chromium to draw with."""


def save_side_by_side(figures: Sequence[go.Figure], file: Path) -> None:
    """Write figures beside each other as one PNG; their layouts tell width and height.

    Raises:
        NoBrowserError: If Chromium is not installed.
    """
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        raise NoBrowserError("chromium is not installed; needed to draw the pictures")
    width = sum(int(figure.layout.width) for figure in figures)
    height = max(int(figure.layout.height) for figure in figures)
    quiet = {"displayModeBar": False}
    parts = [to_html(f, include_plotlyjs=False, full_html=False, config=quiet) for f in figures]
    page = (
        f"<html><meta charset='utf-8'><script>{get_plotlyjs()}</script>"
        f"<body style='margin:0;display:flex'>{''.join(parts)}</body></html>"
    )
    file.parent.mkdir(exist_ok=True)
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
            f"--screenshot={file}",
            html.as_uri(),
        ]
        subprocess.run(command, check=True, capture_output=True)

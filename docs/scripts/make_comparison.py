"""Write docs/comparison.md and its figures from runs of both implementations: make comparison."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib.metadata import version

from docs.scripts import comparison_figures as figures
from docs.scripts import comparison_tables as tables
from docs.scripts.comparison_figures import Window
from docs.scripts.page import fill, finish
from docs.scripts.pictures import save
from examples.compare_implementations import (
    BLEND,
    CURVES,
    FEED,
    RELEASE_TIME,
    SAMPLE,
    SIZE,
    STEPS,
    TOLERANCE,
    Both,
    desired,
    iso_path,
    part,
    release,
)

WHOLE = Window("", 0.0, 0.0, 0.225)
CORNER = Window("A", -0.1986, 0.1992, 0.0022)
SMALL = Window("B", 0.001, 0.0, 0.025)
# MuJoCo is marked at every so many samples.
CORNER_EVERY, SMALL_EVERY = 4, 20
# A blend [s] with which sharp backlash amplifies errors far more.
SENSITIVE_BLEND = 0.25
_SHOWN = 1.5  # of the release [s]


def draw(paths: Mapping[str, Both], falls: Mapping[str, Both]) -> None:
    """Write the pictures."""
    overall = figures.in_plane(paths, desired(), part, WHOLE, size=640)
    details = []
    for window, every in ((CORNER, CORNER_EVERY), (SMALL, SMALL_EVERY)):
        figures.mark(overall, window)
        detail = figures.in_plane(paths, desired(), part, window, size=560)
        figures.mark_mujoco(detail, paths, part, window, every)
        detail.update_layout(title={"text": f"<b>{window.name}</b>", "x": 0.02})
        details.append(detail)
    save("comparison_path", overall)
    save("comparison_details", *details)
    save("comparison_differences", figures.differences(paths))
    save("comparison_release", figures.released(falls, _SHOWN))


def write() -> None:
    """Run everything, and write page and pictures."""
    paths = {curve: iso_path(curve).both() for curve in CURVES}
    falls = {curve: release(curve).both() for curve in CURVES}
    draw(paths, falls)
    sharp = iso_path("backlash", blend=SENSITIVE_BLEND)
    rounded = iso_path("spline", blend=SENSITIVE_BLEND)
    parted = sharp.both()
    half = len(parted.distance) // 2
    coarse = sharp.mujoco(2.0 * STEPS["backlash"])
    fill(
        "comparison",
        mujoco=version("mujoco"),
        pin=version("pin"),
        tolerance=TOLERANCE,
        statics=tables.statics(),
        release=RELEASE_TIME,
        sag_and_settling=tables.sag_and_settling(falls),
        large=1e3 * SIZE,
        small=1e2 * SIZE,
        feed=1e3 * FEED,
        blend=BLEND,
        corner_ms=1e3 * CORNER_EVERY * SAMPLE,
        small_ms=1e3 * SMALL_EVERY * SAMPLE,
        between_torque_curves=tables.between_torque_curves(paths),
        between_implementations=tables.between_implementations(paths),
        other_blend=SENSITIVE_BLEND,
        part_half=parted.distance[:half].max(),
        part_whole=parted.distance.max(),
        part_mujoco=parted.mujoco.distance_to(coarse).max(),
        part_spline=rounded.both().distance.max(),
    )


if __name__ == "__main__":
    sys.exit(finish(write))

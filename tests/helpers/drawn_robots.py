"""Replays of a command on drawn robots: most of the time of a run, and left out of most tests."""

from __future__ import annotations

from coupling.run import drawn_plants

REPLAYS = drawn_plants.drawn_replays


def leave_out_drawn_robots() -> None:
    """Have runs in this process replay their command on none."""
    drawn_plants.drawn_replays = lambda *_: drawn_plants.DrawnReplays()

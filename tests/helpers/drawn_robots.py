"""Replays of a command on drawn robots: most of the time of a run, and left out of most tests."""

from coupling.run import expected_robots

REPLAYS = expected_robots.drawn_replays


def leave_out_drawn_robots() -> None:
    """Have runs in this process replay their command on none."""
    expected_robots.drawn_replays = lambda *_: expected_robots.DrawnReplays()

"""Studies as a user starts them, watched and killed from outside, and what their folders hold."""

import time
from pathlib import Path

import psutil
from killing import Started, start
from line_case import moving_line

TABLES = ("points.csv", "samples.csv", "bands.csv", "study.json", "study.toml")


def started(*arguments: object, folder: Path) -> Started:
    """A study that has begun in a process of its own; what it prints is beside its folder."""
    output = folder.with_suffix(".txt")
    return start(output, "study", *arguments, "-o", folder, daemon=False)


def rows(folder: Path) -> int:
    """Number of whole lines in the table of samples."""
    file = folder / "rows.jsonl"
    return file.read_bytes().count(b"\n") if file.exists() else 0


def wait_for_rows(running: Started, folder: Path, count: int) -> None:
    """Wait until a table has so many lines, or its study has ended."""
    while running.process.is_alive() and rows(folder) < count:
        time.sleep(0.002)


def children(process: int, words: str) -> list[int]:
    """Numbers of the processes below one, of all depths, whose command line has some words."""
    below = psutil.Process(process).children(recursive=True)
    return [child.pid for child in below if words in " ".join(child.cmdline())]


def tables(folder: Path) -> dict[str, bytes]:
    """Bytes of what a finished study leaves; lines of its table of samples sorted."""
    found = {name: (folder / name).read_bytes() for name in TABLES}
    lines = (folder / "rows.jsonl").read_bytes().splitlines(keepends=True)
    return {**found, "rows": b"".join(sorted(lines, key=lambda line: line.split(b" ", 1)[1]))}


def moving(folder: Path, more: str = "", feed: str = "0.02") -> Path:
    """The small case, slow, on the moving robot with backlash by method inverse."""
    text = moving_line(("feed_m_s = 0.1", f"feed_m_s = {feed}"))
    file = folder / "stroke.toml"
    file.write_text(f"{text}\n{more}")
    return file


SAMPLES = 32
# Parameters that are varied on purpose.
CHOSEN = """
[study]
stiffness_factor = [0.98, 1.02]
damping_factor   = [0.8, 1.2]
backlash_factor  = [0.8, 1.2]
force_factor     = [0.95, 1.05]
"""

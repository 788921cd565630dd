"""Judge of a run folder: its command, as written, on the moving robot: replay.py RUN_FOLDER FMU [EVERY].

A program without the project's code.  The wrench is straight between the rows of wrench.csv, the desired
path the spline through the rows of desired.csv; both are looked at every 4 ms, or as often as asked for.
"""

import json
import sys
import tomllib
from pathlib import Path

import numpy as np
from replay_robot import Robot, Settings
from replay_tables import columns, command_figures, path_between_samples, read_table

POSITION, WRENCH = ("x", "y", "z"), ("fx", "fy", "fz", "mx", "my", "mz")


def steps_between(time: np.ndarray, every: float) -> tuple[np.ndarray, np.ndarray]:
    """Divide every step evenly; return the times and the rows of those given."""
    parts = np.maximum(1, np.ceil(np.diff(time) / every - 1e-6)).astype(int)
    pieces = [
        np.linspace(start, end, n + 1)[1:]
        for start, end, n in zip(time, time[1:], parts, strict=False)
    ]
    return np.concatenate([time[:1], *pieces]), np.append(0, np.cumsum(parts))


def straight_wrench(loads: dict[str, np.ndarray], time: np.ndarray) -> np.ndarray:
    """Return wrench and rate at the start of every step; row 0: before [N, N m], (k, 12)."""
    vectors, samples = columns(loads, WRENCH), np.unique(loads["time"])
    first = np.searchsorted(loads["time"], samples, "left")  # a time that stands twice is a jump
    last = np.searchsorted(loads["time"], samples, "right") - 1
    step = np.clip(np.searchsorted(samples, time[:-1] + 1e-9, "right"), 1, len(samples) - 1)
    begin, end = samples[step - 1], samples[step]
    rate = (vectors[first[step]] - vectors[last[step - 1]]) / (end - begin)[:, None]
    start = vectors[last[step - 1]] + (time[:-1] - begin)[:, None] * rate
    return np.vstack([np.append(vectors[0], np.zeros(6)), np.hstack([start, rate])])


def judge(folder: Path, fmu: Path, every: float) -> dict[str, object]:
    """Return how far the tool is from its path [um], and figures of the command."""
    case = tomllib.loads((folder / "case.toml").read_text(encoding="utf-8"))
    settings = Settings(curve=case["robot"].get("torque_curve", ""))
    desired, loads = read_table(folder / "desired.csv"), read_table(folder / "wrench.csv")
    time, sample = steps_between(desired["time"], every)
    position = columns(desired, POSITION)
    between = path_between_samples(desired["time"], position)(time)
    between[sample] = position
    poses = Robot(fmu).poses(folder / "command.csv", time, straight_wrench(loads, time), settings)
    distance = np.linalg.norm(poses[:, :3] - between, axis=1)
    return {
        "max_um": 1e6 * distance.max(),
        "rms_um": 1e6 * np.sqrt(np.mean(distance**2)),
        "command": command_figures(read_table(folder / "command.csv")),
    }


if __name__ == "__main__":
    run, robot, *often = sys.argv[1:]
    print(json.dumps(judge(Path(run), Path(robot), *map(float, often or ["0.004"]))))

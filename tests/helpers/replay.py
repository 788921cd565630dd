"""Judge of a run folder: its command, as written, on the moving robot: replay.py RUN_FOLDER FMU [FMU].

Reads desired.csv, wrench.csv and command.csv, drives the robot's FMU (FMI 2) in dynamic mode by them
and prints as JSON how far the TCP is from the desired path.  A cell has a folder and an FMU for each of
its robots.  Shares no code with the project and must run where the project has not been imported, as
the FMU brings its own model.
"""

from __future__ import annotations

import argparse
import json
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from replay_robot import Robot, Settings
from replay_tables import columns, command_figures, path_between_samples, read_table
from scipy.spatial.transform import Rotation, Slerp

POSITION, QUATERNION = ("x", "y", "z"), ("qx", "qy", "qz", "qw")
WRENCH = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass(frozen=True)
class Base:
    """Place of a robot's base in the frame of the files: world_from_base.

    Attributes:
        position: Origin [m], (3,).
        rotation: Axes.
    """

    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    rotation: Rotation = field(default_factory=Rotation.identity)


@dataclass(frozen=True)
class Replay:
    """Desired and actual motion of one tool in the frame of the files.

    Attributes:
        time: Times of comparison [s], (k,).
        sample: Rows of these that are samples of the desired path, (n,).
        desired, actual: Positions [m], (k, 3).
        desired_rotation, actual_rotation: Axes of the tool; the desired ones are interpolated between
            samples.
    """

    time: np.ndarray
    sample: np.ndarray
    desired: np.ndarray
    actual: np.ndarray
    desired_rotation: Rotation
    actual_rotation: Rotation

    @property
    def distance(self) -> np.ndarray:
        """Distance from the desired path [m], (k,)."""
        return np.linalg.norm(self.actual - self.desired, axis=1)

    @property
    def angle(self) -> np.ndarray:
        """Angle from the desired axes at the samples [rad], (n,)."""
        turned = self.actual_rotation[self.sample] * self.desired_rotation[self.sample].inv()
        return turned.magnitude()


def steps_between(time: np.ndarray, every: float) -> tuple[np.ndarray, np.ndarray]:
    """Divide every step evenly; return the times and the rows of those given."""
    parts = np.maximum(1, np.ceil(np.diff(time) / every - 1e-6)).astype(int)
    pieces = [
        np.linspace(*ends, n + 1)[1:] for *ends, n in zip(time, time[1:], parts, strict=False)
    ]
    return np.concatenate([time[:1], *pieces]), np.append(0, np.cumsum(parts))


def replay(folder: Path, robot: Robot, settings: Settings, base: Base | None = None) -> Replay:
    """Replay the command of one robot's folder; `base` is where it stands in the files' frame."""
    base = base or Base()
    desired, loads = read_table(folder / "desired.csv"), read_table(folder / "wrench.csv")
    samples = desired["time"]
    once = np.unique(loads["time"])
    np.testing.assert_array_equal(once, samples, "wrench.csv and desired.csv: times")
    time, sample = steps_between(samples, settings.every)
    vectors = columns(loads, WRENCH).reshape(-1, 3) * settings.scale.get("wrench", 1.0)
    wrench = base.rotation.inv().apply(vectors).reshape(-1, 6)
    first = np.searchsorted(loads["time"], samples, "left")  # a time that stands twice is a jump
    last = np.searchsorted(loads["time"], samples, "right") - 1
    step = np.searchsorted(sample, np.arange(len(time)))[
        1:
    ]  # of the samples in which each time lies
    begin, end, since = samples[step - 1], samples[step], time[:-1] - samples[step - 1]
    rate = (wrench[first[step]] - wrench[last[step - 1]]) / (end - begin)[:, None]
    start = wrench[last[step - 1]] + since[:, None] * rate
    straight = np.vstack([np.append(wrench[0], np.zeros(6)), np.hstack([start, rate])])
    poses = robot.poses(folder / "command.csv", time, straight, settings)
    position = columns(desired, POSITION)
    between = path_between_samples(samples, position)(time)
    between[sample] = position
    turning = Slerp(samples, Rotation.from_quat(columns(desired, QUATERNION)))
    return Replay(
        time,
        sample,
        between,
        base.position + base.rotation.apply(poses[:, :3]),
        turning(time),
        base.rotation * Rotation.from_quat(poses[:, 3:]),
    )


def figures(run: Replay) -> dict[str, float]:
    """Return how far a tool is from its path."""
    distance, worst = run.distance, int(run.distance.argmax())
    return {
        "max_um": 1e6 * distance[worst],
        "rms_um": 1e6 * np.sqrt(np.mean(distance**2)),
        "time_of_max_s": run.time[worst],
        "max_angle_urad": 1e6 * run.angle.max(),
        "compared": len(distance),
    }


def difference_from_claim(run: Replay, file: Path) -> dict[str, float]:
    """Return how far the path that the run folder claims to be achieved is from the one found here."""
    if not file.exists():
        return {}
    claimed = columns(read_table(file), POSITION)
    distance = np.linalg.norm(run.actual[run.sample] - claimed, axis=1)
    return {"max_from_achieved_um": 1e6 * distance.max()}


def gap_figures(tools: list[Replay], diameters: tuple[float, float]) -> dict[str, float]:
    """Return the gap between the spheres of two tools that approach along their x axes."""

    def gap(positions: list[np.ndarray], rotations: list[Rotation]) -> np.ndarray:
        centres = [
            at - 0.5 * diameter * axes.apply([1.0, 0.0, 0.0])
            for at, axes, diameter in zip(positions, rotations, diameters, strict=True)
        ]
        return np.linalg.norm(centres[1] - centres[0], axis=1) - 0.5 * sum(diameters)

    desired = gap([run.desired for run in tools], [run.desired_rotation for run in tools])
    actual = gap([run.actual for run in tools], [run.actual_rotation for run in tools])
    worst = int(np.abs(actual - desired).argmax())
    return {
        "max_um": 1e6 * abs(actual - desired)[worst],
        "time_of_max_s": tools[0].time[worst],
        "narrowest_um": 1e6 * actual.min(),
        "widest_um": 1e6 * actual.max(),
    }


def judge(folder: Path, fmus: list[Path], settings: Settings) -> dict[str, object]:
    """Return the figures of a run folder, of one robot or of a cell of two."""
    file = folder / "case.toml"
    case = tomllib.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    names = ("forming", "support") if (folder / "forming").is_dir() else ("",)
    robots = {fmu: Robot(fmu) for fmu in fmus}  # one in a process: Python's would share modules
    tools, answer = [], {}
    for name, fmu in zip(names, [*fmus, fmus[-1]], strict=False):
        table = case.get("support" if name == "support" else "robot", {})
        curve = settings.curve or table.get("torque_curve", "")
        own = Settings(curve, settings.tolerance, settings.every, settings.values, settings.scale)
        base = Base(
            np.array(table.get("base_position_m", [0.0, 0.0, 0.0])),
            Rotation.from_euler("xyz", table.get("base_rpy_deg", [0.0, 0.0, 0.0]), degrees=True),
        )
        run = replay(folder / name, robots[fmu], own, base)
        tools.append(run)
        command = command_figures(read_table(folder / name / "command.csv"))
        claimed = difference_from_claim(run, folder / name / "achieved.csv")
        answer[name] = figures(run) | claimed | {"torque_curve": curve, "command": command}
    if len(tools) == 1:
        return answer[""]
    diameters = case["process"]["tool_diameter_m"], case["support"]["tool_diameter_m"]
    return {**answer, "gap": gap_figures(tools, diameters)}


def _pairs(text: str) -> dict[str, float]:
    pairs = (pair.partition("=") for pair in text.split(","))
    return {name: float(value) for name, _, value in pairs}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("fmu", type=Path, nargs="+", help="of the robot; of both robots of a cell")
    parser.add_argument("--curve", default="", choices=("backlash", "linear", "spline"))
    parser.add_argument("--tolerance", type=float, default=Settings.tolerance)
    parser.add_argument("--every", type=float, default=Settings.every)
    parser.add_argument("--set", nargs="+", default=[], metavar="PARAMETER=VALUE")
    parser.add_argument("--scale", type=_pairs, default={}, metavar="stiffness=1.02,wrench=1.05")
    options = parser.parse_args()
    values = {name: value for text in options.set for name, value in _pairs(text).items()}
    settings = Settings(options.curve, options.tolerance, options.every, values, options.scale)
    print(json.dumps(judge(options.folder, options.fmu, settings), indent=1))


if __name__ == "__main__":
    main()

"""Would a mill gain by turning about its axis from pass to pass?  A bound from brute force."""

from __future__ import annotations

import tempfile
import tomllib
from itertools import product
from pathlib import Path

import numpy as np
import tomlkit
from scipy.spatial.transform import Rotation

from coupling.files.robot_file import find_robot, load_robot
from coupling.place.placing import Placing, placing
from coupling.place.settings import NAMES
from coupling.place.station_choice import selected
from coupling.robot.batch.part_placement import part_placements
from docs.scripts.page import table
from docs.scripts.runs import example

# Angles from axis 6 to the spindle [deg].
ANGLES = (0, 30, 60, 90)
SETTINGS, ROTATIONS = 512, 36
_PATHS = {
    "slot": [[0, 0, 0.001], [0.06, 0, -0.003], [0.14, 0, -0.003], [0.2, 0, 0.001]],
    "forth and back": [
        *([0, 0, 0.001], [0.06, 0, -0.003], [0.2, 0, -0.003]),
        *([0.2, 0.016, -0.003], [0.06, 0.016, -0.003], [0, 0.016, 0.001]),
    ],
}
# Half of what the part takes [m].
_HALF = 0.1


def _task(angle: float, points: list[list[float]], folder: Path) -> Placing:
    """Return the milling example, its spindle at an angle to axis 6, where the robot reaches well."""
    data = tomllib.loads(find_robot("icme2008").read_text(encoding="utf-8"))
    turn = np.deg2rad(angle)
    data["tcp"]["position"] = [0.15 + 0.15 * np.cos(turn), 0.0, -0.15 * np.sin(turn)]
    data["tcp"]["rpy"] = [0.0, turn, 0.0]
    file = folder / f"spindle_{angle}.toml"
    file.write_text(tomlkit.dumps(data), encoding="utf-8")
    (seat,) = part_placements(
        load_robot(file), Rotation.from_euler("y", 90.0, degrees=True), _HALF, 1
    )
    case = example(
        "milling_20000",
        robot={"description": str(file), "home_deg": np.rad2deg(seat.home).tolist()},
        part={"position_m": seat.position.tolist()},
        tool_path={"points_m": points},
        place={"optimise": "backlash", "base_roll_deg": [-6.0, 6.0]},
    )
    return placing(case, case.process)


def _torques(task: Placing) -> np.ndarray:
    """Return torques of the gears at places, (k, gears, settings, rotations); NaN where not admitted."""
    every = task.stations.strongest()
    few = every.chosen(selected(task.screen, every, task.ranges, seed=1))
    screen, tried = task.screen(few), task.ranges.sampled(SETTINGS, seed=3)
    found = []
    for rotation in np.linspace(-np.pi, np.pi, ROTATIONS, endpoint=False):
        tried[:, NAMES.index("rotation")] = rotation
        batch = screen.batch(tried)
        well = batch.conditioning > task.goal.demands.conditioning
        found.append(np.where(well[:, None], batch.torque, np.nan))
    return np.stack(found, axis=-1)


def _row(task: Placing) -> tuple[str, ...]:
    """Return in how many settings gears keep their flank, with one rotation and with any at any time."""
    torque = _torques(task)
    usable = np.isfinite(torque).all(axis=(0, 1)).any(axis=1)
    kept = [*_kept(torque[:, 4:5]), *_kept(torque)]
    return tuple(f"{np.sum(own)}" for own in (usable, *kept))


def _kept(torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return in which settings gears keep a flank each: with one rotation, and with any at any time."""
    one, any_ = np.zeros((2, torque.shape[2]), dtype=bool)
    for signs in product((1.0, -1.0), repeat=torque.shape[1]):
        keeps = np.all(torque * np.array(signs)[None, :, None, None] > 0.0, axis=1)
        one |= np.any(np.all(keeps, axis=0), axis=1)
        any_ |= np.all(np.any(keeps, axis=2), axis=0)
    return one, any_


def rotations() -> str:
    """Return a table: settings in which gears keep their flank, as a mill's rotation is free."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for angle, (name, points) in product(ANGLES, _PATHS.items()):
            rows.append((f"{angle} deg", name, *_row(_task(angle, points, Path(folder)))))
    head = (
        *("spindle from axis 6", "path", "settings"),
        *("gear 5 does not reverse, one rotation", "any rotation at any time"),
        *("no gear reverses, one rotation", "any rotation at any time"),
    )
    return table(head, rows)

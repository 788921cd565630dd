"""Tables of joint angles that are commands of a robot."""

from pathlib import Path

import numpy as np

from coupling.files.csv_table import write_table

NAMES = ("time", *(f"q{i}" for i in range(1, 7)))
# Where a robot moves about [deg].
MIDDLES = {
    "icme2008": [0.0, 10.0, 20.0, 0.0, 60.0, 0.0],
    "abb_irb7600": [0.0, 10.0, 20.0, 0.0, 60.0, 0.0],
    "fanuc_r2000ic": [0.0, 10.0, -10.0, 0.0, -70.0, 0.0],
    "kuka_kr210": [0.0, 10.0, 20.0, 0.0, 60.0, 0.0],
}


def rows(robot: str = "icme2008") -> np.ndarray:
    """Return a second of a motion in rows that are on no controller's cycle, (n, 7)."""
    time = np.arange(129) / 128
    rise = 0.5 - 0.5 * np.cos(np.pi * time)
    turn = np.array([0.1, -0.05, 0.08, 0.02, 0.05, 0.1])
    return np.column_stack([time, np.deg2rad(MIDDLES[robot]) + rise[:, None] * turn])


def written(file: Path, table: np.ndarray, names: tuple[str, ...] = NAMES) -> Path:
    write_table(file, names, table)
    return file


WAY = rows()

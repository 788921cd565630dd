"""The recordings of the KUKA KR 300 as `elastic-robot identify` reads them: in radians, at the joints.

python examples/identify/kuka_kr300_motion.py results
elastic-robot identify results/kuka_A.csv --robot kuka_kr300 --hold-out results/kuka_B.csv --leave-out
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

RECORDINGS = Path(__file__).parents[1] / "measured" / "kuka_kr300"
# Turns of the motor for one of the gear's output.
RATIOS = np.array([1798 / 7, 1872 / 7, 757 / 3, 221, 5032 / 21, 206793 / 1340])


def converted(name: str, folder: Path) -> Path:
    """Write the recording "A" or "B" into a folder and return the file."""
    file = RECORDINGS / f"recording_{name}.csv"
    header = file.read_text(encoding="utf-8").splitlines()[0].split(",")
    columns = np.loadtxt(file, delimiter=",", skiprows=1)
    for k, column in enumerate(header):
        what, _, joint = column.rpartition("_")
        if what == "motor_torque":
            columns[:, k] *= RATIOS[int(joint) - 1]
        elif what:  # the robot file's drive angles are zero where the recordings are
            columns[:, k] = np.deg2rad(columns[:, k])
    names = [f"{c.rpartition('_')[0]}[{c.rpartition('_')[2]}]" if "_" in c else c for c in header]
    target = folder / f"kuka_{name}.csv"
    folder.mkdir(parents=True, exist_ok=True)
    np.savetxt(target, columns, delimiter=",", header=",".join(names), comments="", fmt="%.10g")
    return target


if __name__ == "__main__":
    for name in ("A", "B"):
        print(converted(name, Path(sys.argv[1])))

"""Files of a robot whose second joint has a gear."""

import math
from pathlib import Path

from two_joint_file import two_joints

ARCMIN = math.radians(1.0 / 60.0)
K, RATED = 1.7e6, 3000.0
SHEET = "hysteresis_width_arcmin = 0.4\nlost_motion_arcmin = 0.5\nrated_torque_Nm = 3000.0\n"


def written(folder: Path, joint: str, gear: str, after: str = "") -> Path:
    """Write a robot of two joints, the second with a gear; returns the file."""
    return two_joints(folder, joint, f"[joint.gear]\n{gear}", after)


def sheet(width: float, rated: float, lost: float | None = None) -> str:
    lines = [f"hysteresis_width_arcmin = {width!r}", f"rated_torque_Nm = {rated!r}"]
    return "\n".join(lines + ([] if lost is None else [f"lost_motion_arcmin = {lost!r}"]))

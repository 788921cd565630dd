"""Files of a robot whose second joint has a drive."""

from pathlib import Path

from two_joint_file import two_joints

ELASTIC = "stiffness = 1e6"
USUAL = {
    "rotor_inertia_kg_m2": "5e-3",
    "gear_ratio": "200",
    "friction": "{ coulomb_Nm = 90.0, stiction_Nm = 120.0, stribeck_rate = 0.02, viscous_Nm_s = 40.0,"
    " presliding_rad = 3e-5 }",
    "servo": "{ position_gain = 20.0, rate_bandwidth_Hz = 30.0, integral_time_s = 0.02,"
    " rate_feed_forward = 0.9 }",
    "max_torque_Nm": "5000.0",
    "torque_constant_Nm_A": "1.5",
}


def lines(**other: str | None) -> str:
    """Return the usual drive with other keys; None leaves one out."""
    return "\n".join(f"{k} = {v}" for k, v in {**USUAL, **other}.items() if v is not None)


def written(folder: Path, drive: str, joint: str = ELASTIC, after: str = "") -> Path:
    """Write a robot of two joints, the second with a drive; returns the file."""
    return two_joints(folder, joint, f"[joint.drive]\n{drive}", after)

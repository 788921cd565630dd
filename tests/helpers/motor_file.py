"""A robot file with a motor in every gear: the example robot's."""

from pathlib import Path

from coupling.files.robot_file import shipped_robots


def with_motors(
    folder: Path, feed_forward: float = 1.0, more: str = "", friction: float = 20.0
) -> Path:
    """Write servo.toml; `more` are further keys of every [joint.drive]; return the file."""
    drive = (
        f"drive = {{ rotor_inertia_kg_m2 = 5e-3, gear_ratio = 200.0, {more}"
        f" friction = {{ coulomb_Nm = {friction} }},"
        " servo = { position_gain = 20.0, rate_bandwidth_Hz = 30.0, integral_time_s = 0.02,"
        f" rate_feed_forward = {feed_forward} }} }}\n"
    )
    text = shipped_robots()["icme2008"].read_text()
    file = folder / "servo.toml"
    file.write_text(text.replace("\nstiffness", f"\n{drive}stiffness"))
    return file

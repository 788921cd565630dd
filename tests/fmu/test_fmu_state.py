"""States of the FMU: rolled back, copied, and carried to another process, bit for bit."""

from __future__ import annotations

from places import REFERENCE
from random_robots import make_robot

from coupling.fmu_export.build import build_fmu

ISO_PATH = REFERENCE / "iso_path_joints.npz"
# Curve, mode, trajectory, stiffness of a spring and of a plane [N/m].
CASES = (
    "linear,dynamic,,0,0",
    "backlash,dynamic,,0,0",
    f"backlash,dynamic,{ISO_PATH},0,0",
    f"spline,dynamic,{ISO_PATH},0,0",
    f"backlash,quasistatic,{ISO_PATH},0,0",
    "backlash,dynamic,,1e6,0",
    "spline,dynamic,,1e4,0",
    "backlash,quasistatic,,1e7,0",
    "backlash,dynamic,,0,1e7",
    "spline,quasistatic,,0,1e6",
)


def test_a_state_goes_on_bit_for_bit(example_fmu, run_host, tmp_path):
    for what in ("save", "load"):
        run_host("state", example_fmu, tmp_path, what, *CASES)


def test_a_state_of_another_motion_is_refused(example_fmu, run_host, tmp_path):
    """The same file name with other contents."""
    file = tmp_path / "motion.csv"
    line = "{0},0,-0.3,0.5,0,{1},0\n"
    file.write_text("time,q1,q2,q3,q4,q5,q6\n" + line.format(0, 0.6) + line.format(10, 0.7))
    case = f"linear,quasistatic,{file},0,0"
    run_host("state", example_fmu, tmp_path, "save", case)
    file.write_text("time,q1,q2,q3,q4,q5,q6\n" + line.format(0, 0.6) + line.format(10, 0.71))
    said = run_host("state", example_fmu, tmp_path, "load", case, succeeds=False)
    assert "expected the motion that the state was saved with, got another" in said


def test_damaged_and_foreign_states_are_refused(example_fmu, run_host, tmp_path):
    other = build_fmu(make_robot(4, 6), tmp_path / "Other.fmu")
    said = run_host("foreign_states", example_fmu, other)
    for text in ("damaged bytes", "state: expected one that", "with fingerprint"):
        assert text in said

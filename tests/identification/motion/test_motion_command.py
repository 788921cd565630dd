"""elastic-robot identify of recordings, as a user types it."""

import json

import numpy as np
import pytest
from pages import drawn_in

from coupling.files.robot_file import load_robot, robot_numbers
from coupling.identification.motion.driven_fmu import DrivenFmu
from docs.scripts.motion_recovery import arm, recorded

# The arm of the recordings, up to a fifth off.
START = """
name = "arm"
[tcp]
position = [0.0, 0.0, 0.6]

[[joint]]
origin    = [0.0, 0.0, 0.0]
axis      = [0, 1, 0]
mass      = 60.0
com       = [0.0, 0.0, 0.25]
inertia   = [4.0, 4.0, 1.0]
stiffness = 1.3e6                        # a guess
damping   = 1.5e3
[joint.drive]
rotor_inertia_kg_m2 = 4e-3
gear_ratio          = 100.0
friction = { coulomb_Nm = 100.0, viscous_Nm_s = 350.0 }
servo    = { position_gain = 10.0, rate_gain = 1e4 }

[[joint]]
origin    = [0.0, 0.0, 0.5]
axis      = [0, 1, 0]
mass      = 60.0
com       = [0.0, 0.0, 0.25]
inertia   = [4.0, 4.0, 1.0]
stiffness = 9e5
damping   = 8e2
[joint.drive]
rotor_inertia_kg_m2 = 4e-3
gear_ratio          = 100.0
servo    = { position_gain = 10.0, rate_gain = 1e4 }
[joint.drive.friction]
coulomb_Nm   = 70.0
viscous_Nm_s = 150.0

[payload]
mass    = 35.0
com     = [0.0, 0.0, 0.5]
inertia = [1.0, 1.0, 1.0]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder, rng = tmp_path_factory.mktemp("motion"), np.random.default_rng(9)
    with DrivenFmu(arm()) as fmu:
        for name in ("one", "two"):
            recording = recorded(fmu, arm(), rng)
            names = [f"{what}[{i}]" for what in ("motor", "motor_torque", "link") for i in (1, 2)]
            rows = np.column_stack(
                [recording.time, recording.motor, recording.torque, recording.link]
            )
            head = ",".join(["time", *names])
            np.savetxt(folder / f"{name}.csv", rows, "%.12g", ",", header=head, comments="")
    (folder / "start.toml").write_text(START)
    return folder


def test_recordings_become_a_robot_file_a_report_and_figures(command, folder):
    target = folder / "new" / "arm.toml"
    done = command(
        "identify", folder / "one.csv", "--robot", folder / "start.toml",
        "--hold-out", folder / "two.csv", "-v", "-o", target,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "two.csv    predicted" in done.stdout
    assert "not identified: the recordings hardly depend on it" in done.stdout
    robot = load_robot(target)
    for own, known in zip(robot.joints, arm().joints, strict=True):
        assert own.stiffness == pytest.approx(known.stiffness, rel=0.02)
        assert own.drive.friction == pytest.approx(known.drive.friction, rel=0.05)
        assert own.drive.viscous == pytest.approx(known.drive.viscous, rel=0.05)
    assert robot.payload.mass == pytest.approx(40.0, rel=0.02)
    text = target.read_text()
    assert "two.csv, predicted: motor less link" in text
    assert "stiffness = 1.3e6" not in text
    sources = {number.source for number in robot_numbers(target)[1]}
    assert "identified, motion of one.csv" in sources
    told = json.loads(target.with_suffix(".json").read_text())
    assert [one["held_out"] for one in told["recordings"]] == [False, True]
    page = target.with_suffix(".html").read_text()
    assert {"wind-up-two.csv", "causes-two.csv", "torque-two.csv"} <= set(drawn_in(page))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--robot", "kuka_kr300"), "columns motor[3]"),
        (("-o", "robot.txt"), "expected a name that ends in .toml"),
        (("--hold-out", "start.toml"), "start.toml"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_sentence(command, folder, options, says):
    paths = [folder / option if option.endswith("start.toml") else option for option in options]
    done = command(
        "identify", folder / "one.csv", "--robot", folder / "start.toml", *paths, exits=2
    )
    assert says in done.stderr + done.stdout
    assert "Traceback" not in done.stderr


def test_angles_in_degrees_are_refused_with_what_to_look_for(command, folder):
    """At once where they are large; small ones by what is left of the torques."""
    rows = np.loadtxt(folder / "one.csv", delimiter=",", skiprows=1, max_rows=400)
    angles = np.degrees(rows[:, [1, 2, 5, 6]])
    head = (folder / "one.csv").read_text().splitlines()[0]
    target = folder / "degrees.toml"
    for small, status, says in (
        (False, 2, "in degrees, or not divided"),
        (True, 1, "angles in rad"),
    ):
        rows[:, [1, 2, 5, 6]] = angles - small * angles.mean(axis=0)
        table = folder / "degrees.csv"
        np.savetxt(table, rows, "%.12g", ",", header=head, comments="")
        done = command("identify", table, "--robot", folder / "start.toml", "-o", target)
        assert done.returncode == status, done.stderr
        assert says in " ".join((done.stdout + done.stderr).split())
        assert not target.exists()


def test_a_table_of_deflections_has_nothing_to_hold_out(command, folder):
    table = folder / "static.csv"
    table.write_text("q1,q2,fx,fy,fz,dx,dy,dz\n0,0,1,0,0,0,0,0\n")
    done = command("identify", table, "--hold-out", folder / "two.csv", exits=2)
    assert "--hold-out: expected recordings of a motion to fit" in done.stderr + done.stdout

"""Recordings of a motion as they are read and smoothed; those of a KUKA KR 300."""

from dataclasses import replace

import numpy as np
import pytest
from fixture_store import stored
from native_motors import one_joint

from coupling.errors import IdentifyError
from coupling.files.robot_file import find_robot, load_robot
from coupling.identification.motion.identification import identify_motion
from coupling.identification.motion.recording import (
    SmoothedMotion,
    is_recording,
    read_recording,
    smooth,
)
from coupling.identification.motion.sensors import delayed, encoder_lines
from coupling.inverse.servo import presliding
from elastic_robot.description import Robot
from elastic_robot.drive import Drive
from examples.identify.kuka_kr300_motion import RATIOS, RECORDINGS, converted

STEP = 0.004


def arms(joints: int, per_current: float | None = None) -> Robot:
    """A robot of some joints with motors, of a torque constant at the gear's output [N m/A]."""
    joint = one_joint(Drive(10.0, 20.0, 2e3, torque_per_current=per_current)).joints[0]
    return replace(one_joint(Drive(10.0, 20.0, 2e3)), joints=(joint,) * joints)


def _file(folder, header="time,motor[1],motor_torque[1],link[1]", rows=200, change=None):
    lines = [[STEP * k, 0.01 * k, 5.0, 0.01 * k] for k in range(rows)]
    cells = [[f"{value:.9g}" for value in line[: len(header.split(","))]] for line in lines]
    if change is not None:
        row, column, text = change
        cells[row][column] = text
    file = folder / "motion.csv"
    file.write_text("\n".join([header, *(",".join(line) for line in cells)]) + "\n")
    return file


def test_a_recording_is_told_by_its_columns_and_read_in_si_units(tmp_path):
    file = _file(tmp_path)
    assert is_recording(file)
    recording = read_recording(file, arms(1))
    assert recording.with_link == [0]
    assert recording.step == pytest.approx(STEP)
    np.testing.assert_allclose(recording.wind_up, 0.0)


def test_a_joint_without_an_encoder_behind_the_gear_has_no_link(tmp_path):
    recording = read_recording(_file(tmp_path, "time,motor[1],motor_torque[1]"), arms(1))
    assert recording.with_link == []
    assert np.isnan(recording.link).all()


def test_currents_become_torques_by_the_motors_constant(tmp_path):
    """5 A at 300 N m/A; a torque beside counts alone; without a constant the file is refused."""
    header = "time,motor[1],motor_current[1]"
    recording = read_recording(_file(tmp_path, header), arms(1, 300.0))
    np.testing.assert_allclose(recording.torque, 1500.0)
    both = _file(tmp_path, "time,motor[1],motor_torque[1],motor_current[1]")
    np.testing.assert_allclose(read_recording(both, arms(1, 300.0)).torque, 5.0)
    with pytest.raises(IdentifyError, match=r"current.*torque_constant_Nm_A .* of joint 1"):
        read_recording(_file(tmp_path, header), arms(1))


@pytest.mark.parametrize(
    ("change", "joints", "header", "says"),
    [
        ((5, 0, "0.5"), 1, None, "line 7: time: expected equal steps of time"),
        ((5, 1, "x"), 1, None, "motor\\[1\\]: expected a finite number, got 'x'"),
        (None, 2, None, "columns motor\\[2\\], motor_torque\\[2\\] are missing"),
        (None, 1, "time,motor[1],link[1]", "columns motor_torque\\[1\\] are missing"),
        (
            None,
            1,
            "time,motor[1],motor_torque[1],motor[2]",
            "a robot with 1 joints, got motor\\[2\\]",
        ),
    ],
)
def test_what_is_wrong_with_a_recording_is_told_with_its_place(
    tmp_path, change, joints, header, says
):
    given = {} if header is None else {"header": header}
    with pytest.raises(IdentifyError, match=says):
        read_recording(_file(tmp_path, change=change, **given), arms(joints))


@pytest.mark.parametrize(
    ("links", "says"),
    [
        (lambda q: np.degrees(q), r"link\[1\]: .* of motor\[1\], got 57.3 times that: .* unit"),
        (lambda q: q * [1.0, -1.0], r"link\[2\]: .* of motor\[2\], got -1 times that: .* sign"),
        (lambda q: q[:, ::-1], r"link\[1\]: .* rad rms and follows motor\[2\]: .* swapped"),
        (
            lambda q: q * [1.0, 0.0] + 3.0,
            r"link\[2\]: expected .*, got one that differs by 0.2\d* rad",
        ),
        (lambda q: np.roll(q, 25, axis=0), r"link\[1\]: .* of motor\[1\], got it 99 ms late"),
        (lambda q: np.roll(q, 10, axis=0) + 1e-3 * np.sin(50.0 * q) + 3.0, ""),
    ],
    ids=["degrees", "sign", "swapped", "still", "late", "hardly late, with an error"],
)
def test_links_follow_their_own_motors(tmp_path, links, says):
    """In another unit, with another sign, another joint's or late they are refused."""
    time = STEP * np.arange(2000)
    motor = 0.4 * np.sin(np.column_stack([2.0 * time, 0.9 * time]))
    rows = np.column_stack([time, motor, motor, links(motor)])
    names = [f"{what}[{i}]" for what in ("motor", "motor_torque", "link") for i in (1, 2)]
    file = tmp_path / "motion.csv"
    np.savetxt(file, rows[50:], "%.9g", ",", header=",".join(["time", *names]), comments="")
    if says:
        with pytest.raises(IdentifyError, match=says):
            read_recording(file, arms(2))
    else:
        assert read_recording(file, arms(2)).with_link == [0, 1]


def test_a_gap_is_told_with_the_row_behind_it(tmp_path):
    file = _file(tmp_path)
    lines = file.read_text().splitlines()
    file.write_text("\n".join(lines[:150] + lines[160:]))
    with pytest.raises(IdentifyError, match="line 151: time: expected equal steps of time"):
        read_recording(file, arms(1))


def test_motors_at_rest_are_no_motion(tmp_path):
    file = tmp_path / "still.csv"
    lines = [f"{STEP * k:.9g},0.1,5.0" for k in range(200)]
    file.write_text("\n".join(["time,motor[1],motor_torque[1]", *lines]) + "\n")
    with pytest.raises(IdentifyError, match="expected motors that move"):
        read_recording(file, arms(1))


def test_milliseconds_are_no_seconds(tmp_path):
    file = _file(tmp_path)
    rows = [line.split(",") for line in file.read_text().splitlines()]
    told = [[f"{1e3 * float(time):.9g}", *rest] for time, *rest in rows[1:]]
    file.write_text("\n".join(",".join(row) for row in [rows[0], *told]))
    with pytest.raises(
        IdentifyError, match=r"time: expected steps of .* s at most, got 4: is it in milli"
    ):
        read_recording(file, arms(1))


def test_a_few_rows_are_no_motion(tmp_path):
    with pytest.raises(IdentifyError, match="at least 100 rows, got 50"):
        read_recording(_file(tmp_path, rows=50), arms(1))


def test_smoothing_neither_shifts_nor_shrinks_a_slow_motion_and_takes_the_noise():
    """Acceleration of a sine of 0.5 Hz to 1e-3; noise of 1 urad leaves less than 0.05 rad/s^2."""
    time = STEP * np.arange(3000)
    omega = 2.0 * np.pi * 0.5
    rng = np.random.default_rng(2)
    noise = 1e-6 * rng.standard_normal((3000, 1))
    angle = 0.1 * np.sin(omega * time)[:, None]
    exact = -(omega**2) * angle
    clean = SmoothedMotion.of(angle, STEP, 20.0).qdd
    noisy = SmoothedMotion.of(angle + noise, STEP, 20.0).qdd
    inside = slice(200, -200)
    assert np.abs(clean - exact)[inside].max() < 1e-3 * np.abs(exact).max()
    assert np.abs(noisy - clean)[inside].max() < 0.05
    assert np.abs(np.diff(angle + noise, 2, axis=0) / STEP**2 - exact[1:-1]).max() > 0.15
    assert smooth(angle, STEP, 1e3) is angle


def test_presliding_builds_up_over_the_slip_angle_and_turns_with_it():
    angle = np.array([0.0, 1.0, 3.0, 2.5, 0.0])
    np.testing.assert_allclose(presliding(angle, 2.0, 0.0), [0.0, 0.5, 1.0, 0.75, -0.5])


def test_a_lag_is_exact_for_a_cubic():
    time = 0.01 * np.arange(400)
    values = time**3 - 2.0 * time
    later = time - 0.0037
    np.testing.assert_allclose(
        delayed(values, 0.01, 0.0037)[1:], (later**3 - 2.0 * later)[1:], atol=1e-12
    )


def test_lines_are_found_whatever_their_phase_and_noise_has_none():
    """One line in two recordings with phases of their own; none where nothing is periodic."""
    rng = np.random.default_rng(3)
    angle = [np.sin(np.linspace(0.0, end, 3000)) * 0.5 for end in (4.0, 5.0)]
    noise = [1e-5 * rng.standard_normal(3000) for _ in angle]
    left = [
        own + 2e-5 * np.cos(826.0 * turn + phase)
        for own, turn, phase in zip(noise, angle, (0.3, 2.0), strict=True)
    ]
    found = encoder_lines(left, angle)
    assert len(found) == 1
    assert found[0] == pytest.approx(826.0, abs=0.5)
    assert encoder_lines(noise, angle) == ()


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kuka")
    robot = load_robot(find_robot("kuka_kr300"))
    return [read_recording(converted(name, folder), robot) for name in "AB"]


def test_recordings_are_converted_to_radians_and_torques_at_the_joints(recordings):
    raw = np.genfromtxt(RECORDINGS / "recording_A.csv", delimiter=",", names=True)
    first = recordings[0]
    np.testing.assert_allclose(np.degrees(first.motor[:, 3]), raw["motor_4"], atol=1e-7)
    np.testing.assert_allclose(first.torque[:, 1], RATIOS[1] * raw["motor_torque_2"], rtol=1e-6)
    assert first.with_link == [0, 1, 2]


@pytest.mark.parametrize("fits", "AB")
def test_a_fit_to_one_motion_predicts_another(recordings, fits):
    """Bounds: lag and offset alone, the best regression of joint 3, and what is aimed at of torques.

    From one start alone the gear of joint 1 in B has a minimum that predicts A worse than a lag does.
    """
    robot, other = load_robot(find_robot("kuka_kr300")), "BA"["AB".index(fits)]
    predicted = replace(recordings["AB".index(other)], is_held_out=True)
    measured = [recordings["AB".index(fits)], predicted]
    found = stored(identify_motion, robot, measured, 20.0)
    fitted, predicted = found.result.recordings
    assert predicted.held_out
    assert np.all(np.less(predicted.wind_up_rad[:3], predicted.wind_up_lag_alone_rad[:3]))
    assert predicted.wind_up_rad[1] < 45e-6
    assert predicted.wind_up_rad[2] < 47e-6
    assert max(predicted.torque_relative[:3]) < 0.125
    assert max(predicted.torque_relative[3:]) < 0.25
    # Without a robot the recording that is fitted leaves two and a half times as much, of joint 1 in B
    # nearly twice.
    most = {"A": 0.4, "B": 0.6}[fits] * np.array(fitted.wind_up_lag_alone_rad[:3])
    assert np.all(np.array(fitted.wind_up_rad[:3]) < most)
    assert found.result.remarks == ()
    # The two encoders of a joint are as late on all three.
    values = dict(zip((p.name for p in found.fit.problem.parameters), found.fit.x, strict=True))
    for joint in (1, 2, 3):
        assert values[f"encoder[{joint}].lag"] == pytest.approx(3.0, abs=0.15)


@pytest.mark.parametrize("name", "AB")
def test_motors_are_ahead_of_the_reference_that_was_recorded(name):
    """So it is not what their servos were told: by 4 to 16 ms, on the wrist by 83 to 141 ms."""
    raw = np.genfromtxt(RECORDINGS / f"recording_{name}.csv", delimiter=",", names=True)
    ahead = []
    for joint in range(1, 7):
        reference, motor = raw[f"reference_{joint}"], raw[f"motor_{joint}"]
        by = np.column_stack([np.gradient(reference, raw["time"]), np.ones(len(motor))])
        ahead.append(np.linalg.lstsq(by, motor - reference, rcond=None)[0][0])
    assert 3.5e-3 < min(ahead[:3]) < max(ahead[:3]) < 16.5e-3
    assert 82e-3 < min(ahead[3:]) < max(ahead[3:]) < 141.5e-3

"""Recordings of a KUKA KR 300: what one says of the other, and what all agree on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fixture_store import stored

from coupling.files.robot_file import find_robot, load_robot
from coupling.identification.motion.identification import identify_motion
from coupling.identification.motion.recording import read_recording
from examples.identify.kuka_kr300_motion import RATIOS, RECORDINGS, converted


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
    found = stored(identify_motion, robot, measured, 20.0, leave_out=False)
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

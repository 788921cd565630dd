"""A known robot is found again in recordings with noise, quantised encoders and a lag."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fixture_store import stored
from scipy.signal import lfilter

from coupling.errors import IdentifyError
from coupling.identification.motion import fit
from coupling.identification.motion.driven_fmu import DrivenFmu
from coupling.identification.motion.experiment import MotionExperiment, jacobian
from coupling.identification.motion.fit import fit_motion
from coupling.identification.motion.identification import identify_motion
from coupling.identification.motion.normal_blocks import NormalBlocks
from coupling.identification.motion.parameters import motion_parameters
from coupling.identification.motion.problem import MotionProblem, SmoothedRecording
from coupling.identification.motion.recording import Recording
from coupling.identification.motion.sensors import delayed, sensor_parameters, torque_parameters
from coupling.inverse.servo import presliding
from docs.scripts.motion_recovery import BANDWIDTH, STEP, Known, arm, every_error, recorded
from elastic_robot.gear_parts import KinematicError


@pytest.fixture(scope="module")
def recordings():
    rng = np.random.default_rng(5)
    with DrivenFmu(arm()) as fmu:
        return [recorded(fmu, arm(), rng) for _ in range(2)]


def held_out(measured, *numbers):
    """Return recordings of which those of some numbers are held out."""
    return [replace(each, is_held_out=k in numbers) for k, each in enumerate(measured)]


def test_intervals_are_neither_too_narrow_nor_too_wide():
    """10 recordings of 12 numbers: some 95 % inside the intervals, and two thirds inside their halves.

    Right intervals leave 0.73 +- 0.055 inside their halves, those half as wide 0.44, twice as wide 0.95.
    """
    errors = np.array(list(stored(every_error, 10, seed=4).values()))
    assert errors.shape == (12, 10)
    assert np.mean(errors < 1.0) >= 0.85
    assert 0.57 <= np.mean(errors < 0.5) <= 0.88


def test_one_recording_predicts_another_and_names_what_it_does_not_tell(recordings):
    start = Known.drawn(np.random.default_rng(6)).start
    found = stored(identify_motion, start, held_out(recordings, 1), BANDWIDTH)
    fitted, predicted = found.result.recordings
    assert predicted.held_out
    assert np.all(np.array(predicted.wind_up_rad) < 1.3 * np.array(fitted.wind_up_rad))
    assert max(predicted.slow_torque_relative) < 0.03
    robot = found.robot
    for own, known in zip(robot.joints, arm().joints, strict=True):
        assert own.stiffness == pytest.approx(known.stiffness, rel=0.02)
        assert own.drive.friction == pytest.approx(known.drive.friction, rel=0.05)
    # A mass in the plane of motion has no effect across it.
    kept = {verdict.name for verdict in found.result.parameters if not verdict.identified}
    assert "payload.com.y" in kept
    assert robot.payload.com[1] == start.payload.com[1]


def test_a_stiffness_is_found_again_behind_an_encoder_off_its_axis(recordings):
    """0.3 mrad once a turn is a hundred times the noise; an encoder without it is told apart."""
    first = recordings[0]
    link = first.link.copy()
    link[:, 0] += 3e-4 * np.cos(first.link[:, 0] - 0.7)
    start = Known.drawn(np.random.default_rng(6)).start
    found = stored(identify_motion, start, [replace(first, link=link)], BANDWIDTH)
    assert found.result.slow_error_rad[0] > 10.0 * found.result.slow_error_rad[1]
    assert found.result.recordings[0].wind_up_rad[0] < 3e-6
    for own, known in zip(found.robot.joints, arm().joints, strict=True):
        assert own.stiffness == pytest.approx(known.stiffness, rel=0.03)


def test_what_a_prediction_leaves_too_much_of_is_said(recordings):
    """A rigid gear's link is late, and no more; torques are those of another motion."""
    first, other = recordings
    link = other.link.copy()
    link[:, 1] = delayed(other.motor[:, 1], other.step, 3e-3)
    measured = [
        first,
        replace(other, name="rigid.csv", link=link),
        replace(first, name="other.csv", torque=first.torque[::-1]),
    ]
    found = stored(identify_motion, arm(), held_out(measured, 1, 2), BANDWIDTH)
    assert found.result.refusal == ""
    (words,) = (own for own in found.result.remarks if "rigid.csv" in own)
    assert words.startswith("rigid.csv, predicted: ")
    assert "the residual of motor less link 2 is" in words
    assert any(own.startswith("other.csv, predicted: ") for own in found.result.remarks)


@pytest.mark.parametrize(
    ("torque", "says"),
    [
        (
            lambda own: own[:, ::-1],
            "joints 1 and 2, each in its column, got in each the torque of the other",
        ),
        (lambda own: np.roll(own, 50, axis=0), "clock of the motors' angles, got them 200 ms late"),
        (
            lambda own: np.roll(own, -50, axis=0),
            "clock of the motors' angles, got them 200 ms early",
        ),
    ],
    ids=["swapped", "late", "early"],
)
def test_torques_of_another_joint_or_time_are_refused(recordings, torque, says):
    first = recordings[0]
    bad = replace(first, name="bad.csv", torque=torque(first.torque))
    for measured in ([bad], held_out([first, bad], 1)):
        with pytest.raises(IdentifyError, match=f"bad.csv: expected torques .*{says}"):
            identify_motion(arm(), measured, BANDWIDTH)


def test_torques_of_another_motion_are_told_and_written_nowhere(recordings):
    first = recordings[0]
    other = replace(first, name="other.csv", torque=first.torque[::-1])
    found = stored(identify_motion, arm(), [other], BANDWIDTH)
    assert found.result.refusal.startswith("the residual of the torque of motor ")
    assert sum("of the torque of motor" in words for words in found.result.remarks) == 2


@pytest.mark.parametrize(("frequency", "refused"), [(0.9, True), (40.0, False)])
def test_a_load_that_is_mostly_left_is_written_nowhere_but_noise_of_its_size_is(
    recordings, frequency, refused
):
    first = recordings[0]
    wave = (
        1.2
        * np.sin(2.0 * np.pi * frequency * first.time)
        * np.sqrt(np.mean(first.torque[:, 0] ** 2))
    )
    shaken = replace(first, torque=first.torque + np.outer(wave, [1.0, 0.0]))
    found = stored(identify_motion, arm(), [shaken], BANDWIDTH)
    assert 0.5 < found.result.recordings[0].torque_relative[0] < 1.0
    assert found.result.refusal.startswith("the residual of the torque of motor 1 is 6") == refused


def test_gears_are_those_of_their_robot_and_motion_also_when_asked_again(recordings):
    """Two recordings of one motion differ by their noise."""
    robots = arm(), Known.drawn(np.random.default_rng(6)).start
    motions = [SmoothedRecording.of(own, BANDWIDTH).motion for own in recordings]
    asked = [(robot, motion) for robot in robots for motion in motions]
    time = recordings[0].time
    with DrivenFmu(arm()) as fmu:
        first, again = ([fmu.simulate(r, time, m).wind_up for r, m in asked] for _ in range(2))
    np.testing.assert_array_equal(again, first)
    assert len({own.tobytes() for own in first}) == 4


def test_derivatives_are_those_of_differences_of_residuals(recordings):
    first, *others = arm().joints
    robot = replace(
        arm(),
        joints=(replace(first, balancer=((-1.0, 300.0), (0.0, 50.0), (1.0, -200.0))), *others),
    )
    moved = SmoothedRecording.of(recordings[0], BANDWIDTH)
    parameters = (
        *motion_parameters(robot, (0, 1)),
        *sensor_parameters([0, 1]),
        *torque_parameters(robot),
    )
    with DrivenFmu(robot) as fmu:
        problem = MotionProblem(fmu, robot, parameters, (moved,))
        point = MotionExperiment.of(problem, problem.start + 0.2).recompute()
        (matrix,) = jacobian(point)

        def residual(x):
            return point.residuals(MotionExperiment.of(problem, x))[0]

        for k, parameter in enumerate(parameters):
            step = np.where(np.arange(len(point.x)) == k, 0.02, 0.0)
            difference = (residual(point.x + step) - residual(point.x - step)) / 0.04
            error = np.linalg.norm(matrix[:, :, k] - difference)
            # A lag's derivative is the motor's rate, and the link's swings beside.
            part = 0.06 if parameter.name.endswith("lag") else 0.01
            assert error < part * np.linalg.norm(difference) + 1e-3, parameter.name


def test_friction_after_a_rest_and_the_rate_loop_are_found_again(recordings):
    """60 Hz of 20 urad at the motors meet a rate loop of 1e4 N m s/rad and a rotor of 20 kg m2."""
    first, step = recordings[0], recordings[0].step
    fast = 2e-5 * np.sin(2.0 * np.pi * 60.0 * first.time)[:, None] * np.ones(2)
    rate = np.diff(fast, axis=0, prepend=fast[:1]) / step
    acceleration = (
        -((2.0 / step * np.sin(np.pi * 60.0 * step)) ** 2) * fast
    )  # of a sine, as sampled
    travel = np.cumsum(np.abs(np.diff(first.motor, axis=0, prepend=first.motor[:1])), axis=0)
    slipping = np.column_stack(
        [
            presliding(q, joint.drive.slip_angle, 0.0)
            for q, joint in zip(first.motor.T, arm().joints, strict=True)
        ]
    )
    beside = 80.0 * slipping * np.exp(-travel / 5e-3) - 1e4 * rate + 20.0 * acceleration
    recording = replace(first, motor=first.motor + fast, torque=first.torque + beside)
    moved = SmoothedRecording.of(recording, BANDWIDTH)
    with DrivenFmu(arm()) as fmu:
        numbers = torque_parameters(arm())
        found = fit_motion(MotionProblem(fmu, arm(), numbers, (moved,)))
    values = {p.name: p.outward(x) for p, x in zip(numbers, found.x, strict=True)}
    for i in (1, 2):
        assert values[f"motor[{i}].friction_after_rest"] == pytest.approx(80.0, rel=0.1)
        assert values[f"motor[{i}].fast.rate_gain"] == pytest.approx(1e4, rel=0.05)
        assert values[f"motor[{i}].fast.inertia"] == pytest.approx(20.0, rel=0.05)


def test_blocks_left_out_know_correlated_residuals():
    """The mean of noise that holds for 25 rows: the interval of single rows is 5 times too narrow."""
    rng, means, widths = np.random.default_rng(8), [], []
    for _ in range(200):
        residual = np.repeat(rng.standard_normal(80), 25)[:, None]
        blocks = NormalBlocks.of([-np.ones((2000, 1, 1))], [residual])
        means.append(blocks.step[0])
        widths.append(blocks.half[0] * blocks.deviation[0])
    inside = np.mean(np.abs(means) <= widths)
    assert 0.9 <= inside <= 0.99
    assert np.mean(widths) > 3.0 * 1.96 / np.sqrt(2000)


def test_recordings_with_other_encoders_are_refused(recordings):
    other = replace(recordings[1], link=np.full_like(recordings[1].link, np.nan))
    with pytest.raises(IdentifyError, match="expected the links' angles"):
        identify_motion(arm(), held_out([recordings[0], other], 1), BANDWIDTH)
    with pytest.raises(IdentifyError, match="none but those held out"):
        identify_motion(arm(), held_out(recordings, 0, 1), BANDWIDTH)


def test_a_rigid_joint_is_refused(recordings):
    joints = arm().joints
    rigid = replace(joints[1], stiffness=None, damping=0.0, drive=None)
    robot = replace(arm(), joints=(joints[0], rigid))
    with pytest.raises(
        IdentifyError, match="expected a stiffness of every joint, got none of joint 2"
    ):
        identify_motion(robot, recordings[:1], BANDWIDTH)


def test_a_gear_that_does_not_wind_up_shows_its_kinematic_error():
    """Motor less link is -a sin(n q) to what 1 GN m/rad leaves of it."""
    stiff = [
        replace(joint, stiffness=1e9, damping=1e6, kinematic_error=(KinematicError(1e-4, 7.0),))
        for joint in arm().joints
    ]
    robot = replace(arm(), joints=tuple(stiff), gravity=(0.0, 0.0, 0.0))
    time = 0.004 * np.arange(600)
    motor = 0.4 * np.sin(2.0 * np.pi * 0.2 * time)[:, None] * np.ones(2)
    recording = Recording("x", time, motor, np.zeros_like(motor), motor)
    moved = SmoothedRecording.of(recording, BANDWIDTH)
    with DrivenFmu(robot) as fmu:
        problem = MotionProblem(fmu, robot, (), (moved,))
        gear = problem.predicted(moved, problem.start).shares["gear"]
    np.testing.assert_allclose(gear, -1e-4 * np.sin(7.0 * moved.motion.q), atol=1e-6)


def test_a_trillionth_of_a_radian_moves_nothing_that_is_identified():
    """Links without weight swing in a backlash that the start has and the robot has not.

    Beside 20 urad that no model explains, correlated over 0.2 s, the squares along that backlash are
    rugged, and along it all others'.
    """
    rng = np.random.default_rng(2)
    robot = replace(arm(), gravity=(0.0, 0.0, 0.0))
    with DrivenFmu(robot) as fmu:
        recording = recorded(fmu, robot, rng)
    keep = np.exp(-STEP / 0.2)
    white = rng.standard_normal((len(recording.time) + 200, 2))
    unexplained = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, axis=0)[200:]
    rough = 1e-6 * rng.standard_normal(recording.motor.shape)
    recording = replace(
        recording, motor=recording.motor + rough, link=recording.link + 2e-5 * unexplained
    )
    drawn = Known.drawn(np.random.default_rng(6)).start
    joints = tuple(replace(joint, backlash=3e-5) for joint in drawn.joints)
    start = replace(drawn, joints=joints, gravity=(0.0, 0.0, 0.0))
    changed = replace(
        recording, link=recording.link + 1e-12 * rng.standard_normal(recording.link.shape)
    )
    one, other = (stored(identify_motion, start, [own], BANDWIDTH) for own in (recording, changed))
    assert one.fit.converged
    assert one.fit.slopes.exact
    assert not any(p.name.endswith("backlash") for p in one.fit.problem.parameters)
    assert {"joint[1].stiffness", "joint[2].stiffness"} <= one.result.identified
    assert one.result.identified == other.result.identified
    half = one.fit.blocks.half * one.fit.blocks.deviation
    own = np.array([p.name in one.result.identified for p in one.fit.problem.parameters])
    assert np.all(np.abs(other.fit.x - one.fit.x)[own] < 1e-2 * half[own])


@pytest.mark.parametrize(
    ("other", "less_likely", "stays"),
    [(1.0, 0.0, True), (2.0, 0.5, False), (2.0, 5.0, True), (1.25, 0.5, True), (1.4, 0.5, False)],
)
def test_a_value_with_another_as_likely_in_its_interval_is_one_of_several(
    monkeypatch, other, less_likely, stays
):
    """A likelihood with one maximum at 1 and one elsewhere, where fits from above 1.2 end; half 1."""

    def at(x):
        return SimpleNamespace(x=x, minus_log_likelihood=less_likely * float(x[0] != 1.0))

    monkeypatch.setattr(fit, "fit_roughly", lambda problem, x: at(np.where(x > 1.2, other, 1.0)))
    blocks = SimpleNamespace(half=2.0, deviation=np.array([0.5]))
    blocks.only = lambda others, away: SimpleNamespace(step=np.empty(0))
    one = at(np.ones(1))
    one.blocks, one.problem = blocks, SimpleNamespace(bounds=(np.zeros(1), np.full(1, 9.0)))
    assert fit.returns(one, np.array([True])) == [stays]

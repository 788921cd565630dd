"""Angles and torques of motors beside the tool: what they tell of friction, and how they count."""

from dataclasses import replace

import numpy as np
import pytest
from circling_robots import Robots, stored_fit
from slipping_servos import slipping
from tuned_fmu import tuned

from coupling.errors import LearnError
from coupling.identification.runs.effect import ParameterEffect, SecantEffect
from coupling.identification.runs.learning import _with_motors, _with_weights
from coupling.identification.runs.measurement import MeasuredPath, read_measurement
from coupling.identification.runs.motors import MeasuredMotors
from coupling.identification.runs.parameters import prior_of
from coupling.identification.runs.problem import FitProblem
from coupling.identification.runs.residual import Residual
from coupling.identification.runs.slow_part import SlowPart
from coupling.robot.parameters import scaled_values

ANGLE_NOISE, TORQUE_NOISE = 5e-6, 20.0  # [rad], [N m]
COLUMNS = tuple((kind, joint) for kind in ("motor", "motor_torque") for joint in range(5))
NOISES = np.repeat([ANGLE_NOISE, TORQUE_NOISE], 5)


@pytest.fixture(scope="module")
def robots(example, models):
    return Robots(slipping(example), models, seconds=5.0, drive="servo")


def recorded(robots: Robots, x: np.ndarray, every: int = 1, late: float = 0.0) -> MeasuredPath:
    """A run with motors, recorded late by some time [s], with noise."""
    with tuned(robots.fmu, scaled_values(robots.parameters, x)) as fmu:
        path, moved = fmu.with_motors(robots.command, robots.wrench, range(5))
    told = np.hstack([moved.angle, moved.torque])
    noise = NOISES * np.random.default_rng(8).standard_normal(told.shape)
    told = np.column_stack([np.interp(path.time - late, path.time, own) for own in told.T]) + noise
    one = robots.measured(path.position[0], every)
    seen = MeasuredMotors(COLUMNS, told[::every], np.ones(10))
    return replace(one, measured=replace(one.measured, motors=seen))


def problem_of(robots: Robots, one: MeasuredPath) -> FitProblem:
    effect = ParameterEffect(robots.robot, "backlash", robots.parameters, one)
    one = _with_weights(one, effect, robots.fmu, robots.robot)
    return FitProblem((robots.fmu,), robots.parameters, (one,), (effect,))


def test_what_friction_does_to_motors_is_what_simulations_do(robots):
    """Torque and angle by the log factor of its friction, below 1 Hz, without backlash."""
    tight = replace(
        robots.robot, joints=tuple(replace(j, backlash=0.0) for j in robots.robot.joints)
    )
    own = Robots(tight, robots.models, seconds=4.0, drive="servo")
    one = recorded(own, own.none, every=3)
    effect = ParameterEffect(tight, "backlash", own.parameters, one)
    one = _with_weights(one, effect, own.fmu, tight)
    secant = SecantEffect((own.fmu,), one, effect, 0.02)
    slow = SlowPart.of(one.measured.time, 1.0)
    told, found = (slow(by(own.none, one.measured.time)[:, 6:]) for by in (effect, secant))
    for k, parameter in enumerate(own.parameters):
        if parameter.kind != "friction":
            assert not told[:, :, k].any()
            continue
        # Wrists are too light to be left alone by what their friction shakes.
        for column in (parameter.gear, 5 + parameter.gear) if parameter.gear < 3 else ():
            left = np.sum((told[:, column, k] - found[:, column, k]) ** 2)
            assert np.sqrt(left / np.sum(found[:, column, k] ** 2)) < 0.25, (parameter.name, column)
        assert k in secant.shown


def test_a_pass_with_motors_tells_friction_and_leaves_hysteresis_to_the_tool(robots):
    """Friction +20 %, hysteresis -20 %: friction is known much better with the columns, all of it.

    Torques follow friction alone, so that what the tool shows beside it is the gears'.  The columns were
    recorded 5 ms late, which is found: the tool's clock stays to a tenth of that.
    """
    truth = robots.factors(friction=1.2, hysteresis=0.8)
    one = recorded(robots, truth, late=0.005)
    kinds = np.array([own.kind for own in robots.parameters])
    friction = np.flatnonzero(kinds == "friction")
    start, errors, fits = 0.0 * truth, [], []
    for motors in (None, one.measured.motors):
        problem = problem_of(robots, replace(one, measured=replace(one.measured, motors=motors)))
        found = stored_fit(problem, start)
        start = found.x[: len(truth)]
        errors.append(start - truth)
        fits.append(found)
    alone, _ = fits
    # Without the columns the tool tells both kinds of gears that reverse.
    identifiable = alone.deviation < 0.5 * prior_of(robots.parameters)
    for kind, least in (("friction", 4), ("hysteresis", 2)):
        rows = np.flatnonzero(identifiable & (kinds == kind))
        assert len(rows) >= least, kind
        assert np.all(np.abs(errors[0][rows]) < 0.08), kind
    held = np.abs(errors[0]) < alone.half
    assert np.mean(held[identifiable]) > 0.85
    narrower = alone.deviation / found.deviation
    assert narrower[friction].min() > 2.0
    assert narrower.min() > 0.8
    assert np.all(np.abs(errors[1][friction]) < found.half[friction])
    assert np.abs(errors[1][friction]).max() < 0.02
    identifiable = np.flatnonzero((kinds == "hysteresis") & (found.half < 0.1))
    assert len(identifiable) >= 2
    within = np.maximum(found.half[identifiable], 0.03)
    assert np.all(np.abs(errors[1][identifiable]) < within)
    clocks = found.x[len(truth) :]
    assert clocks[10] == pytest.approx(-0.005, abs=2e-4)
    assert abs(clocks[6]) < 5e-4


def test_a_row_is_linear_in_the_clocks_with_motors(robots):
    one = recorded(robots, robots.none, every=5)
    motors = replace(one.measured.motors, deviation=NOISES)
    one = replace(one, measured=replace(one.measured, motors=motors))
    residual, simulated = Residual(one), one.simulated(robots.fmu, robots.robot)
    inner = np.flatnonzero((one.measured.time > 0.5) & (one.measured.time < 4.5))
    exact = residual.by_frame(simulated, one.measured.time, 11)
    assert exact.shape[1:] == (13, 11)
    for k in (6, 10):
        step = np.where(np.arange(11) == k, 1e-6, 0.0)
        ahead, behind = (residual.rows(simulated, sign * step)[inner] for sign in (1, -1))
        got = (behind - ahead) / 2e-6
        # Motors count less their means.
        wanted = exact[inner, :, k]
        for own in (got, wanted):
            own[:, 3:] -= own[:, 3:].mean(axis=0)
        np.testing.assert_allclose(got, wanted, atol=2e-3 * np.abs(wanted).max())


def test_motors_count_by_their_noise_and_by_what_nothing_explains(robots):
    """White noise as it is; a slow ripple of 30 N m as noise that leaves as much of itself."""
    one = recorded(robots, robots.none)
    effect = ParameterEffect(robots.robot, "backlash", robots.parameters, one)
    quiet = _with_weights(one, effect, robots.fmu, robots.robot).measured.motors.deviation
    np.testing.assert_allclose(quiet / NOISES, 1.0, atol=0.2)
    ripple = 30.0 * np.sin(2.0 * np.pi * 1.3 * one.measured.time)
    values = one.measured.motors.values.copy()
    values[:, 7] += ripple
    shaken = replace(
        one, measured=replace(one.measured, motors=replace(one.measured.motors, values=values))
    )
    loud = _with_weights(shaken, effect, robots.fmu, robots.robot).measured.motors.deviation
    slow = SlowPart.of(one.measured.time)
    expected = np.std(slow(ripple[:, None])) / np.sqrt(slow.of_noise)
    assert loud[7] == pytest.approx(expected, rel=0.2)
    np.testing.assert_allclose(np.delete(loud, 7), np.delete(quiet, 7), rtol=1e-9)


@pytest.mark.parametrize(
    ("factor", "says"), [(-1.0, "sign"), (1e-3, "kN m"), (0.0055, "by the gear ratio")]
)
def test_torques_that_no_motor_has_are_refused(robots, factor, says):
    """Of another sign, in kN m, at a motor before a gear of 180; those of the model are not."""
    one = recorded(robots, robots.factors(friction=1.5), every=3)
    effect = ParameterEffect(robots.robot, "backlash", robots.parameters, one)
    assert _with_weights(one, effect, robots.fmu, robots.robot).measured.motors.remarks == ()
    values = one.measured.motors.values.copy()
    values[:, COLUMNS.index(("motor_torque", 1))] *= factor
    other = replace(
        one, measured=replace(one.measured, motors=replace(one.measured.motors, values=values))
    )
    with pytest.raises(LearnError, match=f"joint 2: .*got {factor:.2g}.* times .*{says}"):
        _with_weights(other, effect, robots.fmu, robots.robot)


def test_torques_of_another_joint_or_time_are_refused(robots):
    """Those of joints 2 and 3 in each other's column, and all of them 0.2 s late."""
    torques = np.array([kind == "motor_torque" for kind, _ in COLUMNS])
    one, late = (recorded(robots, robots.factors(friction=1.5), 3, by) for by in (0.0, 0.2))
    swapped = one.measured.motors.values[:, [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]]
    after = np.where(torques, late.measured.motors.values, one.measured.motors.values)
    for values, says in (
        (swapped, "of joints 2 and 3, each in its column, .* swapped"),
        (after, "on the clock of the motors' angles, got them 200 ms late"),
    ):
        other = replace(
            one, measured=replace(one.measured, motors=replace(one.measured.motors, values=values))
        )
        with pytest.raises(LearnError, match=says):
            problem_of(robots, other)


def test_angles_that_are_not_those_of_their_motor_are_refused(robots):
    """In degrees, or of the joint beside; with another zero, as a controller has it, they are read."""
    one = recorded(robots, robots.none, every=3)
    effect = ParameterEffect(robots.robot, "backlash", robots.parameters, one)
    values = one.measured.motors.values

    def weighed(column: np.ndarray) -> MeasuredPath:
        other = values.copy()
        other[:, 1] = column
        motors = replace(one.measured.motors, values=other)
        seen = replace(one.measured, motors=motors)
        return _with_weights(replace(one, measured=seen), effect, robots.fmu, robots.robot)

    assert weighed(values[:, 1] + 1.0).measured.motors.deviation[1] < 2.0 * ANGLE_NOISE
    for column in (np.degrees(values[:, 1]), values[:, 0]):
        with pytest.raises(LearnError, match=r"motor\[2\]: .* rad rms: is it in degrees"):
            weighed(column)


def test_columns_are_read_by_their_names_and_belong_to_joints_with_motors(tmp_path, robots):
    header = "time,x,y,z,motor_torque[6],motor[2],reference[1],motor[6]"
    rows = [f"{0.1 * k},0,0,{0.01 * k},{k},{2 * k},9,{3 * k}" for k in range(30)]
    file = tmp_path / "measured.csv"
    file.write_text("\n".join([header, *rows]))
    seen = read_measurement(file)
    assert seen.motors.columns == (("motor_torque", 5), ("motor", 1), ("motor", 5))
    np.testing.assert_array_equal(seen.motors.values[4], [4.0, 8.0, 12.0])
    np.testing.assert_array_equal(
        seen.at_rows(np.array([3, 9])).motors.values[1], [9.0, 18.0, 27.0]
    )
    own = seen.motors.of(robots.robot, "measured.csv")  # joint 6 has no motor
    assert own.names == ("motor[2]",)
    assert own.joints == (1,)
    assert replace(own, columns=(("motor", 5),)).of(robots.robot, "") is None
    with pytest.raises(LearnError, match=r"motors of a robot with 6 joints, got motor\[7\]"):
        replace(own, columns=(("motor", 6),)).of(robots.robot, "measured.csv")
    file.write_text(
        "\n".join([header.replace(",motor[6]", ""), *(r.rsplit(",", 1)[0] for r in rows)]).replace(
            "motor_torque[6],motor[2]", "a,b"
        )
    )
    assert read_measurement(file).motors is None


def test_currents_count_as_torques_by_the_robots_constant(tmp_path, robots):
    """2 N m/A; beside a torque a current does not count, without a constant it is refused."""
    file = tmp_path / "measured.csv"
    rows = [f"{0.1 * k},0,0,{0.01 * k},{k},{k},{k}" for k in range(30)]
    file.write_text(
        "\n".join(["time,x,y,z,motor_current[2],motor_current[3],motor_torque[3]", *rows])
    )
    seen = read_measurement(file).motors
    first, *others = robots.robot.joints
    motor = replace(others[0].drive, torque_per_current=2.0)
    robot = replace(robots.robot, joints=(first, replace(others[0], drive=motor), *others[1:]))
    own = seen.of(robot, "measured.csv")
    assert own.names == ("motor_torque[2]", "motor_torque[3]")
    np.testing.assert_array_equal(own.values[4], [8.0, 4.0])
    with pytest.raises(
        LearnError, match=r"measured.csv: motor_current\[2\]: .*torque_constant_Nm_A"
    ):
        seen.of(robots.robot, "measured.csv")


def test_ideal_drives_know_no_motors(robots):
    """What was recorded of them is left out there."""
    one = recorded(robots, robots.none, every=20)

    class Source:
        robot, drive = robots.robot, "ideal"

    assert _with_motors(one, Source).measured.motors is None
    Source.drive = "servo"
    assert _with_motors(one, Source).measured.motors.columns == COLUMNS

"""Stiffness and damping from frequency responses: what was drawn is found, nothing else claimed."""

import re
from dataclasses import replace

import numpy as np
import pytest
from command_line import command
from tapped_robot import bending_links, drawn_values, tap

from coupling.errors import IdentifyError
from coupling.files.modal_damping import with_damping_ratio
from coupling.files.robot_file import load_robot, shipped_robots
from coupling.identification.response.experiment import PostureResponse, ResponseProblem
from coupling.identification.response.identification import identify_from_responses
from coupling.identification.response.posture import MeasuredPosture, read_posture
from coupling.identification.response.refusal import LARGEST_ERROR
from coupling.modes.locked_robot import LockedRobot
from coupling.modes.measured_response import MeasuredResponse
from coupling.report.identify_answers import response_answer
from coupling.robot.parameters import value_of
from elastic_robot.parameters import Parameters


def _robot(name="fanuc_r2000ic"):
    return with_damping_ratio(load_robot(shipped_robots()[name]), 0.03)


def _postures(rng, count):
    middle = np.array([0.0, 0.2, 0.3, 0.3, 0.9, 0.0])
    return middle + rng.uniform(-0.5, 0.5, (count, 6))


def test_derivatives_of_the_residual_are_its_differences():
    """Central differences of logs of factors, factor and delay of the instrument; error of order h^2."""
    robot, rng = _robot("icme2008"), np.random.default_rng(3)
    parameters = Parameters.of(robot)
    q = _postures(rng, 2)
    postures = tuple(
        PostureResponse.of(
            LockedRobot(robot, "linear").linear(angles, np.zeros(6)),
            parameters.stiffness,
            tap(robot, drawn_values(robot, rng), angles).responses,
        )
        for angles in q
    )
    count = 2 * len(parameters.stiffness) + 2 * len(postures)
    problem = ResponseProblem(
        postures, parameters.stiffness, parameters.damping, np.ones(count), 1.0
    )
    x, errors = 0.2 * rng.normal(size=count), []
    exact = problem.at(x).columns
    for h in (1e-3, 5e-4):
        differences = np.empty_like(exact)
        for k in range(count):
            step = h * np.eye(count)[k]
            low, high = problem.at(x - step).residual, problem.at(x + step).residual
            change = high - low
            change.imag = (change.imag + np.pi) % (2.0 * np.pi) - np.pi
            differences[:, k] = change / (2.0 * h)
        errors.append(np.linalg.norm(differences - exact))
    assert errors[1] < 1e-2 * np.linalg.norm(exact)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("seed", range(3))
def test_exact_responses_give_the_springs_and_dampers_that_made_them(seed):
    """Two postures without noise: to what the prior pulls, a thousandth of a factor."""
    robot, rng = _robot("kuka_kr300"), np.random.default_rng(seed)
    values = drawn_values(robot, rng)
    taps = [tap(robot, values, q) for q in _postures(rng, 2)]
    identified = identify_from_responses(robot, "linear", taps)
    for verdict in identified.result.parameters:
        if verdict.identified:
            assert verdict.value == pytest.approx(values[verdict.name], rel=0.03), verdict.name
            assert value_of(identified.robot, verdict.name) == pytest.approx(
                verdict.value, rel=0.01
            )
    assert sum(verdict.identified for verdict in identified.result.parameters) >= 9
    assert identified.result.error.written < 0.01 < identified.result.error.start


def test_noise_factor_and_delay_of_instruments_are_not_taken_for_the_robot():
    """3 % of noise, 2 % of gain, 0.2 ms of delay: intervals hold the truth, a posture is predicted."""
    robot, rng = _robot(), np.random.default_rng(5)
    values = drawn_values(robot, rng)
    q = _postures(rng, 4)
    taps = [tap(robot, values, angles, 0.03, 1.02, 2e-4, rng) for angles in q[:3]]
    taps.append(tap(robot, values, q[3], 0.03, 0.99, 1e-4, rng, is_held_out=True))
    identified = identify_from_responses(robot, "linear", taps)
    inside = [
        verdict.low <= values[verdict.name] <= verdict.high
        for verdict in identified.result.parameters
        if verdict.identified
    ]
    assert sum(inside) >= len(inside) - 2
    assert len(inside) >= 12
    assert identified.result.held_out.written < 0.06 < 0.3 < identified.result.held_out.start


def test_what_the_tool_does_not_feel_is_kept():
    """A force through the axis of joint 6 does not turn it: its stiffness stays that of the file."""
    robot, rng = load_robot(shipped_robots()["ur10"]), np.random.default_rng(2)
    q = rng.uniform(-0.8, 0.8, (1, 6))
    identified = identify_from_responses(
        robot, "linear", [tap(robot, drawn_values(robot, rng), q[0], 0.05, rng=rng)]
    )
    kept = [verdict for verdict in identified.result.parameters if not verdict.identified]
    assert "joint[6].stiffness" in [verdict.name for verdict in kept]
    for verdict in kept:
        assert value_of(identified.robot, verdict.name) == value_of(robot, verdict.name)


ELSEWHERE = np.array([0.9, -0.6, 0.5, 1.2, -1.5, 0.0])


def _misread(kind, taps):
    """Return postures with what another reading of the same taps would be."""
    first = taps[0].q
    if kind == "exchanged":
        return [
            MeasuredPosture(t.name, o.q, t.responses) for t, o in zip(taps, taps[::-1], strict=True)
        ]
    if kind == "one elsewhere":
        return [taps[0], MeasuredPosture("elsewhere", first + ELSEWHERE, taps[1].responses)]

    names = str.maketrans("xy", "yx" if kind == "axes" else "xy")

    def read(response):
        of_acceleration = -((2.0 * np.pi * response.frequency) ** 2)
        factors = {"signs": -1.0, "units": 1e3, "accelerations": of_acceleration}
        compliance = response.compliance * factors.get(kind, 1.0)
        return MeasuredResponse(response.name.translate(names), response.frequency, compliance)

    return [MeasuredPosture(t.name, t.q, tuple(map(read, t.responses))) for t in taps]


@pytest.mark.parametrize(
    ("name", "kind", "seen"),
    [
        ("ur10", "exchanged", "in the posture of"),
        ("kuka_kr300", "one elsewhere", "elsewhere: half of its values"),
        ("ur10", "axes", "x, y, z of the file are y, x, z of the base"),
        ("ur10", "signs", "opposite signs"),
        ("fanuc_r2000ic", "units", "mm/N"),
        ("ur10", "accelerations", "accelerations over force"),
    ],
)
def test_responses_that_are_not_of_the_posture_told_are_refused_by_what_they_look_like(
    name, kind, seen
):
    """Two postures with noise: read otherwise, no robot near the start file has them."""
    robot, rng = _robot(name), np.random.default_rng(2)
    values, q = (
        drawn_values(robot, rng),
        np.array([[0.4, -0.2, 0.7, 0.8, 0.6, 0], [-0.3, 0.6, 0, 0.1, 1.4, 0]]),
    )
    taps = [replace(tap(robot, values, each, 0.03, rng=rng), name=f"tap {each[0]}") for each in q]
    assert not identify_from_responses(robot, "linear", taps).result.refusal
    refusal = identify_from_responses(robot, "linear", _misread(kind, taps)).result.refusal
    assert "check --posture-deg" in refusal
    assert seen in refusal


@pytest.mark.parametrize("name", ["kuka_kr300", "ur10"])
def test_a_wrong_posture_of_three_is_seen_by_what_the_others_predict(name):
    """A fit to all of them leaves no more than one to a robot whose links bend."""
    robot, rng = _robot(name), np.random.default_rng(1)
    values, q = drawn_values(robot, rng), _postures(rng, 3)
    taps = [tap(robot, values, each, 0.1, 1.02, 2e-4, rng) for each in q]
    taps = [replace(each, name=f"tap {row}") for row, each in enumerate(taps)]
    elsewhere = _postures(np.random.default_rng(101), 1)[0]
    taps[1] = replace(taps[1], q=elsewhere)
    result = identify_from_responses(robot, "linear", taps).result
    assert result.error.written < LARGEST_ERROR
    assert re.match(
        r"tap 1: a robot fitted to the other postures is off by a factor of", result.refusal
    )
    assert "check --posture-deg" in result.refusal
    assert not identify_from_responses(robot, "linear", [taps[0], taps[2]]).result.refusal


@pytest.mark.parametrize("name", ["kuka_kr300", "icme2008", "ur10"])
def test_a_robot_with_links_that_bend_and_noisy_instruments_is_not_refused(name):
    """Joints have tilts, 3 to 9 times as stiff as the gears, that the start file has not; 10 % noise."""
    robot, rng = _robot(name), np.random.default_rng(4)
    bending = bending_links(robot, rng)
    values = drawn_values(bending, rng)
    taps = [tap(bending, values, q, 0.1, 1.02, 2e-4, rng) for q in _postures(rng, 3)]
    result = identify_from_responses(robot, "linear", taps).result
    assert not result.refusal
    assert result.error.written < LARGEST_ERROR < result.error.start + 0.3


def test_intervals_are_wider_where_more_is_left_than_noise():
    """The same noise on a robot of the model and on one whose links bend as well: a factor of 3."""
    robot, rng = _robot(), np.random.default_rng(6)
    bending, q = bending_links(robot, rng), _postures(rng, 2)
    noise, widths = {}, {}
    for true in (robot, bending):
        taps = [tap(true, {}, each, 0.03, rng=np.random.default_rng(7)) for each in q]
        identified = identify_from_responses(robot, "linear", taps)
        noise[true] = identified.result.noise
        widths[true] = np.array([np.log(v.high / v.low) for v in identified.result.parameters])
    assert noise[robot] == pytest.approx(0.03, rel=0.3)
    assert noise[bending] == pytest.approx(0.03, rel=0.5)
    assert np.median(widths[bending] / widths[robot]) > 3.0


def test_one_response_that_springs_could_explain_is_refused_by_the_springs():
    """Twelve numbers fit a response of another posture, but with springs that no such robot has."""
    robot, rng = _robot("kuka_kr300"), np.random.default_rng(0)
    values, q = drawn_values(robot, rng), _postures(rng, 3)
    response = tap(robot, values, q[0], 0.03, rng=rng).responses[:1]
    right = identify_from_responses(robot, "linear", [MeasuredPosture("single", q[0], response)])
    wrong = identify_from_responses(robot, "linear", [MeasuredPosture("single", q[1], response)])
    assert not right.result.refusal
    assert "half of the springs would have to change" in wrong.result.refusal
    assert response_answer(right.result, "new.toml").good is None  # nothing has checked it


def test_only_responses_that_are_held_out_are_refused():
    robot = _robot()
    tapped = tap(robot, {}, np.array([0.0, 0.2, 0.3, 0.3, 0.9, 0.0]), is_held_out=True)
    with pytest.raises(IdentifyError, match="those held out"):
        identify_from_responses(robot, "linear", [tapped])


def _write_responses(file, tapped):
    columns, names = [tapped.responses[0].frequency], ["frequency_Hz"]
    for response in tapped.responses:
        columns += [response.compliance.real, response.compliance.imag]
        names += [f"{response.name}_real_m_N", f"{response.name}_imag_m_N"]
    np.savetxt(file, np.column_stack(columns), delimiter=",", header=",".join(names), comments="")


def test_the_command_writes_a_robot_and_names_what_is_missing(tmp_path):
    """A table of responses becomes a robot file; without a posture the option is named."""
    robot, rng = _robot(), np.random.default_rng(4)
    values, q = drawn_values(robot, rng), np.deg2rad([0.0, 20.0, 15.0, 10.0, 50.0, 0.0])
    tapped = tap(robot, values, q)
    file = tmp_path / "tapped.csv"
    _write_responses(file, tapped)
    base = ("identify", file, "--robot", "fanuc_r2000ic", "-o", tmp_path / "out.toml")
    missing = command(*base, exits=2)
    assert "--posture-deg: expected it once" in missing.stderr
    done = command(*base, "--torque-curve", "linear", "--posture-deg=0,20,15,10,50,0", exits=0)
    written = load_robot(tmp_path / "out.toml")
    name = "joint[2].stiffness"
    assert value_of(written, name) == pytest.approx(values[name], rel=0.02)
    assert (tmp_path / "out.html").is_file()
    assert (tmp_path / "out.json").is_file()
    assert "IDENTIFIED: half of the values" in done.stdout
    assert len(done.stdout.splitlines()) <= 15
    wrong = command(*base, "--torque-curve", "linear", "--posture-deg=40,-10,60,60,-50,0", exits=1)
    assert "NOT IDENTIFIED, no file was written: tapped.csv: half of its values" in wrong.stdout
    assert "out.toml: from an earlier run, unchanged" in wrong.stdout
    assert load_robot(tmp_path / "out.toml") == written
    assert "NOT IDENTIFIED" in (tmp_path / "out.html").read_text()
    fresh = tmp_path / "fresh.toml"
    command(*base[:-1], fresh, "--torque-curve", "linear", "--posture-deg=40,-10,60,60,-50,0")
    assert not fresh.exists()


def test_a_response_of_zero_is_refused_by_its_place(tmp_path):
    file = tmp_path / "zero.csv"
    file.write_text("frequency_Hz,xx_real_m_N,xx_imag_m_N\n10,1e-6,0\n20,0,0\n30,1e-6,0\n")
    with pytest.raises(IdentifyError, match=r"xx at 20 Hz: expected a response other than zero"):
        read_posture(file, np.zeros(6))

"""What loading loops tell of gears with hysteresis, and what the model predicts of deflections."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from fixture_store import stored
from loading_loops import RISING, TURNS, loops, written
from noisy_arm import arm, exact
from places import EXAMPLES
from random_robots import make_robot
from slipping_robot import ANGLES, with_hysteresis

from coupling.errors import HysteresisError
from coupling.files.robot_file import load_robot, robot_numbers
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.fit import IdentifyOptions
from coupling.identification.static.identification import identify
from coupling.identification.static.measurements import Measurements, noise_of
from coupling.identification.static.model import StaticModel
from elastic_robot.description import Robot
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

NOISE = 5e-6  # [m]
# Up, down through zero, and back up, in fewer steps than `TURNS`: parts of the largest force.
FEWER = (0.5, 1.0, 0.4, -0.2, -0.7, -1.0, -0.2, 0.6, 1.0)
START = EXAMPLES / "identify" / "fanuc_start.toml"


def stiffer(robot: Robot, factor: float) -> Robot:
    """The robot with other stiffnesses of its gears and tilts."""

    def changed(own):
        return own if own.stiffness is None else replace(own, stiffness=factor * own.stiffness)

    joints = (replace(changed(own), tilt=tuple(map(changed, own.tilt))) for own in robot.joints)
    return replace(robot, joints=tuple(joints))


def found_in(start: Robot, rows, **options):
    return stored(identify, start, rows, IdentifyOptions(noise_of(rows, **options)))


def truth(robot: Robot) -> dict[str, float]:
    """Slip torques, slip angles and stiffnesses of a robot by their names."""
    known = {}
    for i, joint in enumerate(robot.joints, start=1):
        known[f"joint[{i}].stiffness"] = joint.stiffness
        known[f"joint[{i}].hysteresis"] = sum(own.slip_torque for own in joint.hysteresis)
        known[f"joint[{i}].slip_angle"] = ANGLES[-1]
        for k, tilt in enumerate(joint.tilt, start=1):
            known[f"joint[{i}].tilt[{k}].stiffness"] = tilt.stiffness
    return known


def in_file(robot: Robot) -> Robot:
    """A start file with the right slip angles, and slip torques and stiffnesses that are off."""
    return stiffer(with_hysteresis(robot, tuple(70.0 + 20.0 * k for k in range(3))), 1.3)


@pytest.mark.parametrize(
    ("bare", "start", "parts"),
    [
        (arm(tilt=True), in_file(arm(tilt=True)), FEWER),
        (stiffer(make_robot(3, 3, 0.0), 0.1), stiffer(make_robot(3, 3, 0.0), 0.08), TURNS),
    ],
    ids=["elements in the file", "no elements in the file"],
)
def test_true_values_lie_in_their_intervals(bare, start, parts):
    """At most one of all outside by chance, and none by as much again as its interval is wide."""
    true = with_hysteresis(bare, (90.0, 150.0, 60.0))
    rows = loops(true, 4, 2, 900.0, parts, NOISE)
    found = found_in(start, rows)
    assert found.fit.converged
    assert not found.result.refusal
    known, outside = truth(true), 0
    names = [own.name for own in found.result.parameters if own.identified]
    assert {f"joint[{i}].hysteresis" for i in (1, 2, 3)} <= set(names)
    for own in found.result.parameters:
        outside += not own.low <= known[own.name] <= own.high
        if own.identified:
            assert abs(own.value - known[own.name]) < own.high - own.low, own.name
    assert outside <= 1
    # What hysteresis is worth, in loops that the fit has not seen; and nothing is overfitted.
    left_out, without = (
        np.array([getattr(loop, key) for loop in found.result.loops])
        for key in ("left_out_m", "without_hysteresis_m")
    )
    assert np.all(left_out < 2.0 * NOISE)
    assert np.all(left_out < 0.5 * without)


def test_loops_that_do_not_turn_back_tell_no_hysteresis():
    """That of the file stays, and is named; a gear without elements gets none."""
    true = with_hysteresis(arm(), (90.0, 150.0, 0.0))
    rows = loops(true, 3, 3, 900.0, RISING[1::2], NOISE)
    found = found_in(true, rows)
    by_name = {own.name: own for own in found.result.parameters}
    assert "joint[3].hysteresis" not in by_name
    for number, torque in ((1, 90.0), (2, 150.0)):
        own = by_name[f"joint[{number}].hysteresis"]
        assert own.reason == "no loop reverses the load of this gear"
        joint = found.robot.joints[number - 1]
        assert sum(stop.slip_torque for stop in joint.hysteresis) == pytest.approx(
            torque, rel=1e-12
        )
    assert all(by_name[f"joint[{i}].stiffness"].identified for i in (1, 2, 3))


def test_a_loop_that_is_left_out_takes_no_part_in_its_prediction():
    """Whatever was measured in it, and also where no other loop turns a gear back."""
    true = with_hysteresis(arm(), (90.0, 150.0, 60.0))
    rows = loops(true, 3, 6, 900.0, FEWER, NOISE)
    first = np.flatnonzero(rows.loop == 1)
    other = rows.deflection.copy()
    other[first] *= 1.2  # by some 0.1 mm
    start = with_hysteresis(stiffer(arm(), 1.2), (80.0, 140.0, 70.0))
    predicted = [
        (own.deflection - found_in(start, own).result.displacements("left_out_error"))[first]
        for own in (rows, replace(rows, deflection=other))
    ]
    np.testing.assert_allclose(*predicted, rtol=0.0, atol=1e-6)


def test_hysteresis_that_does_not_predict_other_loops_is_not_written():
    """One of three loops in the same posture is wide, as by creep: an F test alone would support it."""
    joints = arm().joints
    rigid = [replace(joints[k], stiffness=None) for k in (0, 2)]
    one = replace(arm(), joints=(rigid[0], joints[1], rigid[1]))
    wide = loops(with_hysteresis(one, (0.0, 400.0, 0.0)), 1, 6, 5000.0, noise=NOISE)
    narrow = [loops(one, 1, 6, 5000.0, noise=NOISE) for _ in range(2)]
    rows = replace(
        wide,
        names=tuple(f"row {k}" for k in range(3 * wide.count)),
        loop=np.repeat([1, 2, 3], wide.count),
        **{
            key: np.vstack([getattr(own, key) for own in (wide, *narrow)])
            for key in (
                *("q", "wrench", "deflection", "load_point", "measured_point"),
                *("deflection_deviation", "wrench_deviation"),
            )
        },
    )
    found = found_in(one, rows)
    told = [own for own in found.result.parameters if own.kind == "hysteresis"]
    assert any(own.support.supported for own in told)
    assert all("not predicted better with hysteresis" in own.reason for own in told)
    assert not any(own.identified for own in found.result.parameters if own.added)


def test_a_robot_without_hysteresis_gets_none():
    rows = loops(arm(), 3, 4, 900.0, noise=NOISE)
    found = found_in(stiffer(arm(), 1.3), rows)
    assert [own.name for own in found.result.parameters] == [
        f"joint[{i}].stiffness" for i in (1, 2, 3)
    ]
    assert {own.name for own in found.result.further} == {
        f"joint[{i}].hysteresis" for i in (1, 2, 3)
    }
    assert not any(own.supported for own in found.result.further)
    values = [own.value for own in found.result.parameters]
    np.testing.assert_allclose(values, [1e6, 2e6, 3e5], rtol=0.02)


def test_single_loads_of_a_robot_with_hysteresis_are_refused_by_what_is_needed():
    rows = exact(arm(), 3, 1)
    with pytest.raises(
        HysteresisError,
        match=r"joint 1 has hysteresis, which identify does not know .*a table with a column loop, or"
        r" take the \[joint\.gear\]",
    ):
        identify(with_hysteresis(arm(), (90.0, 0.0, 0.0)), rows, IdentifyOptions(noise_of(rows)))


def test_a_table_of_loops_becomes_a_robot_file_with_elements(command, tmp_path):
    """Of the gears that have hysteresis alone; single loads of that robot are then refused."""
    true = with_hysteresis(load_robot(START), (90.0, 150.0, 0.0, 0.0, 0.0, 0.0))
    table, target = tmp_path / "loops.csv", tmp_path / "found.toml"
    table.write_text(written(loops(true, 3, 2, 900.0, FEWER, NOISE)))
    done = command("identify", table, "--robot", START, "-v", "-o", target, exits=0)
    assert "leave-one-out without hysteresis" in done.stdout
    assert "Gears whose loops show no hysteresis get no elements" in done.stdout
    robot = load_robot(target)
    torques = [sum(own.slip_torque for own in joint.hysteresis) for joint in robot.joints]
    np.testing.assert_allclose(torques[:2], (90.0, 150.0), rtol=0.15)
    assert torques[2:] == [0.0] * 4
    told = json.loads(target.with_suffix(".json").read_text())
    assert [loop["number"] for loop in told["loops"]] == [1, 2, 3]
    assert "largest slip angle: 95 %" in target.read_text()
    sources = {number.place: number.source for number in robot_numbers(target)[1]}
    assert any("gear.hysteresis" in place for place in sources)
    single = Path(tmp_path / "single.csv")
    single.write_text(table.read_text().replace("loop", "turn"))
    refused = command("identify", single, "--robot", target, "-o", tmp_path / "y.toml", exits=2)
    assert "column loop" in " ".join(refused.stderr.split())
    added = command(
        "identify", table, "--robot", START, "--add", "supported", "-o", target, exits=2
    )
    assert "--add: expected none beside loading loops" in " ".join(added.stderr.split())


def require_derivatives(model: StaticModel) -> None:
    """Compare the derivatives by all parameters with differences of predictions."""
    start, predicted = model.elasticity.start, model.predict(model.elasticity.start)
    for j, value in enumerate(start):
        ends = []
        for part in (-1e-6, 1e-6):
            values = start.copy()
            values[j] = value * (1.0 + part)
            ends.append(model.predict(values).deflection)
        slope = (ends[1] - ends[0]) / (2e-6 * value)
        np.testing.assert_allclose(
            predicted.by_parameter[:, :, j],
            slope,
            atol=2e-4 * np.abs(slope).max(),
            err_msg=model.elasticity.names[j],
        )


@pytest.mark.parametrize("tilt", [False, True])
def test_predictions_are_the_robots_own_steps_and_derivatives_their_differences(tilt):
    """Elements that slip, stick and turn back; slip torques, slip angles and compliances."""
    robot = with_hysteresis(arm(tilt), (90.0, 150.0, 60.0))
    rows = loops(robot, 3, 5, 900.0)
    parameters = ElasticParameters.of(robot, "backlash", shaped=(0, 1, 2))
    model = StaticModel(parameters, rows, "backlash")
    predicted = model.predict(parameters.start)
    np.testing.assert_allclose(predicted.deflection, rows.deflection, atol=1e-12)
    require_derivatives(model)


def at_rest(robot: Robot, q: np.ndarray, wrench: np.ndarray, arm: np.ndarray) -> pin.SE3:
    """Return the placement of a point off the TCP, tool axes [m], by the robot that the FMU is."""
    resting = ElasticRobot(robot, "backlash", quasistatic=True)
    resting.reset(0.0, HeldCommand(0.0, q, 0.0 * q, 0.0 * q), Load(wrench))
    tool = pin.XYZQUATToSE3(resting.tcp())
    return pin.SE3(tool.rotation, tool.act(arm))


def test_a_load_from_rest_moves_a_point_by_what_lies_between_the_robots_two_rests():
    """Gears pass through their backlash; load and measured point are off the TCP, rotations are told."""
    robot = arm(tilt=True)
    gears = tuple(replace(joint, backlash=2e-4) for joint in robot.joints)
    robot, rng = replace(robot, joints=gears), np.random.default_rng(3)
    q, wrench = rng.uniform(-1.5, 1.5, (4, 3)), 800.0 * rng.normal(size=(4, 6))
    points = np.repeat(rng.uniform(-0.2, 0.2, (4, 3)), [1, 1, 2, 0], axis=0)
    places = rng.uniform(-0.2, 0.2, (4, 3))
    rows = Measurements.of(q, wrench, np.zeros((4, 6)), points, places)
    model = StaticModel(ElasticParameters.of(robot, "backlash"), rows, "backlash")
    deflection = model.predict(model.elasticity.start).deflection
    for k, point in enumerate(points):
        at_load = replace(robot, tcp_position=tuple(np.add(robot.tcp_position, point)))
        ends = [
            at_rest(at_load, q[k], load, places[k] - point) for load in (np.zeros(6), wrench[k])
        ]
        turn = pin.log3(ends[1].rotation @ ends[0].rotation.T)
        np.testing.assert_allclose(deflection[k, :3], ends[1].translation - ends[0].translation)
        np.testing.assert_allclose(deflection[k, 3:], turn)
    require_derivatives(model)

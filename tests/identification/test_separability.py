"""What postures and loads cannot tell is named, and its start value stays in the file."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomlkit
from noisy_arm import arm, exact, noisy

from coupling.errors import IdentifyError
from coupling.files.robot_file import load_robot
from coupling.identification.separability import separability
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.fit import IdentifyOptions, fit_static
from coupling.identification.static.identification import identify
from coupling.identification.static.measurements import Measurements, noise_of
from coupling.identification.static.model import StaticModel
from elastic_robot.description import Robot


def predicted(robot: Robot, rows: Measurements) -> Measurements:
    elasticity = ElasticParameters.of(robot, "backlash")
    model = StaticModel(elasticity, rows, "backlash")
    return replace(rows, deflection=model.predict(elasticity.start).deflection)


def telling(robot: Robot, rows: Measurements):
    elasticity = ElasticParameters.of(robot, "backlash")
    fit = fit_static(elasticity, rows, IdentifyOptions(noise_of(rows)))
    return separability(fit.rigid, elasticity.names)


def on_the_last_axis() -> tuple[Robot, Measurements]:
    """Loads and measured point on axis 3: nothing turns it."""
    robot = arm()
    joints = (*robot.joints[:2], replace(robot.joints[2], axis=(0.0, 0.0, 1.0)))
    robot = replace(robot, joints=joints, tcp_position=(0.0, 0.0, 0.7))
    return robot, predicted(robot, exact(robot, 15, seed=2))


def test_a_joint_that_no_load_turns_is_without_effect():
    robot, rows = on_the_last_axis()
    assert telling(robot, rows).without_effect == ("joint[3].stiffness",)


def test_the_direction_named_changes_nothing_measured():
    """Parallel axes through one point: c2 + c3 alone counts."""
    robot = arm()
    joints = (*robot.joints[:2], replace(robot.joints[2], origin=(0.0, 0.0, 0.0)))
    robot = replace(robot, joints=joints)
    rows = predicted(robot, exact(robot, 15, seed=2))
    found = telling(robot, rows)
    (direction,) = found.unseen
    assert direction.in_words in ("joint[2] - joint[3]", "joint[3] - joint[2]")
    assert [pair.names for pair in found.pairs] == [("joint[2].stiffness", "joint[3].stiffness")]
    found = identify(robot, rows, IdentifyOptions(noise_of(rows)))
    verdict = {parameter.name: parameter for parameter in found.result.parameters}
    assert verdict["joint[1].stiffness"].identified
    for name in direction.names:
        assert not verdict[name].identified
        assert "not distinguishable" in verdict[name].reason


def test_a_silent_joint_and_a_pair_are_told_one_by_one():
    """Joint 3 turns about the load's own line, joints 1 and 2 about one axis."""
    robot, rows = on_the_last_axis()
    first, second, third = robot.joints
    alike = replace(second, axis=first.axis, origin=(0.0, 0.0, 0.5))
    aside = replace(third, origin=(0.4, 0.0, 0.8))
    robot = replace(robot, joints=(first, alike, aside))
    found = telling(robot, predicted(robot, rows))
    assert found.without_effect == ("joint[3].stiffness",)
    (direction,) = found.unseen
    assert set(direction.names) == {"joint[1].stiffness", "joint[2].stiffness"}
    assert found.weak == ()
    assert found.condition == pytest.approx(1.0)


def test_a_value_that_is_not_identified_is_kept_and_the_file_says_so(tmp_path):
    true, rows = on_the_last_axis()
    rows = noisy(rows, np.random.default_rng(1), 1e-5)
    right = ElasticParameters.of(true, "backlash")
    start = right.described(right.start * [0.7, 1.5, 1.234567890123])
    data = {
        "name": start.name,
        "tcp": {"position": list(start.tcp_position)},
        "joint": [
            {
                "origin": list(joint.origin),
                "axis": list(joint.axis),
                "mass": joint.body.mass,
                "com": list(joint.body.com),
                "inertia": list(joint.body.inertia),
                "stiffness": joint.stiffness,
            }
            for joint in start.joints
        ],
        "sources": {"joint.stiffness": "a guess"},
    }
    file, target = tmp_path / "start.toml", tmp_path / "identified.toml"
    file.write_text(tomlkit.dumps(data))
    assert load_robot(file) == start
    found = identify(start, rows, IdentifyOptions(noise_of(rows)))
    target.write_text(found.text(file, "a test", target))
    written = load_robot(target)
    assert written.joints[2].stiffness == start.joints[2].stiffness  # to the last bit
    assert written.joints[0].stiffness == pytest.approx(true.joints[0].stiffness, rel=0.05)
    lines = target.read_text().splitlines()
    (line,) = [line for line in lines if "NOT IDENTIFIED" in line]
    assert line.startswith("stiffness = ")
    assert "no effect on any measurement" in line
    content = tomllib.loads(target.read_text())
    assert content["sources"] == {
        "joint.stiffness": "a guess",
        "joint[1].stiffness": "identified, a test",
        "joint[1].stiffness_range": "95 % interval, identified, a test",
        "joint[2].stiffness": "identified, a test",
        "joint[2].stiffness_range": "95 % interval, identified, a test",
    }
    ranges = [joint.get("stiffness_range") for joint in content["joint"]]
    assert ranges == [[p.low, p.high] for p in found.result.parameters[:2]] + [None]


def test_one_row_and_rows_all_alike_identify_nothing_and_write_nothing(tmp_path):
    robot = arm(tilt=True)
    one = exact(robot, 1, seed=3)
    many = Measurements.of(*(np.repeat(a, 20, axis=0) for a in (one.q, one.wrench, one.deflection)))
    many = noisy(many, np.random.default_rng(0), 1e-5)
    for rows in (one, many):
        found = identify(robot, rows, IdentifyOptions(noise_of(rows)))
        assert not any(parameter.identified for parameter in found.result.parameters)
        with pytest.raises(IdentifyError, match="not written: nothing is identified"):
            found.text(tmp_path / "a.toml", "a test", tmp_path / "b.toml")


def test_deflections_against_the_load_are_not_fitted_by_negative_springs():
    robot = arm()
    rows = exact(robot, 15, seed=3)
    found = identify(
        robot, replace(rows, deflection=-rows.deflection), IdentifyOptions(noise_of(rows))
    )
    assert np.all(found.fit.x >= 0.0)
    assert found.result.refusal == "nothing is identified"
    assert {parameter.reason for parameter in found.result.parameters} == {
        "deflections are opposite to its load: it would be negative"
    }


def test_a_rigid_robot_and_rows_without_loads_are_refused():
    robot = arm()
    rows = exact(robot, 3, seed=3)
    still = replace(rows, wrench=np.zeros((3, 6)))
    with pytest.raises(IdentifyError, match="a force or moment in at least one row"):
        identify(robot, still, IdentifyOptions(noise_of(rows)))
    joints = tuple(replace(joint, stiffness=None) for joint in robot.joints)
    with pytest.raises(IdentifyError, match="rigid robot"):
        identify(replace(robot, joints=joints), rows, IdentifyOptions(noise_of(rows)))


def test_a_gear_with_its_own_torque_table_is_not_identified_where_the_table_counts():
    points = tuple((angle, 5e5 * angle + 1e9 * angle**3) for angle in np.linspace(-0.02, 0.02, 9))
    joints = arm().joints
    tabled = replace(joints[1], torque_table=points)
    robot = replace(arm(), joints=(joints[0], tabled, joints[2]))
    assert "joint[2].stiffness" in ElasticParameters.of(robot, "backlash").names
    right = ElasticParameters.of(robot, "spline")
    assert right.names == ("joint[1].stiffness", "joint[3].stiffness")
    rows = exact(robot, 12, seed=2)
    rows = replace(
        rows, deflection=StaticModel(right, rows, "spline").predict(right.start).deflection
    )
    start = ElasticParameters.of(right.described(1.5 * right.start), "spline")
    found = fit_static(start, rows, IdentifyOptions(noise_of(rows), "spline"))
    np.testing.assert_allclose(found.x, right.start, rtol=1e-7)

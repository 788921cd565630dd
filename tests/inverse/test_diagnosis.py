"""Which gears reverse along a path: the gears' own equation, and robots set up otherwise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupling.inverse.diagnosis import diagnose, gear_loads
from coupling.inverse.gears import solve_wind_up
from coupling.inverse.inversion import DesiredMotion, MovingRobot
from coupling.inverse.reversals import backlash_reversals, margin
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.run.gear_check import gear_sections as gear_tables
from elastic_robot.dynamics import Dynamics
from elastic_robot.gear_parts import StopElement
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TORQUE_CURVES


def circle(robot, force=300.0) -> DesiredMotion:
    """A horizontal circle in 2 s, with a force that turns with it."""
    time = np.linspace(0.0, 2.0, 101)
    turn = 2.0 * np.pi * (time / 2.0 - np.sin(np.pi * time) / (2.0 * np.pi))
    pose = np.zeros((len(time), 7))
    pose[:, :3] = [1.6, 0.0, 0.8]
    pose[:, 0] += 0.05 * np.cos(turn)
    pose[:, 1] += 0.05 * np.sin(turn)
    pose[:, 3:] = Rotation.from_euler("y", 90.0, degrees=True).as_quat()
    path = ToolPath(time, pose)
    forces = force * np.stack([np.cos(turn), np.sin(turn), np.full(len(time), 0.5)], axis=1)
    home = np.deg2rad([0.0, 10.0, 20.0, 0.0, 60.0, 0.0])
    rigid = InverseKinematics(robot, home).plan(path)
    return DesiredMotion(path, rigid, WrenchHistory.of_forces(time, [forces]))


def rolled(robot, angle, direction):
    """The robot on a base that is tilted about an axis in its x-y plane."""
    axis = angle * np.array([np.cos(direction), np.sin(direction), 0.0])
    gravity = Rotation.from_rotvec(axis).inv().apply(robot.gravity)
    return replace(robot, gravity=tuple(gravity.tolist()))


def test_changes_are_the_passages_of_the_gears_own_equation(example):
    """Thirty slow random torques through backlash and damper, flanks of 1e8 N m/rad."""
    rng, spacing = np.random.default_rng(3), 1e-3
    time = spacing * np.arange(4000)
    waves = rng.uniform(0.2, 2.0, (30, 4)), rng.uniform(0.0, 6.28, (30, 4))
    torque = np.sum(np.sin(2 * np.pi * time[:, None, None] * waves[0] + waves[1]), axis=2) * 20.0
    parameters = MovingRobot(example, "backlash").model.parameters
    many = np.zeros(30)
    curve = TORQUE_CURVES["backlash"].build(
        replace(
            parameters,
            stiffness=many + 1e8,
            damping=many,
            backlash=many + 1e-4,
            tables=(None,) * 30,
        )
    )
    wind_up = solve_wind_up(time, torque, curve, many + 1e4, many)
    wanted = np.zeros(30, dtype=int)
    for crossing in wind_up.reversals:
        wanted[crossing.joint - 1] += crossing.before * crossing.after < 0
    found = backlash_reversals(spacing, torque, many + 1e-4, many + 1e4)
    assert wanted.min() >= 1
    assert wanted.max() >= 10
    np.testing.assert_array_equal(found, wanted)
    signs = np.count_nonzero(np.diff(np.sign(torque), axis=0), axis=0)
    assert np.any(signs > wanted)  # the sign alone says too much


def test_figures_of_many_settings_are_those_of_each():
    rng = np.random.default_rng(1)
    torque = rng.normal(size=(24, 50, 5))
    clear = margin(torque)
    for setting in range(50):
        for gear in range(5):
            own = torque[:, setting, gear]
            least = np.abs(own).min() if abs(np.sign(own).sum()) == 24 else None
            assert least is None or clear[setting, gear] == pytest.approx(least)
            for bias in (-1.001 * clear[setting, gear], 1.001 * clear[setting, gear]):
                if clear[setting, gear] < 0.0 and abs(np.sign(own + bias).sum()) == 24:
                    break
            else:
                assert clear[setting, gear] >= 0.0


def test_static_torques_are_those_of_an_equilibrium(example):
    """A robot without tilts, at samples of its path: the residual of its own statics."""
    stiff = replace(example, joints=tuple(replace(joint, tilt=()) for joint in example.joints))
    robot, wanted = MovingRobot(stiff, "backlash"), circle(stiff, force=0.0)
    loads = gear_loads(robot, wanted)
    dynamics = Dynamics(robot.model.chain, robot.model.parameters.gravity)
    for sample in (0, 30, 77, 100):
        theta = robot.model.chain.theta(wanted.rigid.q[0][sample])
        torque = dynamics.static_torque(theta, ToolLoad(np.zeros(6)))[robot.model.chain.torsions]
        row = int(np.argmin(np.abs(loads.time - wanted.path.time[sample])))
        np.testing.assert_allclose(loads.static[row], torque, rtol=1e-9, atol=1e-6)
        gravity = loads.by_gravity[row] @ robot.model.parameters.gravity
        np.testing.assert_allclose(gravity, torque, rtol=1e-9, atol=1e-6)


def test_the_base_tilt_it_names_keeps_the_gear_and_three_quarters_of_it_do_not(example):
    wanted = circle(example)
    before = diagnose(MovingRobot(example, "backlash"), wanted)[0]
    assert before.reversals > 0
    assert before.base_tilt is not None
    assert before.margin < 0.0
    tilt, direction = before.base_tilt, before.base_tilt_direction

    def of_tilt(part):
        robot = rolled(example, part * tilt, direction)
        return diagnose(MovingRobot(robot, "backlash"), wanted)[0]

    assert of_tilt(1.05).margin > 0.0
    assert of_tilt(1.05).reversals == 0
    assert of_tilt(0.75).margin < 0.0


def test_wrong_slip_torques_are_off_by_their_width_times_the_arm(example):
    """0.6 F |J| / k; none of a gear without elements, and in the table a column where there are any."""
    elements = (StopElement(40.0, 2e-5), StopElement(80.0, 1e-4))
    first = replace(example.joints[0], hysteresis=elements)
    robot = replace(example, joints=(first, *example.joints[1:]))
    slipping, *others = diagnose(MovingRobot(robot, "linear"), circle(example))
    assert slipping.hysteresis_error == pytest.approx(
        0.6 * 120.0 / first.stiffness * 1.65, rel=1e-3
    )
    assert [gear.hysteresis_error for gear in others] == [None] * 4
    tables = []
    for gears in ((slipping, *others), others):
        assert ["hysteresis_30_percent_m" in gear.model_dump(by_alias=True) for gear in gears] == [
            gear.hysteresis_error is not None for gear in gears
        ]
        (section,) = gear_tables(gears)
        tables.append(section.parts[1])
    column = tables[0].columns.index("hysteresis 30 % off, at rest [um]")
    assert [row[column] for row in tables[0].rows] == [
        f"{1e6 * slipping.hysteresis_error:.0f}",
        *4 * ["0"],
    ]
    assert not any("hysteresis" in name for name in tables[1].columns)
    assert {len(row) for table in tables for row in table.rows} == {7, 8}


def test_a_gear_is_unloaded_without_a_force_and_has_no_flank_without_backlash(example):
    still = diagnose(MovingRobot(example, "backlash"), circle(example, force=0.0))
    assert still[0].in_backlash == pytest.approx(2.0)  # a vertical axis carries nothing at rest
    assert [gear.in_backlash for gear in still[1:3]] == [0.0, 0.0]
    pulled = diagnose(MovingRobot(example, "backlash"), circle(example))
    assert pulled[0].in_backlash < 0.2
    assert pulled[0].at_risk
    # 0.4 B |J|: the arm of axis 1 is 1.65 m.
    assert pulled[0].backlash_error == pytest.approx(0.4 * 1e-4 * 1.65, rel=1e-3)
    for gear in diagnose(MovingRobot(example, "linear"), circle(example)):
        assert (gear.backlash, gear.reversals, gear.backlash_error, gear.at_risk) == (
            0.0,
            0,
            0.0,
            False,
        )

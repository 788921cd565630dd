"""Places of robots with hysteresis and with motors: against replays of the FMU and what a path asks."""

from dataclasses import replace

import numpy as np
import pytest
from slipping_robot import with_hysteresis
from tuned_fmu import simulate_tuned

from coupling.errors import PlanningError
from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.inverse.diagnosis import loads_along
from coupling.inverse.inversion import MovingRobot
from coupling.inverse.links import rigid_motion
from coupling.path.histories import WrenchHistory
from coupling.place.gear_loops import GearLoops
from coupling.place.objective import PlaceDemands
from coupling.place.place import best_of
from coupling.place.placing import placing
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.gear_loads import wanted_of
from coupling.run.predicted_motor_torques import predict_motor_torques
from docs.scripts.runs import example
from elastic_robot.description import Robot
from elastic_robot.drive import Drive
from elastic_robot.gear_parts import KinematicError

SLIP = (120.0, 400.0, 300.0, 25.0, 20.0, 0.0)  # [N m]


def case_with(robot: Robot, curve: str = "linear"):
    case = example("cone", tool_path={"depth_m": 0.001})
    (placed,) = case.robots
    return replace(case, robots=(replace(placed, description=robot, torque_curve=curve),))


def placed_with(monkeypatch, robot: Robot, curve: str = "linear"):
    """The placing of a case with a robot that no file has."""
    monkeypatch.setattr("coupling.place.placing.read_described_robot", lambda name, folder: robot)
    case = case_with(robot, curve)
    return placing(case, case.process, "both")


def bare(robot: Robot) -> Robot:
    """Without tilts, so that the gears alone move the tool."""
    return replace(robot, joints=tuple(replace(joint, tilt=()) for joint in robot.joints))


@pytest.fixture
def slipping(monkeypatch):
    robot = with_hysteresis(bare(load_robot(find_robot("icme2008"))), SLIP)
    return placed_with(monkeypatch, robot)


def test_what_slip_torques_30_percent_off_do_is_bounded_by_the_figure(slipping, tmp_path):
    """Quasi-static replays of the FMU along the path, forces in order, all slip torques off together.

    The tool is off by no more from place to place, and by a good part of it; so by each gear alone.
    """
    case = slipping.case
    robot = case.robots[0].description
    wrench = case.process.evaluate(case.desired).wrench
    command = InverseKinematics(robot, case.robots[0].home).plan(case.desired)
    figures = slipping.screen(slipping.stations).figures(slipping.present[None])
    file = build_fmu(robot, tmp_path / "own.fmu", BuildOptions("native"))
    torques = {i + 1: torque for i, torque in enumerate(SLIP) if torque}
    misses = dict(zip(torques, figures.hysteresis_error[0], strict=True))
    assert figures.hysteresis_error.shape == (1, len(torques))
    with RobotFmu(file, "linear") as fmu:

        def tool(*gears: int, factor: float) -> np.ndarray:
            other = {f"joint[{i}].hysteresis": factor * torques[i] for i in gears}
            return simulate_tuned(fmu, command, wrench, "quasistatic", other).position[0]

        as_is = tool(factor=1.0)
        for gears in (tuple(torques), *((i,) for i in torques)):
            most = sum(misses[i] for i in gears)
            for factor in (0.7, 1.3):
                off = tool(*gears, factor=factor) - as_is
                apart = np.linalg.norm(off[:, None] - off[None, ::40], axis=2).max()
                assert 0.1 * most < apart < 1.02 * most, (gears, factor, apart, most)


def test_what_the_process_moves_is_at_most_that_of_gears_whose_elements_slip(slipping, tmp_path):
    """Beside the springs elements hold a part, by their torque F at most: |J| F / k of each less."""
    case = slipping.case
    robot = case.robots[0].description
    wrench = case.process.evaluate(case.desired).wrench
    none = WrenchHistory.none(case.desired.time, 1)
    command = InverseKinematics(robot, case.robots[0].home).plan(case.desired)
    figures = slipping.screen(slipping.stations).figures(slipping.present[None])
    file = build_fmu(robot, tmp_path / "own.fmu", BuildOptions("native"))
    with RobotFmu(file, "linear") as fmu:
        paths = [fmu.simulate(command, own, "quasistatic").position[0] for own in (wrench, none)]
    moved = np.linalg.norm(paths[0] - paths[1], axis=1).max()
    width = float(np.sum(figures.hysteresis_error)) / 0.3
    assert figures.deviation[0] - width < moved < 1.02 * figures.deviation[0]


def test_the_figure_of_a_loop_is_that_of_elements_that_stick_or_slip():
    """Sticking: 0.3 R K / (k (k + K)); slipping: 0.6 F / k; a gear without elements 0."""
    k, K, F = 1e6, 4e5, 50.0
    loops = GearLoops(
        *(np.array([a, b]) for a, b in ((0.0, 0.0), (k, k), (F, 0.0), (K, 0.0), (0.0, 0.0)))
    )
    lever = np.full((2, 2), 1.5)
    swing = np.array([[10.0, 10.0], [1e5, 1e5]])
    expected = 0.3 * 1.5 / k * np.array([[10.0 * K / (k + K), 0.0], [2.0 * F, 0.0]])
    np.testing.assert_allclose(loops.hysteresis_error(swing, lever), expected, rtol=1e-14)


def test_elements_hold_a_gear_in_its_backlash_and_narrow_the_margin(monkeypatch):
    """By f min(1, B / a) of each element; what is not loaded beyond may reverse."""
    robot = with_hysteresis(load_robot(find_robot("icme2008")), SLIP)
    own = placed_with(monkeypatch, robot, "backlash")
    gears = [joint for joint in robot.joints if joint.stiffness is not None]
    held = [
        sum(e.slip_torque * min(1.0, joint.backlash / e.slip_angle) for e in joint.hysteresis)
        for joint in gears
    ]
    assert max(held) > 10.0
    np.testing.assert_allclose(own.gears.held_torque, held, rtol=1e-12)
    plain = replace(own, gears=replace(own.gears, held_torque=np.zeros(len(held))))
    few = own.stations.chosen(np.arange(0, own.stations.count, 100))
    margins = [one.screen(few).figures(own.present[None]).margin[0] for one in (plain, own)]
    np.testing.assert_allclose(margins[0] - margins[1], held, rtol=1e-9)


def moved_by_motors(robot: Robot, limit: float | None) -> Robot:
    drive = Drive(
        300.0, 20.0, 3e4, friction=200.0, viscous=100.0, load_friction=0.1, torque_limit=limit
    )
    sines = (KinematicError(2e-4, 60.0, 0.3),)
    joints = [
        replace(j, drive=drive, kinematic_error=sines) if j.stiffness is not None else j
        for j in robot.joints
    ]
    return replace(robot, joints=tuple(joints))


def test_motors_ask_for_the_torque_that_a_check_of_the_path_estimates(monkeypatch):
    """Per motor alone, by its own limit; what the servo's own friction does at a turn is presliding."""
    robot = moved_by_motors(bare(load_robot(find_robot("icme2008"))), 1e4)
    own = placed_with(monkeypatch, robot)
    case = own.case
    wrench = case.process.evaluate(case.desired).wrench
    (wanted,) = wanted_of(case.robots, case.desired, wrench)
    moving = MovingRobot(robot, "linear")
    task = moving.task(wanted)
    links = rigid_motion(moving.model, task)
    demands = predict_motor_torques(moving, links, loads_along(moving, links, task.wrench))
    share = own.screen(own.stations).figures(own.present[None]).motor_share[0]
    assert share == pytest.approx(max(d.torque[1.0] for d in demands) / 1e4, rel=0.03)


def test_a_setting_beyond_a_motors_torque_is_refused(monkeypatch):
    """Of the same settings as many as ask for more; the reason is said where none is left."""
    robot = load_robot(find_robot("icme2008"))
    free = placed_with(monkeypatch, moved_by_motors(robot, None))
    few = free.stations.chosen(np.arange(0, free.stations.count, 60))
    tried = free.ranges.sampled(64, 3)
    unlimited = free.screen(few).figures(tried)
    assert not unlimited.motor_share.any()
    weak = placed_with(monkeypatch, moved_by_motors(robot, 7000.0))
    figures = weak.screen(few).figures(tried)
    demands = PlaceDemands(joint_margin=0.0, conditioning=0.0, clear_share=0.25)
    refused = demands.refusals(figures)["a motor too weak"]
    assert 0 < refused.sum() < len(tried)
    np.testing.assert_array_equal(refused, demands.admits(unlimited) & (figures.motor_share > 1.0))
    none = placed_with(monkeypatch, moved_by_motors(robot, 100.0))
    with pytest.raises(PlanningError, match="a motor too weak"):
        best_of(none, none.present[None], lambda case: case.process)


def test_friction_of_a_motor_is_against_its_motion(monkeypatch):
    """|J q'' - T + f| of one motor, place by place, with rates from differences of the angles."""
    robot = load_robot(find_robot("icme2008"))
    drive = Drive(300.0, 20.0, 3e4, friction=200.0, viscous=100.0, torque_limit=1e4)
    joints = (robot.joints[0], replace(robot.joints[1], drive=drive), *robot.joints[2:])
    own = placed_with(monkeypatch, replace(robot, joints=joints))
    batch, time = own.screen(own.stations).batch(own.present[None]), own.stations.time
    rate = np.gradient(batch.q[:, 1, 0], time)
    needed = 300.0 * np.gradient(rate, time) - batch.torque[:, 1, 0]
    needed += 200.0 * np.sign(rate) + 100.0 * rate
    moving = np.abs(rate) > 2e-3
    assert {-1.0, 1.0} <= set(np.sign(rate[moving]))
    off = batch.motor_share[moving, 0] - np.abs(needed[moving]) / 1e4
    assert np.median(np.abs(off)) < 1e-4
    assert np.mean(np.abs(off) < 5e-3) > 0.98

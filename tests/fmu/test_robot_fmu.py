"""The robot as an FMU in processes of its own: paths, modes, versions of FMI, and what goes wrong."""

import subprocess
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from coupling.errors import HostError, SimulationError
from coupling.fmu.worker import WorkerProcesses
from coupling.fmu_export.build import KINDS, BuildOptions, build_fmu
from coupling.native.compiler import zig
from coupling.path.histories import WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.robot import robot_fmu
from coupling.robot.parameters import apply_values
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot
from elastic_robot.drive import Drive
from elastic_robot.fmi.interface import MODES
from elastic_robot.gear_parts import KinematicError, StopElement

pytestmark = pytest.mark.usefixtures("started_workers")


@pytest.fixture(scope="module")
def arm() -> Robot:
    """One elastic joint about y, 1 m arm, 1e5 N m/rad: compliance 1e-5 m/N at the TCP."""
    return one_joint()


def one_joint(**gear) -> Robot:
    link = Body(mass=20.0, com=(0.5, 0.0, 0.0), inertia=(0.1, 1.0, 1.0))
    joint = Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), link, stiffness=1e5, damping=100.0, **gear)
    return Robot("arm", (joint,), gravity=(0.0, 0.0, 0.0), tcp_position=(1.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def arm_fmu(arm, tmp_path_factory):
    return build_fmu(arm, tmp_path_factory.mktemp("arm") / "Arm.fmu")


def at_rest(time: np.ndarray, angle: float = 0.0) -> JointPath:
    """The arm at rest."""
    return JointPath(time, (np.full((len(time), 1), angle),))


def test_a_file_that_is_no_robot_fmu_is_refused(tmp_path):
    broken = tmp_path / "broken.fmu"
    broken.write_text("no archive")
    with pytest.raises(SimulationError, match="not a readable FMU"):
        RobotFmu(broken)
    empty = tmp_path / "empty.fmu"
    with zipfile.ZipFile(empty, "w") as archive:
        archive.writestr("resources/nothing.txt", "")
    with pytest.raises(SimulationError, match="not an FMU that runs here"):
        RobotFmu(empty)


def test_no_module_of_the_working_folder_is_run(arm_fmu, tmp_path, monkeypatch):
    """A random.py beside a case is the user's: neither the FMU's process nor a compiler imports it."""
    for name in ("random", "numpy", "pickle"):
        (tmp_path / f"{name}.py").write_text("open('executed', 'w').close()")
    monkeypatch.chdir(tmp_path)
    time = np.linspace(0.0, 0.1, 3)
    with RobotFmu(arm_fmu) as robot:
        robot.simulate(at_rest(time), WrenchHistory(time, np.zeros((3, 6))), "quasistatic")
    if (compiler := zig()) is not None:
        subprocess.run([*compiler, "--version"], check=True, capture_output=True)
    assert not (tmp_path / "executed").exists()


def test_a_shared_path_is_that_of_one_process(arm_fmu, monkeypatch):
    """A quasi-static path in two halves, side by side, is the same to the last bit."""
    time = np.linspace(0.0, 1.0, 200)
    command = JointPath(time, (0.3 * np.sin(5.0 * time)[:, None],))
    wrench = WrenchHistory(time, np.outer(np.sin(9.0 * time), [0, 0, 300.0, 0, 0, 0]))
    with RobotFmu(arm_fmu) as robot:
        alone = robot.simulate(command, wrench, "quasistatic")
        monkeypatch.setitem(robot_fmu._WORTH_SHARING, "native", 10)
        monkeypatch.setattr("os.cpu_count", lambda: 2)
        shared = robot.simulate(command, wrench, "quasistatic")
        assert len(robot._processes.started) == 2
    assert np.array_equal(shared.pose, alone.pose)


def test_fmus_that_take_turns_in_a_process_answer_as_alone(arm, arm_fmu, tmp_path):
    """Each keeps its robot and its command, whichever was simulated between."""
    time = np.linspace(0.0, 0.1, 11)
    wrench = WrenchHistory(time, np.outer(np.sin(9.0 * time), [0, 0, 300.0, 0, 0, 0]))
    heavy = replace(arm, payload=Body(5.0, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    files, processes = (arm_fmu, build_fmu(heavy, tmp_path / "Heavy.fmu")), WorkerProcesses()

    def tool(robot):
        return robot.simulate(at_rest(time), wrench, "dynamic").pose

    alone = []
    for file in files:
        with RobotFmu(file) as robot:
            alone.append(tool(robot))
    assert not np.array_equal(*alone)
    with (
        RobotFmu(files[0], processes=processes) as first,
        RobotFmu(files[1], processes=processes) as second,
    ):
        for robot, pose in ((first, alone[0]), (second, alone[1]), (first, alone[0])):
            assert np.array_equal(tool(robot), pose)
        assert len(processes.started) == 1


def test_commands_that_take_turns_are_each_simulated(arm_fmu):
    """Of three commands, two of which are kept as files, each answer is that of its own."""
    time = np.linspace(0.0, 0.1, 11)
    commands = [at_rest(time, angle) for angle in (0.0, 0.5, 1.0)]
    with RobotFmu(arm_fmu, "linear") as robot:
        for k in (0, 1, 0, 2, 1, 0, 0, 2):
            tool = robot.simulate(commands[k], WrenchHistory.none(time), "dynamic")
            angle = commands[k].q[0][0, 0]
            np.testing.assert_allclose(tool.position[0][:, 0], np.cos(angle), atol=1e-9)


def test_a_process_that_dies_is_an_error_not_a_hang(arm_fmu):
    time = np.array([0.0, 1.0])
    with RobotFmu(arm_fmu) as robot:
        robot._processes.started[0]._process.kill()
        robot._processes.started[0]._process.wait()
        with pytest.raises(HostError, match="process that runs the FMU has ended"):
            robot.simulate(at_rest(time), WrenchHistory.none(time), "dynamic")


def test_an_answer_that_was_not_taken_is_not_that_of_the_next_simulation(arm_fmu, monkeypatch):
    """The second of two processes has died when it is given its half; the first one has its own."""
    monkeypatch.setitem(robot_fmu._WORTH_SHARING, "native", 100)
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    time = np.linspace(0.0, 1.0, 100)
    command = JointPath(time, (0.3 * time[:, None],))
    loaded = WrenchHistory(time, np.tile([0.0, 0.0, 300.0, 0.0, 0.0, 0.0], (100, 1)))
    with RobotFmu(arm_fmu) as robot:
        expected = robot.simulate(command, WrenchHistory.none(time), "quasistatic")
        robot._processes.started[1]._process.kill()
        robot._processes.started[1]._process.wait()
        with pytest.raises(HostError, match="process that runs the FMU has ended"):
            robot.simulate(command, loaded, "quasistatic")
        for n in (50, 100):  # by one process, and by two
            short = JointPath(time[:n], (command.q[0][:n],))
            answer = robot.simulate(short, WrenchHistory.none(short.time), "quasistatic")
            np.testing.assert_array_equal(answer.pose, expected.pose[:, :n])


@pytest.mark.parametrize("kind", KINDS)
def test_simulation_error_carries_the_fmus_sentence(arm, tmp_path, kind):
    time = np.array([0.0, 1.0])
    # The arm points at -x, the force at +x, pushing it in: it buckles under k / l = 1e5 N.
    command = at_rest(time, np.pi)
    load = np.array([[0, 0, 0, 0, 0, 0], [1e9, 0, 1e9, 0, 0, 0]], dtype=float)
    with RobotFmu(build_fmu(arm, tmp_path / "Arm.fmu", BuildOptions(kind)), "linear") as robot:
        with pytest.raises(SimulationError, match="too soft for this load"):
            robot.simulate(command, WrenchHistory(time, load), "quasistatic")
        with pytest.raises(SimulationError, match="expected 0 to 1 s, the trajectory's, got 2 s"):
            robot.simulate(command, WrenchHistory.none(2.0 * time), "quasistatic")


@pytest.mark.parametrize("kind", KINDS)
def test_an_fmu_simulates_robots_with_other_numbers_as_their_own_fmus_do(kind, tmp_path):
    """To the last bit, whatever the number is; between them it is again the robot that was built."""
    elements = StopElement(30.0, 1e-4), StopElement(20.0, 3e-4)
    sines = (KinematicError(1e-4, 3.0),)
    arm = one_joint(hysteresis=elements, kinematic_error=sines)
    heavier = replace(arm, payload=Body(5.0, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    values = {"joint[1].hysteresis": 80.0, "joint[1].gear.kinematic_error.phase": 1.0}
    others = [apply_values(arm, values), apply_values(arm, {"joint[1].stiffness": 2e5}), heavier]
    time = np.linspace(0.0, 0.06, 7)
    command = JointPath(time, (0.3 * np.sin(10.0 * time)[:, None],))
    load = WrenchHistory(time, np.outer(np.sin(40.0 * time), [0.0, 0.0, 300.0, 0.0, 0.0, 0.0]))

    def built(robot: Robot) -> RobotFmu:
        return RobotFmu(build_fmu(robot, tmp_path / "Arm.fmu", BuildOptions(kind)))

    with built(arm) as fmu:
        before = fmu.simulate(command, load, "dynamic").pose
        for other in others:
            found = fmu.simulate(command, load, "dynamic", other).pose
            with built(other) as reference:
                expected = reference.simulate(command, load, "dynamic").pose
            np.testing.assert_array_equal(found, expected)
            assert np.abs(found - before).max() > 1e-6
        np.testing.assert_array_equal(fmu.simulate(command, load, "dynamic").pose, before)


def test_every_simulation_has_the_mode_that_it_is_given(arm_fmu):
    """A dynamic simulation in between leaves no trace: the arm swings, and then it does not."""
    time = np.linspace(0.0, 0.1, 50)
    command = at_rest(time)
    load = WrenchHistory(time, np.outer(time > 0.02, [0.0, 0.0, 300.0, 0.0, 0.0, 0.0]))
    with RobotFmu(arm_fmu, "linear") as robot:
        still, swinging, again = (
            robot.simulate(command, load, mode).position[0]
            for mode in ("quasistatic", "dynamic", "quasistatic")
        )
    np.testing.assert_array_equal(again, still)
    assert np.ptp(still[time > 0.03, 2]) < 1e-12 < 1e-4 < np.ptp(swinging[time > 0.03, 2])


@pytest.mark.parametrize("mode", MODES)
def test_an_fmu_of_fmi_3_takes_the_path_of_one_of_fmi_2(example, tmp_path, mode):
    time = np.linspace(0.0, 0.5, 60)
    drives = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0]) + 0.1 * np.sin(time)[:, None]
    load = np.outer(np.sin(9.0 * time), [100.0, -50.0, 300.0, 5.0, 10.0, -5.0])
    poses = []
    for fmi in ("2", "3"):
        file = build_fmu(example, tmp_path / f"{fmi}.fmu", BuildOptions("native", fmi=fmi))
        with RobotFmu(file) as robot:
            path = robot.simulate(JointPath(time, (drives,)), WrenchHistory(time, load), mode)
        poses.append(path.pose[0])
    assert np.ptp(poses[0][:, 0]) > 1e-2
    np.testing.assert_array_equal(*poses)


def test_a_motor_under_hysteresis_and_kinematic_error_steps_over_a_rounding(tmp_path):
    """Communication points a rounding before samples where the jerk jumps leave steps of 1e-16 s."""
    drive = Drive(200.0, position_gain=20.0, rate_gain=3.8e4)
    arm = one_joint(
        drive=drive,
        hysteresis=(StopElement(4.0, 1e-5),),
        kinematic_error=(KinematicError(5e-5, 400.0),),
    )
    time, h = 0.004 * np.arange(501), 0.004
    jerk = 20.0 * np.sin(4.0 * np.pi * time) + np.random.default_rng(0).uniform(-20.0, 20.0, 501)
    acceleration = h * np.append(0.0, np.cumsum(jerk[:-1]))
    rate = np.append(0.0, np.cumsum(h * acceleration[:-1] + h**2 / 2 * jerk[:-1]))
    gained = h * rate[:-1] + h**2 / 2 * acceleration[:-1] + h**3 / 6 * jerk[:-1]
    angle = np.append(0.0, np.cumsum(gained))
    command = JointPath(time, *((own[:, None],) for own in (angle, rate, acceleration)))
    wrench = WrenchHistory.none(np.nextafter(time, 0.0))
    with RobotFmu(build_fmu(arm, tmp_path / "Arm.fmu"), drive="servo") as robot:
        off = robot.simulate(command, wrench, "dynamic").position[0, :, 0] - np.cos(angle)
    assert 1e-6 < np.abs(off).max() < 0.1

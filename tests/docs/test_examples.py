"""The examples run as they stand."""

import runpy
import tomllib

import numpy as np
import pytest
from places import EXAMPLES

from coupling.case.file import load_case
from coupling.path.histories import ToolPath


def test_press_on_a_wall_shares_the_load_like_springs_in_a_row():
    """depth = commanded / (1 + k C), C from the FMU-free model at the loaded posture, to 0.1 %."""
    from coupling.files.robot_file import load_robot, shipped_robots
    from elastic_robot.robot import ElasticRobot
    from elastic_robot.tool_load import Load
    from elastic_robot.trajectory import HeldCommand

    names = runpy.run_path(str(EXAMPLES / "press_on_a_wall.py"))
    depth, force, _ = names["press"]()
    robot = ElasticRobot(load_robot(shipped_robots()["icme2008"]), "linear", quasistatic=True)
    rest = HeldCommand(0.0, names["posture"], np.zeros(6), np.zeros(6))
    robot.reset(0.0, rest, Load(np.array([0.0, 0.0, force, 0.0, 0.0, 0.0])))
    compliance = robot.compliance()[2, 2]
    assert depth == pytest.approx(2e-3 / (1.0 + 1e6 * compliance), rel=1e-3)
    assert force == pytest.approx(1e6 * depth, rel=1e-4)


def test_hold_against_a_spring_finds_what_coupling_with_the_wall_finds():
    """At rest the coupled wall's depth, to its tolerance; the moving robot swings out around it."""
    coupled, _, _ = runpy.run_path(str(EXAMPLES / "press_on_a_wall.py"))["press"]()
    names = runpy.run_path(str(EXAMPLES / "hold_against_a_spring.py"))
    (way, depth), (_, moving) = names["press"]("quasistatic"), names["press"]("dynamic")
    assert depth[-1] == pytest.approx(coupled, abs=1e-9)
    assert way[-1] == pytest.approx(2e-3 - coupled, abs=1e-9)
    assert depth[0] == moving[0] == pytest.approx(0.0, abs=1e-12)
    assert np.mean(moving[50:]) == pytest.approx(coupled, abs=2e-6)


def test_robot_from_urdf_deviates_by_the_compliance_of_pinocchios_own_model():
    """J diag(1/k) J^T F with J of the URDF as Pinocchio reads it; gravity adds less than 0.5 %."""
    import pinocchio as pin

    from coupling.files.robot_file import load_robot
    from coupling.files.urdf import find_urdf
    from coupling.robot.inverse_kinematics import InverseKinematics

    names = runpy.run_path(str(EXAMPLES / "robot_from_urdf.py"))
    pushed = names["deviations"]()
    settings = tomllib.loads(names["ROBOT"].read_text())
    compliance = [1.0 / joint["stiffness"] for joint in settings["joint"]]
    model = pin.buildModelFromUrdf(str(find_urdf(settings["urdf"]["file"], names["ROBOT"].parent)))
    flange_from_tool = pin.SE3(np.eye(3), np.array(settings["tcp"]["position"]))
    flange = model.frames[model.getFrameId("tool0")]
    tool = model.addFrame(
        pin.Frame("tool", flange.parentJoint, flange.placement * flange_from_tool, flange.type)
    )
    data = model.createData()
    for k in (0, len(names["reach"]) - 1):
        target = np.array([names["reach"][k], 0.0, names["height"]])
        pose = np.append(target, names["DOWN"])
        line = ToolPath(np.array([0.0, 1.0]), np.array([pose, pose]))
        q = InverseKinematics(load_robot(names["ROBOT"]), names["HOME"]).plan(line).q[0][0]
        jacobian = pin.computeFrameJacobian(model, data, q, tool, pin.LOCAL_WORLD_ALIGNED)[:3]
        pin.updateFramePlacements(model, data)
        np.testing.assert_allclose(data.oMf[tool].translation, target, atol=1e-9)
        expected = jacobian * compliance @ jacobian.T * names["FORCE"]
        np.testing.assert_allclose(pushed[:, k], expected, atol=5e-3 * np.abs(expected).max())


def test_hammer_test_finds_the_compliance_of_the_linearised_robot():
    """A simulated blow sideways, Fourier transformed: 0.23 % at most from 3 to 120 Hz was seen."""
    names = runpy.run_path(str(EXAMPLES / "hammer_test.py"))
    linear, frequency = names["robot_at_rest"]().linearise(), names["frequency"]
    computed, tapped = linear.dynamic_compliance(frequency)[:, 1, 1], names["tap"](1)
    assert np.max(np.abs(tapped / computed - 1.0)) < 5e-3
    resonance = frequency[np.argmax(np.abs(tapped))]
    assert np.nanmin(np.abs(linear.modes.frequency - resonance)) < 0.01 * resonance


@pytest.fixture(scope="module")
def comparison():
    pytest.importorskip("mujoco", reason="needs the package mujoco, which is in the extra 'test'")
    return runpy.run_path(str(EXAMPLES / "compare_implementations.py"))


def test_both_implementations_stand_alike(comparison):
    """(a) and (b): ten postures, equal to rounding; the load is seen at all."""
    kinematics = comparison["kinematics"]()
    assert max(kinematics.distance.max(), kinematics.angle.max()) < 1e-13
    unloaded, loaded = (
        comparison["at_rest"](comparison["robot"], "backlash", comparison[load])
        for load in ("NO_LOAD", "LOAD")
    )
    for both in (unloaded, loaded):
        assert max(both.distance.max(), both.angle.max()) < 1e-13
    assert loaded.ours.distance_to(unloaded.ours).min() > 1e-4


@pytest.mark.parametrize("blend", [0.15, 0.25])
def test_the_path_of_both_implementations_is_at_times_that_fit_mujocos_steps(comparison, blend):
    """To its end: a path is told at times of its own, the last of them not a multiple of the samples."""
    times = comparison["desired"](blend).time
    for step in comparison["STEPS"].values():
        steps = np.diff(times) / step
        np.testing.assert_allclose(steps, round(steps[0]), rtol=1e-9)
    assert 20.0 < times[-1] < 30.0


@pytest.mark.parametrize(("curve", "limit"), [("linear", 1e-10), ("backlash", 1e-8)])
def test_both_implementations_start_alike_along_the_path(comparison, curve, limit):
    """(c): the first 0.6 s, in which the tool moves by centimetres and sways by millimetres."""
    both = comparison["iso_path"](curve, end=0.6).both()
    assert both.distance.max() < limit
    assert np.linalg.norm(np.ptp(both.ours.position[0], axis=0)) > 0.05


def test_a_decay_has_settled_after_ln_20_time_constants(comparison):
    """exp(-t) falls below 5 % at ln 20."""
    time = np.linspace(0.0, 40.0, 4001)
    pose = np.zeros((4001, 7))
    pose[:, 0], pose[:, 6] = np.exp(-time), 1.0
    settled = comparison["settling_time"](ToolPath(time, pose))
    assert settled == pytest.approx(np.log(20.0), abs=0.011)


def test_cone_shortened_to_three_contours_meets_its_goals(tmp_path):
    """The README's case down to 1.5 mm: above 300 N, two evaluations, the moving robot within 2 um."""
    from coupling.run.execute import run_compensation
    from coupling.run.figures import shares_of

    text = (EXAMPLES / "cases" / "cone.toml").read_text()
    short = text.replace("depth_m        = 0.01", "depth_m = 0.0015")
    assert short != text
    file = tmp_path / "cone.toml"
    file.write_text(short)
    run = run_compensation(load_case(file))
    found, shares = run.correction, shares_of(run)
    assert found.converged, found.reason
    assert found.response.wrench.peak_force > 300.0
    assert shares.process.maximum > 1e-4
    assert run.deviation(run.before).maximum > 1e-3
    assert run.deviation(found.achieved).maximum <= 2e-6
    assert shares.dynamic_after == run.deviation(found.achieved)
    assert found.consistency <= 1e-6
    assert found.evaluations == 2

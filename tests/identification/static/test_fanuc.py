"""A measured robot: 43 deflections of a FANUC R-2000iC, and what they say of its joints.

The numbers wanted are those of a fit by other means (a Denavit-Hartenberg model, normal equations),
within what gravity and geometry add.
"""

from dataclasses import replace

import numpy as np
import pytest
from places import EXAMPLES

from coupling.files.robot_file import load_robot, shipped_robots
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.fit import IdentifyOptions
from coupling.identification.static.identification import identify
from coupling.identification.static.measurements import noise_of, read_measurements, rms
from coupling.identification.static.prediction import rigid_prediction
from elastic_robot.description import Tilt

START = load_robot(EXAMPLES / "identify" / "fanuc_start.toml")
ROWS = read_measurements(EXAMPLES / "identify" / "fanuc_r2000ic.csv", 6)
OPTIONS = IdentifyOptions(noise_of(ROWS))


@pytest.fixture(scope="module")
def axial():
    return identify(START, ROWS, OPTIONS)


@pytest.fixture(scope="module")
def tilted():
    return identify(START, ROWS, replace(OPTIONS, add=("supported",)))


def test_axial_joints_predict_what_was_left_out_to_0_234_mm(axial):
    assert rms(ROWS.deflection) == pytest.approx(0.996e-3, abs=1e-6)
    assert rms(axial.result.displacements("left_out_error")) == pytest.approx(0.234e-3, abs=0.5e-6)
    assert axial.result.rms_m.fit == pytest.approx(0.215e-3, abs=0.5e-6)
    wanted = [861e3, 2720e3, 1960e3, 271e3, 425e3, 206e3]
    np.testing.assert_allclose(1.0 / axial.fit.x, wanted, rtol=4e-3)
    assert axial.result.worst[:3] == ("sample 17", "sample 11", "sample 24")


@pytest.mark.parametrize("kind", ["postures", "joints", "signs", "axes", "loads"])
def test_deflections_that_are_not_of_the_postures_told_are_refused(kind):
    """As measured they are predicted to a fifth; exchanged in any way to no better than a half."""
    q, wrench, deflection = ROWS.q, ROWS.wrench, ROWS.deflection
    changed = {
        "postures": {"q": q[np.random.default_rng(1).permutation(len(q))]},
        "joints": {"q": q[:, ::-1]},
        "signs": {"q": -q},
        "axes": {"deflection": deflection[:, [1, 0, 2]]},
        "loads": {"wrench": wrench[:, [1, 0, 2, 3, 4, 5]]},
    }[kind]
    refusal = identify(START, replace(ROWS, **changed), OPTIONS).result.refusal
    assert "no robot like the start file gives way so" in refusal
    assert "check q" in refusal


def test_the_lateral_tilt_of_joint_3_is_the_one_that_is_supported(axial, tilted):
    best = min(axial.result.further, key=lambda further: further.left_out_change)
    assert best.name == "joint[3].tilt about [0, 0, 1]"
    assert best.supported
    np.testing.assert_allclose(best.F, 79.8, rtol=0.02)
    assert best.probability < 1e-13
    assert best.left_out_change_without_worst == pytest.approx(-0.09, abs=0.01)
    assert [p.name for p in tilted.result.parameters if p.added] == ["joint[3].tilt[1].stiffness"]
    assert rms(tilted.result.displacements("left_out_error")) <= 0.185e-3
    by_name = {parameter.name: parameter for parameter in tilted.result.parameters}
    tilt = by_name["joint[3].tilt[1].stiffness"]
    assert tilt.identified
    assert 1.3e6 < tilt.value < 2.1e6
    wanted = [1371e3, 2761e3, 1857e3, 1601e3, 499e3, 430e3, 297e3]
    np.testing.assert_allclose(1.0 / tilted.fit.x, wanted, rtol=4e-3)


def test_joint_6_is_not_identifiable_and_keeps_its_start(axial, tilted):
    for found in (axial, tilted):
        assert [p.name for p in found.result.parameters if not p.identified] == [
            "joint[6].stiffness"
        ]
        assert found.robot.joints[5].stiffness == pytest.approx(
            START.joints[5].stiffness, rel=1e-12
        )


def test_all_six_tilts_are_warned_of_and_most_refused():
    x, y, z = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    tilts = [(x, y), (x, z), (x, z)]
    joints = [
        replace(joint, tilt=tuple(Tilt(axis, 2e7, 0.0) for axis in axes))
        for joint, axes in zip(START.joints, tilts, strict=False)
    ]
    robot = replace(START, joints=(*joints, *START.joints[3:]))
    found = identify(robot, ROWS, OPTIONS)
    assert found.fit.separability.condition == pytest.approx(115.0, abs=0.5)
    assert any("condition number 115" in warning for warning in found.result.warnings)
    written = [p.name for p in found.result.parameters if p.identified and "tilt" in p.name]
    assert written == ["joint[3].tilt[2].stiffness"]


def test_the_shipped_robot_is_what_was_identified(tilted):
    """To the four digits that its file has."""
    shipped = load_robot(shipped_robots()["fanuc_r2000ic"])
    right = ElasticParameters.of(tilted.robot, "backlash")
    assert ElasticParameters.of(shipped, "backlash").names == right.names
    np.testing.assert_allclose(
        ElasticParameters.of(shipped, "backlash").start, right.start, rtol=5e-4
    )
    for ours, theirs in zip(shipped.joints, START.joints, strict=True):
        assert (ours.origin, ours.axis, ours.body) == (theirs.origin, theirs.axis, theirs.body)


def test_the_start_file_is_the_published_chain():
    """Modified Denavit-Hartenberg parameters of the source, its signs, joint 3 from the horizontal."""
    alpha = np.array([0, -1, 0, -1, 1, -1]) * np.pi / 2
    a, d = [0, 0.312, 1.075, 0.225, 0, 0], [0.670, 0, 0, 1.280, 0, 0.215]
    compliance = 1.0 / np.array([joint.stiffness for joint in START.joints])
    expected = []
    for q, wrench in zip(ROWS.q, ROWS.wrench, strict=True):
        theta = [
            q[0],
            q[1] - np.pi / 2,
            -q[2],
            -q[3],
            -q[4],
            -q[5],
        ]  # q[2] is the controller's q2 + q3
        frame, axes = np.eye(4), []
        for turn, along, offset, angle in zip(alpha, a, d, theta, strict=True):
            ca, sa, ct, st = np.cos(turn), np.sin(turn), np.cos(angle), np.sin(angle)
            frame = frame @ [
                [ct, -st, 0, along],
                [st * ca, ct * ca, -sa, -sa * offset],
                [st * sa, ct * sa, ca, ca * offset],
                [0, 0, 0, 1],
            ]
            axes.append((frame[:3, 2], frame[:3, 3]))
        tool = (frame @ [0.0069, 0.2453, 0.3193, 1.0])[:3]
        lever = np.array([np.cross(axis, tool - origin) for axis, origin in axes])
        expected.append(lever.T @ (compliance * (lever @ wrench[:3])))
    elasticity = ElasticParameters.of(START, "backlash")
    ours = rigid_prediction(elasticity, ROWS, elasticity.start).deflection
    np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-12)

"""Learning along the path converges for the robots that are possible, by closed forms and simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from coupling.errors import LearnError
from coupling.files.robot_file import find_robot, load_robot
from coupling.identification.next.contraction import (
    EVERYWHERE,
    LEARNED,
    Responses,
    chosen,
    contraction,
)
from coupling.path.histories import WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.run.models import Models
from elastic_robot.parameters import Parameters

POSTURE = np.deg2rad([0.0, 10.0, 20.0, 0.0, 60.0, 0.0])


def possible_factors(deviations: list[float], robots: int, seed: int) -> np.ndarray:
    """Factors of robots that are possible, log-normal within two deviations, (robots, m)."""
    drawn = np.random.default_rng(seed).standard_normal((robots, len(deviations))).clip(-2.0, 2.0)
    return np.exp(drawn * np.asarray(deviations))


def responses(robot, stiffness: np.ndarray, damping: np.ndarray, **more) -> Responses:
    return Responses.of(robot, POSTURE[None], stiffness, damping, **more)


def test_a_robot_as_its_model_leaves_what_gain_and_filter_leave(example):
    """R is the unit matrix: |1 - g Q|."""
    count = len(Parameters.of(example).stiffness)
    own = responses(example, np.ones((1, count)), np.ones((1, count)))
    np.testing.assert_allclose(own.ratio, np.broadcast_to(np.eye(3), own.ratio.shape), atol=1e-9)
    frequency = own.frequency
    expected = np.abs(1.0 - 0.8 * 0.5 ** (0.5 * (frequency / 3.0) ** 2))
    found = own.remaining(0.8, 0.5 ** (0.5 * (frequency / 3.0) ** 2))
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_the_response_is_that_of_the_simulated_robot(example):
    """Joint 2 shaken by 0.2 mrad at 3 and 6 Hz, without backlash: the FMU's tool, by a fit of waves."""
    robot = replace(
        example,
        gravity=(0.0, 0.0, 0.0),
        joints=tuple(replace(own, damping=4.0 * own.damping) for own in example.joints),
    )
    time = np.linspace(0.0, 6.0, 3001)
    with Models("native") as models:
        fmu = models.of(robot, "linear").fmu
        for frequency in (3.0, 6.0):
            own = _response(robot, frequency)
            phase = 2.0 * np.pi * frequency * time
            q = np.tile(POSTURE, (len(time), 1))
            qd, qdd = np.zeros_like(q), np.zeros_like(q)
            rise = 1.0 - np.exp(-((time / 0.8) ** 4))
            q[:, 1] += 2e-4 * rise * np.sin(phase)
            rates = np.gradient(q[:, 1], time, edge_order=2)
            qd[:, 1], qdd[:, 1] = rates, np.gradient(rates, time, edge_order=2)
            path = fmu.simulate(
                JointPath(time, (q,), (qd,), (qdd,)), WrenchHistory.none(time), "dynamic"
            )
            late = time > 4.0
            waves = np.stack([np.sin(phase), np.cos(phase), np.ones_like(phase)], axis=1)[late]
            fitted = np.linalg.lstsq(waves, path.position[0][late], rcond=None)[0] / 2e-4
            answer = fitted[0] + 1j * fitted[1]
            np.testing.assert_allclose(answer, own[:3, 1], atol=0.02 * np.abs(own[:3, 1]).max())


def _response(robot, frequency: float) -> np.ndarray:
    """Return G of the tool by the drives, by the definition of R: of a robot by a rigid one's pose."""
    import pinocchio as pin

    from elastic_robot.chain import build_chain
    from elastic_robot.kinematics import tcp_jacobian

    chain, nominal = build_chain(robot), Parameters.of(robot)
    data, theta = chain.model.createData(), chain.theta(POSTURE)
    mass = pin.crba(chain.model, data, theta)
    mass = np.triu(mass) + np.triu(mass, 1).T
    jacobian = tcp_jacobian(chain, data, theta)
    omega = 2.0 * np.pi * frequency
    x, q = chain.elastic, chain.drive
    dynamic = (
        np.diag(nominal.stiffness + 1j * omega * nominal.damping) - omega**2 * mass[np.ix_(x, x)]
    )
    moved = np.linalg.solve(dynamic, omega**2 * mass[np.ix_(x, q)])
    alone = jacobian[:, q] + jacobian[:, x] @ moved
    # The same by the function that is tested: R times the model's own response.
    count = len(nominal.stiffness)
    other = Responses.of(
        robot, POSTURE[None], np.full((1, count), 0.8), np.ones((1, count)), np.array([frequency])
    )
    softer = (
        np.diag(0.8 * nominal.stiffness + 1j * omega * nominal.damping)
        - omega**2 * mass[np.ix_(x, x)]
    )
    expected = jacobian[:, q] + jacobian[:, x] @ np.linalg.solve(
        softer, omega**2 * mass[np.ix_(x, q)]
    )
    ratio = (expected @ np.linalg.inv(alone))[:3, :3]
    np.testing.assert_allclose(other.ratio[0, 0], ratio, atol=1e-8)
    return alone


@pytest.mark.parametrize("name", ["icme2008", "abb_irb7600", "fanuc_r2000ic", "kuka_kr210"])
def test_what_is_chosen_shrinks_for_robots_that_had_no_part_in_it(name):
    """Iterated twenty times for forty other robots, at every frequency and in every direction."""
    robot = load_robot(find_robot(name))
    count = len(Parameters.of(robot).stiffness)
    seen = responses(
        robot, *(possible_factors([s] * count, 40, k) for k, s in enumerate((0.1, 0.3)))
    )
    own = chosen(seen)
    assert own.holds
    assert own.cutoff < seen.lowest_mode
    others = responses(
        robot, *(possible_factors([s] * count, 40, 9 + k) for k, s in enumerate((0.1, 0.3)))
    )
    kept = 0.5 ** (0.5 * (others.frequency / own.cutoff) ** 2)
    left = others.remaining(own.gain, kept)
    assert left.max() < EVERYWHERE + 0.01
    assert left[others.frequency <= own.cutoff].max() < LEARNED
    one = np.eye(3) - (own.gain * kept)[:, None, None] * others.ratio
    after = np.linalg.norm(np.linalg.matrix_power(one, 20), ord=2, axis=(2, 3))
    assert after.max() < 1.3


def test_a_cutoff_among_the_modes_is_refused_with_what_it_would_do(example):
    count = len(Parameters.of(example).stiffness)
    seen = responses(example, *(possible_factors([s] * count, 20, 1) for s in (0.1, 0.3)))
    best = chosen(seen)
    assert contraction(seen, 1.0, 9.0).everywhere > 2.0
    with pytest.raises(LearnError, match=rf"at most {best.cutoff:g} Hz .* got 9 Hz, .*% at "):
        chosen(seen, cutoff=9.0)
    assert chosen(seen, cutoff=0.5).cutoff == 0.5


def test_a_rigid_robot_learns_at_once(example):
    rigid = tuple(
        replace(j, stiffness=None, damping=0.0, backlash=0.0, tilt=()) for j in example.joints
    )
    own = chosen(responses(replace(example, joints=rigid), np.ones((1, 0)), np.ones((1, 0))))
    assert own.cutoff == 5.0
    assert own.lowest_mode == np.inf

"""Learning along the path converges below a third of the lowest mode, for robots that are possible."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from coupling.files.robot_file import find_robot, load_robot
from coupling.identification.next.command_model import lowest_mode
from coupling.identification.next.learning_filter import low_passed, passed
from coupling.inverse.link_model import LinkModel
from coupling.path.histories import WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.run.fmu_pool import FmuPool
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

POSTURE = np.deg2rad([0.0, 10.0, 20.0, 0.0, 60.0, 0.0])
# Closer than the width of a mode of damping ratio 0.01 [Hz].
FREQUENCIES = np.concatenate([np.linspace(0.05, 5.0, 100), np.geomspace(5.05, 60.0, 250)])


@dataclass(frozen=True)
class Responses:
    """What possible robots make of a correction, by what the model makes of it.

    Attributes:
        frequency: Frequencies [Hz], (f,).
        ratio: R for positions of every pair of posture and robot at every frequency [m/m], complex,
            (pairs, f, 3, 3).
    """

    frequency: np.ndarray
    ratio: np.ndarray

    @classmethod
    def of(
        cls,
        robot: Robot,
        postures: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        frequency: np.ndarray = FREQUENCIES,
    ) -> Responses:
        """Return the responses of robots that differ from a model in stiffness and damping.

        The gears are on their flanks: M x'' + d x' + k x = -M_xq q'', tool = J_x x + J_q q.

        Args:
            robot: The model.
            postures: Joint angles [rad], (p, joints).
            stiffness, damping: Factors of the elastic coordinates of each robot [1], (r, m).
            frequency: Frequencies [Hz], (f,).
        """
        model, nominal = LinkModel(robot), Parameters.of(robot)
        chain = model.chain
        theta = np.array([chain.theta(angles) for angles in postures])
        at_rest = np.zeros_like(theta)
        linear = model.desk.linearised(theta, at_rest, at_rest, np.zeros((len(theta), 6)))
        ratios = []
        for mass, jacobian in zip(
            linear.by_motion[:, 2, chain.elastic], linear.jacobian, strict=True
        ):
            system = Posture(
                mass[:, chain.elastic],
                mass[:, chain.drive],
                jacobian[:, chain.elastic],
                jacobian[:, chain.drive],
            )
            nominally = system.response(nominal.stiffness, nominal.damping, frequency)
            inverse = np.linalg.pinv(nominally)[..., :3]
            for k, d in zip(stiffness, damping, strict=True):
                true = system.response(k * nominal.stiffness, d * nominal.damping, frequency)
                ratios.append(true[:, :3] @ inverse)
        return cls(frequency, np.array(ratios))

    def remaining(self, cutoff: float) -> np.ndarray:
        """Return what is left of a deviation at worst, |I - Q R| over all robots [1], (f,)."""
        remaining = np.eye(3) - passed(self.frequency, cutoff)[:, None, None] * self.ratio
        worst: np.ndarray = np.linalg.norm(remaining, ord=2, axis=(2, 3)).max(axis=0)
        return worst


@dataclass(frozen=True)
class Posture:
    """Mass matrix of the elastic coordinates, theirs with the drives, and their Jacobians."""

    mass: np.ndarray
    driven: np.ndarray
    elastic: np.ndarray
    drives: np.ndarray

    def response(
        self, stiffness: np.ndarray, damping: np.ndarray, frequency: np.ndarray
    ) -> np.ndarray:
        """Return the tool's pose by the drives' angles, complex, (f, 6, joints)."""
        omega = 2.0 * np.pi * frequency[:, None, None]
        stiff = np.diag(stiffness) + 1j * omega * np.diag(damping) - omega**2 * self.mass
        pushed = np.linalg.solve(stiff, omega**2 * self.driven)
        return self.drives + self.elastic @ pushed


def possible_factors(deviation: float, count: int, robots: int, seed: int) -> np.ndarray:
    """Factors of robots that are possible, log-normal within two deviations, (robots, count)."""
    samples = np.random.default_rng(seed).standard_normal((robots, count)).clip(-2.0, 2.0)
    return np.exp(samples * deviation)


def test_the_filter_leaves_what_its_formula_says():
    """A wave in the middle of a long record; 1 / sqrt(2) of it passes at the cutoff."""
    step, cutoff = 0.01, 1.5
    time = step * np.arange(6001)
    for frequency in (0.3, 1.0, 1.5, 3.0):
        wave = np.cos(2.0 * np.pi * frequency * (time - time[3000]))
        share = low_passed(step, wave[:, None], cutoff)[3000, 0]
        assert share == pytest.approx(passed(np.array([frequency]), cutoff)[0], abs=2e-3)
    assert passed(np.array([cutoff]), cutoff)[0] == pytest.approx(np.sqrt(0.5), abs=1e-12)


def test_the_response_is_that_of_the_simulated_robot(example):
    """Joint 2 shaken by 0.2 mrad at 3 and 6 Hz, without backlash: the FMU's tool, by a fit of waves."""
    robot = replace(
        example,
        gravity=(0.0, 0.0, 0.0),
        joints=tuple(replace(own, damping=4.0 * own.damping) for own in example.joints),
    )
    time = np.linspace(0.0, 6.0, 3001)
    with FmuPool("native") as models:
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


@pytest.mark.parametrize(("damping", "highest"), [(1.0, 1.012), (0.1, 1.1)])
@pytest.mark.parametrize("name", ["icme2008", "abb_irb7600", "fanuc_r2000ic", "kuka_kr210"])
def test_below_a_third_of_the_lowest_mode_every_possible_robot_shrinks(name, damping, highest):
    """Forty robots, stiffness off by up to 20 %, at all frequencies and in every direction."""
    robot = load_robot(find_robot(name))
    count = len(Parameters.of(robot).stiffness)
    robots = Responses.of(
        robot,
        POSTURE[None],
        possible_factors(0.1, count, 40, 1),
        damping * possible_factors(0.3, count, 40, 2),
    )
    cutoff = lowest_mode(robot, POSTURE[None]) / 3.0
    assert robots.remaining(cutoff).max() < highest
    assert robots.remaining(cutoff)[robots.frequency <= cutoff].max() < 0.4
    assert robots.remaining(1.6 * cutoff).max() > 1.05


def test_a_rigid_robot_has_no_mode(example):
    rigid = tuple(
        replace(j, stiffness=None, damping=0.0, backlash=0.0, tilt=()) for j in example.joints
    )
    assert lowest_mode(replace(example, joints=rigid), POSTURE[None]) == np.inf

"""Forward sensitivities of a path against central differences of the nonlinear simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_robots import make_robot

from elastic_robot.errors import ParameterError
from elastic_robot.parameter_names import parameter_names
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import ContactSpring, Load
from elastic_robot.trajectory import Trajectory

# Tolerance of the simulations that are subtracted from each other [m].
TOLERANCE = 1e-10


def drives(n: int) -> Trajectory:
    time = np.linspace(0.0, 0.4, 9)
    phase = 0.7 * np.arange(n)
    return Trajectory(time, 0.3 + 0.4 * np.sin(5.0 * time[:, None] + phase))


def path(robot: ElasticRobot, n: int, times: np.ndarray, loads: list[Load]) -> np.ndarray:
    robot.reset(0.0, drives(n), loads[0])
    positions = [robot.tcp()[:3]]
    for time, load in zip(times[1:], loads[1:], strict=True):
        robot.step(time, drives(n), load)
        positions.append(robot.tcp()[:3])
    return np.array(positions)


def changed(robot: ElasticRobot, name: str, by: float) -> None:
    """Add to one parameter, through the same arrays as the FMU's setter."""
    names, m = parameter_names(robot.chain), robot.chain.elastic_count
    k, old = names.index(name), robot.parameters
    torsions = robot.chain.torsions
    fields = ["gravity"] * 3 + ["stiffness"] * m + ["damping"] * m + ["backlash"] * len(torsions)
    rows = [*range(3), *range(m), *range(m), *torsions]
    values = getattr(old, fields[k]).copy()
    values[rows[k]] += by
    robot.parameters = replace(old, **{fields[k]: values})


@pytest.mark.parametrize("curve", ["linear", "backlash", "spline"])
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("stiffness", [0.0, 1e6])
def test_sensitivities_are_the_slopes_of_the_nonlinear_simulation(curve, seed, stiffness):
    """One parameter of each kind, with a step of the force that drives gears through their play.

    The spring at the TCP has an anchor that moves from step to step.
    """
    description = make_robot(seed, 3)
    n = len(description.joints)
    times = np.linspace(0.0, 0.1, 5)
    wrench = np.zeros((5, 6))
    wrench[2:] = [150.0, -100.0, 400.0, 5.0, -10.0, 8.0]
    bare = ElasticRobot(description, curve)
    bare.reset(0.0, drives(n), Load())
    along, velocity = bare.tcp()[:3] + 1e-4, np.array([0.02, 0.0, -0.01])
    springs = [
        ContactSpring(along + time * velocity, velocity, stiffness * np.eye(3)) for time in times
    ]
    loads = [Load(row, spring) for row, spring in zip(wrench, springs, strict=True)]

    def robot() -> ElasticRobot:
        return ElasticRobot(description, curve, tolerance=TOLERANCE)

    follower = robot()
    follower.reset(0.0, drives(n), loads[0])
    sensitivity = follower.path_sensitivity(times, drives(n), loads)
    names = sensitivity.tcp.names
    kinds = [name.rsplit(".", 1)[-1] for name in names]
    for kind in ("z", "stiffness", "damping", "backlash"):
        index = seed % 2 + kinds.index(kind) if kind != "z" else 2
        name = names[index]
        size = 9.81 if name.startswith("gravity") else _size(follower, index)
        if size == 0.0:
            continue
        step = 1e-4 * size
        plus, minus = robot(), robot()
        changed(plus, name, step)
        changed(minus, name, -step)
        difference = path(plus, n, times, loads) - path(minus, n, times, loads)
        exact = sensitivity.tcp[name][:, :3] * 2.0 * step
        # Differences are of the order of 1e-8 m; the step's own error is 1e-8 of the effect.
        np.testing.assert_allclose(
            exact, difference, atol=1e-5 * np.abs(difference).max() + 20.0 * TOLERANCE, err_msg=name
        )


def _size(robot: ElasticRobot, index: int) -> float:
    p = robot.parameters
    flat = np.concatenate([p.gravity, p.stiffness, p.damping, p.backlash[robot.chain.torsions]])
    return float(flat[index])


def test_the_start_and_the_mode_are_checked():
    description = make_robot(3, 4)
    n = len(description.joints)
    robot = ElasticRobot(description)
    robot.reset(0.0, drives(n), Load())
    with pytest.raises(ParameterError, match="present time, 0 s, got"):
        robot.path_sensitivity(np.array([0.1, 0.2]), drives(n), 2 * [Load()])
    still = ElasticRobot(description, quasistatic=True)
    still.reset(0.0, drives(n), Load())
    with pytest.raises(ParameterError, match="dynamic mode"):
        still.path_sensitivity(np.array([0.0, 0.2]), drives(n), 2 * [Load()])

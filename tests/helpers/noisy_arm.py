"""A small elastic arm with exact measurements, to which tests add what they need."""

from dataclasses import replace

import numpy as np

from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.measurements import Measurements
from coupling.identification.static.model import StaticModel
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot, Tilt

_LINK = Body(mass=40.0, com=(0.0, 0.0, 0.3), inertia=(2.0, 2.0, 0.5))
_TILT = Tilt((1.0, 0.0, 0.0), 8e5, 0.0)


def arm(tilt: bool = False, last: float | None = 3e5) -> Robot:
    """Shoulder about z and y, elbow about y; the elbow may tilt about x, the last joint may be rigid."""
    return Robot(
        "arm",
        (
            Joint((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), _LINK, stiffness=1e6),
            Joint((0.1, 0.0, 0.5), (0.0, 1.0, 0.0), _LINK, stiffness=2e6),
            Joint(
                (0.0, 0.0, 0.8),
                (0.0, 1.0, 0.0),
                _LINK,
                stiffness=last,
                tilt=(_TILT,) if tilt else (),
            ),
        ),
        tcp_position=(0.3, 0.1, 0.7),
    )


def exact(robot: Robot, count: int, seed: int, force: float = 600.0) -> Measurements:
    """Deflections that the robot's model itself predicts, random poses and forces at the TCP."""
    rng = np.random.default_rng(seed)
    wrench = np.zeros((count, 6))
    wrench[:, :3] = rng.normal(size=(count, 3))
    wrench *= force / np.linalg.norm(wrench, axis=1, keepdims=True)
    q = rng.uniform(-1.5, 1.5, (count, len(robot.joints)))
    rows = Measurements.of(q, wrench, np.zeros((count, 3)))
    elasticity = ElasticParameters.of(robot, "backlash")
    model = StaticModel(elasticity, rows, "backlash")
    return replace(rows, deflection=model.predict(elasticity.start).deflection)


def noisy(rows: Measurements, rng: np.random.Generator, position: float, force: float = 0.0):
    """The rows with noise on every deflection [m] and every force that was read [N]."""
    wrench = rows.wrench.copy()
    wrench[:, :3] += force * rng.normal(size=(rows.count, 3))
    shifted = rows.deflection + position * rng.normal(size=rows.deflection.shape)
    return replace(rows, deflection=shifted, wrench=wrench)

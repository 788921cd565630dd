"""Rest of the elastic robot under gravity and a wrench, found by MuJoCo's forces alone."""

from __future__ import annotations

import mujoco
import numpy as np

from examples.mujoco_robot.elastic_model import ElasticModel

# At rest no angle moves by more in an iteration [rad].
_AT_REST = 1e-15
# A gear that carries 1 N m needs about 2000 iterations to leave its backlash.
_MAX_ITERATIONS = 200_000


def settle(elastic_model: ElasticModel, q: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Return the elastic coordinates at rest [rad], (m,): let go undeflected, without inertia.

    Every angle moves by its unbalanced torque over its full stiffness until none moves any more.
    MuJoCo's data are left in the state of rest.

    Args:
        elastic_model: The robot.
        q: Drive angles [rad], (joints,).
        wrench: At the TCP, base axes, (6,).

    Raises:
        RuntimeError: If the robot does not come to rest.
    """
    model, data, elastic = elastic_model.model, elastic_model.data, elastic_model.elastic
    mujoco.mj_resetData(model, data)
    start = elastic_model.undeflected(q)
    data.qpos[:] = start
    elastic_model.hold(q)
    data.ctrl[model.nu - len(elastic_model.wrench_axes) :] = wrench[elastic_model.wrench_axes]
    stiffness = model.jnt_stiffness[elastic]
    with elastic_model.running():
        for _ in range(_MAX_ITERATIONS):
            mujoco.mj_forward(model, data)
            torque = data.qfrc_passive + data.qfrc_actuator - data.qfrc_bias
            move = torque[elastic] / stiffness
            data.qpos[elastic] += move
            if np.abs(move).max(initial=0.0) < _AT_REST:
                return np.asarray(data.qpos - start)[elastic]
    raise RuntimeError(f"the robot at q = {q.tolist()} rad does not come to rest")

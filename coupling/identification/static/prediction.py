"""What a robot's parameters predict for each measurement in the rigid robot's posture.

It is exact for a linear robot without gravity: an elastic coordinate j winds up by
c_j (t1_j - t0_j) + B_j (s1_j - s0_j), with the torque t = J_load^T w - g without (0) and with (1) the
load and the flank s = -1, 0, 1 it pushes a gear to; the measured point moves by J_point,j times that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from coupling.identification.static.elastic import Candidate, ElasticParameters
from coupling.identification.static.measurements import Measurements
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.kinematics import base_from_tool, tcp_jacobian
from elastic_robot.settings import SETTINGS
from elastic_robot.tool_load import ToolLoad

# A gear's load turns back where its way, over all loads of a loop, is longer than its range by this
# part of that; and counts where its range is this part of the largest one.
_TURNED, _LOADED = 0.2, 1e-3


@dataclass(frozen=True)
class Prediction:
    """Predicted deflections of k measurements.

    Attributes:
        deflection: Position [m], and rotation [rad] where measured, (k, r).
        by_parameter: Derivative by each parameter p [m, rad per unit of p], (k, r, P).
        by_wrench: Derivative by the load [m/N, rad/(N m), ..], (k, r, 6).
    """

    deflection: np.ndarray
    by_parameter: np.ndarray
    by_wrench: np.ndarray


@dataclass(frozen=True)
class RigidPostures:
    """The undeflected robot in the postures of k measurements, base axes.

    Attributes:
        turn: Rotations of the tool, (k, 3, 3).
        point: Positions of the measured points [m], (k, 3).
        at_load, at_point: Jacobians of the load's and of the measured point by the elastic coordinates
            [m/rad, 1], (k, 6, m).
        weight: Torques of the elastic coordinates without a load [N m], (k, m).
    """

    turn: np.ndarray
    point: np.ndarray
    at_load: np.ndarray
    at_point: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, robot: Robot, measured: Measurements) -> RigidPostures:
        """Return a robot's postures."""
        chain, rows = build_chain(robot), []
        dynamics = Dynamics(chain, np.array(robot.gravity))
        for q, load, point in zip(
            measured.q, measured.load_point, measured.measured_point, strict=True
        ):
            theta = chain.theta(q)
            jacobian = tcp_jacobian(chain, dynamics.data, theta)[:, chain.elastic]
            tool = base_from_tool(chain, dynamics.data, theta)
            ends = [jacobian_at(jacobian, tool.rotation @ place) for place in (load, point)]
            weight = dynamics.static_torque(theta, ToolLoad())
            rows.append((tool.rotation.copy(), tool.act(point), *ends, weight))
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))

    def torque_by_load(self, measured: Measurements) -> np.ndarray:
        """Return the torques of the elastic coordinates by the loads alone [N m], (k, m)."""
        return np.einsum("kw,kwm->km", measured.wrench, self.at_load)


def reversed_ranges(robot: Robot, measured: Measurements) -> np.ndarray:
    """Return the range of each elastic coordinate's torque [N m], 0 where no loop turns it back, (m,).

    In the posture of the rigid robot.
    """
    by_load, ranges, largest = RigidPostures.of(robot, measured).torque_by_load(measured), [], 0.0
    for rows in measured.sequences:
        torque = np.vstack([np.zeros_like(by_load[0]), by_load[rows]])
        whole, way = np.ptp(torque, axis=0), np.abs(np.diff(torque, axis=0)).sum(axis=0)
        largest = max(largest, float(whole.max(initial=0.0)))
        ranges.append(np.where(way - whole > _TURNED * whole, whole, 0.0))
    widest: np.ndarray = np.max(ranges, axis=0)
    return np.where(widest > _LOADED * largest, widest, 0.0)


def rigid_prediction(
    elasticity: ElasticParameters, measured: Measurements, values: np.ndarray
) -> Prediction:
    """Return the prediction in the rigid robot's posture, linear in the parameters.

    Args:
        values: Values of p, in its units, (P,).
    """
    postures, elastic = RigidPostures.of(elasticity.robot, measured), elasticity.elastic
    is_backlash, torque = elasticity.chosen("backlash"), postures.torque_by_load(measured)
    flank = _flank(postures.weight + torque) - _flank(postures.weight)
    change = np.where(is_backlash, flank[:, elastic], torque[:, elastic])
    at_point = postures.at_point[:, : measured.rows, elastic]
    by_parameter = at_point * change[:, None]
    by_load = postures.at_load[:, :, elastic[~is_backlash]].swapaxes(1, 2)
    by_wrench = (at_point[:, :, ~is_backlash] * values[~is_backlash]) @ by_load
    return Prediction(by_parameter @ values, by_parameter, by_wrench)


def candidate_column(
    robot: Robot, torque_curve: str, candidate: Candidate, measured: Measurements
) -> np.ndarray:
    """Return the change of the rigid prediction by a candidate [m, rad per unit of it], (k, r)."""
    with_it, name = candidate.added_to(robot, 1e-6)
    wider = ElasticParameters.of(with_it, torque_curve)
    prediction = rigid_prediction(wider, measured, wider.start)
    return prediction.by_parameter[:, :, wider.names.index(name)]


def point_columns(
    elasticity: ElasticParameters, measured: Measurements, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives of rigid predictions by shifts of measured point and load point.

    They are in [m/m, rad/m], (k, r, 3) each.  The tool turns by r: the measured point moves by r x d
    more for a shift d, and the load turns the joints by J_w^T (d x f) more.

    Args:
        values: Values of p, in its units, (P,).
    """
    postures, compliant = (
        RigidPostures.of(elasticity.robot, measured),
        ~elasticity.chosen("backlash"),
    )
    rows, elastic = measured.rows, elasticity.elastic[compliant]
    turning = rigid_prediction(
        elasticity, replace(measured, deflection=np.zeros((measured.count, 6))), values
    )
    of_point, of_load = np.zeros((2, measured.count, rows, 3))
    for k, turn in enumerate(postures.turn):
        compliance = postures.at_point[k][:rows, elastic] * values[compliant]
        of_point[k, :3] = np.cross(turning.deflection[k, 3:], turn.T).T
        by_moment = compliance @ postures.at_load[k][3:, elastic].T
        of_load[k] = by_moment @ np.cross(turn.T, measured.wrench[k, :3]).T
    return of_point, of_load


def jacobian_at(jacobian: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Return the Jacobian [m, rad], (6, ..), of a point on the tool `arm` [m] away, (3,), base axes."""
    return np.vstack([jacobian[:3] - pin.skew(arm) @ jacobian[3:], jacobian[3:]])


def _flank(torque: np.ndarray) -> np.ndarray:
    return np.where(np.abs(torque) < SETTINGS.neutral_torque, 0.0, np.sign(torque))

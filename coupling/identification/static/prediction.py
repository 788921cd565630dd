"""What a robot's parameters predict for each measurement, and how that follows them.

Rigid posture, exact for a linear robot without gravity: an elastic coordinate j winds up by
c_j (t1_j - t0_j) + B_j (s1_j - s0_j), with the torque t = J_load^T w - g without (0) and with (1) the
load and the flank s = -1, 0, 1 it pushes a gear to; the measured point moves by J_point,j times that.

Model: both states are equilibria of the robot itself, gravity, geometry and backlash included.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from coupling.errors import IdentifyError
from coupling.identification.static.elastic import Candidate, ElasticParameters
from coupling.identification.static.measurements import Measurements
from coupling.path.frame import Frame
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import ElasticRobotError
from elastic_robot.kinematics import base_from_tool, tcp_jacobian
from elastic_robot.parameters import Parameters
from elastic_robot.robot import ElasticRobot
from elastic_robot.settings import SETTINGS
from elastic_robot.tool_load import Load, ToolLoad
from elastic_robot.trajectory import HeldCommand


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

    def at_rows(self, rows: np.ndarray) -> Prediction:
        """Return that of some measurements by their indices, (n,)."""
        return Prediction(self.deflection[rows], self.by_parameter[rows], self.by_wrench[rows])


def rigid_prediction(
    elasticity: ElasticParameters, measured: Measurements, values: np.ndarray
) -> Prediction:
    """Return the prediction in the rigid robot's posture, linear in the parameters.

    Args:
        values: Values of p, in its units, (P,).
    """
    chain = build_chain(elasticity.robot)
    dynamics = Dynamics(chain, np.array(elasticity.robot.gravity))
    rows, count = measured.rows, len(elasticity.names)
    by_parameter = np.empty((measured.count, rows, count))
    by_wrench = np.empty((measured.count, rows, 6))
    compliant = ~elasticity.is_backlash
    compliance = values[compliant]
    for k in range(measured.count):
        theta = chain.theta(measured.q[k])
        jacobian = tcp_jacobian(chain, dynamics.data, theta)[:, chain.elastic]
        turn = base_from_tool(chain, dynamics.data, theta).rotation
        at_load = jacobian_at(jacobian, turn @ measured.load_point[k])
        at_point = jacobian_at(jacobian, turn @ measured.measured_point[k])[:rows]
        unloaded = dynamics.static_torque(theta, ToolLoad())
        torque = measured.wrench[k] @ at_load
        flank = _flank(unloaded + torque) - _flank(unloaded)
        change = np.where(
            elasticity.is_backlash, flank[elasticity.elastic], torque[elasticity.elastic]
        )
        by_parameter[k] = at_point[:, elasticity.elastic] * change
        by_wrench[k] = (at_point[:, elasticity.elastic[compliant]] * compliance) @ at_load[
            :, elasticity.elastic[compliant]
        ].T
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
    chain = build_chain(elasticity.robot)
    data, rows = chain.model.createData(), measured.rows
    compliant_rows = elasticity.elastic[~elasticity.is_backlash]
    turning = rigid_prediction(
        elasticity, replace(measured, deflection=np.zeros((measured.count, 6))), values
    )
    of_point, of_load = np.zeros((2, measured.count, rows, 3))
    for k in range(measured.count):
        theta = chain.theta(measured.q[k])
        jacobian = tcp_jacobian(chain, data, theta)[:, chain.elastic]
        turn = base_from_tool(chain, data, theta).rotation
        at_point = jacobian_at(jacobian, turn @ measured.measured_point[k])[:rows, compliant_rows]
        compliance = at_point * values[~elasticity.is_backlash]
        of_point[k, :3] = np.cross(turning.deflection[k, 3:], turn.T).T
        of_load[k] = (
            compliance @ jacobian[3:, compliant_rows].T @ np.cross(turn.T, measured.wrench[k, :3]).T
        )
    return of_point, of_load


def positions(robot: Robot, measured: Measurements) -> np.ndarray:
    """Return where the measured points of the undeflected robot are [m], base axes, (k, 3)."""
    chain = build_chain(robot)
    data = chain.model.createData()
    places = []
    for q, point in zip(measured.q, measured.measured_point, strict=True):
        tool = base_from_tool(chain, data, chain.theta(q))
        places.append(tool.act(point))
    return np.array(places)


def jacobian_at(jacobian: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Return the Jacobian [m, rad], (6, ..), of a point on the tool `arm` [m] away, (3,), base axes."""
    return np.vstack([jacobian[:3] - pin.skew(arm) @ jacobian[3:], jacobian[3:]])


def displacement(before: pin.SE3, after: pin.SE3) -> np.ndarray:
    """Return the deflection from one placement to another, base axes [m, rad], (6,)."""
    turn = pin.log3(after.rotation @ before.rotation.T)
    return np.append(after.translation - before.translation, turn)


def between(
    before: pin.SE3,
    by_before: np.ndarray,
    after: pin.SE3,
    by_after: np.ndarray,
    by_wrench: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the deflection from one state to another [m, rad], (6,), and its derivatives.

    Args:
        before, after: Placements of the measured point, base axes.
        by_before, by_after: Their derivatives by p [m, rad per unit of p], (6, P).
        by_wrench: Derivative of the second one by its load [m/N, rad/(N m), ..], (6, 6).
    """
    turn = after.rotation @ before.rotation.T
    # d log(E) = J_l^-1 (w1 - E w0), E = R1 R0^T; J_l^-1 is Pinocchio's Jlog3 of the inverse turn.
    by_turn = pin.Jlog3(turn.T)
    changed, by_load = by_after - by_before, by_wrench.copy()
    changed[3:] = by_turn @ (by_after[3:] - turn @ by_before[3:])
    by_load[3:] = by_turn @ by_wrench[3:]
    return displacement(before, after), changed, by_load


def _flank(torque: np.ndarray) -> np.ndarray:
    return np.where(np.abs(torque) < SETTINGS.neutral_torque, 0.0, np.sign(torque))


class StaticModel:
    """The robot's own equilibria under the loads of measurements.

    Args:
        torque_curve: A name of `TORQUE_CURVES`.
    """

    def __init__(
        self, elasticity: ElasticParameters, measured: Measurements, torque_curve: str
    ) -> None:
        self._elasticity, self._measured = elasticity, measured
        # The load keeps its direction while its point moves along: one robot for each such point.
        self._robots: dict[tuple[float, ...], ElasticRobot] = {}
        for point in measured.load_point:
            place = tuple(point.tolist())
            if place not in self._robots:
                at_load = with_tcp_at(elasticity.robot, point)
                self._robots[place] = ElasticRobot(at_load, torque_curve, quasistatic=True)

    def predict(self, values: np.ndarray) -> Prediction:
        """Return the prediction at values of p, in its units, (P,).

        Raises:
            IdentifyError: If the robot finds no rest, with the row.
        """
        parameters = Parameters.of(self._elasticity.described(values))
        for robot in self._robots.values():
            robot.parameters = parameters
        rows = [self._row(k) for k in range(self._measured.count)]
        deflection, by_parameter, by_wrench = (np.array(part) for part in zip(*rows, strict=True))
        return Prediction(deflection, by_parameter, by_wrench)

    def _row(self, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        measured, rows = self._measured, self._measured.rows
        robot = self._robots[tuple(measured.load_point[k].tolist())]
        arm = measured.measured_point[k] - measured.load_point[k]
        zero = np.zeros_like(measured.q[k])
        drives = HeldCommand(0.0, measured.q[k], zero, zero)
        ends = []
        for load in (Load(), Load(measured.wrench[k])):
            try:
                robot.reset(0.0, drives, load)
            except ElasticRobotError as cause:
                raise IdentifyError(f"{measured.names[k]}: {cause}") from cause
            ends.append(self._state(robot, arm))
        (before, by_before, _), (after, by_after, by_wrench) = ends
        moves = between(before, by_before, after, by_after, by_wrench)
        return moves[0][:rows], moves[1][:rows], moves[2][:rows]

    def _state(
        self, robot: ElasticRobot, arm: np.ndarray
    ) -> tuple[pin.SE3, np.ndarray, np.ndarray]:
        """Return the measured point's placement and its derivatives by p and by the wrench."""
        placement = pin.XYZQUATToSE3(robot.tcp())
        offset = placement.rotation @ arm
        of_tcp = robot.static_sensitivities().tcp
        by_wrench = jacobian_at(of_tcp.wrench, offset)
        elasticity, stiffness = self._elasticity, robot.parameters.stiffness
        columns = []
        for name, elastic, backlash in zip(
            elasticity.names, elasticity.elastic, elasticity.is_backlash, strict=True
        ):
            column = of_tcp.parameters[name]
            # dk/dc = -k^2
            columns.append(column if backlash else -(stiffness[elastic] ** 2) * column)
        by_parameter = jacobian_at(np.array(columns).T, offset)
        at_point = pin.SE3(placement.rotation, placement.translation + offset)
        return at_point, by_parameter, by_wrench


def with_tcp_at(robot: Robot, point: np.ndarray) -> Robot:
    """Return the robot with its TCP moved to a point of its TCP frame [m], (3,)."""
    place = Frame.of_rpy(robot.tcp_position, robot.tcp_rpy).points(point)
    return replace(robot, tcp_position=tuple(place.tolist()))

"""What a robot predicts of deflections at rest, one load after the other, and how that follows p.

A loop begins with the robot under its own weight, to which its gears went from no load; each load is
then applied where the one before was.  A row that was loaded from rest is a loop of one load.
Deflections are those from that beginning.  With x at rest,

    S(x) + H(s) + g - J^T w = 0,      s = clip(s_before + x - x_before, +-a)

an element that sticks follows x, from what it carried before, and derivatives are handed on likewise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from coupling.errors import IdentifyError
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.measurements import Measurements, rms
from coupling.identification.static.prediction import Prediction, jacobian_at, reversed_ranges
from coupling.path.frame import Frame
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import ElasticRobotError
from elastic_robot.hysteresis import Hysteresis, Past
from elastic_robot.kinematics import base_from_tool, tcp_jacobian
from elastic_robot.parameter_names import ByParameter
from elastic_robot.parameters import Parameters
from elastic_robot.residual import OperatingPoint, residual_derivatives
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TORQUE_CURVES


@dataclass(frozen=True)
class _Rest:
    """A robot at rest under a load.

    Attributes:
        theta: Angles of the chain [rad], (angles,).
        x, elongation: Elastic coordinates and elongations of elements [rad], (m,), (e,).
        x_by_p, elongation_by_p: Their derivatives by p, (m, P), (e, P).
        x_by_wrench: Derivatives of the elastic coordinates by the load, (m, 6).
    """

    theta: np.ndarray
    x: np.ndarray
    elongation: np.ndarray
    x_by_p: np.ndarray
    elongation_by_p: np.ndarray
    x_by_wrench: np.ndarray


class StaticModel:
    """The robot's own equilibria under the loads of measurements.

    Args:
        measured: The measurements.
        torque_curve: A name of `TORQUE_CURVES`.

    Attributes:
        elasticity: The parameters.
        effective: Mask of parameters that act on the deflections, a gear's hysteresis where its load
            reverses, (P,).
    """

    def __init__(
        self, elasticity: ElasticParameters, measured: Measurements, torque_curve: str
    ) -> None:
        self.elasticity, self._measured, self._curve = elasticity, measured, torque_curve
        reverses = reversed_ranges(elasticity.robot, measured) > 0.0
        slips = elasticity.chosen("hysteresis") | elasticity.chosen("slip_angle")
        self.effective = ~slips | reverses[elasticity.elastic]

    def predict(self, values: np.ndarray) -> Prediction:
        """Return deflections and derivatives at values of p, in its units, (P,).

        Raises:
            IdentifyError: If the robot finds no rest, with the row.
        """
        measured, robot = self._measured, self.elasticity.described(values)
        deflection = np.empty((measured.count, measured.rows))
        by_parameter = np.empty((measured.count, measured.rows, len(values)))
        by_wrench = np.empty((measured.count, measured.rows, 6))
        # The load keeps its direction while its point moves along: one robot for each such point.
        robots: dict[tuple[float, ...], _LoadedRobot] = {}
        for rows in measured.sequences:
            place = tuple(measured.load_point[rows[0]].tolist())
            if place not in robots:
                at_load = _with_tcp_at(robot, np.array(place))
                robots[place] = _LoadedRobot(at_load, self.elasticity, self._curve)
            loaded = unloaded = self._settle(robots[place], rows[0], np.zeros(6), None)
            for k in rows:
                loaded = self._settle(robots[place], k, measured.wrench[k], loaded)
                arm = measured.measured_point[k] - measured.load_point[k]
                ends = (robots[place].point(state, arm) for state in (unloaded, loaded))
                moves = _between(*ends)
                deflection[k], by_parameter[k], by_wrench[k] = (m[: measured.rows] for m in moves)
        return Prediction(deflection, by_parameter * self.effective, by_wrench)

    def rms_at(self, values: np.ndarray) -> float:
        """Return the rms error [m] at values of p, in its units, (P,); nan where there is no rest."""
        try:
            return rms(self._measured.deflection - self.predict(values).deflection)
        except IdentifyError:
            return float("nan")

    def _settle(
        self, robot: _LoadedRobot, row: int, wrench: np.ndarray, before: _Rest | None
    ) -> _Rest:
        try:
            return robot.settle(self._measured.q[row], wrench, before)
        except ElasticRobotError as cause:
            raise IdentifyError(f"{self._measured.names[row]}: {cause}") from cause


class _LoadedRobot:
    """A robot whose gears remember, its TCP where the load acts."""

    def __init__(self, robot: Robot, elasticity: ElasticParameters, torque_curve: str) -> None:
        self._chain, self._elasticity = build_chain(robot), elasticity
        self._dynamics = Dynamics(self._chain, np.array(robot.gravity))
        parameters, elements = Parameters.of(robot), self._chain.elements
        self._stiffness = parameters.stiffness
        self._law = TORQUE_CURVES[torque_curve].build(parameters)
        self._hysteresis = Hysteresis(elements, parameters.hysteresis)
        of_gear = np.equal.outer(elements.coordinate, elasticity.elastic)
        largest = np.max(of_gear.T * elements.slip_angle, axis=1, initial=1e-300)
        # Change of an element's elongation by the largest slip angle of its gear, over it, (e, P).
        self._over_largest = (of_gear & elasticity.chosen("slip_angle")) / largest

    def settle(self, q: np.ndarray, wrench: np.ndarray, before: _Rest | None) -> _Rest:
        """Return the rest of drives at q [rad], (n,), under a load, from the one before or from none."""
        elements, acting = self._chain.elements, ToolLoad(wrench)
        u, past = self._chain.kinematic_errors.output_angle(q), Past.start(self._hysteresis)
        follows = np.zeros((elements.count, len(self._elasticity.names)))
        if before is not None:
            past = Past(self._hysteresis, before.x, before.elongation)
            follows = before.elongation_by_p - before.x_by_p[elements.coordinate]
        x = equilibrium(self._dynamics, self._law, u, acting, past)
        s, zero = past.elongation_at(x), np.zeros_like(x)
        sticking = self._hysteresis.at_state(s, zero)
        drives, motion = np.stack([u, 0.0 * u, 0.0 * u]), np.stack([x, zero, zero])
        point = OperatingPoint(drives, motion, acting, self._law.region(x), sticking)
        by = residual_derivatives(self._dynamics, self._law, zero, point)
        sticks = np.abs(s) < elements.slip_angle
        # An element that slips is as long as its slip angle, which may be a parameter itself.
        relative = self._over_largest * s[:, None]
        elongation = np.where(sticks[:, None], follows, relative)
        torque = self._fixed(by.parameters)
        stiffness = self._hysteresis.stiffness[:, None]
        np.add.at(torque, elements.coordinate, stiffness * (elongation - relative))
        theta = self._chain.theta(u, x)
        slope = -self._dynamics.static_torque_gradient(theta, acting)
        slope[np.diag_indices_from(slope)] += self._law.flank_slope(x) + sticking.slope
        solution = -np.linalg.solve(slope, np.hstack([torque, by.wrench]))
        by_p, by_wrench = np.split(solution, [len(self._elasticity.names)], axis=1)
        elongation = elongation + sticks[:, None] * by_p[elements.coordinate]
        return _Rest(theta, x, s, by_p, elongation, by_wrench)

    def _fixed(self, parameters: ByParameter) -> np.ndarray:
        """Return the torques by p where elements come from a given past, (m, P)."""
        elasticity = self._elasticity
        columns = np.zeros((len(self._stiffness), len(elasticity.names)))
        for j, (name, elastic) in enumerate(zip(elasticity.names, elasticity.elastic, strict=True)):
            if elasticity.parameters[j].kind != "slip_angle":
                # dk/dc = -k^2
                factor = -(self._stiffness[elastic] ** 2) if elasticity.is_compliance[j] else 1.0
                columns[:, j] = factor * parameters[name]
        return columns

    def point(self, state: _Rest, arm: np.ndarray) -> tuple[pin.SE3, np.ndarray, np.ndarray]:
        """Return the placement of a point off the TCP, tool axes [m], (3,); its slopes by p and load."""
        tool = base_from_tool(self._chain, self._dynamics.data, state.theta)
        offset = tool.rotation @ arm
        jacobian = tcp_jacobian(self._chain, self._dynamics.data, state.theta)[
            :, self._chain.elastic
        ]
        at_point = jacobian_at(jacobian, offset)
        place = pin.SE3(tool.rotation, tool.translation + offset)
        return place, at_point @ state.x_by_p, at_point @ state.x_by_wrench


def _between(
    before: tuple[pin.SE3, np.ndarray, np.ndarray], after: tuple[pin.SE3, np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the deflection from one state to another [m, rad], (6,), and its slopes by p and load.

    Args:
        before, after: Placement of the measured point, base axes, and its derivatives by p and by the
            load [m, rad per unit], (6, P), (6, 6).
    """
    (start, start_by_p, _), (end, end_by_p, end_by_wrench) = before, after
    turn = end.rotation @ start.rotation.T
    # d log(E) = J_l^-1 (w1 - E w0), E = R1 R0^T; J_l^-1 is Pinocchio's Jlog3 of the inverse turn.
    by_turn = pin.Jlog3(turn.T)
    by_p, by_wrench = end_by_p - start_by_p, end_by_wrench.copy()
    by_p[3:] = by_turn @ (end_by_p[3:] - turn @ start_by_p[3:])
    by_wrench[3:] = by_turn @ end_by_wrench[3:]
    return np.append(end.translation - start.translation, pin.log3(turn)), by_p, by_wrench


def _with_tcp_at(robot: Robot, point: np.ndarray) -> Robot:
    """Return the robot with its TCP moved to a point of its TCP frame [m], (3,)."""
    place = Frame.of_rpy(robot.tcp_position, robot.tcp_rpy).points(point)
    return replace(robot, tcp_position=tuple(place.tolist()))

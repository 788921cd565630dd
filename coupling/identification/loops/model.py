"""What a robot whose gears have memory predicts of loading loops, with derivatives by its parameters.

A loop begins with the robot under its own weight, to which its gears went from no load; each load is
then applied where the one before was.  Deflections are those from that beginning.  With x at rest,

    S(x) + H(s) + g - J^T w = 0,      s = clip(s_before + x - x_before, +-a)

an element that sticks follows x, from what it carried before, and derivatives are handed on likewise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from coupling.errors import IdentifyError
from coupling.identification.loops.parameters import LoopParameters, loop_rows, reversed_ranges
from coupling.identification.static.measurements import Measurements
from coupling.identification.static.prediction import (
    Prediction,
    between,
    displacement,
    jacobian_at,
    with_tcp_at,
)
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import ElasticRobotError
from elastic_robot.hysteresis import HeldHysteresis, Hysteresis, Past
from elastic_robot.kinematics import base_from_tool, tcp_jacobian
from elastic_robot.parameter_names import ByParameter
from elastic_robot.parameters import Parameters
from elastic_robot.residual import OperatingPoint, residual_derivatives
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TORQUE_CURVES


@dataclass(frozen=True)
class _Rest:
    """A rest of a loop: elastic coordinates and elongations of elements [rad], (m,), (e,)."""

    x: np.ndarray
    elongation: np.ndarray


@dataclass(frozen=True)
class _Slopes:
    """Derivatives of a rest.

    Attributes:
        x, elongation: Derivatives of elastic coordinates and elongations by p, (m, P), (e, P).
        wrench: Derivatives of elastic coordinates by the load, (m, 6).
    """

    x: np.ndarray
    elongation: np.ndarray
    wrench: np.ndarray


@dataclass(frozen=True)
class _Run:
    """A robot on its way through a loop.

    Attributes:
        rows: Rows of the loop in the measurements, (k,).
        loop: The robot in the loop's posture.
        rests: Its rests: under its own weight, then under each load, k + 1.
    """

    rows: np.ndarray
    loop: _Loop
    rests: list[_Rest]


class LoopModel:
    """The robot's own equilibria along loading loops.

    Args:
        measured: The measurements, with loops.
        torque_curve: A name of `TORQUE_CURVES`.

    Attributes:
        elasticity: The parameters.
        effective: Mask of parameters that act on the deflections, a gear's hysteresis where its load
            reverses, (P,).
    """

    def __init__(
        self, elasticity: LoopParameters, measured: Measurements, torque_curve: str
    ) -> None:
        self.elasticity, self._measured, self._curve = elasticity, measured, torque_curve
        self._loops = loop_rows(measured)
        reverses = reversed_ranges(elasticity.robot, measured) > 0.0
        slips = elasticity.chosen("hysteresis") | elasticity.chosen("slip_angle")
        self.effective = ~slips | reverses[elasticity.elastic]

    def predict(self, values: np.ndarray) -> Prediction:
        """Return deflections and derivatives at values of p, in its units, (P,).

        Raises:
            IdentifyError: If the robot finds no rest, with the row.
        """
        runs = self._followed(values)
        return Prediction(self._deflections(runs), *self._derivatives(runs))

    def _followed(self, values: np.ndarray) -> list[_Run]:
        robot, measured, runs = self.elasticity.described(values), self._measured, list[_Run]()
        for rows in self._loops:
            loop = _Loop(
                with_tcp_at(robot, measured.load_point[rows[0]]),
                self.elasticity,
                self._curve,
                measured.q[rows[0]],
            )
            rests = [self._settle(loop, np.zeros(6), None, int(rows[0]))]
            for k in rows:
                rests.append(self._settle(loop, measured.wrench[k], rests[-1], int(k)))
            runs.append(_Run(rows, loop, rests))
        return runs

    def _settle(self, loop: _Loop, wrench: np.ndarray, before: _Rest | None, row: int) -> _Rest:
        try:
            return loop.settle(wrench, before)
        except ElasticRobotError as cause:
            raise IdentifyError(f"{self._measured.names[row]}: {cause}") from cause

    def _arm(self, row: int) -> np.ndarray:
        """Return from the point of the load to the measured one, tool axes [m], (3,)."""
        arm: np.ndarray = self._measured.measured_point[row] - self._measured.load_point[row]
        return arm

    def _deflections(self, runs: list[_Run]) -> np.ndarray:
        deflection = np.empty((self._measured.count, self._measured.rows))
        for run in runs:
            for k, loaded in zip(run.rows, run.rests[1:], strict=True):
                places = (run.loop.place(state, self._arm(k)) for state in (run.rests[0], loaded))
                deflection[k] = displacement(*places)[: deflection.shape[1]]
        return deflection

    def _derivatives(self, runs: list[_Run]) -> tuple[np.ndarray, np.ndarray]:
        """Return those of the deflections by p and by the loads, (k, r, P), (k, r, 6)."""
        measured = self._measured
        by_parameter = np.zeros((measured.count, measured.rows, len(self.elasticity.names)))
        by_wrench = np.empty((measured.count, measured.rows, 6))
        for run in runs:
            unloaded, loop = run.rests[0], run.loop
            before = slopes = loop.slopes(np.zeros(6), unloaded, None)
            for k, loaded in zip(run.rows, run.rests[1:], strict=True):
                slopes = loop.slopes(measured.wrench[k], loaded, slopes)
                arm = self._arm(k)
                ends = [*loop.point(unloaded, before, arm)[:2], *loop.point(loaded, slopes, arm)]
                _, *moves = between(*ends)
                by_parameter[k], by_wrench[k] = (part[: measured.rows] for part in moves)
        return by_parameter * self.effective, by_wrench


class _Loop:
    """One posture of a robot with memory, its TCP where the load acts."""

    def __init__(
        self, robot: Robot, elasticity: LoopParameters, torque_curve: str, q: np.ndarray
    ) -> None:
        self._chain, self._elasticity = build_chain(robot), elasticity
        self._dynamics = Dynamics(self._chain, np.array(robot.gravity))
        parameters = Parameters.of(robot)
        self._stiffness = parameters.stiffness
        self._law = TORQUE_CURVES[torque_curve].build(parameters)
        self._hysteresis = Hysteresis(self._chain.elements, parameters.hysteresis)
        elements, columns = (
            self._chain.elements,
            np.equal.outer(elasticity.elastic, self._chain.elements.coordinate),
        )
        self._largest = np.max(columns * elements.slip_angle, axis=1, initial=1e-300)
        self._q = self._chain.kinematic_errors.at_output(np.stack([q, 0.0 * q, 0.0 * q]))[0]

    def settle(self, wrench: np.ndarray, before: _Rest | None) -> _Rest:
        """Return the rest under a load, from the one before, or from no load."""
        past = Past.start(self._hysteresis)
        if before is not None:
            past = Past(self._hysteresis, before.x, before.elongation)
        x = equilibrium(self._dynamics, self._law, self._q, ToolLoad(wrench), past)
        return _Rest(x, past.elongation_at(x))

    def slopes(self, wrench: np.ndarray, loaded: _Rest, before: _Slopes | None) -> _Slopes:
        """Return the derivatives of a rest under a load, with those of the one before."""
        elasticity, elements, x, s = (
            self._elasticity,
            self._chain.elements,
            loaded.x,
            loaded.elongation,
        )
        if before is None:
            shapes = (
                (len(x), len(elasticity.names)),
                (elements.count, len(elasticity.names)),
                (len(x), 6),
            )
            before = _Slopes(*map(np.zeros, shapes))
        zero, acting = np.zeros_like(x), ToolLoad(wrench)
        sticking = self._hysteresis.at_state(s, zero)
        point = OperatingPoint(
            np.stack([self._q, 0.0 * self._q, 0.0 * self._q]),
            np.stack([x, zero, zero]),
            acting,
            self._law.region(x),
            sticking,
        )
        by = residual_derivatives(self._dynamics, self._law, zero, point)
        sticks = np.abs(s) < elements.slip_angle
        # An element that slips is as long as its slip angle, which may be a parameter itself.
        longer = np.equal.outer(elements.coordinate, elasticity.elastic) & elasticity.chosen(
            "slip_angle"
        )
        relative = longer * s[:, None] / self._largest
        follows = before.elongation - before.x[elements.coordinate]
        elongation = np.where(sticks[:, None], follows, relative)
        torque = self._fixed(by.parameters)
        np.add.at(
            torque,
            elements.coordinate,
            self._hysteresis.stiffness[:, None] * (elongation - relative),
        )
        forces = np.hstack([torque, by.wrench])
        solution = -np.linalg.solve(self._slope(x, acting, sticking), forces)
        by_x, by_wrench = solution[:, : len(elasticity.names)], solution[:, len(elasticity.names) :]
        return _Slopes(by_x, elongation + sticks[:, None] * by_x[elements.coordinate], by_wrench)

    def _fixed(self, parameters: ByParameter) -> np.ndarray:
        """Return the torques by p where elements come from a given past, (m, P)."""
        elasticity, columns = (
            self._elasticity,
            np.zeros((len(self._stiffness), len(self._elasticity.names))),
        )
        for j, (name, elastic) in enumerate(zip(elasticity.names, elasticity.elastic, strict=True)):
            if elasticity.parameters[j].kind != "slip_angle":
                # dk/dc = -k^2
                factor = -(self._stiffness[elastic] ** 2) if elasticity.is_compliance[j] else 1.0
                columns[:, j] = factor * parameters[name]
        return columns

    def _slope(self, x: np.ndarray, acting: ToolLoad, sticking: HeldHysteresis) -> np.ndarray:
        """Return what torque a change of x takes [N m/rad], (m, m)."""
        theta = self._chain.theta(self._q, x)
        slope = -self._dynamics.static_torque_gradient(theta, acting)
        slope[np.diag_indices_from(slope)] += self._law.flank_slope(x) + sticking.slope
        return slope

    def place(self, state: _Rest, arm: np.ndarray) -> pin.SE3:
        """Return the placement of a point `arm` off the TCP."""
        theta = self._chain.theta(self._q, state.x)
        tool = base_from_tool(self._chain, self._dynamics.data, theta)
        return pin.SE3(tool.rotation, tool.translation + tool.rotation @ arm)

    def point(
        self, state: _Rest, slopes: _Slopes, arm: np.ndarray
    ) -> tuple[pin.SE3, np.ndarray, np.ndarray]:
        """Return the placement of a point `arm` off the TCP, and its derivatives by p and load."""
        place = self.place(state, arm)
        theta = self._chain.theta(self._q, state.x)
        jacobian = tcp_jacobian(self._chain, self._dynamics.data, theta)[:, self._chain.elastic]
        at_point = jacobian_at(jacobian, place.rotation @ arm)
        return place, at_point @ slopes.x, at_point @ slopes.wrench

"""What a robot whose gears have memory predicts of loading loops, and the parameters that it depends on.

A loop begins with the robot under its own weight, to which its gears went from no load; each load is
then applied where the one before was.  Deflections are those from that beginning.  With x at rest,

    S(x) + H(s) + g - J^T w = 0,      s = clip(s_before + x - x_before, +-a)

an element that sticks follows x, from what it carried before, and derivatives are handed on likewise.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from coupling.errors import IdentifyError
from coupling.files.gear_table import sheet_elements
from coupling.files.robot_edit import place_of
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.measurements import Measurements
from coupling.identification.static.prediction import Prediction, between, moved, with_tcp_at
from coupling.robot.parameters import SLIP_ANGLE, RobotParameter, robot_parameters, with_joints
from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import ElasticRobotError
from elastic_robot.hysteresis import HeldHysteresis, Hysteresis, Past
from elastic_robot.kinematics import base_from_tool, tcp_jacobian
from elastic_robot.parameter_names import ByParameter
from elastic_robot.parameters import Parameters
from elastic_robot.static_sensitivity import static_sensitivities
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TORQUE_CURVES

# A gear's load turns back where its way, over all loads of a loop, is longer than its range by this
# part of that; and counts where its range is this part of the largest one.
_TURNED, _LOADED = 0.2, 1e-3
# Values of parameters are the same up to so small a part: a search counts them by other units.
_ROUNDING = 1e-14
# Slip torque at the start of a fit, over the range of the gear's torque in the loops.
_START = 0.1


@dataclass(frozen=True)
class LoopParameters(ElasticParameters):
    """The parameters p: those of `ElasticParameters`, then hysteresis of gears.

    `joint[i].hysteresis` is the torque at which all elements of a gear slip [N m].
    `joint[i].slip_angle`, of a gear that the file has without elements, is the largest slip angle [rad],
    to which the others are in proportion.
    """

    @classmethod
    def of_loops(
        cls, robot: Robot, torque_curve: str, shaped: Collection[int] = ()
    ) -> LoopParameters:
        """Return the parameters of a robot.

        Args:
            torque_curve: A name of `TORQUE_CURVES`.
            shaped: Numbers of joints, from 0, whose slip angles are fitted as well.
        """
        kinds = ("stiffness", "backlash", "hysteresis", SLIP_ANGLE)
        every = robot_parameters(robot, torque_curve, kinds)
        return cls(
            robot, tuple(own for own in every if own.kind != SLIP_ANGLE or joint_of(own) in shaped)
        )

    def chosen(self, kind: str) -> np.ndarray:
        """Return the mask of parameters of a kind, (P,)."""
        return np.array([own.kind == kind for own in self.own], dtype=bool)

    def together(self, j: int) -> np.ndarray:
        """Return the mask of those that stand and fall with one: a slip torque has its angle, (P,)."""
        own = self.own[j]
        with_it = [own.kind == "hysteresis" and p.coordinate == own.coordinate for p in self.own]
        mask = np.array(with_it) & self.chosen("slip_angle")
        mask[j] = True
        return mask


def joint_of(parameter: RobotParameter) -> int:
    """Return the number of a parameter's joint, from 0."""
    return place_of(parameter.name)[0] - 1


def with_elements(robot: Robot, ranges: Mapping[int, float]) -> Robot:
    """Return the robot with elements for gears that have none, three as a data sheet's loop has them.

    Args:
        ranges: Ranges of gears' torques [N m] by their joints' numbers, from 0.
    """

    def given(own: Joint, largest: float) -> Joint:
        assert own.stiffness is not None
        lost = 2.0 * _START * largest / own.stiffness
        return replace(own, hysteresis=sheet_elements(lost, own.stiffness))

    return with_joints(robot, {i: given(robot.joints[i], own) for i, own in ranges.items()})


def without_elements(robot: Robot, joints: Collection[int]) -> Robot:
    """Return the robot with gears that have no hysteresis, by their joints' numbers, from 0."""
    return with_joints(robot, {i: replace(robot.joints[i], hysteresis=()) for i in joints})


def loop_rows(measured: Measurements) -> list[np.ndarray]:
    """Return the indices of the rows of each loop, in their order, (rows,) each."""
    assert measured.loop is not None
    numbers, first = np.unique(measured.loop, return_index=True)
    return [np.flatnonzero(measured.loop == n) for n in numbers[np.argsort(first)]]


def reversed_ranges(robot: Robot, measured: Measurements) -> np.ndarray:
    """Return the range of each elastic coordinate's torque [N m], 0 where no loop turns it back, (m,).

    In the posture of the rigid robot.
    """
    chain = build_chain(robot)
    data, ranges, largest = chain.model.createData(), [], 0.0
    for rows in loop_rows(measured):
        theta = chain.theta(measured.q[rows[0]])
        turn = base_from_tool(chain, data, theta).rotation
        jacobian = tcp_jacobian(chain, data, theta)[:, chain.elastic]
        loads = np.vstack([np.zeros(6), measured.wrench[rows]])
        torque = loads @ moved(jacobian, turn @ measured.load_point[rows[0]])
        whole, way = np.ptp(torque, axis=0), np.abs(np.diff(torque, axis=0)).sum(axis=0)
        largest = max(largest, float(whole.max(initial=0.0)))
        ranges.append(np.where(way - whole > _TURNED * whole, whole, 0.0))
    found: np.ndarray = np.max(ranges, axis=0)
    return np.where(found > _LOADED * largest, found, 0.0)


@dataclass(frozen=True)
class _Rest:
    """A rest of a loop, and derivatives by p.

    Attributes:
        x, elongation: Elastic coordinates and elongations of elements [rad], (m,), (e,).
        by_x, by_elongation: Their derivatives, (m, P), (e, P).
        by_wrench: Derivative of x by the load, (m, 6).
    """

    x: np.ndarray
    elongation: np.ndarray
    by_x: np.ndarray
    by_elongation: np.ndarray
    by_wrench: np.ndarray


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
        turned = reversed_ranges(elasticity.robot, measured) > 0.0
        slips = elasticity.chosen("hysteresis") | elasticity.chosen("slip_angle")
        self.effective = ~slips | turned[elasticity.elastic]
        self._last: tuple[np.ndarray, Prediction] | None = None

    def predict(self, values: np.ndarray) -> Prediction:
        """Return the prediction at values of p, in its units, (P,); the last one is kept.

        Raises:
            IdentifyError: If the robot finds no rest, with the row.
        """
        if self._last is None or not np.allclose(values, self._last[0], rtol=_ROUNDING, atol=0.0):
            self._last = values.copy(), self._predicted(values)
        return self._last[1]

    def _predicted(self, values: np.ndarray) -> Prediction:
        robot, measured = self.elasticity.described(values), self._measured
        count, width = measured.count, measured.rows
        deflection = np.empty((count, width))
        by_parameter = np.zeros((count, width, len(values)))
        by_wrench = np.empty((count, width, 6))
        for rows in self._loops:
            loop = _Loop(
                with_tcp_at(robot, measured.load_point[rows[0]]),
                self.elasticity,
                self._curve,
                measured.q[rows[0]],
            )
            before = rest = self._rest(loop, np.zeros(6), None, int(rows[0]))
            for k in rows:
                rest = self._rest(loop, measured.wrench[k], rest, int(k))
                arm = measured.measured_point[k] - measured.load_point[k]
                ends = [*loop.point(before, arm)[:2], *loop.point(rest, arm)]
                moves = between(*ends)
                deflection[k], by_parameter[k], by_wrench[k] = (part[:width] for part in moves)
        return Prediction(deflection, by_parameter * self.effective, by_wrench)

    def _rest(self, loop: _Loop, wrench: np.ndarray, before: _Rest | None, row: int) -> _Rest:
        try:
            return loop.rest(wrench, before)
        except ElasticRobotError as cause:
            raise IdentifyError(f"{self._measured.names[row]}: {cause}") from cause


class _Loop:
    """One posture of a robot with memory, its TCP where the load acts."""

    def __init__(
        self, robot: Robot, elasticity: LoopParameters, torque_curve: str, q: np.ndarray
    ) -> None:
        self._chain, self._own = build_chain(robot), elasticity
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

    def rest(self, wrench: np.ndarray, before: _Rest | None) -> _Rest:
        """Return the rest under a load, from the one before, or from no load."""
        own, elements = self._own, self._chain.elements
        past, count = Past.start(self._hysteresis), len(own.names)
        by_x, by_s = np.zeros((len(past.x), count)), np.zeros((elements.count, count))
        if before is not None:
            past = Past(self._hysteresis, before.x, before.elongation)
            by_x, by_s = before.by_x, before.by_elongation
        acting = ToolLoad(wrench)
        x = equilibrium(self._dynamics, self._law, self._q, acting, past)
        s = past.elongation_at(x)
        held = self._hysteresis.held(s, np.zeros_like(x))
        found = static_sensitivities(self._dynamics, self._law, self._q, x, acting, held).x
        sticks = np.abs(s) < elements.slip_angle
        # An element that slips is as long as its slip angle, which may be a parameter itself.
        longer = np.equal.outer(elements.coordinate, own.elastic) & own.chosen("slip_angle")
        relative = longer * s[:, None] / self._largest
        carried = np.where(sticks[:, None], by_s - by_x[elements.coordinate], relative)
        stiff = self._hysteresis.stiffness[:, None] * (carried - relative)
        torque = np.zeros_like(by_x)
        np.add.at(torque, elements.coordinate, stiff)
        by_x = self._fixed(found.parameters) - np.linalg.solve(self._slope(x, acting, held), torque)
        by_s = carried + sticks[:, None] * by_x[elements.coordinate]
        return _Rest(x, s, by_x, by_s, found.wrench)

    def _fixed(self, parameters: ByParameter) -> np.ndarray:
        """Return the derivatives of x by p where elements come from a given past, (m, P)."""
        own, columns = self._own, np.zeros((len(self._stiffness), len(self._own.names)))
        for j, (name, elastic) in enumerate(zip(own.names, own.elastic, strict=True)):
            if own.own[j].kind != "slip_angle":
                # dk/dc = -k^2
                factor = -(self._stiffness[elastic] ** 2) if own.is_compliance[j] else 1.0
                columns[:, j] = factor * parameters[name]
        return columns

    def _slope(self, x: np.ndarray, acting: ToolLoad, held: HeldHysteresis) -> np.ndarray:
        """Return what torque a change of x takes [N m/rad], (m, m)."""
        theta = self._chain.theta(self._q, x)
        slope = -self._dynamics.static_torque_gradient(theta, acting)
        slope[np.diag_indices_from(slope)] += self._law.flank_slope(x) + held.slope
        return slope

    def point(self, rest: _Rest, arm: np.ndarray) -> tuple[pin.SE3, np.ndarray, np.ndarray]:
        """Return the placement of a point `arm` off the TCP, and its derivatives by p and load."""
        theta = self._chain.theta(self._q, rest.x)
        place = base_from_tool(self._chain, self._dynamics.data, theta)
        rotation, translation = place.rotation.copy(), place.translation.copy()
        offset = rotation @ arm
        jacobian = tcp_jacobian(self._chain, self._dynamics.data, theta)[:, self._chain.elastic]
        at_point = moved(jacobian, offset)
        placement = pin.SE3(rotation, translation + offset)
        return placement, at_point @ rest.by_x, at_point @ rest.by_wrench

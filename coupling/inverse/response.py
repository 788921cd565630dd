"""Response of the moving robot's tool to small changes of its command, along a known motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from coupling.inverse.gear_elements import GearElements
from coupling.inverse.link_model import LinkModel
from coupling.inverse.spline import UniformSpline, stencil
from coupling.path.linear import interpolate_rows
from elastic_robot.torque_curves import TorqueCurve

# Longest step over which the linear robot is taken as constant [s]: a gear that crosses its backlash
# changes its stiffness within milliseconds.
_STEP = 1e-3
# Points of a step at which the stiffness of a gear is averaged.
_SUBSTEPS = 8


@dataclass(frozen=True)
class AlongMotion:
    """A motion of the robot, about which it is linearised.

    Attributes:
        model: The robot.
        curve: Torque curve of all elastic coordinates.
        theta: Motion of the links.
        wrench: Function from times to wrenches on the robot at the TCP, (k, 6).
        elements: Elements of the hysteresis of each gear, (gears,).
    """

    model: LinkModel
    curve: TorqueCurve
    theta: UniformSpline
    wrench: Callable[[np.ndarray], np.ndarray]
    elements: tuple[GearElements, ...]

    def response(
        self,
        command: UniformSpline,
        free: range,
        outputs: np.ndarray,
        deflection: np.ndarray,
        before: np.ndarray,
    ) -> np.ndarray:
        """Return the derivatives of the tool's pose by coefficients of the command.

        M dx'' + C dx' + K dx = - (M dq'' + C dq' + G dq) in the rows of the elastic coordinates, from
        rest at the first output; exponentials of steps of a millisecond.

        Args:
            command: Motion of the drives.
            free: Numbers of the coefficients that change; the first acts after the first output.
            outputs: Evenly spaced times [s], (k,).
            deflection: Elastic coordinates of the robot under the command at these times [rad], (k, m):
                where the gears really are in their backlash.
            before: The same from the motion's first time to that of the first output [rad], (b, m): what
                the elements of a hysteresis come from.

        Returns:
            Position [m/rad] and rotation [rad/rad], base axes, (k, 6, len(free), joints).
        """
        chain = self.model.chain
        every = max(1, int(np.ceil((outputs[1] - outputs[0]) / _STEP - 1e-9)))
        step = float(outputs[1] - outputs[0]) / every
        times = outputs[0] + step * (np.arange((len(outputs) - 1) * every) + 0.5)
        slope = self._slope(times, step, outputs, deflection, before)
        transition, half, forcing = self._matrices(command, times, slope, step)
        first, part = command.place(times)
        weights = np.stack(
            [stencil(part, command.degree, o) / command.spacing**o for o in range(3)], axis=1
        )
        size, joints = chain.elastic_count, chain.joint_count
        flat = forcing.reshape(len(times), size, 3 * joints)
        pushes = (step * half[:, :, size:] @ flat).reshape(len(times), 2 * size, 3, joints)
        state = np.zeros((2 * size, len(free), joints))
        pushed = np.zeros((len(outputs), size, len(free), joints))
        acted = 0  # coefficients that have moved the robot so far
        for k in range(len(times)):
            moved = state[:, :acted].reshape(2 * size, -1)
            state[:, :acted] = (transition[k] @ moved).reshape(2 * size, acted, joints)
            used = range(max(first[k], free.start), min(first[k] + command.degree + 1, free.stop))
            if len(used):
                taken = slice(used.start - first[k], used.stop - first[k])
                acted = used.stop - free.start
                state[:, used.start - free.start : acted] += weights[k][:, taken].T @ pushes[k]
            if (k + 1) % every == 0:
                pushed[(k + 1) // every] = state[:size]
        return self._of_tool(command, free, outputs, pushed)

    def _of_tool(
        self, command: UniformSpline, free: range, outputs: np.ndarray, pushed: np.ndarray
    ) -> np.ndarray:
        """Return the tool's changes by those of elastic coordinates (k, m, free, joints) and drives."""
        chain = self.model.chain
        theta = self.theta.at(outputs)
        rest = np.zeros_like(theta)
        linear = self.model.desk.linearised(theta, rest, rest, np.zeros((len(outputs), 6)))
        answer = np.einsum("kra,kacj->krcj", linear.jacobian[:, :, chain.elastic], pushed)
        first, part = command.place(outputs)
        weights = stencil(part, command.degree, 0)
        driven = linear.jacobian[:, :, chain.drive]
        driven = driven * chain.kinematic_errors.slope(command.at(outputs))[:, None]
        for k in range(len(outputs)):
            used = range(max(first[k], free.start), min(first[k] + command.degree + 1, free.stop))
            for c in used:
                answer[k, :, c - free.start] += weights[k, c - first[k]] * driven[k]
        return answer

    def _matrices(
        self, command: UniformSpline, times: np.ndarray, slope: np.ndarray, step: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return transition over a step and its half, and accelerations by q, q', q'' of the motors."""
        chain, parameters = self.model.chain, self.model.parameters
        motion = [self.theta.at(times, order) for order in range(3)]
        linear = self.model.desk.linearised(motion[0], motion[1], motion[2], self.wrench(times))
        rows = linear.by_motion[:, :, chain.elastic]
        own, driven = rows[..., chain.elastic], rows[..., chain.drive]
        each = np.arange(chain.elastic_count)
        stiffness, damping = own[:, 0].copy(), own[:, 1].copy()
        stiffness[:, each, each] += slope
        damping[:, each, each] += parameters.damping
        count, size = len(times), chain.elastic_count
        solved = np.linalg.solve(
            own[:, 2], np.concatenate([stiffness, damping, *driven.swapaxes(0, 1)], axis=2)
        )
        generator = np.zeros((count, 2 * size, 2 * size))
        generator[:, :size, size:] = np.eye(size)
        generator[:, size:] = -solved[..., : 2 * size]
        half = expm(0.5 * step * generator)
        forcing = -solved[..., 2 * size :]
        if chain.kinematic_errors.count:
            motors = np.stack([command.at(times, order) for order in range(3)])
            forcing = forcing @ chain.kinematic_errors.gradient(motors)
        return half @ half, half, forcing.reshape(count, size, 3, -1)

    def _slope(
        self,
        times: np.ndarray,
        step: float,
        outputs: np.ndarray,
        deflection: np.ndarray,
        before: np.ndarray,
    ) -> np.ndarray:
        """Return the mean stiffness of the elastic coordinates over each step, (k, m)."""
        offsets = step * ((np.arange(_SUBSTEPS) + 0.5) / _SUBSTEPS - 0.5)
        fine = (times[:, None] + offsets).ravel()
        x = interpolate_rows(fine, outputs, deflection)
        slope = np.array(self.curve.slope(x))
        for gear, elements in zip(self.model.chain.torsions, self.elements, strict=True):
            if elements.count:
                path = np.append(before[:, gear], x[:, gear])
                start = np.clip(path[0], -elements.slip_angle, elements.slip_angle)
                slope[:, gear] += elements.slope(elements.along(path, start)[len(before) :])
        mean: np.ndarray = slope.reshape(len(times), _SUBSTEPS, -1).mean(axis=1)
        return mean

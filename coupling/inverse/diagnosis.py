"""Diagnosis of a robot's gears along a path: whether its command rests on their backlash.

The motion is that of the rigid robot with its tilts at rest under their loads: what counts here is the
sign of torques and their size, and no command is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from coupling.inverse.gears import gears_of
from coupling.inverse.inversion import DesiredMotion, MovingRobot
from coupling.inverse.links import rigid_motion
from coupling.inverse.reversals import (
    backlash_error,
    backlash_reversals,
    hysteresis_error,
    margin,
    negligible_torque,
)
from coupling.inverse.spline import UniformSpline
from coupling.native.desk_robot import DeskRobot
from coupling.path.linear import interpolate_rows
from coupling.results.gear_result import GearDiagnosis

# Directions in which the base is tilted.
_DIRECTIONS = 72
# Tilts of a base beyond are none [rad]; up to here gravity's share is nearly linear in them.
_LARGEST_TILT = 0.5
# Nodes between two looks at how far the tool moves with a gear.
_SELDOM = 5


@dataclass(frozen=True)
class GearLoads:
    """Torque of the gears along a path.

    Attributes:
        time: Evenly spaced [s], (k,).
        torque: Torque that the links need of every gear, with inertia [N m], (k, gears).
        carried: Torque without the inertia of tilts that spring back where a load jumps [N m],
            (k, gears): what counts beside a gear's strength.
        static: Torque at rest in every pose, under gravity and wrench [N m], (k, gears).
        by_gravity: Derivatives of these by gravity [N m s^2/m], (k, gears, 3).
        lever: Displacement of the TCP by the wind-up of every gear [m/rad], (k, gears).
    """

    time: np.ndarray
    torque: np.ndarray
    carried: np.ndarray
    static: np.ndarray
    by_gravity: np.ndarray
    lever: np.ndarray


def diagnose(robot: MovingRobot, motion: DesiredMotion) -> tuple[GearDiagnosis, ...]:
    """Return the diagnosis of every gear along a path.

    Args:
        motion: The path, its wrench, and the joint angles of the undeflected robot along it.
    """
    return diagnosed(robot, gear_loads(robot, motion))


def diagnosed(robot: MovingRobot, loads: GearLoads) -> tuple[GearDiagnosis, ...]:
    """Return the diagnosis of every gear under its loads."""
    model = robot.model
    backlash, damping = robot.backlash, robot.damping_in_backlash
    none = np.maximum(negligible_torque(backlash, damping), robot.held_in_backlash)
    step = float(loads.time[-1] - loads.time[0]) / (len(loads.time) - 1)
    reversals = backlash_reversals(step, loads.torque, backlash, damping)
    slipping = np.array([elements.count > 0 for elements in robot.elements], dtype=bool)
    if slipping.any():
        passages = robot.wind_up_from(loads.static[0], loads.time, loads.torque).reversals
        crossed = [c.joint - 1 for c in passages if c.before * c.after < 0]
        reversals = np.where(slipping, np.bincount(crossed, minlength=len(slipping)), reversals)
    clear = margin(loads.torque)
    gear_torque = np.abs(loads.carried)
    at_most = loads.time[gear_torque.argmax(axis=0)]
    may_carry_nothing = (backlash > 0.0) | slipping
    unloaded = (np.abs(loads.static[1:]) <= none) & may_carry_nothing
    in_backlash = step * np.sum(unloaded, axis=0)
    lever = loads.lever.max(axis=0)
    by_backlash = backlash_error(backlash, lever)
    gears = gears_of(model.parameters, model.chain)
    slip_torque = gears.hysteresis
    by_hysteresis = hysteresis_error(slip_torque, gears.stiffness, lever)
    gravity = np.asarray(model.parameters.gravity)
    tilts = [
        _base_tilt(loads.torque[:, gear], loads.by_gravity[:, gear], gravity)
        if clear[gear] < 0.0
        else (None, None)
        for gear in range(len(model.gears))
    ]
    return tuple(
        GearDiagnosis(
            joint=int(joint) + 1,
            backlash=float(backlash[gear]),
            reversals=int(reversals[gear]),
            in_backlash=float(in_backlash[gear]),
            margin=float(clear[gear]),
            backlash_error=float(by_backlash[gear]),
            torque=float(gear_torque[:, gear].max()),
            torque_time=float(at_most[gear]),
            base_tilt=tilts[gear][0],
            base_tilt_direction=tilts[gear][1],
            hysteresis_error=float(by_hysteresis[gear]) if slip_torque[gear] > 0.0 else None,
        )
        for gear, joint in enumerate(model.gear_joint)
    )


def gear_loads(robot: MovingRobot, motion: DesiredMotion) -> GearLoads:
    """Return the torque of the gears of the rigid robot with its tilts at rest under their loads."""
    task = robot.task(motion)
    return loads_along(robot, rigid_motion(robot.model, task), task.wrench)


def loads_along(
    robot: MovingRobot, theta: UniformSpline, wrench: Callable[[np.ndarray], np.ndarray]
) -> GearLoads:
    """Return the torque of the gears along a motion of the links.

    Args:
        theta: Motion of the links.
        wrench: Function from times to wrenches on the robot at the TCP, (k, 6).
    """
    model, time = robot.model, theta.nodes
    angles = theta.at(time)
    zero = np.zeros_like(angles)
    static = -model.desk.loads(angles, zero, zero, wrench(time))[:, model.gears]
    rate, acceleration = theta.at(time, 1), theta.at(time, 2)
    rate[:, model.tilts] = acceleration[:, model.tilts] = 0.0
    carried = -model.desk.loads(angles, rate, acceleration, wrench(time))[:, model.gears]
    seldom = np.append(time[:-1:_SELDOM], time[-1])
    by_gravity, lever = _by_pose(robot, theta.at(seldom))
    return GearLoads(
        time,
        robot.torque(theta, time, wrench),
        carried,
        static,
        interpolate_rows(time, seldom, by_gravity),
        interpolate_rows(time, seldom, lever),
    )


def _by_pose(robot: MovingRobot, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives of the gears' static torque by gravity, and their levers."""
    gears, zero, no_wrench = robot.model.gears, np.zeros_like(theta), np.zeros((len(theta), 6))
    jacobian = robot.model.desk.linearised(theta, zero, zero, no_wrench)[2]
    # What is linear in gravity follows from gravity of 1 along each axis.
    joints = tuple(replace(joint, balancer=None) for joint in robot.robot.joints)
    pulled = [replace(robot.robot, gravity=tuple(axis), joints=joints) for axis in np.eye(3)]
    loads = [DeskRobot(unit).loads(theta, zero, zero, no_wrench)[:, gears] for unit in pulled]
    return -np.stack(loads, axis=2), np.linalg.norm(jacobian[:, :3, gears], axis=1)


def _base_tilt(
    torque: np.ndarray, by_gravity: np.ndarray, gravity: np.ndarray
) -> tuple[float, float] | tuple[None, None]:
    """Return angle and direction [rad] of the smallest base tilt that keeps a gear from reversing.

    Args:
        torque: Torque of the gear [N m], (k,).
        by_gravity: Its derivative by gravity, (k, 3).
        gravity: Gravity in base axes [m/s^2], (3,).
    """
    best: tuple[float, float] | tuple[None, None] = None, None
    for direction in np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False).tolist():
        axis = np.array([np.cos(direction), np.sin(direction), 0.0])
        # Seen from the base gravity turns the other way: what a radian of tilt adds.
        added = by_gravity @ np.cross(gravity, axis)
        if added.min() <= 0.0:
            continue
        angle = float(np.max(-torque / added))
        if angle < (_LARGEST_TILT if best[0] is None else best[0]):
            best = angle, direction
    return best

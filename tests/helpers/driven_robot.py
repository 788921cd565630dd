"""A robot whose motors, gears and servos move, as one differential equation for SciPy.

It shares the chain's inverse dynamics with the package (Pinocchio), nothing of its time stepping:
elements of hysteresis and friction are s' = x' while they stick and 0 while they slip, watched by small
steps and not by events.  Kinematic errors and balancers are added here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.tool_load import ToolLoad

Motion = Callable[[float], tuple[np.ndarray, np.ndarray, np.ndarray]]


@dataclass
class DrivenRobot:
    """Equations of motion of a robot with drives; gears are linear.

    Args:
        robot: Every elastic joint may have a drive; others follow their command.
        command: q, q', q'' of the drives over time.
        wrench: On the tool over time, (6,).
        servo: Whether motors have their servo; else `torque` over time, one for each motor.
    """

    robot: Robot
    command: Motion
    wrench: Callable[[float], np.ndarray]
    servo: bool = True
    torque: Callable[[float], np.ndarray] | None = None

    def __post_init__(self) -> None:
        joints = self.robot.joints
        bare = replace(self.robot, joints=tuple(replace(joint, balancer=None) for joint in joints))
        self.chain = build_chain(bare)
        self.dynamics = Dynamics(self.chain, np.array(self.robot.gravity))
        self.driven = [i for i, joint in enumerate(joints) if joint.drive is not None]
        self.drives = [joints[i].drive for i in self.driven]
        torsion = {self.chain.elastic_joint[k]: k for k in self.chain.torsions}
        self.gear = [torsion[i] for i in self.driven]
        self.balancers = [
            (torsion[i], self.chain.drive[i], _balancer(j.balancer))
            for i, j in enumerate(joints)
            if j.balancer is not None
        ]
        stops = [(torsion[i], e) for i, j in enumerate(joints) for e in j.hysteresis]
        self.stop_of = [k for k, _ in stops]
        self.stop_torque = np.array([e.slip_torque for _, e in stops])
        self.stop_angle = np.array([e.slip_angle for _, e in stops])
        self.presliding = np.array([drive.slip_angle for drive in self.drives])
        springs = []
        for joint in joints:
            if joint.stiffness is not None:
                springs.append((joint.stiffness, joint.damping))
            springs += [(tilt.stiffness, tilt.damping) for tilt in joint.tilt]
        self.stiffness, self.damping = np.array(springs).T
        m, d = len(springs), len(self.driven)
        self.parts = np.cumsum([m, m, d, d, d, len(stops)])

    def split(self, y: np.ndarray) -> list[np.ndarray]:
        """x, x', motors' angles, rates, integrals; elongations of gears and of friction."""
        return np.split(y, self.parts)

    def at_output(
        self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """u = q + eps(q), u', u'' and du/dq of all drives, (n,) each."""
        u, rise, bend = q.copy(), np.ones_like(q), np.zeros_like(q)
        for i, joint in enumerate(self.robot.joints):
            for error in joint.kinematic_error:
                turned = error.order * q[i] + error.phase
                u[i] += error.amplitude * np.sin(turned)
                rise[i] += error.amplitude * error.order * np.cos(turned)
                bend[i] -= error.amplitude * error.order**2 * np.sin(turned)
        return u, rise * qd, rise * qdd + bend * qd**2, rise

    def friction(self, rate: np.ndarray, elongation: np.ndarray, gears: np.ndarray) -> np.ndarray:
        """Friction of every motor whose gear carries a torque [N m]."""
        return np.array(
            [
                (
                    d.friction * (1.0 - d.stribeck * (1.0 - np.exp(-((w / d.stribeck_rate) ** 2))))
                    + d.load_friction * abs(carried)
                )
                * (s / d.slip_angle)
                + d.viscous * w
                for d, w, s, carried in zip(self.drives, rate, elongation, gears, strict=True)
            ]
        )

    def balance(self, theta: np.ndarray) -> np.ndarray:
        """Torque of the balancers on the elastic coordinates [N m], (m,)."""
        torque = np.zeros(len(self.stiffness))
        for row, angle, law in self.balancers:
            torque[row] = law(theta[angle])
        return torque

    def gear_torque(self, x, v, stops) -> np.ndarray:
        """S + H + d x' [N m], (m,)."""
        torque = self.stiffness * x + self.damping * v
        np.add.at(torque, self.stop_of, self.stop_torque * stops / self.stop_angle)
        return torque

    def motor_torque(self, time, angle, rate, integral) -> np.ndarray:
        """Torque of every motor [N m], (d,)."""
        if not self.servo:
            return self.torque(time)
        q, qd, _ = self.command(time)
        wanted = self.wanted(q, qd, angle, rate)
        gains = np.array([d.rate_gain for d in self.drives])
        limit = np.array([d.torque_limit or np.inf for d in self.drives])
        return np.clip(gains * wanted + integral, -limit, limit)

    def wanted(self, q, qd, angle, rate) -> np.ndarray:
        return np.array(
            [
                d.position_gain * (q[i] - a) + d.feed_forward * qd[i] - w
                for d, i, a, w in zip(self.drives, self.driven, angle, rate, strict=True)
            ]
        )

    def rate_of(self, time: float, y: np.ndarray) -> np.ndarray:
        x, v, angle, rate, integral, stops, presliding = self.split(y)
        q, qd, qdd = self.command(time)
        wanted = self.wanted(q, qd, angle, rate)
        torque = self.motor_torque(time, angle, rate, integral)
        gears = self.gear_torque(x, v, stops)
        inertia = np.array([d.inertia for d in self.drives])
        drives = np.array([q, qd, qdd])
        drives[:2, self.driven] = angle, rate
        rise = self.at_output(*drives)[3][self.driven]
        carried = gears[self.gear]
        rubs = self.friction(rate, presliding, carried)
        acceleration = (torque + rise * carried - rubs) / inertia
        drives[2, self.driven] = acceleration
        u, u_rate, u_acceleration, _ = self.at_output(*drives)
        theta, theta_rate = self.chain.theta(u, x), self.chain.theta(u_rate, v)
        own = self.dynamics.loads(
            theta[None],
            theta_rate[None],
            self.chain.theta(u_acceleration)[None],
            ToolLoad(self.wrench(time)),
        )[0] - self.balance(theta)
        bend = np.linalg.solve(self.dynamics.mass_matrix(theta), -own - gears)
        growth = np.array([d.integral_gain for d in self.drives]) * wanted
        unlimited = np.array([d.rate_gain for d in self.drives]) * wanted + integral
        limit = np.array([d.torque_limit or np.inf for d in self.drives])
        growth[(np.abs(unlimited) > limit) & (unlimited * wanted > 0.0)] = 0.0
        if not self.servo:
            growth[:] = 0.0
        return np.concatenate(
            [
                v,
                bend,
                rate,
                acceleration,
                growth,
                _follow(stops, v[self.stop_of], self.stop_angle),
                _follow(presliding, rate, self.presliding),
            ]
        )

    def run(self, start: np.ndarray, times: np.ndarray, longest: float, rtol: float) -> np.ndarray:
        """States at times, (k, states)."""
        atol = rtol * 1e-4
        done = solve_ivp(
            self.rate_of,
            (times[0], times[-1]),
            start,
            "DOP853",
            times,
            rtol=rtol,
            atol=atol,
            max_step=longest,
        )
        assert done.success
        return done.y.T


def _balancer(table: tuple[tuple[float, float], ...]) -> Callable[[float], float]:
    """A natural spline through the points, straight beyond the last ones."""
    angle, torque = np.array(table).T
    spline = CubicSpline(angle, torque, bc_type="natural")

    def law(at: float) -> float:
        inside = min(max(at, angle[0]), angle[-1])
        return float(spline(inside) + spline(inside, 1) * (at - inside))

    return law


def _follow(elongation: np.ndarray, rate: np.ndarray, slip_angle: np.ndarray) -> np.ndarray:
    slips = (np.abs(elongation) >= slip_angle) & (elongation * rate > 0.0)
    return np.where(slips, 0.0, rate)

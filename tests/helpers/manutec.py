"""The Manutec r3 as the Modelica Standard Library has it [MslR3]: its motion, one axis, results."""

from dataclasses import dataclass

import numpy as np
from places import REFERENCE
from scipy.integrate import solve_ivp

# Constants of the motor and its current loop, axis 2.
TORQUE, INERTIA, OMEGA, DAMPING, RESISTANCE, AMPLIFIER = 1.1616, 0.0013, 5500.0, 0.6, 250.0, 5.0


def published(name: str) -> dict[str, np.ndarray]:
    """Columns of a table in tests/reference."""
    table = np.genfromtxt(REFERENCE / f"manutec_r3_{name}.csv", delimiter=",", names=True)
    return {column: table[column] for column in table.dtype.names}


class PointToPoint:
    """Constant acceleration, rate and deceleration, all axes at once, as fast as limits let them.

    Args:
        first, last: Angles [rad].
        rate, acceleration: Limits [rad/s, rad/s^2].
    """

    def __init__(self, first, last, rate, acceleration) -> None:
        self.first, self.way = np.asarray(first), np.subtract(last, first)
        self.rate = np.min(np.abs(rate / self.way))
        self.acceleration = np.min(np.abs(acceleration / self.way))
        self.rise = self.rate / self.acceleration
        self.end = self.rise + 1.0 / self.rate
        self.jumps = np.array([0.0, self.rise, self.end - self.rise, self.end])

    def at(self, time: float) -> np.ndarray:
        """q, q', q'' from a time on, (3, axes)."""
        rows = np.outer(self.part(time), self.way)
        rows[0] += self.first
        return rows

    def part(self, time: float) -> tuple[float, float, float]:
        """Part of the way, its rate [1/s] and acceleration [1/s^2] from a time on."""
        a, v, rise, left = self.acceleration, self.rate, self.rise, self.end - time
        if time < rise:
            return 0.5 * a * time**2, a * time, a
        if left > rise:
            return v * (time - 0.5 * rise), v, 0.0
        if left > 0.0:
            return 1.0 - 0.5 * a * left**2, a * left, -a
        return 1.0, 0.0, 0.0


@dataclass
class PublishedAxis:
    """Axis 2 with a load of 1.3 times 15 kg m^2, in Modelica's units, at the motor.

    A spring and a damper between rotor and gear, Coulomb and viscous friction at the rotor, a P-PI
    servo, and a current i that an amplifier's integrator u leads to its reference:

        La i' = 5 u - 250 i - k w,   u' = (i_ref - i) omega / (0.04 D),   La = 250 / (2 D omega).

    Attributes:
        path: Command at the gear's output.
        presliding: Angle of the motor over which friction builds up [rad]; 0: it is rigid at rest.
        with_current: Whether currents have their loop; else they are their reference.
    """

    path: PointToPoint
    presliding: float = 0.0
    with_current: bool = True

    ratio = 210.0
    spring, damper = 8.0, 0.01
    coulomb, viscous = 0.5, 0.1 / 130.0
    position_gain, gain, integral_time = 5.0, 0.5, 0.05
    load = 1.3 * 15.0

    def torques(self, time: float, y: np.ndarray) -> tuple[float, float, float]:
        """Of the motor and of the spring on it [N m], and what the rate loop is told [rad/s]."""
        theta, theta_rate, motor, rate, integral, current, _, _ = y.tolist()
        first, way = self.ratio * float(self.path.first[0]), self.ratio * float(self.path.way[0])
        part, part_rate, _ = self.path.part(time)
        q, qd = first + way * part, way * part_rate
        wanted = qd + self.position_gain * (q - motor) - rate
        reference = self.gain * (wanted + integral)
        spring = self.spring * (self.ratio * theta - motor)
        spring += self.damper * (self.ratio * theta_rate - rate)
        return TORQUE * (current if self.with_current else reference), spring, wanted

    def derivative(self, time: float, y: np.ndarray, side: int) -> np.ndarray:
        """Of theta, theta', phi, phi', integral, i, u and elongation; side 0: friction sticks."""
        _, theta_rate, _, rate, integral, current, amplified, elongation = y.tolist()
        torque, spring, wanted = self.torques(time, y)
        still = side == 0 and self.presliding == 0.0
        if self.presliding > 0.0:
            friction = self.coulomb * elongation / self.presliding + self.viscous * rate
        else:
            friction = side * self.coulomb + self.viscous * rate
        inductance = RESISTANCE / (2.0 * DAMPING * OMEGA)
        reference = self.gain * (wanted + integral)
        emf = AMPLIFIER * amplified - RESISTANCE * current - TORQUE * rate
        return np.array(
            [
                theta_rate,
                -self.ratio * spring / self.load,
                rate,
                0.0 if still else (torque + spring - friction) / INERTIA,
                wanted / self.integral_time,
                emf / inductance,
                (reference - current) * OMEGA / (0.04 * DAMPING),
                rate if side == 0 else 0.0,
            ]
        )

    def run(self, times: np.ndarray) -> np.ndarray:
        """States at times, from rest at zero, (n, 8); each smooth piece by itself."""
        y, side, time, rows = np.zeros(8), 0, 0.0, [np.zeros((1, 8))]
        jumps = [*self.path.jumps[1:], times[-1]]

        def end(t: float, y: np.ndarray, side: int) -> float:
            if side:
                return side * y[3]
            if self.presliding:
                return self.presliding - abs(y[7])
            torque, spring, _ = self.torques(t, y)
            return self.coulomb - abs(torque + spring)

        end.terminal, end.direction = True, -1.0
        while time < times[-1]:
            until = min(jump for jump in jumps if jump > time)
            piece = solve_ivp(
                self.derivative,
                (time, until),
                y,
                "DOP853",
                events=end,
                dense_output=True,
                args=(side,),
                rtol=1e-11,
                atol=1e-13,
            )
            inside = times[(times > time) & (times <= piece.t[-1])]
            if len(inside):
                rows.append(piece.sol(inside).T)
            time, y = piece.t[-1], piece.y[:, -1].copy()
            if piece.status == 1:
                side = self.next_side(time, y, side)
                y[3] = 0.0 if self.presliding == 0.0 else y[3]
        return np.vstack(rows)

    def next_side(self, time: float, y: np.ndarray, side: int) -> int:
        """Which way friction slips behind an event; 0 where it sticks."""
        if self.presliding:
            return 0 if side else int(np.sign(y[7]))
        torque, spring, _ = self.torques(time, y)
        applied = torque + spring
        return 0 if side and abs(applied) <= self.coulomb else int(np.sign(applied))

"""One motor, gear and link of the native FMU against closed forms, solutions by events, and balances."""

import itertools
from dataclasses import dataclass

import numpy as np
import pytest
from native_fmu import NativeFmu
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import expm

from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot
from elastic_robot.drive import Drive
from elastic_robot.gear_parts import StopElement

# About the joint: 7.5 kg m^2 at the centre of mass and 10 kg at 0.5 m.
LINK, STIFFNESS, DAMPING = 10.0, 1e6, 200.0
ELEMENTS = (StopElement(8.0, 2e-5), StopElement(10.0, 6e-5), StopElement(6.0, 1.5e-4))


def built(folder, drive: Drive, **joint) -> NativeFmu:
    """A horizontal link without weight, of 10 kg m^2 about its joint."""
    body = Body(mass=10.0, com=(0.5, 0.0, 0.0), inertia=(0.1, 7.5, 7.5))
    gear = {"stiffness": STIFFNESS, "damping": DAMPING, **joint}
    own = Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), body, drive=drive, **gear)
    robot = Robot("arm", (own,), gravity=(0.0, 0.0, 0.0), tcp_position=(1.0, 0.0, 0.0))
    return NativeFmu(build_fmu(robot, folder / "R.fmu", BuildOptions("native")), folder / "fmu")


class LinearServo:
    """theta, theta', q, q', z of a motor without friction at rest, after a jump of its command.

    Args:
        drive: Motor and servo.
        jump: Of the command [rad], at time zero.
        step: Between the states [s].
    """

    def __init__(self, drive: Drive, jump: float, step: float) -> None:
        k_p, k_v, b = drive.rate_gain, drive.position_gain, drive.viscous
        gear = np.array([-STIFFNESS, -DAMPING, STIFFNESS, DAMPING, 0.0])
        servo = np.array([0.0, 0.0, -k_p * k_v, -k_p - b, 1.0])
        rows = [
            [0.0, 1.0, 0.0, 0.0, 0.0],
            gear / LINK,
            [0.0, 0.0, 0.0, 1.0, 0.0],
            (servo - gear) / drive.inertia,
            drive.integral_gain * np.array([0.0, 0.0, -k_v, -1.0, 0.0]),
        ]
        # What stands still: all at the command, without torque.
        self.rest = np.array([jump, 0.0, jump, 0.0, 0.0])
        self.state, self._forward = np.zeros(5), expm(step * np.array(rows))

    def go(self) -> np.ndarray:
        """Go on by a step; return the state."""
        self.state = self.rest + self._forward @ (self.state - self.rest)
        return self.state


def jumped(fmu: NativeFmu, drive: Drive, step: float, steps: int, tolerance: float) -> np.ndarray:
    """What the FMU differs by from the matrix exponential: theta, theta', q, q' at all steps."""
    jump = 0.01
    slave = fmu.start(fmu.slave(), [0.0], tolerance, drive="servo", torque_curve="linear")
    fmu.set(slave, {"q_cmd[1]": jump})
    names = ("deflection[1]", "deflection_rate[1]", "motor_angle[1]", "motor_rate[1]")
    exact, apart = LinearServo(drive, jump, step), []
    for k in range(steps):
        slave.doStep(k * step, step)
        e, e_rate, q, rate = fmu.get(slave, *names)
        apart.append(np.array([q + e, rate + e_rate, q, rate]) - exact.go()[:4])
    assert abs(q - jump) < 5e-3
    return np.array(apart)


@pytest.mark.parametrize("integral_gain", [0.0, 2e6])
def test_a_jump_is_answered_as_the_matrix_exponential_has_it(tmp_path, integral_gain):
    """To 1e-10 rad of 0.01 and 1e-8 rad/s, over 0.6 s."""
    drive = Drive(30.0, 20.0, 4e3, integral_gain=integral_gain, viscous=50.0)
    apart = jumped(built(tmp_path, drive), drive, 2e-3, 300, 1e-11)
    assert np.abs(apart[:, [0, 2]]).max() < 1e-10
    assert np.abs(apart[:, [1, 3]]).max() < 1e-8


def test_steps_with_motors_are_of_eighth_order(tmp_path):
    """A tolerance that asks for nothing leaves the communication step: 4, 2, 1 ms, to 2e-14 rad."""
    drive = Drive(30.0, 20.0, 4e3, integral_gain=2e6, viscous=50.0)
    fmu, errors = built(tmp_path, drive), []
    for step in (4e-3, 2e-3, 1e-3):
        apart = jumped(fmu, drive, step, round(0.064 / step), 1.0)
        errors.append(np.abs(apart[:, [0, 2]]).max())
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 8.0, atol=0.4)


@dataclass
class BeltedMotor:
    """A motor whose servo without integral draws it slowly over Stribeck's friction, with gear and link.

    Between slipping and sticking the equation is smooth; SciPy solves each piece and finds its end.

    Args:
        drive: Motor, friction and servo.
        rate: Of the command [rad/s].
    """

    drive: Drive
    rate: float

    def friction(self, part: float, rate: float) -> float:
        own = self.drive
        lost = own.stribeck * (1.0 - np.exp(-((rate / own.stribeck_rate) ** 2)))
        return own.friction * part * (1.0 - lost) + own.viscous * rate

    def derivative(self, time: float, y: np.ndarray, side: int) -> list[float]:
        """Of theta, theta', q, q', s; side 0 while the friction sticks."""
        own = self.drive
        theta, theta_rate, q, rate, s = y
        gear = STIFFNESS * (theta - q) + DAMPING * (theta_rate - rate)
        wanted = own.position_gain * (self.rate * time - q) + own.feed_forward * self.rate - rate
        torque = own.rate_gain * wanted - self.friction(s / own.slip_angle, rate)
        return [
            theta_rate,
            -gear / LINK,
            rate,
            (torque + gear) / own.inertia,
            0.0 if side else rate,
        ]

    def run(self, times: np.ndarray) -> tuple[np.ndarray, list[float]]:
        """States at times, (n, 5), and when slipping began [s]."""
        most = self.drive.slip_angle
        y, side, time, began, rows = np.zeros(5), 0, times[0], [], [np.zeros((1, 5))]
        while time < times[-1]:

            def end(t: float, y: np.ndarray, side: int) -> float:
                return most - abs(y[4]) if side == 0 else side * y[3]

            end.terminal, end.direction = True, -1.0
            span, precise = (time, times[-1]), {"rtol": 1e-12, "atol": 1e-15}
            piece = solve_ivp(
                self.derivative,
                span,
                y,
                "DOP853",
                events=end,
                dense_output=True,
                args=(side,),
                **precise,
            )
            inside = times[(times > time) & (times <= piece.t[-1])]
            rows.append(piece.sol(inside).T.reshape(-1, 5))
            time, y = piece.t[-1], piece.y[:, -1].copy()
            if side == 0 and time < times[-1]:
                began.append(time)
                side = int(np.sign(y[4]))
                y[4] = side * most
            else:
                side = 0
        return np.vstack(rows), began


def test_a_slow_servo_sticks_and_slips_at_the_period_of_an_event_driven_solution(tmp_path):
    """Mass on a belt, the servo its spring: angles to 1e-9 rad in 11 periods, the period to 1e-6."""
    drive = Drive(
        30.0,
        position_gain=600.0,
        rate_gain=100.0,
        friction=40.0,
        stribeck=0.5,
        stribeck_rate=0.01,
        viscous=3.0,
    )
    rate, step, steps = 2e-3, 2e-3, 2500
    times = step * np.arange(steps + 1)
    expected, began = BeltedMotor(drive, rate).run(times)
    fmu = built(tmp_path, drive)
    # The motor starts at the command's rate; SciPy's at rest does, too.
    slave = fmu.start(fmu.slave(), [0.0], 1e-11, drive="servo", torque_curve="linear")
    found = [[0.0, 0.0, 0.0]]
    for k in range(steps):
        fmu.set(slave, {"q_cmd[1]": rate * times[k], "qd_cmd[1]": rate})
        slave.doStep(times[k], step)
        found.append(fmu.get(slave, "motor_angle[1]", "deflection[1]", "motor_rate[1]"))
    q, e, moving = np.array(found).T
    np.testing.assert_allclose(q, expected[:, 2], rtol=0, atol=1e-11)
    np.testing.assert_allclose(q + e, expected[:, 0], rtol=0, atol=1e-11)
    # It sticks far longer than it moves, and the cycle, of two long sticks, has settled.
    sticks = np.diff(began)
    assert sticks.max() > 5.0 * sticks.min()
    assert len(began) > 60
    np.testing.assert_allclose(sticks[-8:], sticks[-16:-8], rtol=1e-5)
    assert moving.max() > 3.0 * rate


def plastic_travel(turns: np.ndarray, slip_angle: float) -> tuple[float, float]:
    """Way on which a stop element slips between places [rad] where its coordinate turns, and its end."""
    way, s = 0.0, 0.0
    for a, b in itertools.pairwise(turns):
        tried = s + b - a
        s = float(np.clip(tried, -slip_angle, slip_angle))
        way += abs(tried - s)
    return way, s


def turning_points(times: np.ndarray, x: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """First, last and extreme places of a coordinate between samples."""
    curve = CubicHermiteSpline(times, x, rate)
    roots = curve.derivative().roots(extrapolate=False)
    return np.concatenate([x[:1], curve(np.sort(roots[np.isfinite(roots)])), x[-1:]])


def squared(times: np.ndarray, x: np.ndarray, rate: np.ndarray) -> float:
    """Integral of x'^2."""
    nodes, weights = np.polynomial.legendre.leggauss(3)
    half = 0.5 * np.diff(times)[:, None]
    places = 0.5 * (times[1:] + times[:-1])[:, None] + half * nodes
    return float(np.sum(half * weights * CubicHermiteSpline(times, x, rate)(places, 1) ** 2))


@pytest.mark.parametrize(
    "lossy",
    [
        ("friction",),
        ("viscous",),
        ("hysteresis",),
        ("friction", "viscous", "hysteresis", "damping"),
    ],
    ids="-".join,
)
def test_what_a_motor_puts_in_is_stored_or_lost(tmp_path, lossy):
    """Torques held over a step, so that their work is exact; to 1e-7 of what is lost in six cycles."""
    losses = {"friction": 30.0, "viscous": 40.0}
    drive = Drive(
        30.0,
        position_gain=20.0,
        rate_gain=2e3,
        slip_angle=1e-4,
        **{key: value for key, value in losses.items() if key in lossy},
    )
    elements = ELEMENTS if "hysteresis" in lossy else ()
    damping = DAMPING if "damping" in lossy else 0.0
    fmu = built(tmp_path, drive, hysteresis=elements, damping=damping)
    slave = fmu.start(fmu.slave(), [0.0], 1e-11, drive="torque", torque_curve="linear")
    names = ["motor_angle[1]", "motor_rate[1]", "deflection[1]", "deflection_rate[1]"]
    names += [f"elongation[{j + 1}]" for j in range(len(elements))]
    step = 2.5e-4
    times = step * np.arange(4801)
    torque = 400.0 * np.sin(2.0 * np.pi * 5.0 * times[:-1])
    rows = [fmu.get(slave, *names)]
    for time, value in zip(times[:-1], torque, strict=True):
        fmu.set(slave, {"torque_cmd[1]": value})
        slave.doStep(time, step)
        rows.append(fmu.get(slave, *names))
    q, rate, e, e_rate, *stops = np.array(rows).T
    work = torque @ np.diff(q)
    way, s = plastic_travel(turning_points(times, q, rate), drive.slip_angle)
    lost = drive.friction * way + drive.viscous * squared(times, q, rate)
    lost += damping * squared(times, e, e_rate)
    stored = 0.5 * drive.friction / drive.slip_angle * s**2
    for element, elongation in zip(elements, stops, strict=True):
        way, s = plastic_travel(turning_points(times, e, e_rate), element.slip_angle)
        assert elongation[-1] == pytest.approx(s, abs=1e-10)
        lost += element.slip_torque * way
        stored += 0.5 * element.stiffness * s**2
    stored += 0.5 * (LINK * (rate + e_rate)[-1] ** 2 + drive.inertia * rate[-1] ** 2)
    stored += 0.5 * STIFFNESS * e[-1] ** 2
    assert work == pytest.approx(stored + lost, abs=1e-7 * lost)

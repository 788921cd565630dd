"""The robot by Newton's and Euler's laws in base axes, in complex arithmetic: an independent model.

Every operation is analytic, so f(y + i h) has the imaginary part h f'(y) without cancellation
(docs/references.md, Martins2003).  It reads the description itself and shares no code with the project.
States may be many at once, as in `OperatingPoint`.
"""

import functools
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline

from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot

STEP = 1e-40
_EYE = np.eye(3)
# Matrices of e x .. of the three unit vectors e, row by row, (3, 9).
_SKEW = np.cross(_EYE[:, None], _EYE).swapaxes(1, 2).reshape(3, 9)


@dataclass(frozen=True)
class Numbers:
    """What the equation of motion depends on; arrays as in `OperatingPoint` and `Parameters`.

    The spring at the TCP has an anchor and the entries xx xy xz yy yz zz of its stiffness.
    """

    drives: np.ndarray
    motion: np.ndarray
    wrench: np.ndarray
    gravity: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    backlash: np.ndarray
    anchor: np.ndarray = field(default_factory=lambda: np.zeros(3))
    spring: np.ndarray = field(default_factory=lambda: np.zeros(6))
    anchor_velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @property
    def spring_matrix(self) -> np.ndarray:
        xx, xy, xz, yy, yz, zz = self.spring
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


@dataclass(frozen=True)
class Answer:
    """Loads M theta'' + h - J^T w in the rows of x; the TCP's position, axes and velocities.

    Of k states every array has k as its first axis.
    """

    loads: np.ndarray
    position: np.ndarray
    rotation: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray


def evaluate(robot: Robot, given: Numbers) -> Answer:
    """Walk the chain once: velocities and accelerations outwards, forces of all bodies on all axes.

    The drives are motors, before their gears' kinematic errors.
    """
    states = given.motion.shape[1:-1]
    turn = np.zeros((*states, 3, 3), dtype=complex) + np.eye(3)
    point, velocity, acceleration, spin, spin_rate = np.zeros((5, *states, 3), dtype=complex)
    # Matrices of spin x .. and of spin' x .. + spin x (spin x ..).
    whirl = whirling = np.zeros((*states, 3, 3), dtype=complex)
    axes, points, elastic, bodies, balanced = [], [], [], [], {}
    free = iter(np.moveaxis(given.motion, -1, 0))
    one_for_all = given.drives.ndim < given.motion.ndim
    drives = given.drives[:, None] if one_for_all else given.drives

    def shifted(arm):
        return point + arm, velocity + times(whirl, arm), acceleration + times(whirling, arm)

    def rotate(axis, motion, is_elastic):
        nonlocal turn, spin, spin_rate, whirl, whirling
        angle, (rate, rate_of_rate) = motion[0], motion[1:, ..., None]
        z = turn @ np.array(axis)
        spin_rate = spin_rate + z * rate_of_rate + times(whirl, z) * rate
        spin = spin + z * rate
        whirl = skew(spin)
        whirling = skew(spin_rate) + whirl @ whirl
        turn = turn @ rodrigues(axis, angle)
        axes.append(z), points.append(point), elastic.append(is_elastic)

    def load(body: Body):
        place, _, of_centre = shifted(turn @ np.array(body.com))
        inertia = turn @ body.inertia_matrix @ turn.swapaxes(-1, -2)
        moment = times(inertia, spin_rate) + times(whirl @ inertia, spin)
        bodies.append((len(axes), place, body.mass * (of_centre - given.gravity), moment))

    for joint, drive in zip(robot.joints, np.moveaxis(drives, -1, 0), strict=True):
        point, velocity, acceleration = shifted(turn @ np.array(joint.origin))
        is_elastic, output = joint.stiffness is not None, behind_gear(joint, drive)
        motion = output + next(free) if is_elastic else output
        if joint.balancer is not None:
            balanced[len(axes)] = balance(joint.balancer, motion[0])
        rotate(joint.axis, motion, is_elastic)
        for tilt in joint.tilt:
            rotate(tilt.axis, next(free), True)
        load(joint.body)
    if robot.payload is not None:
        load(robot.payload)
    tcp, tcp_velocity, _ = shifted(turn @ np.array(robot.tcp_position))
    force = given.wrench[:3] + times(given.spring_matrix, given.anchor - tcp)
    bodies.append((len(axes), tcp, -force, np.broadcast_to(-given.wrench[3:], tcp.shape)))
    # Moment about the base's origin and force of all bodies that each axis carries.
    behind, places, forces, moments = (np.array(part) for part in zip(*bodies, strict=True))
    carries = (behind > np.arange(len(axes))[:, None]).astype(float)
    moment_beyond = np.tensordot(carries, cross(places, forces) + moments, 1)
    turning = moment_beyond - cross(np.array(points), np.tensordot(carries, forces, 1))
    torques = (np.array(axes) * turning).sum(axis=-1)
    for i, torque_of_spring in balanced.items():
        torques[i] -= torque_of_spring
    return Answer(torques[np.array(elastic)].T, tcp, turn, tcp_velocity, spin)


def behind_gear(joint: Joint, drive: np.ndarray) -> np.ndarray:
    """Angle, rate and acceleration at the output of a gear with its kinematic error."""
    q, rate, acceleration = drive
    output = np.array([q, rate, acceleration])
    for error in joint.kinematic_error:
        a, n = error.amplitude, error.order
        sine, cosine = np.sin(n * q + error.phase), np.cos(n * q + error.phase)
        bent = a * n * cosine * acceleration - a * n**2 * sine * rate**2
        output = output + np.array([a * sine, a * n * cosine * rate, bent])
    return output


@functools.cache
def natural_spline(table: tuple[tuple[float, float], ...]) -> CubicSpline:
    return CubicSpline(*np.array(table).T, bc_type="natural")


def balance(table: tuple[tuple[float, float], ...], angle: complex) -> complex:
    """Torque of a balancer: the piece of a natural spline where the real part of the angle lies."""
    spline = natural_spline(table)
    if np.ndim(angle):
        return np.array([balance(table, one) for one in angle])
    (first, last), at = spline.x[[0, -1]], np.real(angle)
    if first <= at <= last:
        piece = min(int(np.searchsorted(spline.x, at, side="right")) - 1, len(table) - 2)
        return np.polyval(spline.c[:, piece], angle - spline.x[piece])
    end = first if at < first else last
    return spline(end) + spline(end, 1) * (angle - end)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b; np.cross takes several times as long."""
    (a1, a2, a3), (b1, b2, b3) = a.T, b.T
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1]).T


def times(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return (matrix @ vector[..., None])[..., 0]


def skew(vector: np.ndarray) -> np.ndarray:
    """Matrix of vector x .., (..., 3, 3)."""
    return (vector @ _SKEW).reshape(*vector.shape, 3)


def rodrigues(axis: tuple[float, ...], angle: np.ndarray) -> np.ndarray:
    k, angle = skew(np.array(axis)), angle[..., None, None]
    return _EYE + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)


def torque(curve: str, given: Numbers) -> np.ndarray:
    """Closed forms of the torque curves on the piece where the real part of x lies."""
    x, k, b = given.motion[0], given.stiffness, given.backlash
    side, size = np.sign(x.real), np.abs(x.real)
    if curve == "linear":
        return k * x
    line = k * (x - side * b)
    if curve == "backlash":
        return np.where(size > b.real, line, 0.0)
    assert curve == "spline", f"{curve}: expected its closed form here"
    beyond = x - side * b / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        corner = side * k * beyond**2 / (2 * b)
    return np.where(size > 1.5 * b.real, line, np.where(size > 0.5 * b.real, corner, 0.0))


def residual(robot: Robot, curve: str, given: Numbers) -> np.ndarray:
    return evaluate(robot, given).loads + torque(curve, given) + given.damping * given.motion[1]


def acceleration(robot: Robot, curve: str, given: Numbers) -> np.ndarray:
    """The x'' that makes the residual zero; the residual is affine in x''."""
    x, rate, _ = given.motion
    units = np.eye(len(x) + 1, len(x), -1)  # none, and each alone
    motion = np.array(np.broadcast_arrays(x, rate, units))
    bias, *columns = residual(robot, curve, changed(given, motion=motion))
    mass = np.reshape(columns, (len(x), len(x))).T - bias[:, None]
    return np.linalg.solve(mass, -bias)


def changed(given: Numbers, **values: np.ndarray) -> Numbers:
    return Numbers(**{**vars(given), **values})


def along(given: Numbers, **directions: np.ndarray) -> Numbers:
    """Return the numbers, an imaginary step further in a direction."""
    return changed(
        given, **{name: vars(given)[name] + 1j * STEP * d for name, d in directions.items()}
    )


def derivative(value: np.ndarray) -> np.ndarray:
    """Return the directional derivative that a value after `along` carries."""
    return value.imag / STEP


def small_rotation(rotation: np.ndarray) -> np.ndarray:
    """Return the derivative of an orientation as a rotation vector, base axes."""
    skew = derivative(rotation) @ rotation.real.T
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0]])

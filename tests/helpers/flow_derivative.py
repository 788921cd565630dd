"""The exact flow of the independent model and its derivative along a change of the inputs.

Collocation at eight Gauss nodes (order 16) of the equation of motion in tests/helpers/complex_robot.py,
in complex arithmetic: inputs that are moved by an imaginary step carry the derivative of everything that
follows, without truncation or cancellation.  Steps end where a coordinate passes a knot of its torque
curve; the length of such a step is complex too, so that the moment of the passage moves as it should.
No code is shared with the project, neither formulas nor steps.
"""

from dataclasses import dataclass, field

import numpy as np
from complex_robot import STEP, Numbers, changed, derivative, evaluate

from elastic_robot.description import Robot

STAGES = 8
NODES = 0.5 * (1.0 + np.polynomial.legendre.leggauss(STAGES)[0])
LEGENDRE = np.polynomial.legendre
# Values at the nodes -> coefficients of Legendre polynomials on [0, 1].
_FIT = np.linalg.inv(LEGENDRE.legvander(2.0 * NODES - 1.0, STAGES - 1))
# What the last of these coefficients may change x' by in a step, relative to its largest entry.
RESOLVED = 1e-12
FIRST = 2e-5


def _integrals(at: np.ndarray, times: int) -> np.ndarray:
    """Weights of the nodes' values for the integral, taken `times` times from 0, at points of [0, 1]."""
    rows = []
    for unit in np.eye(STAGES):
        rows.append(LEGENDRE.legval(2.0 * at - 1.0, LEGENDRE.legint(unit, times, scl=0.5, lbnd=-1)))
    return np.array(rows).T @ _FIT


ONCE, TWICE = _integrals(NODES, 1), _integrals(NODES, 2)
DENSE = np.linspace(0.0, 1.0, 200)[1:]
DENSE_TWICE = _integrals(DENSE, 2)
END_ONCE, END_TWICE = _integrals(np.ones(1), 1)[0], _integrals(np.ones(1), 2)[0]


def knots(curve: str, backlash: float) -> np.ndarray:
    """Where the law of a coordinate changes; `spline` as rounded by default."""
    if curve == "linear" or backlash == 0.0:
        return np.zeros(0)
    if curve == "backlash":
        return np.array([-backlash, backlash])
    return np.array([-1.5, -0.5, 0.5, 1.5]) * backlash


def piece_torque(pieces: int, piece: int, x: complex, k: float, b: float) -> complex:
    """S(x) on a piece, counted from below."""
    side = np.sign(piece - 0.5 * (pieces - 1))
    if pieces == 1:
        return k * x
    if piece in (0, pieces - 1):
        return k * (x - side * b)
    if side == 0:
        return 0.0 * x
    beyond = x - side * b / 2
    return side * k * beyond**2 / (2 * b)


def piece_slope(pieces: int, piece: int, x: complex, k: float, b: float) -> complex:
    """S'(x) on a piece."""
    side = np.sign(piece - 0.5 * (pieces - 1))
    if pieces == 1 or piece in (0, pieces - 1):
        return k + 0.0 * x
    return 0.0 * x if side == 0 else side * k * (x - side * b / 2) / b


@dataclass
class Flow:
    """An integration in complex arithmetic.

    Attributes:
        robot, curve: The model.
        numbers: Drives (q, q', q'') and anchor at the command, wrench and parameters; complex where
            moved.
        x, v: State, complex.
        crossings: Knots passed so far.
    """

    robot: Robot
    curve: str
    numbers: Numbers
    x: np.ndarray
    v: np.ndarray
    time: complex = 0.0
    crossings: int = 0
    steps: int = 0
    piece: np.ndarray = field(init=False)
    _mass: np.ndarray | None = field(init=False, default=None)
    _support: np.ndarray | None = field(init=False, default=None)
    _rounding: list[float] = field(init=False, default_factory=list)

    def __post_init__(self) -> None:
        self.knots = [knots(self.curve, b) for b in self.numbers.backlash.real]
        self._damping = np.diag(self.numbers.damping.real)
        self.piece = np.array(
            [int(np.searchsorted(k, x)) for k, x in zip(self.knots, self.x.real, strict=True)]
        )

    def drives(self, time: complex) -> np.ndarray:
        """Their motion at a time, or at k of them, (3, n) or (3, k, n)."""
        (q, qd, qdd), t = self.numbers.drives, np.asarray(time)[..., None]
        return np.array([q + t * (qd + 0.5 * t * qdd), qd + t * qdd, qdd + 0.0 * t])

    def _laws(self, law, x: np.ndarray) -> np.ndarray:
        given = zip(
            self.knots, self.piece, x.T, self.numbers.stiffness, self.numbers.backlash, strict=True
        )
        return np.array([law(len(k) + 1, p, y, s, b) for k, p, y, s, b in given]).T

    def torque(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """S(x) + d x' on the pieces that the coordinates are on."""
        return self._laws(piece_torque, x) + self.numbers.damping * v

    def slope(self, x: np.ndarray) -> np.ndarray:
        """S'(x) on the pieces that the coordinates are on."""
        return self._laws(piece_slope, x)

    def residual(self, time: complex, x: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Of one state, (m,), or of k, (k, m), at times (k,)."""
        anchor = self.numbers.anchor + np.asarray(time)[..., None] * self.numbers.anchor_velocity
        motion = np.array([x, v, a])
        at = changed(self.numbers, drives=self.drives(time), motion=motion, anchor=anchor)
        loads = evaluate(self.robot, at).loads
        return loads + self.torque(x, v)

    def _matrix(self, h: float) -> np.ndarray:
        """Newton's matrix of a step: mass and spring where the flow began, slopes now, dampers."""
        m, zero = len(self.x), np.zeros(len(self.x))
        if self._mass is None:
            bias = self.residual(self.time, self.x, zero, zero)
            columns = [self.residual(self.time, self.x, zero, e) - bias for e in np.eye(m)]
            self._mass = np.array(columns).real.T.reshape(m, m)
            lever = np.array([self._position(e) for e in np.eye(m)]).reshape(m, 3)
            spring = self.numbers.spring_matrix
            self._support = lever @ spring.real @ lever.T
            # Accelerations that spring and seed make of the rounding of the TCP's position.
            by_force = np.linalg.solve(self._mass, lever)
            place = 4.0 * np.finfo(float).eps * np.abs(self.numbers.anchor.real).max()
            self._rounding = [
                place * np.abs(by_force @ part).max(initial=0.0)
                for part in (spring.real, spring.imag)
            ]
        slope = np.diag(self.slope(self.x).real) + self._support
        matrix = np.kron(np.eye(STAGES), self._mass) + h * np.kron(ONCE, self._damping)
        return np.linalg.inv(matrix + h * h * np.kron(TWICE, slope))

    def _position(self, direction: np.ndarray) -> np.ndarray:
        """Derivative of the TCP's position along a direction of x, where the flow is now."""
        real = Numbers(**{name: value.real for name, value in vars(self.numbers).items()})
        zero = np.zeros(len(self.x))
        motion = np.array([self.x.real + 1j * STEP * direction, zero, zero])
        at = changed(real, drives=self.drives(self.time.real).real, motion=motion)
        return derivative(evaluate(self.robot, at).position)

    def _solve(self, h: complex, a: np.ndarray, inverse: np.ndarray) -> np.ndarray | None:
        last = np.inf
        for passes in range(40):
            x = self.x + h * NODES[:, None] * self.v + h * h * TWICE @ a
            v = self.v + h * ONCE @ a
            r = self.residual(self.time + h * NODES, x, v, a)
            step = (inverse @ np.ravel(r)).reshape(a.shape)
            a = a - step
            sizes = [
                np.abs(part(step)).max() / (np.abs(part(a)).max() + 1e-300)
                for part in (np.real, np.imag)
            ]
            if max(sizes) < 1e-13 or (passes > 4 and last <= max(sizes) < 1e-11):
                return a
            last = max(sizes)
        return None

    def _leaves(self, h: float, a: np.ndarray) -> tuple[float, int, int] | None:
        """The first dense point at which a coordinate is off its piece: place, coordinate, side."""
        x = (self.x + h * DENSE[:, None] * self.v + h * h * DENSE_TWICE @ a).real
        first = None
        for k, edges in enumerate(self.knots):
            low = edges[self.piece[k] - 1] if self.piece[k] > 0 else -np.inf
            high = edges[self.piece[k]] if self.piece[k] < len(edges) else np.inf
            off = np.flatnonzero((x[:, k] < low - 1e-15) | (x[:, k] > high + 1e-15))
            if len(off) and (first is None or DENSE[off[0]] < first[0]):
                first = (DENSE[off[0]], k, 1 if x[off[0], k] > high else -1)
        return first

    def _take(self, h: complex, a: np.ndarray) -> None:
        self.x = self.x + h * self.v + h * h * END_TWICE @ a
        self.v = self.v + h * END_ONCE @ a
        self.time = self.time + h
        self.steps += 1

    def run(self, end: float) -> None:
        """Integrate to a time."""
        h = FIRST
        while end - self.time.real > 1e-15:
            h = min(h, end - self.time.real)
            reaches = h == end - self.time.real
            length = end - self.time if reaches else h  # the end is where it is: real
            inverse = self._matrix(h)
            a = self._solve(length, np.zeros((STAGES, len(self.x)), complex), inverse)
            if a is None or not self._resolved(h, a):
                h *= 0.5
                assert h > 1e-9
                continue
            leaves = self._leaves(h, a)
            if leaves is None:
                self._take(length, a)
                h *= 1.6
                continue
            place, k, side = leaves
            edge = self.knots[k][self.piece[k] - (side < 0)]
            length = complex(place * h)
            for _ in range(12):
                inverse = self._matrix(length.real)
                a = self._solve(length, np.zeros_like(a), inverse)
                x = self.x + length * self.v + length**2 * END_TWICE @ a
                v = self.v + length * END_ONCE @ a
                length = length - (x[k] - edge) / v[k]
            self._take(length, self._solve(length, a, inverse))
            self.piece[k] += side
            self.crossings += 1
            h = FIRST

    def _resolved(self, h: float, a: np.ndarray) -> bool:
        """Whether what the polynomial leaves out matters to x and x', or to their derivatives."""
        tail, rate = (_FIT @ a)[-2:], self.v + h * END_ONCE @ a
        return all(
            h * np.abs(part(tail)).max() <= RESOLVED * np.abs(part(rate)).max() + h * rounding
            for part, rounding in zip((np.real, np.imag), self._rounding, strict=True)
        )

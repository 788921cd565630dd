"""Errors of the model's derivatives against complex steps through the independent model.

`python tests/helpers/derivative_errors.py` prints the largest over 300 random robots and states, as
docs/derivatives.md says.  Every error is that of one random directional derivative per argument,
relative to its largest term, so that a wrong sign, a permuted column or a missing term shows.
"""

from collections.abc import Iterator

import numpy as np
from complex_robot import (
    Numbers,
    acceleration,
    along,
    changed,
    derivative,
    evaluate,
    residual,
    small_rotation,
)
from random_robots import make_robot

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.linearisation import linearise
from elastic_robot.parameters import Parameters
from elastic_robot.residual import OperatingPoint, free_acceleration, residual_derivatives
from elastic_robot.static_sensitivity import static_sensitivities
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import ToolLoad, symmetric
from elastic_robot.torque_curves import TORQUE_CURVES

LOADS = ("wrench", "anchor", "spring")
PARAMETERS = ("gravity", "stiffness", "damping", "backlash")
# What is zero in theory is rounding of torques of some 1e4 N m here; compared with 1 N m.
ROUNDING_FLOOR = 1.0


def random_spring(rng: np.random.Generator) -> np.ndarray:
    """Return a stiffness of rank 1 to 3, 1 to 1e8 N/m, as its entries xx xy xz yy yz zz, (6,)."""
    axes = rng.normal(size=(rng.integers(1, 4), 3))
    stiffness = sum(10.0 ** rng.uniform(0.0, 8.0) * np.outer(a, a) / (a @ a) for a in axes)
    return stiffness[np.triu_indices(3)]


class Case:
    """A random robot in a random state, as the project's model and as the independent one.

    In every other one a spring of rank 1 to 3, 1 to 1e8 N/m, holds the TCP some millimetres off.
    """

    def __init__(self, robot: Robot, curve: str, seed: int) -> None:
        self.robot, self.name = robot, curve
        self.rng = rng = np.random.default_rng(seed)
        self.parameters = parameters = Parameters.of(robot)
        self.chain = build_chain(robot)
        self.dynamics = Dynamics(self.chain, parameters.gravity)
        self.curve = TORQUE_CURVES[curve].build(parameters)
        n, m = self.chain.joint_count, self.chain.elastic_count
        drives = rng.normal(size=(3, n)) * [[1.5], [1.0], [5.0]]
        # Deflections on both sides of a backlash of 1e-4 rad and inside it.
        motion = rng.normal(size=(3, m)) * [[2e-4], [0.1], [10.0]]
        wrench = rng.normal(size=6) * [1e3, 1e3, 1e3, 1e2, 1e2, 1e2]
        values = (parameters.gravity, parameters.stiffness, parameters.damping, parameters.backlash)
        free = Numbers(drives, motion, wrench, *values)
        anchor = evaluate(robot, free).position.real + 3e-3 * rng.normal(size=3)
        spring = random_spring(rng) * (seed % 2)
        self.numbers = changed(free, anchor=anchor, spring=spring)
        acting = ToolLoad(wrench, anchor, symmetric(spring))
        errors = self.chain.kinematic_errors
        self.at_output, self.by_motor = errors.at_output(drives), errors.gradient(drives)
        self.slope = errors.slope(drives[0])
        self.point = OperatingPoint(self.at_output, motion, acting, self.curve.region(motion[0]))
        self.directions = {
            name: rng.normal(size=value.shape) for name, value in vars(self.numbers).items()
        }
        self.directions["backlash"] *= self.chain.elastic_tilt == 0  # a tilt has none to change

    def model(self) -> tuple:
        return self.dynamics, self.curve, self.parameters.damping, self.point

    def column_changes(self, key: str) -> np.ndarray:
        """The direction of one kind of parameter in the order of `parameter_names`, (p,)."""
        kept = {name: self.directions[name] * (name == key) for name in PARAMETERS}
        kept["backlash"] = kept["backlash"][self.chain.torsions]
        return np.concatenate([kept[name] for name in PARAMETERS])


def error(
    matrix: np.ndarray, change: np.ndarray, expected: np.ndarray, floor: float = 1e-300
) -> float:
    """Return |matrix change - expected| relative to the largest term of the product."""
    terms = np.abs(matrix * change).max(initial=0.0)
    difference = np.abs(matrix @ change - expected).max(initial=0.0)
    return float(difference / (terms + floor))


def residual_errors(case: Case) -> Iterator[tuple[str, float]]:
    """By x, x', x'', q, q', q'', wrench, anchor, spring and the four kinds of parameters."""
    by = residual_derivatives(*case.model()).by_motors(case.by_motor)
    numbers = case.numbers

    def expected(**directions: np.ndarray) -> np.ndarray:
        return derivative(residual(case.robot, case.name, along(numbers, **directions)))

    for name, matrices in (
        ("motion", (by.x, by.rate, by.acceleration)),
        ("drives", (by.drive, by.drive_rate, by.drive_acceleration)),
    ):
        for row, matrix in enumerate(matrices):
            change = np.zeros_like(case.directions[name])
            change[row] = case.directions[name][row]
            truth = expected(**{name: change})
            yield "state and drives", error(matrix, change[row], truth, ROUNDING_FLOOR)
    for key in LOADS:
        change = case.directions[key]
        truth = expected(**{key: change})
        # By the spring it is lever arms of some metres times a distance, rounded as they are.
        floor = 1e-2 if key == "spring" else 1e-300
        yield key, error(getattr(by, key), change, truth, floor)
    for key in PARAMETERS:
        truth = expected(**{key: case.directions[key]})
        yield key, error(by.parameters.values, case.column_changes(key), truth)


def state_space_errors(case: Case) -> Iterator[tuple[str, float]]:
    """Of x'' and of the TCP's pose and velocity, in motion, along one change of states and inputs."""
    x, rate, _ = case.point.motion
    carried = case.curve.torque(x) + case.parameters.damping * rate
    case.point.motion[2] = free_acceleration(
        case.dynamics, case.point.drives, x, rate, case.point.acting, carried
    )
    a, b, c, d = linearise(*case.model()).by_motors(case.by_motor).state_space
    m, directions = case.chain.elastic_count, case.directions
    moved = along(
        case.numbers,
        motion=directions["motion"] * [[1.0], [1.0], [0.0]],
        drives=directions["drives"],
        wrench=directions["wrench"],
    )
    change = np.concatenate(
        [directions["motion"][:2].ravel(), directions["wrench"], directions["drives"].ravel()]
    )
    truth = derivative(acceleration(case.robot, case.name, moved))
    yield "A, B", error(np.hstack([a, b])[m:], change, truth)
    tcp = evaluate(case.robot, moved)
    truth = np.concatenate(
        [
            derivative(tcp.position),
            small_rotation(tcp.rotation),
            derivative(tcp.velocity),
            derivative(tcp.spin),
        ]
    )
    yield "C, D", error(np.hstack([c, d]), change, truth)


def rest(case: Case) -> np.ndarray:
    """Return the equilibrium x of the case's drives and wrench, (m,)."""
    return equilibrium(case.dynamics, case.curve, case.at_output[0], case.point.acting)


def engaged(case: Case, x: np.ndarray) -> bool:
    """Every gear carries load, clear of the edge of its backlash: there the sensitivities are exact."""
    carries = np.abs(case.curve.torque(x)) > 1.0
    clear = case.curve.region(1.01 * x) == case.curve.region(0.99 * x)
    return bool(np.all(carries & clear))


def static_errors(case: Case, x: np.ndarray) -> Iterator[tuple[str, float]]:
    """Of the equilibrium, found anew by Newton's method in complex arithmetic, and of the TCP there."""
    q, u, acting = case.numbers.drives[0], case.at_output[0], case.point.acting
    by = static_sensitivities(case.dynamics, case.curve, u, x, acting).by_motors(case.slope)
    numbers = changed(case.numbers, drives=np.array([q, 0 * q, 0 * q]))
    stiffness = np.diag(case.curve.slope(x)) - case.dynamics.static_torque_gradient(
        case.chain.theta(u, x), acting
    )
    for key in (*LOADS, "drives", *PARAMETERS):
        change = case.directions[key] * ([[1.0], [0.0], [0.0]] if key == "drives" else 1.0)
        at, moved = x, along(numbers, **{key: change})
        for _ in range(4):
            moved = changed(moved, motion=np.array([at, 0 * at, 0 * at]))
            at = at - np.linalg.solve(stiffness, residual(case.robot, case.name, moved))
        tcp = evaluate(case.robot, changed(moved, motion=np.array([at, 0 * at, 0 * at])))
        pose = np.append(derivative(tcp.position), small_rotation(tcp.rotation))
        for of, truth in ((by.x, derivative(at)), (by.tcp, pose)):
            if key in PARAMETERS:
                yield key, error(of.parameters.values, case.column_changes(key), truth)
            elif key == "drives":
                yield key, error(of.drives, change[0], truth)
            else:
                yield key, error(getattr(of, key), change, truth)


def main() -> None:
    worst: dict[str, float] = {}

    def note(title: str, errors: Iterator[tuple[str, float]]) -> None:
        for name, value in errors:
            key = f"{title}: {name}"
            worst[key] = max(worst.get(key, 0.0), value)

    for seed in range(300):
        curve = sorted(TORQUE_CURVES)[seed % len(TORQUE_CURVES)]
        case = Case(make_robot(seed, 1 + seed % 8), curve, seed)
        note("residual", residual_errors(case))
        x = rest(case)
        if engaged(case, x):
            note("equilibrium", static_errors(case, x))
        note("linear robot", state_space_errors(case))
    for key, value in worst.items():
        print(f"{key:32s} {value:.0e}")


if __name__ == "__main__":
    main()

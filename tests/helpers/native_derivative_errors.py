"""Errors of the native FMU's directional derivatives against the independent model.

`python tests/helpers/native_derivative_errors.py 84 1e-12` prints the largest over 84 random robots, at
this tolerance, as docs/native.md says.  Errors are those of one random directional derivative of
all outputs, relative to the largest entry of each block of outputs.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from complex_robot import (
    STEP,
    Answer,
    Numbers,
    along,
    changed,
    derivative,
    evaluate,
    rodrigues,
    small_rotation,
)
from flow_derivative import Flow, knots, piece_slope
from native_derivatives import (
    CURVES,
    SEEDS,
    SPRING_SEEDS,
    Case,
    Found,
    make_case,
    make_sprung_case,
    through_fmu,
)

from elastic_robot.chain import build_chain
from elastic_robot.parameters import Parameters


def numbers_of(case: Case) -> Numbers:
    """The inputs as the independent model takes them, moved an imaginary step along the seed."""
    n, p = len(case.robot.joints), Parameters.of(case.robot)
    none = np.zeros((3, len(p.stiffness)))
    parts = np.cumsum([6, 3 * n, 3, 3])
    wrench, drives, *spring = np.split(case.inputs, parts)
    wrench_seed, drives_seed, *spring_seed = np.split(case.seed, parts)
    names = ("anchor", "anchor_velocity", "spring")
    given = Numbers(
        *(drives.reshape(3, n), none, wrench),
        *(p.gravity, p.stiffness, p.damping, p.backlash),
        **dict(zip(names, spring, strict=True)),
    )
    seeds = dict(zip(names, spring_seed, strict=True))
    return along(given, drives=drives_seed.reshape(3, n), wrench=wrench_seed, **seeds)


def rest(case: Case, numbers: Numbers, x: np.ndarray) -> np.ndarray:
    """Return the equilibrium near x in complex arithmetic; a gear amid its backlash stays."""
    zero = np.zeros_like(x)
    drives = np.array([numbers.drives[0], 0.0 * numbers.drives[0], 0.0 * numbers.drives[0]])
    flow = Flow(case.robot, case.curve, changed(numbers, drives=drives), x, zero)
    free = (x != 0.0) | np.array([len(edges) == 0 for edges in flow.knots])
    stiffness = _softening(case, numbers, x) + np.diag(flow.slope(x).real)
    at = x.astype(complex)
    for _ in range(6):
        r = flow.residual(0.0, at, zero, zero)
        at[free] -= np.linalg.solve(stiffness[np.ix_(free, free)], r[free])
    return at


def _loads(case: Case, numbers: Numbers, x: np.ndarray) -> Answer:
    none, q = np.zeros_like(x), numbers.drives[0]
    drives, motion = np.array([q, 0.0 * q, 0.0 * q]), np.array([x, none, none])
    return evaluate(case.robot, changed(numbers, drives=drives, motion=motion))


def _softening(case: Case, numbers: Numbers, x: np.ndarray) -> np.ndarray:
    """-d(static torque)/dx of the real parts, by complex steps."""
    real = Numbers(**{name: value.real for name, value in vars(numbers).items()})
    columns = [derivative(_loads(case, real, x.real + 1j * STEP * e).loads) for e in np.eye(len(x))]
    return np.array(columns).T.reshape(len(x), len(x))


def compliance_along(case: Case, numbers: Numbers, x: np.ndarray) -> np.ndarray:
    """Derivative of J K^-1 J^T: columns of dK and dJ by real differences of complex steps."""
    m, h = len(x), 2e-3
    curve, parameters = case.curve, Parameters.of(case.robot)
    slope, bend = np.zeros(m), np.zeros(m)
    for k, (stiffness, b) in enumerate(zip(parameters.stiffness, parameters.backlash, strict=True)):
        edges = knots(curve, b)
        piece = int(np.searchsorted(edges, x[k].real))
        law = piece_slope(len(edges) + 1, piece, x[k], stiffness, b)
        # Inside its backlash a gear counts with the flank beyond.
        slope[k], bend[k] = (law.real, derivative(law)) if law.real > 0.0 else (stiffness, 0.0)
    by, by_along = _softening(case, numbers, x), np.zeros((m, m))
    lever, lever_along = np.zeros((3, m)), np.zeros((3, m))
    weights = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
    real = Numbers(**{name: value.real for name, value in vars(numbers).items()})
    for j, e in enumerate(np.eye(m)):
        lever[:, j] = derivative(_loads(case, real, x.real + 1j * STEP * e).position)
        for f, weight in weights.items():
            answer = _loads(case, numbers, x + f * h * e)
            by_along[:, j] += weight / h * derivative(answer.loads)
            lever_along[:, j] += weight / h * derivative(answer.position)
    inverse = np.linalg.inv(by + np.diag(slope))
    change = lever_along @ inverse @ lever.T + lever @ inverse @ lever_along.T
    change -= lever @ inverse @ (by_along + np.diag(bend)) @ inverse @ lever.T
    return change[[0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]


def _turn_of_quaternion(q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    x, y, z, w = q + 1j * STEP * dq
    rotation = np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
    return small_rotation(rotation)


def _turn_of_vector(r: np.ndarray, dr: np.ndarray) -> np.ndarray:
    if not r.any():
        return dr
    vector = r + 1j * STEP * dr
    angle = np.sqrt(vector @ vector)
    return small_rotation(rodrigues(vector / angle, angle))


def errors(case: Case, found: Found) -> tuple[dict[str, float], Flow | None]:
    """Largest error of each block, relative to its largest derivative."""
    numbers = numbers_of(case)
    quasistatic, flow = case.mode == "quasistatic", None
    if case.length > 0.0 and not quasistatic and len(found.x):
        flow = Flow(case.robot, case.curve, numbers, found.x, np.zeros_like(found.x))
        flow.run(case.length)
        x, v = flow.x, flow.v
    else:
        x = v = np.zeros(len(found.x))
    anchor = numbers.anchor + case.length * numbers.anchor_velocity
    held = changed(numbers, drives=_drives_at(numbers, case.length), anchor=anchor)
    if quasistatic or case.length == 0.0:
        v = np.zeros(len(x))
        if len(x) and (case.initial_state == "equilibrium" or case.length > 0.0):
            x = rest(case, held, found.values["deflection"])
    elastic = evaluate(case.robot, changed(held, motion=np.array([x, v, 0 * x])))
    rigid = evaluate(case.robot, changed(held, motion=np.zeros((3, len(x)))))
    of, at = found.derivatives, found.values
    turn, rigid_turn = small_rotation(elastic.rotation), small_rotation(rigid.rotation)
    deviation = elastic.position - rigid.position
    between = small_rotation(elastic.rotation @ rigid.rotation.T)
    moving = rigid if quasistatic else elastic
    pairs = {
        "tcp": (of["tcp"][:3], derivative(elastic.position)),
        "tcp turn": (_turn_of_quaternion(at["tcp"][3:], of["tcp"][3:]), turn),
        "velocity": (of["velocity"][:3], derivative(moving.velocity)),
        "velocity turn": (of["velocity"][3:], derivative(moving.spin)),
        "rigid": (of["rigid"][:3], derivative(rigid.position)),
        "rigid turn": (_turn_of_quaternion(at["rigid"][3:], of["rigid"][3:]), rigid_turn),
        "deviation": (of["deviation"][:3], derivative(deviation)),
        "deviation turn": (_turn_of_vector(at["deviation"][3:], of["deviation"][3:]), between),
        "motor_angle": (of["motor_angle"], derivative(held.drives[0])),
        "motor_rate": (of["motor_rate"], derivative(held.drives[1])),
    }
    if len(x):
        pairs["deflection"] = (of["deflection"], derivative(x))
        pairs["deflection_rate"] = (of["deflection_rate"], derivative(v))
        pairs["compliance"] = (of["compliance"], compliance_along(case, held, x))
        torque = Flow(case.robot, case.curve, held, x, v).torque(x, v)
        gears = derivative(-torque)[build_chain(case.robot).torsions]
        pairs |= {name: (of[name], gears) for name in ("gear_torque", "motor_torque") if name in of}
        pairs["contact_force"] = (of["contact_force"], np.zeros(3))
        untold = set(of) - {name.split()[0] for name in pairs}
        assert not untold, f"{untold}: expected what their derivatives should be, among these pairs"
    # A difference of two nearly equal motions is rounding of these; what is zero is rounding of all.
    whole = {"deviation": "tcp", "deviation turn": "tcp turn"}
    result = {}
    for name, (one, two) in pairs.items():
        scale = np.abs(two).max() + (1e-18 if name == "compliance" else 1e-12)
        if name in whole:
            scale = max(scale, 1e-6 * np.abs(pairs[whole[name]][1]).max())
        result[name] = float(np.abs(one - two).max() / scale)
    return result, flow


def _drives_at(numbers: Numbers, time: float) -> np.ndarray:
    q, qd, qdd = numbers.drives
    return np.array([q + time * qd + 0.5 * time * time * qdd, qd + time * qdd, qdd])


def numbered(number: int, sprung: bool, tolerance: float) -> Case:
    """The case of a number, on a spring or not: curves, seeds and kinds of steps take turns."""
    curve, joints = CURVES[number % 3], 1 + number % 8
    mode = "quasistatic" if number % 7 == 6 else "dynamic"
    length = 0.0 if number % 7 == 5 else 0.004
    if sprung:
        seeds = SPRING_SEEDS[number // 3 % 4]
        return make_sprung_case(number, joints, curve, mode, length, seeds, tolerance)
    return make_case(number, joints, curve, mode, length, SEEDS[number % 5], tolerance)


def main() -> None:
    """Print the largest error of each kind of case, the curves' knots passed or not."""
    count, tolerance, sprung = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3:] == ["springs"]
    worst: dict[str, float] = {}
    for number in range(count):
        case = numbered(number, sprung, tolerance)
        with tempfile.TemporaryDirectory() as folder:
            found = through_fmu(case, Path(folder))
        if len(found.x) == 0:
            continue  # rigid: nothing but rounding
        relative, flow = errors(case, found)
        kind = "equilibrium" if flow is None else f"{case.curve}, {min(flow.crossings, 1)} passages"
        worst[kind] = max(worst.get(kind, 0.0), *relative.values())
        print(f"{number:4d} {kind:24s} {max(relative.values()):.1e}", file=sys.stderr, flush=True)
    for key, value in sorted(worst.items()):
        print(f"{key:24s} {value:.0e}")


if __name__ == "__main__":
    main()

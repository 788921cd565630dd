"""What a deviation beyond the model may be: the causes it follows, with their shares.

Each cause moves the tool in its own way along the path: hysteresis and friction by the direction in
which a joint turns, kinematic errors of a gear by the joint's angle, wind-up by the gear's torque,
geometry by the place, heat by the time.  They are taken one after the other, the one that explains most
first (orthogonal matching pursuit [Pati1993]), as long as one explains more than chance does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.identification.next.deviation_size import signal_filter
from coupling.identification.next.history import History
from coupling.identification.next.smoother import Smoother
from coupling.identification.runs.measurement import SimulatedPath
from coupling.inverse.link_model import LinkModel
from coupling.path.linear import interpolated

# A cause explains at least this part of the mean square that is left, and is this large [m].
_WORTH, _LEAST = 0.1, 2e-6
# Causes at most.
_MOST = 6
# Turn of a joint over which hysteresis comes to its other side: half of it [rad].
_REVERSAL = 2e-5
# Waves a turn that are looked for: behind a gear of 1:250 the motor turns as often.
_WAVES = np.arange(4.0, 300.5, 0.5)
# What no parameter of the model explains.
_NO_PARAMETER = ("turn", "direction", "time")
# Waves along the path at least, else it is not distinguishable from geometry; rows that are compared.
_FEWEST_WAVES, _ROWS = 1.0, 1500


@dataclass(frozen=True)
class Cause:
    """A cause, and what it moves the tool by.

    Attributes:
        kind: "constant", "direction", "turn", "torque", "position", "time" or "rest".
        joint: Number of the joint, from 1; 0 where it is none's.
        size: Rms of what it moves the tool by [m].
        waves: Periods a turn of the joint, of "turn"; 0 of others.
        time: Times at which it is given [s], (k,).
        moved: Displacement of the tool by it at these times [m], (k, 3).
    """

    kind: str
    joint: int
    size: float
    waves: float
    time: np.ndarray
    moved: np.ndarray

    def __str__(self) -> str:
        """Its sentence."""
        words = {
            "constant": "a constant (frame, part, or sag of the robot)",
            "direction": f"direction of rotation of joint {self.joint} (hysteresis or friction)",
            "turn": f"angle of joint {self.joint}, {self.waves:g} periods per turn (kinematic error of"
            " its gear)",
            "torque": f"torque in the gear of joint {self.joint} (its stiffness)",
            "position": "position (geometry of robot or frame)",
            "time": "time (heat, or drift of the measuring device)",
            "rest": "none of these (gears in their backlash, vibration modes, random errors)",
        }
        return f"{1e6 * self.size:.3g} um rms: {words[self.kind]}"


@dataclass(frozen=True)
class _Group:
    """Ways in which a cause moves the tool, (rows, coordinates, columns)."""

    kind: str
    joint: int
    columns: np.ndarray
    waves: float = 0.0


def causes(history: History, x: np.ndarray, number: int) -> tuple[Cause, ...]:
    """Return what the deviation of a measured run beyond a model follows, the largest first.

    Args:
        history: The measured runs.
        x: Log factors of the model [1], (P,).
        number: Number of the measured run, from 0.
    """
    run = history.runs[number]
    beyond = history.beyond(number, x)[:, :3]
    low = signal_filter(run.measured.time)
    slow = low(beyond)
    every = max(1, len(low.time) // _ROWS)
    rows = np.arange(0, len(low.time), every)
    time, off = low.time[rows], slow[rows]
    constant = off.mean(axis=0)
    rest = off - constant
    of_noise = 3.0 * run.noise**2 * low.of_noise
    found: list[Cause] = []
    chosen: list[_Group] = []
    groups = [own for own in _groups(history, number, low, rows) if np.any(own.columns)]
    left = rest
    while len(chosen) < _MOST:
        gains = [_explained(own.columns, left) for own in groups]
        best = int(np.argmax(gains))
        before = float(np.mean(np.sum(left**2, axis=1)))
        independent = 2.0 * low.cutoff * float(np.ptp(time))
        columns = groups[best].columns.shape[2]
        # A column that has nothing to do with it explains one of the numbers that are independent; a
        # frequency that is looked for is the best of many.
        chance = of_noise * columns * (3.0 if groups[best].kind != "turn" else 12.0) / independent
        if gains[best] < max(_WORTH * before, _LEAST**2, chance):
            break
        chosen.append(groups[best])
        every_column = np.concatenate([own.columns for own in chosen], axis=2)
        flat = every_column.reshape(-1, every_column.shape[2])
        weights = np.linalg.lstsq(flat, rest.reshape(-1), rcond=1e-8)[0]
        left = rest - (flat @ weights).reshape(rest.shape)
    if chosen:
        parts = np.split(weights, np.cumsum([own.columns.shape[2] for own in chosen])[:-1])
        for own, part in zip(chosen, parts, strict=True):
            moved = own.columns @ part
            size = float(np.sqrt(np.mean(np.sum(moved**2, axis=1))))
            found.append(Cause(own.kind, own.joint, size, own.waves, time, moved))
    square = float(np.mean(np.sum(left**2, axis=1))) - of_noise
    size = float(np.linalg.norm(constant))
    found += [
        Cause("constant", 0, size, 0.0, time, np.broadcast_to(constant, left.shape)),
        Cause("rest", 0, float(np.sqrt(max(square, 0.0))), 0.0, time, left),
    ]
    return tuple(sorted(found, key=lambda own: -own.size))


def _explained(columns: np.ndarray, left: np.ndarray) -> float:
    """Return the mean square that columns (n, c, p) explain of what is left, (n, c)."""
    flat, wanted = columns.reshape(-1, columns.shape[2]), left.reshape(-1)
    gram, right = flat.T @ flat, flat.T @ wanted
    scale = np.sqrt(np.maximum(gram.diagonal(), 1e-30))
    solved = np.linalg.lstsq(gram / scale[:, None] / scale, right / scale, rcond=1e-9)[0]
    return float((right / scale) @ solved) / len(left)


def _groups(history: History, number: int, low: Smoother, rows: np.ndarray) -> list[_Group]:
    """Return every cause that is looked for, less its own constant."""
    run = history.runs[number]
    stored, source = run.source.stored, run.source
    model = LinkModel(source.robot)
    command = stored.joints
    nodes = low.time[rows]
    at = np.clip(nodes, command.time[0], command.time[-1])
    drives = CubicSpline(command.time, command.q[0])
    q = drives(at)
    theta = np.array([model.chain.theta(own) for own in q])
    still = np.zeros_like(theta)
    wrench = stored.wrench.at(np.clip(at, stored.wrench.time[0], stored.wrench.time[-1]))[0]
    state, by = model.linearised(theta, still, still, wrench)
    arms = by.jacobian[:, :3][:, :, model.chain.drive]
    place = SimulatedPath(run.desired).position(nodes)
    span = (nodes - nodes.mean()) / float(np.ptp(nodes))
    found = [
        _Group("time", 0, np.stack([span[:, None, None] * np.eye(3)], axis=0)[0]),
        _Group("position", 0, _kronecker(place - place.mean(axis=0))),
    ]
    fine = drives(np.clip(low.time, command.time[0], command.time[-1]))
    for joint in range(arms.shape[2]):
        arm = arms[:, :, joint]
        side = _side(fine[:, joint])[rows]
        found.append(_Group("direction", joint + 1, (arm * side[:, None])[:, :, None]))
        if joint in model.gear_joint.tolist():
            torque = state.load[:, model.chain.drive[joint]]
            found.append(_Group("torque", joint + 1, (arm * torque[:, None])[:, :, None]))
        found += _turns(arm, q[:, joint], joint + 1)
    return [
        _Group(own.kind, own.joint, own.columns - own.columns.mean(axis=0), own.waves)
        for own in found
    ]


def _kronecker(place: np.ndarray) -> np.ndarray:
    """Return what every coordinate of a place does to every coordinate, (n, 3, 9)."""
    columns = np.einsum("nk,ab->nabk", place, np.eye(3))
    return columns.reshape(len(place), 3, 9)


def _side(angle: np.ndarray) -> np.ndarray:
    """Return on which side of its hysteresis a joint is, -1 to 1, (n,): a play operator of its angle."""
    behind = np.empty(len(angle))
    behind[0] = angle[0]
    for k in range(1, len(angle)):
        behind[k] = min(max(behind[k - 1], angle[k] - _REVERSAL), angle[k] + _REVERSAL)
    return (angle - behind) / _REVERSAL


def _turns(arm: np.ndarray, angle: np.ndarray, joint: int) -> Iterator[_Group]:
    """Yield a joint's kinematic errors, of all waves a turn that show."""
    turned = float(np.ptp(angle)) / (2.0 * np.pi)
    # Samples that are too far apart for a wave do not tell it.
    fastest = 0.2 / max(float(np.abs(np.diff(angle)).max()) / (2.0 * np.pi), 1e-12)
    for waves in _WAVES[(_WAVES * turned >= _FEWEST_WAVES) & (fastest >= _WAVES)]:
        both = np.stack([np.sin(waves * angle), np.cos(waves * angle)], axis=1)
        yield _Group("turn", joint, arm[:, :, None] * both[:, None], float(waves))


def no_parameters(found: Sequence[Cause], time: np.ndarray) -> np.ndarray:
    """Return what the tool is moved by that no stiffness, damping or backlash explains [m], (n, 3).

    Args:
        found: The causes.
        time: Times [s], (n,).
    """
    moved = np.zeros((len(time), 3))
    for own in found:
        if own.kind in _NO_PARAMETER:
            moved += interpolated(time, own.time, own.moved)
    return moved


def largest(found: Sequence[Cause]) -> tuple[Cause, ...]:
    """Return the causes that are at least a twentieth of the largest, the first, and a micrometre."""
    return tuple(own for own in found if own.size >= max(0.05 * found[0].size, 1e-6))

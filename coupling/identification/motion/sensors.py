"""Beside the model: lag, offset, slow error, lines of encoders; torque after a rest, and fast one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.identification.motion.parameters import MotionParameter
from coupling.identification.motion.recording import Recording, SmoothedMotion
from coupling.robot.parameter_table import dry_friction
from elastic_robot.description import Robot

# Slow error of an encoder [rad]: standard deviation of its first harmonic at most, 20 seconds of arc, as
# ring encoders have them once they are mounted, and how many harmonics there are.  That of the k-th is a
# k-th, as of a scale whose error is a random walk along it.
_SLOW, _HARMONICS = 1e-4, 8
# Standard deviation of friction after a rest over dry friction.
_AFTER_REST = 3.0
# Travel [rad] over which friction after a rest wears off by 63 %: 2 to 20 mrad on a KUKA KR 300.
_WEARS_OFF = 5e-3
# Fewest lines in a turn: what is slower may be the gear's.
_FEWEST = 100.0
# A line is one if it takes this part of what is left, in the sum over all recordings.
_TAKES = 0.1
# How many periods of a line a motion must cover; most lines of an encoder.
_PERIODS, _MOST_LINES = 20.0, 2
# Points in a main lobe of the spectrum.
_POINTS = 8


def sensor_parameters(with_link: list[int]) -> tuple[MotionParameter, ...]:
    """Return those of joints whose link's angle is measured, by their indices."""
    parameters, sensor = [], MotionParameter.of_sensor
    for i in with_link:
        place, joint = f"encoder[{i + 1}]", i + 1
        parameters += [
            sensor(f"{place}.lag", f"lag {joint}", i, 1e-3, "s", "lag", prior=10.0),
            sensor(f"{place}.loop", f"loop {joint}", i, 1e-4, "rad", "loop"),
        ]
        parameters += [
            sensor(
                f"{place}.slow_error.{kind}[{k}]",
                f"slow error {joint}",
                i,
                _SLOW / k,
                "rad",
                kind,
                harmonic=k,
            )
            for k in range(1, _HARMONICS + 1)
            for kind in ("cosine", "sine")
        ]
    return tuple(parameters)


def torque_parameters(robot: Robot) -> tuple[MotionParameter, ...]:
    """Return those of the torques of a robot's motors."""
    parameters = []
    for i, joint in enumerate(robot.joints):
        drive = joint.drive
        if drive is None:
            continue
        for name, term, kind, size, unit in (
            ("friction_after_rest", "friction after a rest", "rest", dry_friction(drive)[0], "N m"),
            ("fast.rate_gain", "rate loop", "rate", drive.rate_gain, "N m s/rad"),
            ("fast.inertia", "fast rotor", "inertia", drive.inertia, "kg m^2"),
        ):
            # Where the file has no friction or no rate loop, their size is not known.
            prior = np.inf if size <= 0.0 else _AFTER_REST if kind == "rest" else 1.0
            of_torque = f"motor[{i + 1}].{name}", f"{term} {i + 1}"
            parameters.append(
                MotionParameter.of_sensor(*of_torque, i, max(size, 1.0), unit, kind, prior=prior)
            )
    return tuple(parameters)


def delayed(values: np.ndarray, step: float, lag: float) -> np.ndarray:
    """Return values at equal steps [s] a lag [s] later, any unit, (n,): a spline, held at its ends."""
    rows = np.arange(len(values))
    there = np.clip(rows - lag / step, 0.0, len(values) - 1.0)
    return CubicSpline(rows, values)(there)


def column(parameter: MotionParameter, motion: SmoothedMotion, dry: np.ndarray) -> np.ndarray:
    """Return the wind-up by a sensor's number of 1 [rad], (n,): of a lag, to first order.

    Args:
        parameter: The number.
        motion: Motion of the motors.
        dry: Dry friction of the joint's motor over that of the start's slipping one [1], (n,).
    """
    q = motion.q[:, parameter.joint]
    if parameter.sensor == "lag":
        return motion.qd[:, parameter.joint]
    if parameter.sensor == "cosine":
        return np.cos(parameter.harmonic * q)
    if parameter.sensor == "sine":
        return np.sin(parameter.harmonic * q)
    return dry


def worn(motion: SmoothedMotion, joint: int) -> np.ndarray:
    """Return what friction after a rest is over that at the start [1], (n,): it wears off."""
    q = motion.q[:, joint]
    travel = np.cumsum(np.abs(np.diff(q, prepend=q[0])))
    return np.exp(-travel / _WEARS_OFF)


def torque_column(
    parameter: MotionParameter, motion: SmoothedMotion, part: np.ndarray, step: float
) -> np.ndarray:
    """Return the motor's torque by a number of 1 that adds to it [N m], (n,).

    After a rest dry friction is larger, and wears off with travel.  What is faster than the bandwidth
    meets the rotor and the rate loop, whose command is slow: J_f r'' - K r' of the fast angle r.

    Args:
        parameter: The number.
        motion: Motion of the motors.
        part: Friction of the joint's motor over its largest [1], (n,).
        step: Step of time [s].
    """
    if parameter.sensor == "rest":
        return part * worn(motion, parameter.joint)
    fast = np.pad(motion.fast[:, parameter.joint], 1, mode="edge")
    if parameter.sensor == "rate":  # as a loop of this step sees it
        return np.asarray((fast[:-2] - fast[1:-1]) / step)
    return np.asarray((fast[2:] - 2.0 * fast[1:-1] + fast[:-2]) / step**2)


def fitted_columns(recording: Recording, joint: int, lines: tuple[float, ...]) -> np.ndarray:
    """Return the wind-up by 1 rad of a recording's own offset and lines [1], (n, 1 + 2 l).

    The offset's column comes first, then cosine and sine of every line.

    Args:
        joint: Index of the joint.
        lines: Numbers of periods in a turn of the link.
    """
    angle = recording.link[:, joint]
    columns = [np.ones(len(angle))]
    for line in lines:
        columns += [np.cos(line * angle), np.sin(line * angle)]
    return np.column_stack(columns)


def encoder_lines(
    residuals: Sequence[np.ndarray], angle: Sequence[np.ndarray]
) -> tuple[float, ...]:
    """Return the numbers of periods in a turn that what is left of wind-ups has.

    An incremental encoder's scale begins anywhere in each recording, so that every recording has a phase
    of its own; the number must be the same.

    Args:
        residuals: Measured less predicted wind-up in each recording [rad], (n,) each.
        angle: Angles of the link [rad], (n,) each.

    Example:
        >>> turn = np.sin(np.linspace(0.0, 6.0, 4000))
        >>> encoder_lines([2e-5 * np.cos(512.0 * turn + 1.0)], [turn])
        (512.0,)
    """
    travel = max(float(np.ptp(values)) for values in angle)
    if travel <= 0.0:
        return ()
    # Two samples a period where the link turns fastest.
    fastest = max(float(np.abs(np.diff(values)).max()) for values in angle)
    lowest = max(_FEWEST, 2.0 * np.pi * _PERIODS / travel)
    tried = np.arange(lowest, np.pi / fastest, 2.0 * np.pi / travel / _POINTS)
    remaining = [values - values.mean() for values in residuals]
    lines: list[float] = []
    while len(tried) and len(lines) < _MOST_LINES:
        takes = _explained(remaining, angle, tried)
        best = float(tried[int(np.argmax(takes))])
        step = tried[1] - tried[0] if len(tried) > 1 else 1.0
        near = best + step * np.linspace(-1.0, 1.0, 41)
        near_takes = _explained(remaining, angle, near)
        best = round(float(near[int(np.argmax(near_takes))]), 1)
        if near_takes.max() < _TAKES:
            break
        lines.append(best)
        remaining = [
            values - _fit_line(values, best * turn)
            for values, turn in zip(remaining, angle, strict=True)
        ]
    return tuple(lines)


def _explained(
    residuals: Sequence[np.ndarray], angle: Sequence[np.ndarray], lines: np.ndarray
) -> np.ndarray:
    """Return the part of the squares that each of lines in equal steps takes, (len(lines),)."""
    whole = sum(float(values @ values) for values in residuals)
    parts = np.zeros(len(lines))
    # exp(i (l + k d) q) is a product, of every few-th line's and of that of few steps.
    few = round(np.sqrt(len(lines)))
    coarse, fine = lines[::few, None], lines[:few, None] - lines[0]
    for values, turn in zip(residuals, angle, strict=True):
        sums = (np.exp(1j * coarse * turn) * values) @ np.exp(1j * fine * turn).T
        parts += 2.0 * np.abs(sums.ravel()[: len(lines)]) ** 2 / len(values)
    return parts / max(whole, 1e-300)


def _fit_line(residual: np.ndarray, phase: np.ndarray) -> np.ndarray:
    columns = np.column_stack([np.cos(phase), np.sin(phase)])
    return columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]

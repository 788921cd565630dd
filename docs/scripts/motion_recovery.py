"""Recordings of a known robot with noise, quantised encoders and a lag, and how often intervals hold it.

python docs/scripts/motion_recovery.py 200 1: with how many recordings, and the generator's seed.

Links are delayed, both encoders quantised, their noise and that of torques correlated over 20 ms.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from coupling.identification.motion.driven_fmu import DrivenFmu
from coupling.identification.motion.fit import fit_motion
from coupling.identification.motion.parameters import motion_parameters
from coupling.identification.motion.problem import MotionProblem, SmoothedRecording
from coupling.identification.motion.recording import Recording, SmoothedMotion
from coupling.identification.motion.sensors import sensor_parameters
from coupling.inverse.servo import presliding
from coupling.robot.parameters import apply_values
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot
from elastic_robot.drive import Drive

STEP, ROWS, BANDWIDTH = 0.004, 1500, 20.0  # [s], [Hz]
MOTOR_LINE, LINK_LINE = 1e-7, 1e-6  # resolution of the encoders [rad]
LAG, NOISE_LINK, NOISE_TORQUE = 3e-3, 2e-6, 0.02  # [s], [rad], part of the torque's rms
CORRELATION = 0.02  # of the noise [s]


def arm() -> Robot:
    """Return a robot of two joints with drives and a payload."""
    joints = [
        Joint(
            origin=(0.0, 0.0, 0.5 * i),
            axis=(0.0, 1.0, 0.0),
            body=Body(60.0, (0.0, 0.0, 0.25), (4.0, 4.0, 1.0)),
            stiffness=k,
            damping=k * 1e-3,
            drive=Drive(inertia=40.0, position_gain=10.0, rate_gain=1e4, friction=f, viscous=b),
        )
        for i, (k, f, b) in enumerate(((1.5e6, 120.0, 300.0), (8e5, 60.0, 150.0)))
    ]
    payload = Body(40.0, (0.0, 0.0, 0.6), (1.0, 1.0, 1.0))
    return Robot("arm", tuple(joints), payload=payload, tcp_position=(0.0, 0.0, 0.6))


@dataclass(frozen=True)
class Known:
    """A robot that is known, and the start that a fit begins from."""

    robot: Robot
    start: Robot

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Known:
        """Return the arm, and a start that is up to a fifth off in every number."""
        robot = arm()
        numbers = motion_parameters(robot, (0, 1))
        off = {p.name: p.value * rng.uniform(0.8, 1.25) for p in numbers if p.value}
        return cls(robot, apply_values(robot, off))


def recorded(fmu: DrivenFmu, robot: Robot, rng: np.random.Generator) -> Recording:
    """Return a recording of a robot along a random motion."""
    time = STEP * np.arange(ROWS)
    whole = time[-1]
    # Sums of sines that begin and end at rest, as their window does.
    window = np.sin(np.pi * time / whole)[:, None] ** 4
    frequency, phase = rng.uniform(0.15, 0.6, (3, 2)), rng.uniform(0.0, 2 * np.pi, (3, 2))
    waves = np.sin(2 * np.pi * frequency * time[:, None, None] + phase)
    motor = 0.25 * window * waves.sum(axis=1) + rng.uniform(-0.5, 0.5, 2)
    motion = SmoothedMotion.of(motor, STEP, 1e9)
    gears = fmu.simulate(robot, time, motion)
    torque = gears.torque.copy()
    for i, joint in enumerate(robot.joints):
        drive = joint.drive
        assert drive is not None
        part = presliding(motor[:, i], drive.slip_angle, 0.0)
        torque[:, i] += drive.inertia * motion.qdd[:, i] + drive.friction_torque(
            drive.friction, part, motion.qd[:, i], gears.torque[:, i]
        )
    moved = motor + gears.wind_up
    link = CubicSpline(time, moved)(np.maximum(time - LAG, 0.0))
    link += NOISE_LINK * _noise(rng, ROWS, 2) + rng.uniform(-1e-3, 1e-3, 2)
    torque += NOISE_TORQUE * torque.std(axis=0) * _noise(rng, ROWS, 2)
    return Recording(
        "simulated", time, _quantised(motor, MOTOR_LINE), torque, _quantised(link, LINK_LINE)
    )


def errors(fmu: DrivenFmu, rng: np.random.Generator) -> dict[str, float]:
    """Return errors of a fit to one recording over half of its intervals [1], by name."""
    known = Known.drawn(rng)
    moved = SmoothedRecording.of(recorded(fmu, known.robot, rng), BANDWIDTH)
    truth = {p.name: p.value for p in motion_parameters(known.robot, (0, 1))}
    truth |= {f"encoder[{i}].lag": LAG for i in (1, 2)}
    fitted_ = [p for p in motion_parameters(known.start, (0, 1)) if truth[p.name] != 0.0]
    lags = [p for p in sensor_parameters([0, 1]) if p.sensor == "lag"]
    fit = fit_motion(MotionProblem(fmu, known.start, (*fitted_, *lags), (moved,)))
    half = fit.blocks.half * fit.blocks.deviation
    found = zip(fit.problem.parameters, fit.x.tolist(), half.tolist(), strict=True)
    return {p.name: abs(p.inward(truth[p.name]) - x) / h for p, x, h in found}


def every_error(count: int, seed: int = 1) -> dict[str, np.ndarray]:
    """Return the errors of so many recordings over half of their intervals [1], by name.

    The known value is inside its interval where they are below 1.
    """
    rng = np.random.default_rng(seed)
    with DrivenFmu(arm()) as fmu:
        every = [errors(fmu, rng) for _ in range(count)]
    return {name: np.array([one[name] for one in every]) for name in every[0]}


def _noise(rng: np.random.Generator, rows: int, columns: int) -> np.ndarray:
    """Return noise of deviation 1, correlated over some time, (rows, columns)."""
    keep = np.exp(-STEP / CORRELATION)
    white = rng.standard_normal((rows + 200, columns))
    coloured = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, axis=0)
    return np.asarray(coloured[200:])


def _quantised(values: np.ndarray, line: float) -> np.ndarray:
    return np.round(values / line) * line


if __name__ == "__main__":
    for own, found_ in every_error(*map(int, sys.argv[1:])).items():
        print(f"{own}: {100.0 * np.mean(found_ < 1.0):.1f} %")

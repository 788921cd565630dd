"""A KUKA KR 300 in motion: motor torques of its recorded motion, by the shipped file.

The motors' measured motion moves the FMU, whose motors follow it exactly; what they need for that is
compared with what was measured. Friction of the file is from recording A, so that A is a fit in this one
respect, and B is predicted. The data: examples/measured/kuka_kr300.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import butter, sosfiltfilt

from coupling.files.robot_file import find_robot, load_robot, robot_numbers
from coupling.fmu.job import SimulationJob
from docs.scripts.page import table
from docs.scripts.trust_comparison import Against, Comparison
from docs.scripts.trust_fmu import answers
from elastic_robot.description import Robot

DATA = Path(__file__).parents[2] / "examples" / "measured" / "kuka_kr300"
# Encoders' noise is some 1 urad; twice derived, of a rotor that counts 600 kg m2, it is 40 N m at 10 Hz.
CUTOFF = 10.0  # [Hz]
_AXES = range(1, 7)


@dataclass(frozen=True)
class Recording:
    """A motion as the motors made it, without what is faster than CUTOFF.

    Attributes:
        time: Times [s], (n,).
        angle, rate, acceleration: Of the motors over the gear ratio, drive angles of the file
            [rad, rad/s, rad/s^2], (n, 6).
        torque: Motor torque at the gear's output [N m], (n, 6).
    """

    time: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    torque: np.ndarray

    @classmethod
    def read(cls, name: str, ratios: np.ndarray) -> Recording:
        """Read "A" or "B", with the gear ratios (6,)."""
        data = np.genfromtxt(DATA / f"recording_{name}.csv", delimiter=",", names=True)
        time = data["time"]
        angle = smooth(np.deg2rad([data[f"motor_{axis}"] for axis in _AXES]).T, time)
        torque = np.column_stack([data[f"motor_torque_{axis}"] for axis in _AXES]) * ratios
        rate = np.gradient(angle, time, axis=0)
        return cls(time, angle, rate, np.gradient(rate, time, axis=0), smooth(torque, time))

    def needed(self, robot: Robot) -> np.ndarray:
        """Return the motor torques that the FMU says this motion needs [N m], (n, 6)."""
        motion = np.column_stack([self.time, self.angle, self.rate, self.acceleration])
        head = ",".join(["time", *(f"{key}{axis}" for key in ("q", "qd", "qdd") for axis in _AXES)])
        outputs = tuple(f"motor_torque[{axis}]" for axis in _AXES)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "motion.csv")
            np.savetxt(file, motion, delimiter=",", header=head, comments="", fmt="%.17g")
            settings = {"mode": "dynamic", "torque_curve": "backlash", "trajectory": str(file)}
            none = np.zeros((len(self.time), 1))
            job = SimulationJob(settings, self.time, ("force.x",), none, outputs, 6)
            (found,) = answers(robot, [job])
        return smooth(found, self.time)


@dataclass(frozen=True)
class Torques:
    """Motor torques, measured and predicted, at the gears' outputs [N m], (n, 6), at times [s]."""

    time: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """Rms of the difference [N m], (6,)."""
        return _rms(self.predicted - self.measured)

    @property
    def size(self) -> np.ndarray:
        """Rms of what was measured [N m], (6,)."""
        return _rms(self.measured)

    def words(self) -> list[str]:
        """Return the error of every axis, and of what."""
        both = zip(self.error, self.size, strict=True)
        return [f"{e:.0f} of {s:.0f} N m ({100.0 * e / s:.0f} %)" for e, s in both]

    @property
    def slope(self) -> np.ndarray:
        """Measured over predicted torque, least squares, (6,): 1 where signs and units are right."""
        return np.sum(self.measured * self.predicted, axis=0) / np.sum(self.predicted**2, axis=0)


def smooth(values: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return values without what is faster than CUTOFF, both ways so that nothing is late."""
    rate = 1.0 / (time[1] - time[0])
    filtered: np.ndarray = sosfiltfilt(butter(4, CUTOFF, fs=rate, output="sos"), values, axis=0)
    return filtered


@cache
def torques(name: str) -> Torques:
    """Return those of recording "A" or "B"."""
    file = find_robot("kuka_kr300")
    given = {number.place: number.value for number in robot_numbers(file)[1]}
    ratios = np.array([given[f"joint[{axis}].drive.gear_ratio"] for axis in _AXES])
    recording = Recording.read(name, ratios)
    return Torques(recording.time, recording.torque, recording.needed(load_robot(file)))


def values() -> dict[str, Any]:
    """Return what the page says of it, by the names of its template."""
    lines = [
        (f"{name}, {how}", *torques(name).words())
        for name, how in (("A", "friction read off it"), ("B", "predicted"))
    ]
    found = torques("B")
    slope = found.slope
    return {
        "torque": compared("motor torque of a recorded motion", found.error / found.size),
        "torques": table(("recording", *(f"A{axis}" for axis in _AXES)), lines),
        "cutoff": CUTOFF,
        "slope_low": slope.min(),
        "slope_high": slope.max(),
        **tracking(),
    }


def tracking() -> dict[str, str]:
    """Return how far motors are off their references, and how much ahead of them, as ranges in words."""
    off, ahead = np.zeros((2, 6)), np.zeros((2, 6))
    for row, name in enumerate("AB"):
        data = np.genfromtxt(DATA / f"recording_{name}.csv", delimiter=",", names=True)
        for axis in _AXES:
            wanted, moved = (np.deg2rad(data[f"{what}_{axis}"]) for what in ("reference", "motor"))
            rate = np.gradient(wanted, data["time"])
            off[row, axis - 1] = np.std(moved - wanted)
            ahead[row, axis - 1] = np.cov(rate, moved - wanted)[0, 1] / np.var(rate, ddof=1)
    return {
        "arm_off": _range(off[:, :3], 1),
        "wrist_off": _range(off[:, 3:], 1),
        "arm_ahead": _range(ahead[:, :3], 0),
    }


def _range(values_: np.ndarray, digits: int) -> str:
    return f"{1e3 * values_.min():.{digits}f} to {1e3 * values_.max():.{digits}f}"


def compared(what: str, shares: np.ndarray) -> Comparison:
    """Return an entry of the page: rms over axes of error over what was measured, (3,) or (6,)."""
    axes = {3: "three", 6: "six"}[len(shares)]
    words = f"{100.0 * shares.min():.0f} to {100.0 * shares.max():.0f} % on {axes} axes"
    return Comparison(what, Against.MEASUREMENT, float(_rms(shares)), 1.0, words)


def _rms(values: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(values**2, axis=0))

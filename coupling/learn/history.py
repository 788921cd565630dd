"""What was measured under the commands of one path, pass after pass, beside what a model says of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.ndimage import median_filter
from scipy.spatial.transform import Rotation

from coupling.errors import LearnError
from coupling.learn.alignment import aligned, clock_offset
from coupling.learn.parameters import Learnable, changed, factors_between, learnables
from coupling.learn.passes import Seen, Simulated
from coupling.learn.residual import noise_of
from coupling.learn.smoother import Smoother
from coupling.learn.source import Source, require_alike
from coupling.path.deviation import less_constant, root_mean_square
from coupling.path.histories import ToolPath
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.models import Models

# No mode that a robot of this size is moved in is faster [Hz].
_SEEN = 15.0
# What the standard deviation of a noise is estimated to, as a part.
_NOISE_OFF = 0.015
# What shows by less than this part of what shows most is not told: a tip on a tool that hardly turns.
_TOLD = 1e-4
# Samples around one by whose median it is judged, how far beside it is an outlier, by the noise and at
# least [m], and how many may be, as a part.
_AROUND, _FAR, _FAR_OFF, _MOST_LOST = 7, 10.0, 1e-4, 0.05
# Passes that find clock and frame.
_ROUNDS = 3
# Paths are the same to this [m], and begin and end at the same time to this [s].
_SAME, _SAME_TIME = 1e-6, 1e-9


# What an industrial robot's tool may be off before it is measured: pose accuracy of robots that are not
# calibrated, some tenths of a millimetre [m], and that over an arm of a metre [rad].
_ROBOT_OFF, _ROBOT_TURNED = 5e-4, 5e-4


@dataclass(frozen=True)
class FrameKnown:
    """How well the measuring frame is known: standard deviations from the robot's base frame.

    Attributes:
        shift: Of each coordinate of its origin [m].
        turn: Of each coordinate of its turn about the middle of the path [rad].
        tip: Of each coordinate of the probe's tip from the TCP, axes of the tool [m]; 0: it is the TCP.
    """

    shift: float = np.inf
    turn: float = 1e-4
    tip: float = 0.0

    def of_device(self, shift: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the parts of a shift [m] and a turn [rad] that are the device's, not the robot's.

        Both may be off; each gets its share of the variance.

        Example:
            >>> shift, turn = FrameKnown(5e-5, 5e-5).of_device(np.full(3, 1e-4), np.zeros(3))
            >>> shift.round(8).tolist()
            [9.9e-07, 9.9e-07, 9.9e-07]
            >>> FrameKnown().of_device(np.full(3, 1e-4), np.zeros(3))[0].tolist()
            [0.0001, 0.0001, 0.0001]
        """
        return (
            shift * _share(self.shift, _ROBOT_OFF),
            turn * _share(self.turn, _ROBOT_TURNED),
        )


def _share(known: float, robot: float) -> float:
    return 1.0 if np.isinf(known) else known**2 / (known**2 + robot**2)


ANYWHERE = FrameKnown(np.inf, np.inf)


def seen_below(time: np.ndarray) -> Smoother:
    """Return the low-pass above which a measurement is taken to have noise alone.

    Args:
        time: Of its samples [s], (n,).
    """
    rate = (len(time) - 1) / float(np.ptp(time))
    return Smoother(time, min(_SEEN, 0.25 * rate))


@dataclass(frozen=True)
class Size:
    """Size of a deviation below 15 Hz [m]; noise is taken off the rms.

    Attributes:
        maximum, rms: Largest and rms distance.
        maximum_less_constant, rms_less_constant: The same less a constant.
        doubt: Standard deviation of the square of the rms, by the noise [m^2].
    """

    maximum: float
    rms: float
    maximum_less_constant: float
    rms_less_constant: float
    doubt: float = 0.0

    @classmethod
    def of(cls, time: np.ndarray, off: np.ndarray, noise: float = 0.0) -> Size:
        """Return the size of deviations.

        Args:
            time: Rising [s], (n,).
            off: [m], (n, 3).
            noise: Standard deviation of a coordinate's noise [m].
        """
        low = seen_below(time)
        slow = low.at_samples(low(off))
        of_noise = 3.0 * noise**2 * low.of_noise
        largest, rms = [], []
        for own in (slow, less_constant(time, slow)):
            distance = np.linalg.norm(own, axis=1)
            largest.append(float(distance.max()))
            square = root_mean_square(time, distance) ** 2 - of_noise
            rms.append(float(np.sqrt(max(square, 0.0))))
        # Mean square of so many numbers that are independent, and the noise's own estimate.
        independent = 6.0 * low.cutoff * float(np.ptp(time))
        doubt = of_noise * float(np.hypot(np.sqrt(2.0 / independent), 2.0 * _NOISE_OFF))
        return cls(largest[0], rms[0], largest[1], rms[1], doubt)


@dataclass(frozen=True)
class MeasuredRun:
    """A run, and where its tool was seen, in the frame and on the clock of its command.

    Attributes:
        source: The run, and what was measured as it came.
        seen: What was measured, the device's frame and clock taken off.
        clock: What was added to the device's clock, on the command's to two seconds [s].
        shift, turn: What was taken off as the device's [m] and [rad], (3,).
        tip: What was taken off as the probe's, axes of the tool [m], (3,).
        noise: Standard deviation of a coordinate's noise [m].
        left_out: Number of samples that were left out, as they are far beside those around them.
    """

    source: Source
    seen: Seen
    clock: float
    shift: np.ndarray
    turn: np.ndarray
    tip: np.ndarray
    noise: float
    left_out: int = 0

    @property
    def desired(self) -> ToolPath:
        """Desired path, axes of the robot's base."""
        return self.source.stored.desired

    @property
    def told(self) -> np.ndarray:
        """Positions of the TCP as they came, axes of the robot's base, the probe's tip taken off [m]."""
        time = self.source.seen.time + self.clock
        path = Simulated(self.desired)
        return self.source.seen.position - path.rotation(time).apply(self.tip)

    @property
    def deviation(self) -> np.ndarray:
        """Measured less desired positions [m], (n, 3)."""
        off: np.ndarray = self.seen.position - Simulated(self.desired).position(self.seen.time)
        return off

    @property
    def size(self) -> Size:
        """Size of that."""
        return Size.of(self.seen.time, self.deviation, self.noise)


@dataclass
class History:
    """Passes along one path, in their order.

    Attributes:
        runs: The runs.
        parameters: What is learned of the robot of the first one's file.
        fmu: That robot, simulated.
        watch: Told how far simulations are.
    """

    runs: tuple[MeasuredRun, ...]
    parameters: tuple[Learnable, ...]
    fmu: RobotFmu
    _paths: dict[tuple[int, bytes], Simulated] = field(default_factory=dict)

    @classmethod
    def of(cls, sources: Sequence[Source], known: FrameKnown, models: Models) -> History:
        """Return the history of runs and what was measured under their commands.

        Args:
            sources: In their order; the robot of the first one is the file's.
            known: What is known of the measuring frame.
            models: What simulates robots.

        Raises:
            LearnError: If a measurement is none of its run, or the runs are of other robots or paths.
        """
        require_alike(sources)
        _require_one_path(sources)
        first = sources[0]
        own = cls(
            (),
            learnables(first.robot, first.torque_curve),
            models.of(first.robot, first.torque_curve).fmu,
        )
        for source in sources:
            own.runs = (*own.runs, own._measured(source, known))
        return own

    @property
    def start(self) -> np.ndarray:
        """Log factors of the file's robot, (P,)."""
        return np.zeros(len(self.parameters))

    def robot_of(self, number: int) -> np.ndarray:
        """Return the log factors of the robot that a run was computed for, (P,)."""
        return factors_between(self.parameters, self.runs[number].source.robot)

    def simulated(self, number: int, x: np.ndarray) -> Simulated:
        """Return where the tool of a robot is under a run's command.

        Args:
            number: Of the run.
            x: Log factors of the robot, (P,).
        """
        return self._simulated(number, self.runs[number].source, x)

    def beyond(self, number: int, x: np.ndarray) -> np.ndarray:
        """Return measured less simulated poses of a run, (n, 6): [m], and [rad] or 0."""
        seen, path = self.runs[number].seen, self.simulated(number, x)
        return _beyond(seen, path)

    def _simulated(self, number: int, source: Source, x: np.ndarray) -> Simulated:
        key = (number, x.tobytes())
        if key not in self._paths:
            stored, values = source.stored, changed(self.parameters, x)
            path = self.fmu.simulate(stored.joints, stored.wrench, "dynamic", values)
            self._paths[key] = Simulated(path)
        return self._paths[key]

    def _measured(self, source: Source, known: FrameKnown) -> MeasuredRun:
        """Return a run on its command's clock and in the robot's frame."""
        model = self._simulated(len(self.runs), source, self.start)
        seen = aligned(source.seen, model.path, own_frame=np.isinf(known.turn))
        coarse = clock_offset(source.seen, model.path)
        kept = _kept(seen.name, seen.position - model.position(seen.time))
        lost = seen.time[~kept] - coarse
        if len(lost):
            rows = np.flatnonzero(~np.isin(np.round(source.seen.time, 9), np.round(lost, 9)))
            source = replace(source, seen=source.seen.at_rows(rows))
            seen = seen.at_rows(np.flatnonzero(kept))
        cycle = float(np.median(np.diff(source.stored.joints.time)))
        clock, tip = 0.0, np.zeros(3)
        for _ in range(_ROUNDS):
            there = model.position(seen.time + clock)
            held = model.rotation(seen.time + clock).as_matrix()
            off = seen.position - there - held @ tip
            columns = _columns(there, model.position(seen.time + clock, 1), held, known)
            centred = (off - off.mean(axis=0)).reshape(-1)
            found = np.linalg.lstsq(columns, centred, rcond=_TOLD)[0]
            shift, turn = off.mean(axis=0), found[:3]
            clock += float(found[3])
            tip = tip + (found[4:] if known.tip else 0.0)
        tip = tip * _share(known.tip, _ROBOT_OFF)
        # A device on the command's clock is not known from one that is a few milliseconds late; what the
        # robot is late by is the robot's.
        if abs(coarse + clock) <= cycle:
            clock = -coarse
        there = model.position(seen.time + clock)
        moved = seen.position - model.rotation(seen.time + clock).apply(tip)
        shift, turn = known.of_device((moved - there).mean(axis=0), turn)
        position = moved - shift - np.cross(turn, there - there.mean(axis=0))
        rotation = seen.rotation
        if rotation is not None:
            rotation = Rotation.from_rotvec(-turn) * rotation
        own = replace(seen, time=seen.time + clock, position=position, rotation=rotation)
        inside = (own.time >= source.stored.desired.time[0]) & (
            own.time <= source.stored.desired.time[-1]
        )
        own = own.at_rows(np.flatnonzero(inside))
        noise = noise_of([_beyond(own, model)[:, :3]])
        return MeasuredRun(source, own, coarse + clock, shift, turn, tip, noise, len(lost))


def _kept(name: str, beyond: np.ndarray) -> np.ndarray:
    """Return which samples are not far beside those around them, (n,).

    Args:
        name: Of the measurement.
        beyond: Measured less simulated positions [m], (n, 3).

    Raises:
        LearnError: If too many are.
    """
    off = np.linalg.norm(beyond - median_filter(beyond, size=(_AROUND, 1), mode="nearest"), axis=1)
    kept: np.ndarray = off <= max(_FAR * noise_of([beyond]), _FAR_OFF)
    lost = len(kept) - np.count_nonzero(kept)
    if lost > _MOST_LOST * len(kept):
        raise LearnError(
            f"{name}: expected positions that follow each other, got {lost} of {len(kept)} that are far"
            " beside those around them: has the device lost its target?"
        )
    return kept


def _columns(
    place: np.ndarray, rate: np.ndarray, held: np.ndarray, known: FrameKnown
) -> np.ndarray:
    """Return what turn, clock and, where it is looked for, the tip do to positions, less their mean.

    Args:
        place: Positions [m], (n, 3).
        rate: Their rates [m/s], (n, 3).
        held: Rotations base_from_tool, (n, 3, 3).
        known: What is known of the measuring frame.

    Returns:
        (3 n, 4), or (3 n, 7).
    """
    arm = place - place.mean(axis=0)
    turned = np.cross(np.eye(3)[:, None], arm[None]).transpose(1, 2, 0)
    parts = [turned, rate[:, :, None]] + ([held] if known.tip else [])
    full = np.concatenate(parts, axis=2)
    columns: np.ndarray = (full - full.mean(axis=0)).reshape(-1, full.shape[2])
    return columns


def _beyond(seen: Seen, path: Simulated) -> np.ndarray:
    moved = seen.position - path.position(seen.time)
    if seen.rotation is None:
        return np.hstack([moved, np.zeros_like(moved)])
    return np.hstack([moved, (seen.rotation * path.rotation(seen.time).inv()).as_rotvec()])


def _require_one_path(sources: Sequence[Source]) -> None:
    """Refuse runs of other paths than the first one's.

    Raises:
        LearnError: If one of them has another desired path.
    """
    first = sources[0]
    path = first.stored.desired
    for other in sources[1:]:
        own = other.stored.desired
        same = len(own.time) == len(path.time) and np.allclose(
            own.time, path.time, rtol=0.0, atol=_SAME_TIME
        )
        if not same or np.abs(own.position - path.position).max() > _SAME:
            raise LearnError(
                f"{other.folder}: expected the desired path of {first.folder}, got another one: give"
                " passes of one path"
            )

"""A run and what was measured under it, on the command's clock and in the robot's frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.identification.next.deviation_size import deviation_size
from coupling.identification.next.options import FrameAccuracy
from coupling.identification.runs.alignment import aligned, clock_offset
from coupling.identification.runs.lost_target import distance_from_neighbours, near_those_around
from coupling.identification.runs.measurement import Measurement, SimulatedPath
from coupling.identification.runs.residual import noise_of
from coupling.identification.runs.source import MeasuredFile
from coupling.path.histories import ToolPath
from coupling.results.next_result import DeviationSize

# What shows by less than this part of what shows most is not identifiable: a tip that hardly turns.
_IDENTIFIABLE = 1e-4
# Distance of an outlier from the samples around it: by the noise, at least [m], and by the distance of
# this part of all samples, which vibrate where the device is slow.
_FAR, _FAR_OFF, _FAR_OF_OTHERS, _OTHERS = 10.0, 1e-4, 3.0, 0.9
# Iterations that find clock and frame.
_ROUNDS = 3


@dataclass(frozen=True)
class MeasuredRun:
    """A run, and where its tool was measured, in the frame and on the clock of its command.

    Attributes:
        source: The run, and what was measured as it came.
        measured: Measurement, the device's frame and clock taken off.
        clock: Offset that was added to the device's clock, for the command's [s].
        shift, turn: Shift [m] and turn [rad] that were taken off as the device's, (3,).
        tip: Offset that was taken off as the probe's, axes of the tool [m], (3,).
        offset: Constant by which what was measured is off what the robot's model does [m], (3,).
        noise: Standard deviation of a coordinate's noise [m].
        left_out: Number of samples that were left out, as they are far beside those around them.
    """

    source: MeasuredFile
    measured: Measurement
    clock: float
    shift: np.ndarray
    turn: np.ndarray
    tip: np.ndarray
    offset: np.ndarray
    noise: float
    left_out: int = 0

    @property
    def desired(self) -> ToolPath:
        """Desired path, axes of the robot's base."""
        return self.source.stored.desired

    @property
    def tcp_positions(self) -> np.ndarray:
        """Positions of the TCP as they came, less the probe's tip, base axes [m], (samples, 3)."""
        time = self.source.measured.time + self.clock
        path = SimulatedPath(self.desired)
        return self.source.measured.position - path.rotation(time).apply(self.tip)

    @cached_property
    def deviation(self) -> np.ndarray:
        """Measured less desired positions [m], (n, 3)."""
        off: np.ndarray = self.measured.position - SimulatedPath(self.desired).position(
            self.measured.time
        )
        return off

    @property
    def paths(self) -> tuple[ToolPath, ToolPath]:
        """Desired and measured path at the measured times, world frame."""
        time, desired = self.measured.time, SimulatedPath(self.desired)
        quaternion = desired.rotation(time).as_quat()
        path, actual = (
            ToolPath(time, np.hstack([position, quaternion])).transformed(
                self.source.world_from_base
            )
            for position in (desired.position(time), self.measured.position)
        )
        return path, actual

    @cached_property
    def size(self) -> DeviationSize:
        """Size of that."""
        return deviation_size(self.measured.time, self.deviation, self.noise)

    @classmethod
    def of(
        cls, source: MeasuredFile, model: SimulatedPath, frame_accuracy: FrameAccuracy
    ) -> MeasuredRun:
        """Return a run on its command's clock and in the robot's frame.

        Args:
            source: The run, and what was measured.
            model: Simulated path of the robot's tool under the run's command.
            frame_accuracy: Standard deviations of the measuring device's frame and tip.

        Raises:
            LearnError: If what was measured does not fit the run.
        """
        is_clock_known = frame_accuracy.is_clock_known
        coarse = 0.0 if is_clock_known else clock_offset(source.measured, model.path)
        measured = aligned(source.measured, model.path, np.isinf(frame_accuracy.turn), coarse)
        unmodelled = measured.position - model.position(measured.time)
        vibration = float(np.quantile(distance_from_neighbours(unmodelled), _OTHERS))
        far = max(_FAR * noise_of([unmodelled]), _FAR_OFF, _FAR_OF_OTHERS * vibration)
        near = near_those_around(measured.name, unmodelled, far)
        measured = measured.at_rows(np.flatnonzero(near))
        recorded = source.measured.time
        start, end = measured.time[[0, -1]] - coarse
        lost = (recorded > start) & (recorded < end)
        lost &= ~np.isin(np.round(recorded, 9), np.round(measured.time - coarse, 9))
        source = replace(source, measured=source.measured.at_rows(np.flatnonzero(~lost)))
        cycle = float(np.median(np.diff(source.stored.joints.time)))
        clock, tip = 0.0, np.zeros(3)
        for _ in range(_ROUNDS):
            there = model.position(measured.time + clock)
            base_from_tool = model.rotation(measured.time + clock).as_matrix()
            off = measured.position - there - base_from_tool @ tip
            columns = _columns(
                there, model.position(measured.time + clock, 1), base_from_tool, frame_accuracy
            )
            centred = (off - off.mean(axis=0)).reshape(-1)
            fitted = np.linalg.lstsq(columns, centred, rcond=_IDENTIFIABLE)[0]
            shift, turn = off.mean(axis=0), fitted[:3]
            clock += float(fitted[3])
            tip = tip + (fitted[4:] if frame_accuracy.tip else 0.0)
        tip = tip * frame_accuracy.of_tip()
        # A device on the command's clock is not known from one that is a few milliseconds late; what the
        # robot is late by is the robot's.
        if is_clock_known or abs(coarse + clock) <= cycle:
            clock = -coarse
        there = model.position(measured.time + clock)
        tip_free = measured.position - model.rotation(measured.time + clock).apply(tip)
        offset = (tip_free - there).mean(axis=0)
        shift, turn = frame_accuracy.of_device(offset, turn)
        position = tip_free - shift - np.cross(turn, there - there.mean(axis=0))
        rotation = measured.rotation
        if rotation is not None:
            rotation = Rotation.from_rotvec(-turn) * rotation
        measured_on_clock = replace(
            measured, time=measured.time + clock, position=position, rotation=rotation
        )
        inside = (measured_on_clock.time >= source.stored.desired.time[0]) & (
            measured_on_clock.time <= source.stored.desired.time[-1]
        )
        measured_on_clock = measured_on_clock.at_rows(np.flatnonzero(inside))
        noise = noise_of([measured_on_clock.position - model.position(measured_on_clock.time)])
        return cls(
            source,
            measured_on_clock,
            coarse + clock,
            shift,
            turn,
            tip,
            offset,
            noise,
            int(np.count_nonzero(lost)),
        )


def _columns(
    place: np.ndarray, rate: np.ndarray, base_from_tool: np.ndarray, frame_accuracy: FrameAccuracy
) -> np.ndarray:
    """Return what turn, clock and, where it is looked for, the tip do to positions, less their mean.

    Args:
        place: Positions [m], (n, 3).
        rate: Their rates [m/s], (n, 3).
        base_from_tool: Rotations base_from_tool, (n, 3, 3).
        frame_accuracy: Standard deviations of the measuring device's frame and tip.

    Returns:
        (3 n, 4), or (3 n, 7).
    """
    arm = place - place.mean(axis=0)
    turn_columns = np.cross(np.eye(3)[:, None], arm[None]).transpose(1, 2, 0)
    parts = [turn_columns, rate[:, :, None]] + ([base_from_tool] if frame_accuracy.tip else [])
    full = np.concatenate(parts, axis=2)
    columns: np.ndarray = (full - full.mean(axis=0)).reshape(-1, full.shape[2])
    return columns

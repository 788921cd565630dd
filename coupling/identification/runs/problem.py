"""What is to be fitted, parameters, measured runs and frame, and how their rows are weighted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from coupling.identification.runs.effect import ParameterEffect, SecantEffect
from coupling.identification.runs.measurement import MeasuredPath
from coupling.identification.runs.parameters import prior_of
from coupling.identification.runs.residual import Residual, noise_of
from coupling.identification.runs.slow_part import SlowPart
from coupling.identification.runs.whitening import NONE, UnmodelledSpectrum, Whitening
from coupling.robot.parameters import RobotParameter
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.description import Robot

# Of the measuring frame and clock beside the parameters: shift, turn, time; and with orientations the
# probe's turn on the tool, with motors how late these were recorded.
_FRAME, _WITH_PROBE, _WITH_MOTORS = 7, 10, 11
# Smallest scale of the residual's slow part [m]: below it lies what the model itself is not worth.
FLOOR = 1e-6

# Derivatives of the tool's pose by log factors, around x (P,) at times (n,): [m] and, base axes, [rad],
# then of c columns of motors [rad], [N m], (n, 6 + c, P).
PoseDerivatives = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class FramePrior:
    """What is known of the measuring frame and clock: standard deviations.

    Attributes:
        shift: Shift of the frame [m].
        turn: Turn of the frame [rad].
        time: Offset of the clock [s].
        probe: Turn of the probe on the tool, of which the mean is known [rad].
        motors: Time between records of the motors and of the tool [s].
    """

    shift: float = 1e-3
    turn: float = 1e-3
    time: float = 0.1
    probe: float = 1e-2
    motors: float = 0.02

    @property
    def prior(self) -> np.ndarray:
        """Standard deviations of all numbers of a frame, in this order [m, rad, s], (11,)."""
        frame = [self.shift] * 3 + [self.turn] * 3 + [self.time]
        return np.array(frame + [self.probe] * 3 + [self.motors])


# The frame of a device that stands anywhere: nothing is known of it.
ANYWHERE = FramePrior(shift=1.0, turn=1.0)


@dataclass(frozen=True)
class FitProblem:
    """What is to be fitted.

    Attributes:
        fmus: FMUs of the robot of the file, one or more to run side by side.
        parameters: Parameters that are learned.
        runs: The measured runs.
        effects: Effects of the parameters in each of them.
        frame: Prior of the measuring frame and clock.
        spectrum: Spectrum of what the model does not describe.
        variance: Variance of a coordinate of the rows [m^2]; None: by Cauchy's scale, under which the
            prior has more weight, and the sum of squares is smoother.
    """

    fmus: tuple[RobotFmu, ...]
    parameters: tuple[RobotParameter, ...]
    runs: tuple[MeasuredPath, ...]
    effects: tuple[ParameterEffect, ...]
    frame: FramePrior = FramePrior()
    spectrum: UnmodelledSpectrum = NONE
    variance: float | None = None

    @property
    def fmu(self) -> RobotFmu:
        """What simulates the robot of the file."""
        return self.fmus[0]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.parameters) + self.frame_size * len(self.runs)

    @property
    def frame_size(self) -> int:
        """Number of unknowns of each measured run beside the parameters.

        7, or 10 where orientations were measured, or 11 where motors were recorded.
        """
        if any(run.measured.motors is not None for run in self.runs):
            return _WITH_MOTORS
        return _FRAME if all(run.tool_rotation is None for run in self.runs) else _WITH_PROBE

    @property
    def prior(self) -> np.ndarray:
        """Standard deviations of all unknowns before anything is measured [1, m, rad, s], (U,)."""
        frame_prior = self.frame.prior[: self.frame_size]
        return np.concatenate([prior_of(self.parameters), *[frame_prior] * len(self.runs)])

    @cached_property
    def slow(self) -> tuple[SlowPart, ...]:
        """Slow parts of the samples of every measured run."""
        return tuple(SlowPart.of(run.measured.time) for run in self.runs)

    @cached_property
    def residuals(self) -> tuple[Residual, ...]:
        """Residuals of every measured run, for any path of the simulated tool."""
        return tuple(map(Residual, self.runs))

    @cached_property
    def whitening(self) -> tuple[Whitening, ...]:
        """Filters of the rows of every measured run."""
        return tuple(
            Whitening(mean, max(residual.noise[0], FLOOR / float(np.sqrt(mean.of_noise))))
            for mean, residual in zip(self.slow, self.residuals, strict=True)
        )

    def whiten(self, number: int, rows: np.ndarray) -> np.ndarray:
        """Return slow rows of a run [m], or their columns, whitened but for motors', (k, c, ...)."""
        poses = self.runs[number].coordinates
        whitened = self.whitening[number](rows[:, :poses], self.spectrum)
        return np.concatenate([whitened, rows[:, poses:]], axis=1)

    def noise(self, residuals: Sequence[np.ndarray]) -> float:
        """Return the rms of slow parts that residuals (n, 3 or more) have by noise alone [m]."""
        noise = noise_of([rows[:, :3] for rows in residuals])
        return noise * float(np.sqrt(3.0 * np.mean([mean.of_noise for mean in self.slow])))

    def weight(self, scale: float) -> float:
        """Return the weight of rows, by that of Cauchy's scale [m]."""
        return 1.0 if self.variance is None else scale**2 / self.variance

    def robot_at(self, x: np.ndarray) -> Robot:
        """Return the robot with log factors x [1], (P,)."""
        return self.effects[0].robot(x)

    def until(self, seconds: float) -> FitProblem:
        """Return the problem of the first seconds of every measured run."""
        return replace(self, runs=tuple(run.until(seconds) for run in self.runs))

    def secants(self, change: np.ndarray | float) -> tuple[SecantEffect, ...]:
        """What the parameters do in each measured run, by differences of simulations.

        Args:
            change: Changes of the log factors [1], (P,), or of each.
        """
        return tuple(
            SecantEffect(self.fmus, run, effect, change)
            for run, effect in zip(self.runs, self.effects, strict=True)
        )

    def frame_values(self, x: np.ndarray, number: int) -> np.ndarray:
        """Return frame, clock, probe and the motors' clock of a measured run, as far as there are.

        Args:
            x: All unknowns, log factors first [1, m, rad, s], (U,).
            number: Number of the measured run, from 0.

        Returns:
            Numbers in the order of `FramePrior` [m, rad, s], (7,), (10,) or (11,).
        """
        return x[self.rows_of(number)]

    def rows_of(self, number: int) -> slice:
        """Return where a measured run's own unknowns are."""
        first = len(self.parameters) + self.frame_size * number
        return slice(first, first + self.frame_size)

    def unknowns_of(self, number: int) -> np.ndarray:
        """Return the numbers of the unknowns of a run, (P + its frame's,)."""
        return np.r_[: len(self.parameters), self.rows_of(number)]

"""What was learned, as plain data: learned.json, and what its report is drawn from."""

from __future__ import annotations

import numpy as np

from coupling.learn.judge import LearnedParameter
from coupling.learn.learning import Learned
from coupling.learn.measurement import MeasuredPath
from coupling.learn.residual import Residual
from coupling.learn.smoothing import CUT_OFF, SlowPart
from coupling.results.learned_result import (
    LearnedParameterResult,
    LearnedPassResult,
    LearnedResult,
    LeftResult,
)


def figures(found: Learned) -> LearnedResult:
    """Return the figures of what was learned; SI."""
    before, after = found.left
    return LearnedResult.of(
        found,
        found.fit,
        found.spread,
        robot=found.sources[0].file,
        left_m=LeftResult(robot_file=before, learned=after),
        slow_below_Hz=CUT_OFF,
        parameters=[_parameter(own) for own in found.parameters],
        passes=[_pass(found, number) for number in range(len(found.passes))],
    )


def _parameter(own: LearnedParameter) -> LearnedParameterResult:
    low, high = own.low / own.start, own.high / own.start
    return LearnedParameterResult.of(own, factor_low=low, factor_high=high)


def _of_motors(one: MeasuredPath) -> dict[str, float]:
    """Return the deviations by which columns of motors count [rad], [N m], by name."""
    motors = one.seen.motors
    if motors is None:
        return {}
    return dict(zip(motors.names, motors.deviation.tolist(), strict=True))


def _pass(found: Learned, number: int) -> LearnedPassResult:
    one, source = found.passes[number], found.sources[number]
    size = (len(found.fit.z) - len(found.parameters)) // len(found.passes)
    own = found.fit.z[len(found.parameters) + size * number :][:size]
    rest, slow = found.before[number], found.fit.slow[number]
    return LearnedPassResult.of(
        one,
        run=source.folder,
        from_s=one.seen.time[0],
        to_s=one.seen.time[-1],
        frame_shift_m=own[:3],
        frame_turn_rad=own[3:6],
        clock_s=own[6],
        orientation_noise_rad=Residual(one).noise[1] if one.held is not None else None,
        motors=_of_motors(one),
        time=SlowPart.of(one.seen.time).time,
        left_robot_file_m=np.linalg.norm(rest[:, :3], axis=1),
        left_learned_m=np.linalg.norm(slow[:, :3], axis=1),
    )

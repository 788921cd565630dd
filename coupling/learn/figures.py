"""What was learned, as plain data: learned.json, and what its report is drawn from."""

from __future__ import annotations

import numpy as np

from coupling.learn.learning import Learned
from coupling.learn.residual import Residual
from coupling.learn.smoothing import CUT_OFF, SlowPart
from coupling.results.learned_result import (
    LearnedParameterResult,
    LearnedPassResult,
    LearnedResult,
    LeftResult,
)
from coupling.run.figures import gear_figures


def figures(found: Learned) -> LearnedResult:
    """Return the figures of what was learned; SI."""
    before, after = found.left
    return LearnedResult(
        robot=str(found.sources[0].file),
        refusal=found.refusal,
        converged=found.fit.converged,
        left_m=LeftResult(robot_file=before, learned=after),
        noise_m=found.spread.noise,
        noise_left_m=found.noise_left,
        widened=found.widened,
        warnings=found.warnings,
        draws=found.spread.draws,
        slow_below_Hz=CUT_OFF,
        parameters=tuple(
            LearnedParameterResult(
                name=own.name,
                start=own.start,
                value=own.value,
                low=own.low,
                high=own.high,
                written=own.written,
                factor=own.factor,
                factor_low=own.low / own.start,
                factor_high=own.high / own.start,
                identifiable=own.identifiable,
                significant=own.significant,
                effect_m=own.effect,
                reason=own.reason,
            )
            for own in found.parameters
        ),
        gears=tuple(gear_figures(gear) for gear in found.gears),
        passes=tuple(_pass(found, number) for number in range(len(found.passes))),
    )


def _pass(found: Learned, number: int) -> LearnedPassResult:
    one, source = found.passes[number], found.sources[number]
    size = (len(found.fit.z) - len(found.parameters)) // len(found.passes)
    own = found.fit.z[len(found.parameters) + size * number :][:size]
    rest, slow = found.before[number], found.fit.slow[number]
    return LearnedPassResult(
        run=str(source.folder),
        measured=source.seen.name,
        rows=len(one.seen.time),
        from_s=float(one.seen.time[0]),
        to_s=float(one.seen.time[-1]),
        frame_shift_m=own[:3].tolist(),
        frame_turn_rad=own[3:6].tolist(),
        clock_s=float(own[6]),
        orientation_noise_rad=Residual(one).noise[1] if one.held is not None else None,
        time=SlowPart.of(one.seen.time).time.tolist(),
        left_robot_file_m=np.linalg.norm(rest[:, :3], axis=1).tolist(),
        left_learned_m=np.linalg.norm(slow[:, :3], axis=1).tolist(),
    )

"""The report of an identification from motion."""

from __future__ import annotations

import numpy as np

from coupling.motion.identification import MotionIdentification
from coupling.motion.parameters import MotionParameter
from coupling.report.section import Section, Table

_UM = 1e6


def motion_summary(found: MotionIdentification) -> list[Section]:
    """Return what was identified from motion."""
    joints = range(1, len(found.robot.joints) + 1)
    rows = []
    for one in found.judged:
        words = "held out" if one.held_out else "fitted"
        rows.append((one.name, words, "motor less link [urad]", *map(_size, _UM * one.wind_up)))
        rows.append((one.name, words, "torque [% of its rms]", *map(_size, 100 * one.torque)))
    sizes = Table(("recording", "", "rms left of", *(f"joint {i}" for i in joints)), rows)
    return [Section("", [sizes]), Section("Parameters", [_parameters(found)])]


def _size(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.3g}"


def _parameters(found: MotionIdentification) -> Table:
    fit, rows = found.fit, []
    half = fit.blocks.half * fit.blocks.deviation
    for p, x, h in zip(fit.problem.parameters, fit.x, half, strict=True):
        if isinstance(p, MotionParameter):
            start, value = p.value(found.robot), p.outward(float(x))
            ends = sorted((p.outward(float(x - h)), p.outward(float(x + h))))
        else:
            start, value, ends = 0.0, p.size * x, [p.size * (x - h), p.size * (x + h)]
        rows.append((p.name, *(f"{v:.4g}" for v in (start, value, *ends)), p.unit))
    rows += [(p.name, "", "kept", "", "", p.unit) for p in found.kept]
    return Table(("parameter", "start", "fit", "95 % from", "to", "unit"), rows)

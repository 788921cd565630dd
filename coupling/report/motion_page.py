"""The report of an identification from motion."""

from __future__ import annotations

import numpy as np

from coupling.motion.identification import MotionIdentification
from coupling.report.section import Section, Table

_UM = 1e6


def motion_summary(found: MotionIdentification) -> list[Section]:
    """Return what was identified from motion."""
    joints = range(1, len(found.robot.joints) + 1)
    rows = []
    for one in found.judged:
        name = one.moved.recording.name
        words = "held out" if one.held_out else "fitted"
        rows += [
            (name, words, "motor less link [urad]", *map(_size, _UM * one.wind_up)),
            (name, words, "- an offset alone", *map(_size, _UM * one.without_lines)),
            (name, words, "torque [% of its rms]", *map(_size, 100 * one.torque)),
            (name, words, f"- below {found.bandwidth:g} Hz", *map(_size, 100 * one.slow_torque)),
        ]
    sizes = Table(("recording", "", "rms left of", *(f"joint {i}" for i in joints)), rows)
    sections = [Section("", [sizes]), Section("Parameters", [_parameters(found)])]
    lines = [
        f"Encoder of link {i + 1}: {', '.join(f'{line:g}' for line in own)} periods in a turn."
        for i, own in enumerate(found.judged[0].moved.lines)
        if own
    ]
    if lines:
        sections.append(Section("Lines of encoders", lines))
    if found.terms:
        sections.append(Section("Without each term", [_terms(found)]))
    return sections


def _terms(found: MotionIdentification) -> Table:
    rows = [
        (t.term, *(_size(_UM * v) for v in t.wind_up), *(_size(100 * v) for v in t.torque))
        for t in found.terms
    ]
    head = ("held out, without", "motor less link, with [urad]", "without", "torque, with [%]", "without")
    return Table(head, rows)


def _size(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.3g}"


def _parameters(found: MotionIdentification) -> Table:
    fit, rows = found.fit, []
    half = fit.blocks.half * fit.blocks.deviation
    for p, x, h in zip(fit.problem.parameters, fit.x.tolist(), half.tolist(), strict=True):
        ends = sorted((p.outward(x - h), p.outward(x + h)))
        rows.append((p.name, *(f"{v:.4g}" for v in (p.start, p.outward(x), *ends)), p.unit))
    for p, own in zip(found.first.problem.parameters, found.chosen, strict=True):
        if not own:
            rows.append((p.name, f"{p.start:.4g}", "kept", "", "", p.unit))
    return Table(("parameter", "start", "fit", "95 % from", "to", "unit"), rows)

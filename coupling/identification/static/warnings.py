"""What a user should look at before trusting an identification."""

from __future__ import annotations

import numpy as np

from coupling.identification.static.found import Identification, rms
from coupling.identification.static.separable import STRONG


def warnings(found: Identification) -> list[str]:
    """Return what the user should look at."""
    measured, fit, telling = found.measured, found.fit, found.separability
    said = list(measured.remarks)
    if not fit.converged:
        said.append(f"the fit has not converged: {fit.reason}")
    idle = [n for n, w in zip(measured.names, measured.wrench, strict=True) if not w.any()]
    if idle and not found.loops:
        said.append(f"rows without a load: {', '.join(idle[:5])}{' ..' * (len(idle) > 5)}")
    if np.abs(measured.q).max() > 4.0 * np.pi:
        said.append(f"an angle is {np.abs(measured.q).max():.3g} rad: are they in degrees?")
    size = rms(measured.deflection) / max(rms(_start(found)), 1e-300)
    if not 0.02 < size < 50.0:
        said.append(
            f"deflections are {size:.3g} times those of the start file: are they in m and loads in N?"
        )
    along = float(np.sum(measured.deflection[:, :3] * _start(found)[:, :3]))
    if along < 0.0:
        said.append(
            "deflections go against what the start file predicts: is the load that on the robot, in base"
            " axes, and the deflection loaded less unloaded?"
        )
    if not fit.converged:
        return said
    if telling.condition > STRONG:
        said.append(
            f"the parameters pull against each other, condition {telling.condition:.0f}: hardly"
            f" distinguishable are {'; '.join(d.in_words() for d in telling.weak)}"
        )
    said += [
        f"{p.name}: the start value that is kept, {p.start:.4g}, is outside of what the data allow,"
        f" {p.low:.4g} to {p.high:.4g}"
        for p, against in zip(found.parameters, found.intervals.against, strict=True)
        if not (p.identifiable or against or p.name in found.added)
        and not p.low <= p.start <= p.high
    ]
    rests: dict[int, list[str]] = {}
    for parameter, row in zip(found.parameters, found.intervals.rests_on.tolist(), strict=True):
        if row >= 0 and parameter.identifiable:
            rests.setdefault(row, []).append(parameter.name)
    said += [f"{', '.join(own)} rest on {measured.names[row]} alone" for row, own in rests.items()]
    if found.noise.known and found.intervals.freedom > 0:
        if found.intervals.scale > 1.5:
            said.append(
                f"residuals are {found.intervals.scale:.2g} times what the standard deviations say: the"
                " model lacks something, or they are too small"
            )
        elif found.intervals.scale < 0.6:
            said.append(
                f"residuals are {found.intervals.scale:.2g} times what the standard deviations say: they"
                " are too large"
            )
    suspicions = [point.suspicion() for point in found.points]
    suspicions += [found.loss.suspicion()] if found.loss is not None else []
    said += [suspicion for suspicion in suspicions if suspicion]
    if found.rms_written > 1.2 * rms(found.residual):
        said.append(
            "with the values that were kept the robot as written is off by"
            f" {1e3 * found.rms_written:.3g} mm rms, the fit by {1e3 * rms(found.residual):.3g} mm:"
            " measure what was not identified, or leave tilts that are not supported out of the start"
            " file"
        )
    return said


def _start(found: Identification) -> np.ndarray:
    """Return what the start values predict in the rigid posture, (k, r)."""
    rigid = found.fit.rigid
    return found.fit.in_units(rigid.columns @ rigid.start)

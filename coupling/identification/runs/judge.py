"""Which parameters measured runs identify, and which of the others are significant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coupling.path.length_text import in_words
from coupling.results.gear_result import GearDiagnosis
from coupling.results.learned_result import LearnedParameterResult
from coupling.robot.parameters import RobotParameter

# A parameter is identifiable where its error is below this part of what was known before.
_IDENTIFIABLE = 0.5
# A parameter is significant where its prior deviation moves the tool by this rms [m], less a constant,
# as the measuring frame takes one anyway.
_SIGNIFICANT = 2e-6
# Below this the path does not depend on it [m].
_MOVES = 1e-8
# A gear without load for more than this part of the time makes a path that does not repeat.
_MOSTLY = 0.5
# Noise is the smaller part of what is left from so many times noise on.
_SMALLER = float(np.sqrt(2.0))


def judge_parameters(
    parameters: Sequence[RobotParameter],
    x: np.ndarray,
    deviation: np.ndarray,
    half: np.ndarray,
    prior: np.ndarray,
    effect: np.ndarray,
    gears: Sequence[GearDiagnosis],
) -> tuple[LearnedParameterResult, ...]:
    """Return the verdicts.

    What is not significant by itself is written as it fits best beside the others: these make up for
    it, and a dozen such left out are missed.  Where the path does not depend on it, the file's is.

    Args:
        parameters: Parameters that were learned.
        x: Log factors found [1], (P,).
        deviation: Standard deviations of their errors [1], (P,).
        half: Half widths of their intervals [1], (P,); not wider than what was known before.
        prior: Standard deviations before [1], (P,).
        effect: Effect of a prior standard deviation on the tool, rms [m], (P,).
        gears: Diagnosis of the gears where it was measured.
    """
    verdicts = []
    for k, parameter in enumerate(parameters):
        identifiable, width = deviation[k] < _IDENTIFIABLE * prior[k], half[k]
        if not identifiable:
            width = min(width, 1.96 * prior[k])
        ends = np.exp(x[k] + width * np.array([0.0, -1.0, 1.0]))
        value, low, high = (parameter.value * ends).tolist()
        moves = effect[k] >= _MOVES or parameter.vibrates
        verdict = LearnedParameterResult.judged(
            parameter.name,
            parameter.unit,
            parameter.value,
            value,
            (low, high),
            "" if identifiable else _reason(parameter, float(effect[k]), gears),
            written=value if identifiable or moves else parameter.value,
            factor=value / parameter.value,
            factor_low=low / parameter.value,
            factor_high=high / parameter.value,
            significant=bool(effect[k] >= _SIGNIFICANT),
            effect_m=float(effect[k]),
        )
        verdicts.append(verdict)
    return tuple(verdicts)


def judge_absent(parameter: RobotParameter) -> LearnedParameterResult:
    """Return the verdict on a backlash without which the runs are explained: at most the file's."""
    return LearnedParameterResult.judged(
        parameter.name,
        parameter.unit,
        parameter.value,
        0.0,
        (0.0, parameter.value),
        "",
        factor=0.0,
        factor_low=0.0,
        factor_high=1.0,
        significant=True,
        effect_m=0.0,
    )


def _reason(parameter: RobotParameter, effect: float, gears: Sequence[GearDiagnosis]) -> str:
    if effect >= _SIGNIFICANT:
        return "not distinguishable from the others"
    stays = parameter.gear is not None and gears[parameter.gear].reversals == 0
    if stays and parameter.kind in ("backlash", "damping"):
        return "the gear does not reverse on this path"
    return "not significant on this path"


def mostly_in_backlash(gears: Sequence[GearDiagnosis], seconds: float) -> str:
    """Return which gears are unloaded for most of a path, in words; "" where none does.

    Args:
        gears: Diagnosis of the gears where it was measured.
        seconds: Duration of that [s].
    """
    names = [g.joint for g in gears if g.at_risk and g.in_backlash > _MOSTLY * seconds]
    if not names:
        return ""
    which = ", ".join(map(str, names))
    gears_words = f"the gear{'s' * (len(names) > 1)} of joint{'s' * (len(names) > 1)} {which}"
    return (
        f"{gears_words} {'are' if len(names) > 1 else 'is'} unloaded at rest for most of the path"
    )


def discrepancy(before: float, after: float, noise: float) -> str:
    """Return what the model does not explain of a measurement, in words; "" where most of it is noise.

    Args:
        before: Rms of the residuals' slow parts with the robot file [m].
        after: The same with what was found [m].
        noise: Rms that noise alone would leave of them [m].
    """
    if after <= _SMALLER * noise:
        return ""
    explained = float(np.sqrt(max(before**2 - after**2, 0.0)))
    return (
        f"the model explains only {in_words(explained)} of {in_words(before)} of the slow part of"
        f" the deviation; {in_words(after)} remain, noise alone would be {in_words(noise)}"
    )


def measurement_lacks(
    gears: Sequence[GearDiagnosis],
    whole: Sequence[GearDiagnosis],
    seconds: float,
    unknown: str,
) -> str:
    """Return what a measurement lacks that identifies nothing, in words.

    Args:
        gears: Diagnosis of the gears where it was measured.
        whole: Diagnosis of them along the whole path.
        seconds: Duration of what was measured [s].
        unknown: Deviation that the model does not explain, in words; "" where that is noise.
    """
    later = [g.joint for g, w in zip(gears, whole, strict=True) if w.reversals > g.reversals == 0]
    if later:
        names = ", ".join(map(str, later))
        return (
            f"no gear reverses in the measured {seconds:.3g} s: measure longer, as those of joints"
            f" {names} reverse later in the run"
        )
    if unknown:
        return (
            f"{unknown}; the rest, which is neither backlash nor stiffness nor damping (gear errors,"
            " hysteresis, heat, another load), would distort these: correct the command by the measured"
            " deviation itself (elastic-robot mirror)"
        )
    if not any(gear.reversals for gear in gears):
        return (
            "no gear reverses on this path, and no other effect exceeds the uncertainty of the measuring"
            " frame: measure a path on which gears reverse, or keep the robot file, which suffices for"
            " this path"
        )
    return "the noise conceals the effect of the gears: measure longer, or with less noise"

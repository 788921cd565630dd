"""Refuse what was measured under another run's command.

Two runs of one robot differ as its model does, y_j - y_i = s_j - s_i, but for what does not repeat.  If
both measurements belong to one command y_j - y_i = 0, and if they are exchanged s_i - s_j.  The model is
that of the last command: the file's may cross its backlash under one of two commands that are nearly the
same to a robot that was learned.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from coupling.errors import LearnError
from coupling.identification.next.history import History
from coupling.identification.runs.slow_part import SlowPart
from coupling.path.deviation import less_constant
from coupling.path.length_text import in_words
from coupling.path.linear import interpolate_rows

# Commands differ if their paths do by so many times what differs from run to run, and the noise.
_DIFFERENT = 3.0
# Runs belong to other commands if these explain their difference to so much of the rms that their own
# commands leave of it.
_EXPLAINED = 0.5


def require_measured_under(history: History, random: float) -> None:
    """Refuse runs whose measurements belong to other commands of theirs.

    Args:
        history: The runs.
        random: Rms distance from run to run [m].

    Raises:
        LearnError: With both measurements and runs.
    """
    x = history.factors_of(len(history.runs) - 1)
    for i, j in combinations(range(len(history.runs)), 2):
        first, second = history.sources[i], history.sources[j]
        if np.array_equal(first.measured.position, second.measured.position):
            raise LearnError(
                f"{second.measured.name}: expected what was measured under the command of"
                f" {second.folder}, got the rows of {first.measured.name}, given for {first.folder}"
            )
        by_model, measured, noise = _differences(history, i, j, x)
        if _rms(by_model) < _DIFFERENT * float(np.hypot(random, noise)):
            continue
        least = _EXPLAINED * _rms(measured - by_model)
        for unexplained, words in (
            (measured, "are both of one run?"),
            (measured + by_model, "are they exchanged?"),
        ):
            if _rms(unexplained) < least:
                raise LearnError(
                    f"{second.measured.name}: expected what was measured under the command of"
                    f" {second.folder}, which differs from that of {first.folder} by"
                    f" {in_words(_rms(by_model))} rms; it differs from {first.measured.name} by"
                    f" {in_words(_rms(measured))}, and from what is expected of it by"
                    f" {in_words(_rms(measured - by_model))}: {words}"
                )


def _differences(
    history: History, i: int, j: int, x: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return how run j differs from run i, by model and measured [m], (k, 3), and its noise [m]."""
    time, other = history.runs[j].measured.time, history.runs[i].measured.time
    slow, slow_other = SlowPart.of(time), SlowPart.of(other)
    inside = (slow.time >= slow_other.time[0]) & (slow.time <= slow_other.time[-1])
    common = slow.time[inside]
    path, path_before = (history.simulated(k, x).position for k in (j, i))
    by_model = slow(path(time) - path_before(time))[inside]
    before = interpolate_rows(common, slow_other.time, slow_other(history.unmodelled(i, x)[:, :3]))
    measured = slow(history.unmodelled(j, x)[:, :3])[inside] - before + by_model
    square = sum(
        3.0 * history.runs[k].noise ** 2 * part.of_noise for k, part in ((j, slow), (i, slow_other))
    )
    return less_constant(common, by_model), less_constant(common, measured), float(np.sqrt(square))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(values**2, axis=1))))

"""The deviation to expect on a real robot, in the words of every command that judges a tolerance."""

from __future__ import annotations

from coupling.path.length_text import in_words
from coupling.report.lengths import judged
from coupling.results.expected_deviation import ExpectedDeviation


def expected_words(expected: ExpectedDeviation) -> str:
    """Return the deviation in words."""
    return f"{'' if expected.is_whole else 'at least '}{in_words(expected.maximum)}"


def expected_sentence(expected: ExpectedDeviation, tolerance: float | None) -> str:
    """Return what to expect, and whether a tolerance [m] will be kept, in a sentence."""
    if expected.is_whole:
        reach = f"expect the tool within {in_words(expected.maximum)} of its path on the real robot"
    else:
        reach = (
            f"expect {expected_words(expected)} on the real robot, whose file does not say how exact it"
            " is"
        )
    fits = None if tolerance is None else expected.fits(tolerance)
    return judged(reach, fits, tolerance)

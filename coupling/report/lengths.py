"""Lengths beside a tolerance, and numbers in three digits."""

from __future__ import annotations

from coupling.path.length_text import in_words
from coupling.results.section import NextStep

# Words for a figure that there is not.
NOT_KNOWN = "not known"


def three_digits(value: float) -> str:
    """Return a number in three digits, without an exponent below a thousand million.

    Example:
        >>> three_digits(1234567.0), three_digits(0.01234)
        ('1230000', '0.0123')
    """
    return f"{float(f'{value:.3g}'):.9g}"


def words_if_known(length: float | None) -> str:
    """Return a length [m] with its unit, or that it is not known."""
    return NOT_KNOWN if length is None else in_words(length)


def judged(words: str, fits: bool | None, tolerance: float | None) -> str:
    """Return what to expect as a sentence with its verdict.

    Args:
        words: Expectation, without capital and full stop.
        fits: Whether a tolerance is kept; None where that is open.
        tolerance: Deviation that the part allows [m]; None where it is not stated.

    Example:
        >>> judged("expect 0.300 mm", False, 2e-4)
        'NOT GOOD ENOUGH: expect 0.300 mm; your tolerance is 0.200 mm.'
    """
    if tolerance is None:
        return f"{words[:1].upper()}{words[1:]}. How much the part allows is not stated."
    verdict = {True: "GOOD ENOUGH", False: "NOT GOOD ENOUGH", None: "NOT CERTAIN"}[fits]
    return f"{verdict}: {words}; your tolerance is {in_words(tolerance)}."


def state_tolerance(case: str) -> NextStep:
    """Return the step that states what a part allows, in its case file."""
    return NextStep(f"State what the part allows: tolerance_mm = 0.2 in [part] of {case}.")

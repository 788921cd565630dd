"""Lengths as a shop floor reads them: mm, or um where small, three digits; beside a tolerance."""

from __future__ import annotations

from coupling.results.section import NextStep

# Below, micrometres are read more easily; below a micrometre nothing is measured at a robot [m].
_SMALL, _NOTHING = 1e-4, 1e-6
# Words for a figure that there is not.
NOT_KNOWN = "not known"


def in_words(length: float) -> str:
    """Return a length [m] with its unit.

    Example:
        >>> [in_words(length) for length in (2.1043e-3, 9.996e-5, 67.5e-6, -3e-4, 2.2e-7, 1.25)]
        ['2.10 mm', '0.100 mm', '67.5 um', '-0.300 mm', '< 1 um', '1250 mm']
    """
    size = abs(length)
    if size < _NOTHING:
        return "< 1 um"
    factor, unit = (1e3, "mm") if float(f"{size:.3g}") >= _SMALL else (1e6, "um")
    whole = f"{factor * length:#.3g}".rstrip(".")
    return f"{float(whole):.0f} {unit}" if "e" in whole else f"{whole} {unit}"


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

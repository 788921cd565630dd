"""Lengths as a shop floor reads them: millimetres, or micrometres where small, three digits."""

from __future__ import annotations

# Below, micrometres are read more easily; below a micrometre nothing is measured at a robot [m].
_SMALL, _NOTHING = 1e-4, 1e-6


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

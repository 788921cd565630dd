"""Lengths as terminal, pages and messages have them: mm, or um where small, three digits."""

from __future__ import annotations

from math import floor, isnan, log10

# Below, micrometres are read more easily; below a micrometre nothing is measured at a robot [m].
_SMALL, _NOTHING = 1e-4, 1e-6
# Factors of units in which lengths are shown, and decimals of them that are measured at a robot.
_FACTORS, _DECIMALS = {"mm": 1e3, "um": 1e6}, {"mm": 3, "um": 1}


def format_um(length: float) -> str:
    """Return a length [m] in micrometres: three digits, none below a nanometre, no exponent to a metre.

    Example:
        >>> format_um(1.23456e-3), format_um(4.2e-8), format_um(3e-16)
        ('1230', '0.042', '0')
    """
    return f"{round(float(f'{1e6 * length:.3g}'), 3):g}"


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


def length_unit(*largest: float) -> tuple[float, str]:
    """Return factor and name of the unit in which lengths [m] are shown: mm, or um where all are small.

    Example:
        >>> length_unit(2.1e-3, 1e-6), length_unit(4e-5)
        ((1000.0, 'mm'), (1000000.0, 'um'))
    """
    return (1e3, "mm") if max(largest) >= _SMALL else (1e6, "um")


def in_unit(length: float, unit: str) -> str:
    """Return a length [m] in mm or um, as a column of a table has it; a dash for none (NaN).

    Example:
        >>> [in_unit(length, "mm") for length in (1.7234e-3, 3.19e-5, 2.2e-7, 0.0)]
        ['1.72', '0.032', '< 0.001', '0']
        >>> [in_unit(length, "um") for length in (6.75e-5, 8.26e-6, 2.2e-7)]
        ['67.5', '8.3', '< 1']
    """
    if isnan(length):
        return "-"
    size = abs(length)
    if size < _NOTHING:
        return f"< {_FACTORS[unit] * _NOTHING:g}" if size else "0"
    value = _FACTORS[unit] * length
    decimals = min(max(2 - floor(log10(abs(value))), 0), _DECIMALS[unit])
    return f"{value:.{decimals}f}"

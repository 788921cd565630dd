"""Lengths as terminal, pages and messages have them."""

from __future__ import annotations


def format_um(length: float) -> str:
    """Return a length [m] in micrometres: three digits, none below a nanometre, no exponent to a metre.

    Example:
        >>> format_um(1.23456e-3), format_um(4.2e-8), format_um(3e-16)
        ('1230', '0.042', '0')
    """
    return f"{round(float(f'{1e6 * length:.3g}'), 3):g}"

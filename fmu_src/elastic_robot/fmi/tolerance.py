"""Error allowed at the TCP: a parameter of its own, or what the experiment's tolerance makes of it.

A master's tolerance is relative, to whatever its solver has for states; one of 1e-4 is common.  Here
it is taken relative to 10 mm, more than the elastic joints give way under the loads that robots bear:
so the usual one allows 1e-6 m.  Bounded, since a coarser one than MOST saves hardly any steps, and a
finer one than LEAST is below the accuracy of any robot file.
"""

from __future__ import annotations

# Error allowed to begin with [m], and the relative tolerance of an experiment that is the same.
TOLERANCE = 1e-6
RELATIVE = 1e-4
# Limits of what follows from an experiment's tolerance [m].
LEAST, MOST = 1e-9, 1e-5


def allowed_error(tcp_tolerance: float, relative: float | None) -> float:
    """Return the error allowed at the TCP over a path [m].

    Args:
        tcp_tolerance: Value of the parameter [m]; 0: not set.
        relative: Relative tolerance of the experiment; None or 0: not given.

    Example:
        >>> allowed_error(0.0, None), allowed_error(0.0, 1e-4), round(allowed_error(0.0, 1e-6), 12)
        (1e-06, 1e-06, 1e-08)
        >>> allowed_error(0.0, 0.5), allowed_error(1e-12, 0.5)
        (1e-05, 1e-12)
    """
    if tcp_tolerance > 0.0:
        return tcp_tolerance
    if not relative:
        return TOLERANCE
    return min(max(TOLERANCE * (relative / RELATIVE), LEAST), MOST)

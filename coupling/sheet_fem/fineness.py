"""Force in the limit of small elements, from elements of one size."""

from __future__ import annotations

# Excess of the force over its limit where the element is the tool's radius and that the thickness:
# fitted to what docs/sheet_fem.md shows under "How fine".
_EXCESS = 0.35
# Size of the coarsest elements that were looked at, over the tool's radius.
_COARSEST = 0.8


def limit_of_force(element: float, radius: float, thickness: float) -> float:
    """Return the force of ever smaller elements over that of elements of a size.

    The bend about a tool is sharper than its elements can follow, so that they are too stiff: by
    0.35 (h/R)^2 (R/t)^(1/4), as the error of splines of second degree in a shell that bends
    falls with the square of their size h.  The factor 0.35 and the fourth root are fitted.  From
    elements larger than 0.8 R as much is taken off as from those.

    Args:
        element: Side of an element [m].
        radius: Radius of the tool's sphere [m].
        thickness: First thickness of the sheet [m].

    Example:
        >>> round(limit_of_force(2.5e-3, 5e-3, 1e-3), 3)
        0.884
    """
    size = min(element / radius, _COARSEST)
    return 1.0 / (1.0 + _EXCESS * size**2 * (radius / thickness) ** 0.25)

"""What was measured beside what is predicted, as the picture of a first screen."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from coupling.report.thinning import extremes

# Width and height of a picture, and of what is left, right, above and below the curves [px].
_WIDTH, _HEIGHT, _LEFT, _RIGHT, _ABOVE, _BELOW = 480, 300, 62, 14, 34, 44
# Parts of the axis of which the extremes are drawn, and numbers at an axis at most.
_PARTS, _NUMBERS = 240, 6


class SvgCurve(NamedTuple):
    """A curve of a picture.

    Attributes:
        name: Its name above the picture; empty for none.
        colour: Name of its colour in the page, such as "link".
        x, y: Its points, any unit, (n,); what is not finite is left out.
        has_dots: Whether its points are drawn, not the lines between them.
    """

    name: str
    colour: str
    x: np.ndarray
    y: np.ndarray
    has_dots: bool = False


def curves(
    content: Sequence[SvgCurve], across: str, upright: str, *, logarithmic: bool = False
) -> str:
    """Return curves as SVG, on linear axes or on logarithmic ones.

    Args:
        across, upright: Names of the axes, with units.
        logarithmic: Whether both axes are.

    Example:
        >>> x = np.arange(3.0)
        >>> curves([SvgCurve("measured", "ink", x, x, True)], "time [s]", "force [N]").count("<circle")
        3
    """
    x_axis, y_axis = (
        _Axis.of(np.concatenate(values), logarithmic)
        for values in zip(*((curve.x, curve.y) for curve in content), strict=True)
    )
    right, bottom = _WIDTH - _RIGHT, _HEIGHT - _BELOW
    shapes = []
    for value in x_axis.numbers:
        x = _LEFT + x_axis.share(value) * (right - _LEFT)
        shapes.append(f'<path d="M{x:.1f} {_ABOVE}V{bottom}" class="grid"/>')
        shapes.append(f'<text x="{x:.1f}" y="{bottom + 16}" text-anchor="middle">{value:g}</text>')
    for value in y_axis.numbers:
        y = bottom - y_axis.share(value) * (bottom - _ABOVE)
        shapes.append(f'<path d="M{_LEFT} {y:.1f}H{right}" class="grid"/>')
        shapes.append(f'<text x="{_LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>')
    place = _LEFT
    for curve in content:
        rows = np.flatnonzero(x_axis.has(curve.x) & y_axis.has(curve.y))
        rows = rows[extremes(curve.x[rows], curve.y[rows], _PARTS)]
        x = _LEFT + x_axis.share(curve.x[rows]) * (right - _LEFT)
        y = bottom - y_axis.share(curve.y[rows]) * (bottom - _ABOVE)
        points = [f"{a:.1f} {b:.1f}" for a, b in zip(x, y, strict=True)]
        paint = f"var(--{curve.colour})"
        if curve.has_dots:
            dots = "".join(
                f'<circle cx="{p.split()[0]}" cy="{p.split()[1]}" r="2.5"/>' for p in points
            )
            shapes.append(f'<g style="fill: {paint}">{dots}</g>')
        else:
            shapes.append(f'<path d="M{"L".join(points)}" class="curve" style="stroke: {paint}"/>')
        if curve.name:
            shapes.append(
                f'<rect x="{place}" y="9" width="12" height="4" style="fill: {paint}"/>'
                f'<text x="{place + 17}" y="16">{html.escape(curve.name)}</text>'
            )
            place += 36 + 7 * len(curve.name)
    names = " and ".join(curve.name for curve in content if curve.name)
    return (
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{html.escape(names)}">'
        f"{''.join(shapes)}"
        f'<text x="{(_LEFT + right) / 2}" y="{_HEIGHT - 8}" text-anchor="middle">{html.escape(across)}'
        f'</text><text transform="translate(14 {(_ABOVE + bottom) / 2}) rotate(-90)"'
        f' text-anchor="middle">{html.escape(upright)}</text></svg>'
    )


class _Axis(NamedTuple):
    """An axis from its lowest to its highest value, with numbers beside it."""

    low: float
    high: float
    numbers: Sequence[float]
    logarithmic: bool

    @classmethod
    def of(cls, values: np.ndarray, logarithmic: bool) -> _Axis:
        finite = values[np.isfinite(values) & ((values > 0.0) | (not logarithmic))]
        low, high = (float(finite.min()), float(finite.max())) if len(finite) else (1.0, 10.0)
        if logarithmic:
            decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.log10(high) + 1.0)
            steps = [digit * decade for decade in decades for digit in (1.0, 2.0, 5.0)]
            numbers = [step for step in steps if low <= step <= high]
            whole = [number for number in numbers if number in decades]
            some = whole[:: len(whole) // _NUMBERS + 1]
            return cls(low, high, numbers if len(numbers) <= _NUMBERS else some, True)
        rough = max((high - low) / _NUMBERS, 1e-12, 1e-9 * max(abs(low), abs(high)))
        decade = 10.0 ** np.floor(np.log10(rough))
        step = next(digit * decade for digit in (1.0, 2.0, 5.0, 10.0) if digit * decade >= rough)
        low, high = step * np.floor(low / step), step * np.ceil(high / step)
        return cls(low, max(high, low + step), [*np.arange(low, high + 0.5 * step, step)], False)

    def has(self, values: np.ndarray) -> np.ndarray:
        """Return which values are on the axis, a mask."""
        return np.isfinite(values) & (values >= self.low)

    def share(self, value: Any) -> Any:
        """Return where a value, or values, are between the ends, from 0 to 1."""
        low, high = self.low, self.high
        if self.logarithmic:
            return (np.log(value) - np.log(low)) / max(np.log(high) - np.log(low), 1e-12)
        return (value - low) / (high - low)

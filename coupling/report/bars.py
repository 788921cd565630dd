"""Deviations as bars beside a tolerance: the picture of a first screen where nothing moves."""

from __future__ import annotations

import html
from collections.abc import Sequence

from coupling.path.length_text import in_words

# Width of a picture, of its labels at least, of a character and of its values, height of a bar and of a
# row [px].
_WIDTH, _LABEL, _CHARACTER, _VALUE, _BAR, _ROW = 480, 150, 7.3, 78, 16, 34
# Characters of a name that are shown.
_SHOWN = 36


def bars(lengths: Sequence[tuple[str, float | None]], tolerance: float | None = None) -> str:
    """Return lengths as bars, as SVG: those beyond the tolerance in another colour; empty without any.

    Args:
        lengths: Names and lengths [m]; one that is not known is left out.
        tolerance: Deviation that the part allows [m]; None where it is not stated.

    Example:
        >>> bars([("before", 2e-3), ("after", 1e-4)], 2e-4).count("<rect")
        2
    """
    known = [(name, length) for name, length in lengths if length is not None]
    most = max([*(length for _, length in known), tolerance or 0.0], default=0.0)
    if most <= 0.0:
        return ""
    names = [_shortened(name) for name, _ in known]
    label = max(_LABEL, round(_CHARACTER * max(map(len, names))) + 16)
    scale = (_WIDTH - label - _VALUE) / most
    height, shapes = _ROW * len(known) + 12, []
    if tolerance is not None:
        x, height = label + scale * tolerance, height + 20
        anchor = "end" if x > 0.7 * _WIDTH else "start" if x < 0.4 * _WIDTH else "middle"
        shapes.append(
            f'<path d="M{x:.1f} 4V{height - 20}" style="stroke: var(--ink)" stroke-dasharray="5 3"/>'
            f'<text x="{x:.1f}" y="{height - 6}" text-anchor="{anchor}">your tolerance</text>'
        )
    for number, (name, (_, length)) in enumerate(zip(names, known, strict=True)):
        y = _ROW * number + 12
        colour = "link" if tolerance is None else "good" if length <= tolerance else "bad"
        end = label + max(scale * length, 1.0)
        shapes += [
            f'<text x="{label - 8}" y="{y + 13}" text-anchor="end">{html.escape(name)}</text>',
            f'<rect x="{label}" y="{y}" width="{end - label:.1f}" height="{_BAR}"'
            f' style="fill: var(--{colour})"/>',
            f'<text x="{end + 6:.1f}" y="{y + 13}">{html.escape(in_words(length))}</text>',
        ]
    words = ", ".join(f"{name} {in_words(length)}" for name, length in known)
    return (
        f'<svg viewBox="0 0 {_WIDTH} {height}" role="img" aria-label="{html.escape(words)}">'
        f"{''.join(shapes)}</svg>"
    )


def _shortened(name: str) -> str:
    """Return a name without its middle where it is long.

    Example:
        >>> _shortened("of a folder whose name is very long indeed, expected")
        'of a folder whose…g indeed, expected'
    """
    half = (_SHOWN - 1) // 2
    return name if len(name) <= _SHOWN else f"{name[:half]}…{name[half - _SHOWN + 1 :]}"

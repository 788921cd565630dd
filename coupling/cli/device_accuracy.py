"""How well a measuring device is known, from words: 0.05mm,0.02mrad."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING

from coupling.errors import LearnError

if TYPE_CHECKING:
    from coupling.identification.next.options import FrameAccuracy

_LENGTHS = {"um": 1e-6, "mm": 1e-3, "m": 1.0}
_ANGLES = {"urad": 1e-6, "mrad": 1e-3, "rad": 1.0}
# A frame that is known to a length is known to that over an arm of a metre.
_ARM = 1.0


def device_accuracy(
    frame: str | None, own_frame: bool, tip: str | None, clock_known: bool
) -> FrameAccuracy:
    """Return what is known of the measuring device, from options.

    Args:
        frame: Text of --frame-known.
        own_frame: Whether --own-frame is given.
        tip: Text of --tip-known.
        clock_known: Whether --clock-known is given.

    Raises:
        LearnError: If a text is none of a length, or both options are given.
    """
    from coupling.identification.next.options import ANYWHERE, FrameAccuracy

    if own_frame and frame is not None:
        raise LearnError("expected either --own-frame or --frame-known, got both")
    accuracy = ANYWHERE if own_frame else FrameAccuracy()
    if frame is not None:
        accuracy = frame_of(frame)
    tip_accuracy = 0.0 if tip is None else length_of("--tip-known", tip, "0.5mm")
    return replace(accuracy, tip=tip_accuracy, is_clock_known=clock_known)


def length_of(option: str, text: str, example: str) -> float:
    """Return a length [m] from the text of an option, with an example of it.

    Raises:
        LearnError: If it is none.
    """
    size = _value(text.replace(" ", ""), _LENGTHS)
    if size is None:
        raise LearnError(f"{option}: expected a length, as {example}, got {text!r}")
    return size


def frame_of(text: str) -> FrameAccuracy:
    """Return what is known of a measuring frame, from words.

    Example:
        >>> frame_of("0.05mm,0.02mrad")
        FrameAccuracy(shift=5e-05, turn=2e-05, tip=0.0, is_clock_known=False)
    """
    from coupling.identification.next.options import FrameAccuracy

    parts = text.replace(" ", "").split(",")
    units = (_LENGTHS, _ANGLES)
    values = [_value(part, unit) for part, unit in zip(parts, units, strict=False)]
    if len(parts) > len(units) or None in values:
        raise LearnError(
            f"--frame-known: expected a length and an angle, as 0.05mm or 0.05mm,0.05mrad, got {text!r}"
        )
    shift, turn = (*values, None)[:2]
    assert shift is not None
    return FrameAccuracy(shift, shift / _ARM if turn is None else turn)


def _value(text: str, units: dict[str, float]) -> float | None:
    match = re.fullmatch(r"([0-9.]+(?:e[+-]?[0-9]+)?)([a-z]+)", text)
    if match is None or match[2] not in units:
        return None
    try:
        value = float(match[1]) * units[match[2]]
    except ValueError:
        return None
    return value if 0.0 < value < math.inf else None

"""What is said of a number outside its usual range: which unit it may have been meant in."""

from __future__ import annotations

import numpy as np

from coupling.files.gear_table import ARCMIN
from coupling.run.usual_ranges import EXPECTED

# Units that are mistaken for the right one, and what one of them is in the right one.
_RAD = 180.0 / np.pi
MISTAKEN = {
    "": {"%": 0.01},
    "Pa": {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "m": {"mm": 1e-3, "um": 1e-6},
    "mm": {"m": 1e3, "um": 1e-3},
    "m2": {"cm2": 1e-4, "mm2": 1e-6},
    "m3": {"l": 1e-3, "cm3": 1e-6, "mm3": 1e-9},
    "m/s": {"mm/s": 1e-3, "m/min": 1.0 / 60.0, "mm/min": 1e-3 / 60.0},
    "m/s2": {"cm/s2": 1e-2, "mm/s2": 1e-3},
    "N/m": {"N/mm": 1e3, "N/um": 1e6},
    "N m": {"kN m": 1e3, "N mm": 1e-3},
    "N m/rad": {
        "N m/deg": _RAD,
        "N m/arcmin": 1.0 / ARCMIN,
        "kN m/rad": 1e3,
        "MN m/rad": 1e6,
    },
    "rad": {"arcsec": ARCMIN / 60.0, "arcmin": ARCMIN, "deg": 1.0 / _RAD},
    "rad/s": {"deg/s": 1.0 / _RAD},
    "rad/s2": {"deg/s2": 1.0 / _RAD},
    "deg": {"rad": _RAD},
    "deg/s": {"rad/s": _RAD},
    "arcmin": {"arcsec": 1.0 / 60.0, "rad": 1.0 / ARCMIN},
    "kg": {"g": 1e-3, "t": 1e3},
    "kg m2": {"kg cm2": 1e-4, "kg mm2": 1e-6},
    "s": {"ms": 1e-3, "us": 1e-6},
    "Hz": {"rad/s": 0.5 / np.pi},
    "1/s": {"m/min/mm": 1e3 / 60.0},
    "1/min": {"1/s": 60.0, "rad/s": 30.0 / np.pi},
    "N": {"kN": 1e3, "mN": 1e-3, "kg": 9.81},
}
# Multiples of pi that are written where degrees are expected, and how well: pi/2 with two decimals, a
# twelfth of pi with four.
_QUARTER, _ROUGH = np.pi / 2.0, 6e-4
_TWELFTH, _FINE = np.pi / 12.0, 1e-4


def remark(place: str, key: str, value: float, is_computed: bool = False) -> str:
    """Return what there is to say of a value, "" where it is usual.

    Args:
        key: One of `EXPECTED`.
        value: In the unit there.
        is_computed: Whether a formula has computed it, so that nobody was mistaken in its unit.

    Example:
        >>> print(remark("process: tensile_strength_Pa", "process.tensile_strength_Pa", 310.0))
        process: tensile_strength_Pa: expected 3e+07 to 2.5e+09 Pa (metal sheet, from soft aluminium
        to press-hardened steel), got 310 Pa: did you mean 3.1e+08 Pa (310 MPa)?
    """
    usual = EXPECTED[key]
    unit = f" {usual.unit}" * bool(usual.unit)
    if usual.holds(value):
        if usual.unit == "deg" and not is_computed and (degrees := _degrees_in_radians(value)):
            return (
                f"{place}: expected degrees, got {value:.6g}, a part of pi: did you mean"
                f" {degrees:g} deg ({value:.6g} rad)?"
            )
        return ""
    text = (
        f"{place}: expected {usual.low:.4g} to {usual.high:.4g}{unit} ({usual.why}), got"
        f" {value:.6g}{unit}"
    )
    meant = [
        f"{factor * value:.4g}{unit} ({value:.6g} {name})"
        for name, factor in MISTAKEN.get(usual.unit, {}).items()
        if usual.holds(factor * value) and not is_computed
    ]
    return f"{text}: did you mean {' or '.join(meant)}?" if meant else text


def _degrees_in_radians(value: float) -> float:
    """Return the degrees of an angle that is a part of pi; 0 where it is none.

    Example:
        >>> [_degrees_in_radians(value) for value in (1.57, -3.14159, 0.7854, 5.5)]
        [90.0, -180.0, 45.0, 0.0]
    """
    for step, rounding in ((_QUARTER, _ROUGH), (_TWELFTH, _FINE)):
        count = round(value / step)
        if 0.0 < abs(value) < 6.3 and count and abs(value - count * step) <= rounding * abs(value):
            return round(count * step * _RAD, 6)
    return 0.0

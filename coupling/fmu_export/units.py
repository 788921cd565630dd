"""Units of the FMU's variables in terms of SI base units."""

from __future__ import annotations

# Exponents of the base units (FMI 2.0.4, 2.2.2); all variables are in coherent SI units, factor 1.
BASE_UNITS: dict[str, dict[str, int]] = {
    "1": {},
    "s": {"s": 1},
    "m": {"m": 1},
    "s/m": {"m": -1, "s": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "m/N": {"kg": -1, "s": 2},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N/s": {"kg": 1, "m": 1, "s": -3},
    "N/m": {"kg": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N.m/s": {"kg": 1, "m": 2, "s": -3},
    "N.m/rad": {"kg": 1, "m": 2, "s": -2, "rad": -1},
    "N.m.s/rad": {"kg": 1, "m": 2, "s": -1, "rad": -1},
}

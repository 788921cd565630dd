"""Data that RAPID defines itself: frames, speeds, zones and constants."""

from __future__ import annotations

import math

from coupling.programs.rapid.functions import MODES
from coupling.programs.rapid.values import Data, Value, single
from coupling.programs.unknown import Unknown

_HERE: Value = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
_LOAD: Value = (0.001, (0.0, 0.0, 0.001), (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
# Highest speed, which is that of the robot's type.
HIGHEST = Unknown("vmax, the highest speed of the robot")
# mm/s; degrees per second of the tool, speeds of external axes.
_SPEEDS = """5 10 20 30 40 50 60 80 100 150 200 300 400 500 600 800 1000 1500 2000 2500 3000 4000 5000
6000 7000"""
_TURN, _EXTERNAL_LINEAR, _EXTERNAL_TURN = 500.0, 5000.0, 1000.0
# Radius of a fly-by zone [mm]; z0 has 0.3.
_ZONES = (0, 1, 5, 10, 15, 20, 30, 40, 50, 60, 80, 100, 150, 200)


def _zone(is_stop: bool, radius: float) -> Data:
    wide = 1.5 * radius
    return Data("zonedata", (is_stop, radius, wide, wide, 0.1 * wide, wide, 0.1 * wide))


def speed_of(tcp: Value) -> Value:
    """Return speed data of the TCP's speed [mm/s], with the usual others."""
    return (tcp, _TURN, _EXTERNAL_LINEAR, _EXTERNAL_TURN)


PREDEFINED: dict[str, Data] = {
    "TOOL0": Data("tooldata", (True, _HERE, _LOAD)),
    "WOBJ0": Data("wobjdata", (False, True, "", _HERE, _HERE)),
    "LOAD0": Data("loaddata", _LOAD),
    "PI": Data("num", single(math.pi, "pi")),
    "LOW": Data("num", 0.0),
    "HIGH": Data("num", 1.0),
    "FINE": _zone(True, 0.0),
    **{f"Z{radius}": _zone(False, float(radius) or 0.3) for radius in _ZONES},
    **{f"V{speed}": Data("speeddata", speed_of(float(speed))) for speed in _SPEEDS.split()},
    "VMAX": Data("speeddata", speed_of(HIGHEST)),
    **{name: Data("num", value) for name, value in MODES.items()},
}

"""Forces of a mill's teeth on its actual way, in C (`desk/cut.h`)."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, numbers

# ER_MOST_PASSES of desk/cut.h.
MOST_PASSES = 64


class _Mill(ctypes.Structure):
    """er_mill of desk/cut.h."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("teeth", "passes")),
        *((name, ctypes.c_double) for name in ("radius", "lag", "speed", "rubs")),
        *((name, ctypes.c_void_p) for name in ("tip", "delay", "further", "coefficients")),
    )


class _Engagement(ctypes.Structure):
    """er_engagement of desk/cut.h."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("count", "arcs")),
        *((name, ctypes.c_void_p) for name in ("time", "feed", "start", "end", "depth")),
    )


@dataclass(frozen=True)
class MillTeeth:
    """Teeth of a mill as the library takes them.

    Attributes:
        radius: Radius of the cutter [m].
        lag: Lag of an edge with the height above the tip [rad/m].
        speed: Speed of the spindle [rad/s].
        rubs: Height above the surface up to which an edge rubs [m], > 0.
        tip: Angles of the tips at time 0 [rad], (teeth,).
        delay: Times since the passes before [s], (teeth, passes).
        further: Parts of how far a tooth reaches beyond the tooth of each of these passes, at the tip
            and a quarter of a turn further up its edge [m], (teeth, passes, 2).
        coefficients: K_tc, K_rc, K_ac [Pa], K_te, K_re, K_ae [N/m], (6,).
    """

    radius: float
    lag: float
    speed: float
    rubs: float
    tip: np.ndarray
    delay: np.ndarray
    further: np.ndarray
    coefficients: np.ndarray

    def wrench(
        self,
        time: np.ndarray,
        feed: np.ndarray,
        arcs: tuple[np.ndarray, np.ndarray, np.ndarray],
        way_time: np.ndarray,
        way: np.ndarray,
    ) -> np.ndarray:
        """Return the wrench of all teeth, each on what the passes before it have left.

        Args:
            time: Rising times [s], (n,).
            feed: Unit vectors along the feed in the part's plane, (n, 2).
            arcs: Starts and ends of the engaged arcs [rad] and their axial depths [m], (n, arcs).
            way_time: Rising times of the tool's way [s], (k,).
            way: Positions in the part's plane [m], (k, 2), straight in between, held beyond the ends.

        Returns:
            Forces [N] and moments about the tip's centre [N m], axes f, n, z, (n, 6).

        Raises:
            ValueError: If an array has another shape.
        """
        teeth, passes = self.delay.shape
        count, number = arcs[0].shape
        if passes > MOST_PASSES:
            raise ValueError(f"expected at most {MOST_PASSES} passes, got {passes}")
        of_mill = [
            numbers(name, values, shape)
            for name, values, shape in (
                ("tip", self.tip, (teeth,)),
                ("delay", self.delay, (teeth, passes)),
                ("further", self.further, (teeth, passes, 2)),
                ("coefficients", self.coefficients, (6,)),
            )
        ]
        of_cut = [
            numbers("time", time, (count,)),
            numbers("feed", feed, (count, 2)),
            *(numbers("arcs", values, (count, number)) for values in arcs),
        ]
        times = numbers("way_time", way_time, (len(way_time),))
        places = numbers("way", way, (len(way_time), 2))
        mill = _Mill(
            teeth, passes, self.radius, self.lag, self.speed, self.rubs, *map(address, of_mill)
        )
        cut = _Engagement(count, number, *map(address, of_cut))
        wrench = np.empty((count, 6))
        loaded_library().er_mill_wrench(
            ctypes.byref(mill),
            ctypes.byref(cut),
            ctypes.c_int64(len(times)),
            address(times),
            address(places),
            address(wrench),
        )
        return wrench

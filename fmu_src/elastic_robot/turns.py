"""Choice between the two unit quaternions of a tool's orientation.

The product of the turns along the chain, each by the half of its angle, is continuous in the angles: the
quaternion that is taken after it does not jump to its opposite where the tool has turned by 180 degrees,
and follows from the angles alone, not from the way there.  `native/core/chain/chain.h` is the same in C.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from elastic_robot.chain import Chain

# Angles that differ by less in sum turn a tool by less than half a turn [rad]: the scalar product of its
# quaternions is positive then.
_NEARBY = 2.0


class Turns:
    """The product, and the last one that was made: it serves all angles nearby."""

    def __init__(self, chain: Chain) -> None:
        self._axes = chain.axes
        self._tool = pin.Quaternion(chain.model.frames[chain.tcp].placement.rotation)
        self._theta = np.full(len(chain.axes), np.inf)
        self._quaternion = np.zeros(4)

    def sign(self, theta: np.ndarray, quaternion: np.ndarray) -> float:
        """Return 1 where a tool's quaternion is that of the turns by theta, -1 where it is the opposite.

        Args:
            theta: Angles of the chain [rad], (angles,).
            quaternion: Unit quaternion x, y, z, w, (4,).
        """
        if not np.abs(theta - self._theta).sum() < _NEARBY:
            self._theta, self._quaternion = theta.copy(), self._product(theta)
        return -1.0 if self._quaternion @ quaternion < 0.0 else 1.0

    def _product(self, theta: np.ndarray) -> np.ndarray:
        product = pin.Quaternion.Identity()
        for axis, half in zip(self._axes, 0.5 * theta, strict=True):
            product = product * pin.Quaternion(np.append(axis * np.sin(half), np.cos(half)))
        return (product * self._tool).coeffs()

"""Names of the tunable parameters, in the order of the FMU, and arrays with one column for each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic_robot.chain import Chain
from elastic_robot.errors import ParameterError


def parameter_names(chain: Chain) -> tuple[str, ...]:
    """Return gravity.x .y .z, then every stiffness, damping, backlash and hysteresis.

    For instance joint[1].stiffness, joint[1].tilt[1].damping and joint[1].backlash.
    """
    elastic = chain.elastic_names
    return (
        *(f"gravity.{axis}" for axis in "xyz"),
        *(f"{name}.stiffness" for name in elastic),
        *(f"{name}.damping" for name in elastic),
        *(f"{elastic[row]}.backlash" for row in chain.torsions),
        *(f"{elastic[row]}.hysteresis" for row in chain.elements.gears),
    )


@dataclass(frozen=True)
class ByParameter:
    """Derivatives of a quantity with respect to every parameter.

    Attributes:
        names: Names of the parameters, p of them, as `parameter_names` has them.
        values: One column for each name, (..., p); the quantity's unit per unit of the parameter:
            m/s^2 (gravity), N m/rad (stiffness), N m s/rad (damping), rad (backlash), N m (hysteresis).

    Example:
        >>> ByParameter(("gravity.x", "gravity.y"), np.array([[1.0, 2.0], [3.0, 4.0]]))["gravity.y"]
        array([2., 4.])
    """

    names: tuple[str, ...]
    values: np.ndarray

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the derivative with respect to one parameter, (...).

        Raises:
            ParameterError: If the robot has no such parameter.
        """
        if name not in self.names:
            raise ParameterError(
                f"parameter: expected one of {', '.join(self.names)}, got {name!r}"
            )
        return self.values[..., self.names.index(name)]

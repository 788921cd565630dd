"""A plane wall on linear springs; the test case of the coupling."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from coupling.files.toml_file import Vector3
from coupling.process.base import MemorylessProcess, ProcessSchema
from coupling.process.corners import crossings
from coupling.process.force_laws import ForceLaw
from coupling.toolpaths.instants import Corners
from coupling.toolpaths.task import Task


@dataclass(frozen=True)
class ElasticWall(MemorylessProcess):
    """Frictionless wall that pushes back in proportion to the penetration.

    Attributes:
        point: A point of the wall's plane, base frame [m], (3,).
        normal: Unit vector out of the wall, base axes, (3,).
        stiffness: Stiffness of the wall [N/m].

    Example:
        >>> from coupling.path.histories import ToolPath
        >>> wall = ElasticWall(np.zeros(3), np.array([0.0, 0.0, 1.0]), stiffness=1e5)
        >>> pose = np.array([[0.0, 0.0, -1e-3, 0.0, 0.0, 0.0, 1.0]] * 2)
        >>> wall.evaluate(ToolPath(np.array([0.0, 1.0]), pose)).wrench.force[0, 0]
        array([  0.,   0., 100.])
    """

    point: np.ndarray
    normal: np.ndarray
    stiffness: float

    def law(self) -> ForceLaw:
        """Return stiffness times penetration along the normal; nothing off the wall."""
        constants: dict[str, float | np.ndarray] = {
            "point": self.point,
            "normal": self.normal,
            "stiffness": self.stiffness,
        }
        return ForceLaw("elastic_wall", constants)


class ElasticWallTable(ProcessSchema):
    """Keys: stiffness_N_m; point_m and normal (unit vector out of the wall) in the part frame."""

    FORMULA: ClassVar[bool] = True

    model: Literal["elastic-wall"]
    stiffness_N_m: Annotated[float, Field(ge=0.0)]
    point_m: Vector3 = [0.0, 0.0, 0.0]
    normal: Vector3 = [0.0, 0.0, 1.0]

    @model_validator(mode="after")
    def _unit_normal(self) -> ElasticWallTable:
        length = float(np.linalg.norm(self.normal))
        if abs(length - 1.0) > 1e-9:
            raise ValueError(f"normal: expected length 1, got {length:.9g} ({self.normal})")
        return self

    def corners(self, task: Task) -> Corners:
        """Return the times at which the desired path enters the wall and leaves it."""

        def off(position: np.ndarray) -> np.ndarray:
            distance: np.ndarray = (task.part.coordinates(position) - self.point_m) @ self.normal
            return distance

        return crossings(task.forming, off)

    def process(self, task: Task) -> ElasticWall:
        """Return the wall in the robot's base frame."""
        return ElasticWall(
            point=task.part.points(np.array(self.point_m)),
            normal=task.part.rotate(np.array(self.normal)),
            stiffness=self.stiffness_N_m,
            identity=self.identity(task),
        )

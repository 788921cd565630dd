"""The case file's table of sheet-fem."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from coupling.errors import CaseError
from coupling.files.toml_file import Positive
from coupling.process.base import ProcessSchema
from coupling.process.corners import level_crossings
from coupling.sheet_fem.coarse import COARSENING
from coupling.toolpaths.instants import Corners
from coupling.toolpaths.task import Task
from coupling.toolpaths.tilt import APPROACH

if TYPE_CHECKING:
    from coupling.process.sheet_fem import SheetFem
    from coupling.sheet_fem.return_mapping import Metal


# Of the yield criterion; sheets of metal are within a factor of two or so of one.
_Coefficient = Annotated[float, Field(ge=0.1, le=10.0)]

# Side of an element, half side of the window about a tool, and distance of two equilibria, over the
# radius of the tool.  A tool that goes by more than it touches leaves a row of dents, whose forces jump.
_ELEMENT = 0.5
_WINDOW = 2.0
_POSITION = 0.5


class SheetFemTable(ProcessSchema):
    """Keys of the sheet, its material, the tool and the fineness; see docs/sheet_fem.md.

    sheet_size_m is the side inside the clamps; the part's origin is in its middle.  Without
    prestrain the hardening is Hollomon's.  An anisotropic sheet is rolled along the x of the part.
    """

    # By 37 % it missed one measured force; on another sheet it may miss to the other side.
    FORCE_FACTORS: ClassVar[tuple[float, float] | None] = (0.63, 1.37)

    model: Literal["sheet-fem"]
    sheet_size_m: Annotated[list[Positive], Field(min_length=2, max_length=2)]
    sheet_thickness_m: Positive
    backing_radius_m: Positive | None = None
    backing_edge_radius_m: Annotated[float, Field(ge=0.0)] = 0.0
    youngs_modulus_Pa: Positive
    poisson_ratio: Annotated[float, Field(ge=0.0, lt=0.5)]
    strength_Pa: Positive
    hardening_exponent: Annotated[float, Field(ge=0.0, lt=1.0)]
    prestrain: Positive | None = None
    yield_criterion: Literal["von-mises", "yld91"] = "von-mises"
    anisotropy: Annotated[list[_Coefficient], Field(min_length=6, max_length=6)] | None = None
    yield_exponent: Annotated[int, Field(ge=2, le=20, multiple_of=2)] | None = None
    tool_diameter_m: Positive
    friction_coefficient: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    force_factor: Positive = 1.0
    element_m: Positive | None = None
    layers: Annotated[int, Field(ge=2, le=20)] = 5
    position_m: Positive | None = None
    window_m: Positive | None = None

    @model_validator(mode="after")
    def _elements_fit(self) -> SheetFemTable:
        if min(self.sheet_size_m) < 5.0 * self._element:
            raise ValueError(
                "element_m: expected at most a fifth of the sheet's side,"
                f" {min(self.sheet_size_m) / 5.0:.4g}, got {self._element:.4g}"
            )
        if self._window < self._least_window(self.tool_diameter_m):
            raise ValueError(
                "window_m: expected at least the tool's radius, the thickness and two elements,"
                f" {self._least_window(self.tool_diameter_m):.4g}, got {self._window:.4g}"
            )
        if self.backing_edge_radius_m and self.backing_radius_m is None:
            raise ValueError(
                "backing_edge_radius_m: expected backing_radius_m beside it, the opening whose edge is"
                " rounded, got none"
            )
        return self

    @model_validator(mode="after")
    def _criterion_has_its_keys(self) -> SheetFemTable:
        criterion_keys = {"anisotropy": self.anisotropy, "yield_exponent": self.yield_exponent}
        stated = [name for name, value in criterion_keys.items() if value is not None]
        if self.yield_criterion == "von-mises" and stated:
            raise ValueError(
                f'{stated[0]}: expected yield_criterion = "yld91" beside it, got "von-mises", which is'
                " isotropic"
            )
        if self.yield_criterion == "yld91" and len(stated) < len(criterion_keys):
            missing = next(name for name in criterion_keys if name not in stated)
            raise ValueError(
                f'{missing}: expected beside yield_criterion = "yld91", got none: give anisotropy ='
                " [c1, ..., c6] and yield_exponent (8 is usual for aluminium, 6 for steel)"
            )
        return self

    @property
    def _element(self) -> float:
        """Side of an element [m]."""
        return self.element_m or _ELEMENT * 0.5 * self.tool_diameter_m

    @property
    def _window(self) -> float:
        """Half side of the part about a tool whose elements are not joined to coarse ones [m]."""
        return self.window_m or max(
            _WINDOW * 0.5 * self.tool_diameter_m, self._least_window(self.tool_diameter_m)
        )

    def _least_window(self, tool_diameter: float) -> float:
        """Return the half side that a tool's contact and two elements about it need [m]."""
        return 0.5 * tool_diameter + self.sheet_thickness_m + 2.0 * self._element

    @property
    def _position(self) -> float:
        """Distance of two equilibria along the path [m]."""
        return self.position_m or _POSITION * 0.5 * self.tool_diameter_m

    @property
    def forming_tool_diameter(self) -> float:
        """Diameter of the forming tool's sphere [m]."""
        return self.tool_diameter_m

    def corners(self, task: Task) -> Corners:
        """Return the times at which the forming tool crosses the flat sheet's plane."""
        return level_crossings(task.forming, task.part, (task.height,))

    def process(self, task: Task) -> SheetFem:
        """Return the sheet, flat and ready, for one tool or between two.

        Raises:
            CaseError: If the extra `fem` is not installed, or the tool path leaves the sheet.
        """
        # numba is of the extra `fem`, and its import takes longer than other cases should wait.
        from coupling.process.sheet_fem import SheetFem
        from coupling.sheet_fem.forming import SheetModel, SheetSettings
        from coupling.sheet_fem.mesh import SheetMesh, limit_of_force
        from coupling.sheet_fem.schedule import schedule

        points = [task.part.coordinates(positions) for positions in task.desired.position]
        points[0] = points[0] - [0.0, 0.0, task.height]
        reach = np.max(np.abs(np.vstack(points)[:, :2]), axis=0)
        if np.any(reach > 0.5 * np.array(self.sheet_size_m)):
            raise CaseError(
                f"process: sheet_size_m: expected more than {(2.0 * reach).round(6).tolist()}, which"
                f" the tool path spans, got {self.sheet_size_m}"
            )
        x, y = self.sheet_size_m
        elements = (_coarsen_count(x / self._element), _coarsen_count(y / self._element))
        radii, contacts = [0.5 * self.tool_diameter_m], [task.contact]
        if task.support is not None:
            radii.append(0.5 * task.support.tool_diameter)
            contacts.append(APPROACH)
        settings = SheetSettings(
            self.layers,
            max(self._window, self._least_window(2.0 * max(radii))),
            self.backing_radius_m,
            self.backing_edge_radius_m,
            self.friction_coefficient,
        )
        mesh = SheetMesh((x, y), elements, self.sheet_thickness_m)
        limit = limit_of_force(max(mesh.element_size), min(radii), self.sheet_thickness_m)
        return SheetFem(
            part=task.part,
            model=SheetModel(mesh, self._metal(), settings),
            radii=tuple(radii),
            tips=tuple(radius * at for radius, at in zip(radii, contacts, strict=True)),
            schedule=schedule(points[0], self._position),
            desired=task.desired,
            force_factor=limit * self.force_factor,
            watch=task.watch,
            identity=self.identity(task),
        )

    def _metal(self) -> Metal:
        from coupling.sheet_fem.material import Material, hollomon_prestrain
        from coupling.sheet_fem.orthotropic import Yld91

        prestrain = self.prestrain or hollomon_prestrain(
            self.youngs_modulus_Pa, self.strength_Pa, self.hardening_exponent
        )
        material = Material(
            self.youngs_modulus_Pa,
            self.poisson_ratio,
            self.strength_Pa,
            prestrain,
            self.hardening_exponent,
        )
        if self.anisotropy is None or self.yield_exponent is None:
            return material
        return Yld91.of(material, self.anisotropy, self.yield_exponent)


def _coarsen_count(count: float) -> int:
    """Return the number nearest to a given one that coarse elements can be cut from."""
    return max(round(count / COARSENING), 1) * COARSENING

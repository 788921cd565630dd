"""How an FMU is built: its kind, its platforms, its version of FMI."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from coupling.errors import BuildError, one_of
from coupling.fmu_export.native_standards import FMI3_ARRAYS, STANDARDS, FmiStandard
from coupling.robot.robot_fmu import DEFAULT_KIND, FMU_KINDS
from elastic_robot.fmi.interface import MODEL_NAME

# What outputs are declared to follow: at a communication point (in co-simulation none of the inputs), or
# over the step before it, as directional derivatives do.
DEPENDENCIES = ("point", "step")


@dataclass(frozen=True)
class BuildOptions:
    """How an FMU is built.

    Attributes:
        kind: One of FMU_KINDS.
        platforms: Names of the platforms that it has libraries for; none: this machine, and with
            kind python those that PythonFMU brings.
        sources: Whether the C sources of a native FMU are packed as well.
        fmi: Version of FMI, one of STANDARDS; 3 is for a native FMU.
        arrays: Whether reals that belong together are one array, in FMI 3.
        name: Name of the model, and identifier that its libraries and, in packed sources, its functions
            bear.
        dependencies: Dependencies of outputs in ModelStructure, one of DEPENDENCIES.
        strings: Start values of string parameters by name, where they are not the usual ones.

    Raises:
        BuildError: If the kind or the version is not known, or the options do not fit the kind or the
            version, or the name is not one of C, or a start value is no word of 1 to 63 bytes.

    Example:
        >>> BuildOptions("native", fmi="4")
        Traceback (most recent call last):
        coupling.errors.BuildError: FMI version: expected one of 2, 3, got '4'
    """

    kind: str = DEFAULT_KIND
    platforms: tuple[str, ...] = ()
    sources: bool = False
    fmi: str = "2"
    arrays: bool = False
    name: str = MODEL_NAME
    dependencies: str = "point"
    strings: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for what, name, names in (
            ("kind", self.kind, FMU_KINDS),
            ("FMI version", self.fmi, STANDARDS),
            ("dependencies", self.dependencies, DEPENDENCIES),
        ):
            if name not in names:
                raise BuildError(f"{what}: {one_of(names, name)}")
        if self.kind == "python" and (self.sources or self.fmi != "2"):
            raise BuildError(
                "kind: expected native with sources or FMI 3, got python: leave out --kind python"
            )
        if self.arrays and self.fmi != "3":
            raise BuildError(f"arrays: expected FMI 3, got FMI {self.fmi}: add --fmi 3")
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]{0,63}", self.name):
            raise BuildError(
                "name: expected up to 64 letters, digits and _, no digit first, as functions of C have,"
                f" got {self.name!r}"
            )

        for name, value in self.strings.items():
            if not (value.isprintable() and value.split() == [value] and len(value.encode()) < 64):
                raise BuildError(
                    f"start value of {name}: expected 1 to 63 bytes without blanks, got {value!r}"
                )

    @property
    def standard(self) -> FmiStandard:
        """What the version of FMI asks of a native FMU."""
        return FMI3_ARRAYS if self.arrays else STANDARDS[self.fmi]

    @property
    def over_step(self) -> bool:
        """Whether what outputs follow over a step is declared."""
        return self.dependencies == "step"

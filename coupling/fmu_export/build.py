"""robot -> FMU: the home of building, whoever asks for it."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from coupling.fmu_export.build_options import BuildOptions
from coupling.fmu_export.native_fmu import build_native_fmu
from coupling.fmu_export.python_fmu import build_python_fmu
from coupling.fmu_export.python_host import without_host
from coupling.native.compiler import PLATFORMS
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import MODEL_NAME

__all__ = ["KINDS", "BuildOptions", "build_fmu", "platform_names", "remarks"]

_USUAL = BuildOptions()
# What writes an FMU of each kind.
KINDS: dict[str, Callable[[Robot, Path, Mapping[str, bytes], BuildOptions], Path]] = {
    "python": build_python_fmu,
    "native": build_native_fmu,
}


def build_fmu(
    robot: Robot,
    file: Path,
    options: BuildOptions = _USUAL,
    resources: Mapping[str, bytes] = MappingProxyType({}),
) -> Path:
    """Write a robot's FMU; an existing file is replaced only when the new one is complete.

    The same robot, options and sources give the same bytes.

    Args:
        robot: The robot, fixed in the FMU.
        file: File to write, ending in .fmu.
        resources: More files by name; `trajectory` can name one of them.

    Returns:
        The file.

    Raises:
        BuildError: If a platform is not known, the compiler fails or the file cannot be written.
        RobotFileError: If the robot is larger than a native FMU holds.
        ParameterError: If there is no string parameter of a start value's name.
    """
    return KINDS[options.kind](robot, file, resources, options)


def remarks(file: Path, name: str = MODEL_NAME) -> list[str]:
    """Return sentences on an FMU's libraries: the platforms they are for, and what they lack."""
    alone = without_host(file, name)
    said = [f"{file}: built for {', '.join(_platforms_inside(file))}"]
    if alone:
        said.append(
            f"{', '.join(alone)}: PythonFMU's library alone, as python_host was not compiled for it"
            " (docs/fmu.md; --platforms)"
        )
    return said


def _platforms_inside(file: Path) -> list[str]:
    with zipfile.ZipFile(file) as archive:
        folders = {name.split("/")[1] for name in archive.namelist() if "binaries/" in name}
    return [p.name for p in PLATFORMS.values() if {p.name, p.machine} & folders]


def platform_names(text: str) -> tuple[str, ...]:
    """Return the platforms of a text with commas between them; "all" are all that there are.

    Example:
        >>> platform_names("linux64,win64")
        ('linux64', 'win64')
        >>> platform_names("")
        ()
    """
    return tuple(PLATFORMS) if text == "all" else tuple(filter(None, text.split(",")))

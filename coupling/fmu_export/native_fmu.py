"""The robot's FMU in C: it needs nothing of its host."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import elastic_robot
from coupling.errors import BuildError
from coupling.fmu_export.archive import build_date, content_guid, write_fmu
from coupling.fmu_export.documentation import index_html
from coupling.fmu_export.identity import ICON, about_robot, license_text
from coupling.fmu_export.model_description import model_description
from coupling.fmu_export.native_compiler import (
    PLATFORMS,
    SOURCES,
    compile_library,
    core_sources,
    host_platform,
)
from coupling.fmu_export.native_robot import robot_text
from elastic_robot.description import Robot
from elastic_robot.interface import MODEL_NAME, blocks
from elastic_robot.parameters import Parameters
from elastic_robot.spline_curve import SplineCurve

ROBOT_ENTRY = "resources/robot.txt"
_NEEDS = "This FMU needs nothing of its host but the C library."
_CAPABILITIES = (
    "canHandleVariableCommunicationStepSize",
    "canNotUseMemoryManagementFunctions",
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
    "providesDirectionalDerivative",
)


def build_native_fmu(
    robot: Robot,
    file: Path,
    platforms: Sequence[str] = (),
    with_sources: bool = False,
    resources: Mapping[str, bytes] = MappingProxyType({}),
) -> Path:
    """Write a robot's native FMU; an existing file is replaced only when the new one is complete.

    Args:
        robot: The robot, fixed in the FMU.
        file: Where to write it, ending in .fmu.
        platforms: Names of PLATFORMS that it shall run on; none: the one this runs on.
        with_sources: Pack the C sources as well, so that a master can compile them.
        resources: More files by name; `trajectory` can name one of them.

    Returns:
        The file.

    Raises:
        BuildError: If the file cannot be written, a platform is not known or the compiler fails.
        RobotFileError: If the robot is larger than the C core holds.
        ValueError: If a torque table's curve does not rise.
    """
    SplineCurve.build(Parameters.of(robot))  # the C core takes it that tables are good
    table = blocks(robot)
    date = build_date(Path(elastic_robot.__file__).parent, SOURCES)
    texts = {
        "documentation/index.html": index_html(robot, table, elastic_robot.__version__, _NEEDS),
        "documentation/licenses/license.txt": license_text("elastic-robot-fmu"),
        "documentation/licenses/fmi-headers.txt": _headers_license(),
    }
    entries = {name: text.encode() for name, text in texts.items()}
    entries["model.png"] = ICON.read_bytes()
    entries |= {f"resources/{name}": data for name, data in resources.items()}
    entries |= _libraries(platforms or [host_platform().name])
    source_files: tuple[str, ...] = ()
    if with_sources:
        entries |= _sources()
        source_files = tuple(source.name for source in fmu_sources())
    about = about_robot(robot, "native", date, _CAPABILITIES)
    # Description and robot are part of the content that the GUID stands for.
    draft = model_description(about, table, guid="", source_files=source_files)
    robot_data = robot_text(robot, guid="").encode()
    guid = content_guid({**entries, "modelDescription.xml": draft, ROBOT_ENTRY: robot_data})
    entries["modelDescription.xml"] = model_description(about, table, guid, source_files)
    entries[ROBOT_ENTRY] = robot_text(robot, guid).encode()
    write_fmu(file, entries, date)
    return file


def fmu_sources() -> list[Path]:
    """Return the C files of the FMU's library."""
    return [*core_sources(), SOURCES / "fmi2.c"]


def _libraries(names: Sequence[str]) -> dict[str, bytes]:
    entries = {}
    for name in names:
        if name not in PLATFORMS:
            raise BuildError(f"platform is {name!r}; needed is one of {', '.join(PLATFORMS)}")
        platform = PLATFORMS[name]
        library = compile_library(platform, fmu_sources())
        entries[f"binaries/{name}/{MODEL_NAME}{platform.suffix}"] = library.read_bytes()
    return entries


def _sources() -> dict[str, bytes]:
    files = [*fmu_sources(), *SOURCES.rglob("*.h")]
    return {f"sources/{f.relative_to(SOURCES).as_posix()}": f.read_bytes() for f in files}


def _headers_license() -> str:
    """Return the notice of the FMI standard's own headers, which the libraries are compiled with."""
    text = (SOURCES / "fmi" / "fmi2TypesPlatform.h").read_text(encoding="utf-8")
    return text[text.index("Copyright") : text.index("*/")].rstrip("- \n") + "\n"

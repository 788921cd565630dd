"""The robot's FMU in C: it needs nothing of its host."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import elastic_robot
from coupling.fmu_export.archive import build_date, write_fmu
from coupling.fmu_export.build_options import BuildOptions
from coupling.fmu_export.exchange_blocks import all_blocks
from coupling.fmu_export.grouping import Groups
from coupling.fmu_export.index_html import index_html, variable_rows
from coupling.fmu_export.interface_text import interface_text
from coupling.fmu_export.licenses import licenses
from coupling.fmu_export.model_description import ModelInfo, at_points, robot_line
from coupling.fmu_export.native_standards import FmiStandard, headers_licenses
from coupling.native.compiler import SOURCES, host_platform
from coupling.native.core_library import core_libraries, platforms_named
from coupling.native.robot_text import robot_text
from coupling.robot.fmu_signals import NATIVE
from elastic_robot.description import Robot
from elastic_robot.fmi.variables import Block
from elastic_robot.parameters import Parameters
from elastic_robot.spline_curve import SplineCurve

_NEEDS = (
    "This FMU needs nothing of its host but the C library. It is for co-simulation and for model"
    " exchange, in which inputs are what they are at the moment and the states are {}."
)
_NAMES = "names.h"
# fmuCheck integrates model exchange by Euler's method in 500 steps up to there: 0.1 ms each, which suits
# all shipped robots' modes.
_STOP_TIME = 0.05
# The core's own names; those of FMI have the standard's macro.
_OWN = re.compile(r"\ber_[a-z0-9_]+\b")
# How a file of FMI's functions begins to include, by the version of FMI.
_FIRST_INCLUDE = re.compile(r'^#include "', re.MULTILINE)


def build_native_fmu(
    robot: Robot, file: Path, resources: Mapping[str, bytes], options: BuildOptions
) -> Path:
    """Write a robot's native FMU and return the file.

    Args:
        robot: The robot, fixed in the FMU.
        file: File to write, ending in .fmu.
        resources: More files by name; `trajectory` can name one of them.

    Raises:
        BuildError: If the file cannot be written, or a platform is not known or has no library.
        RobotFileError: If the robot is larger than the C core holds.
        ValueError: If a torque table's curve does not rise.
    """
    SplineCurve.build(Parameters.of(robot))  # the C core takes it that tables are good
    standard, name = options.standard, options.name
    table = all_blocks(robot, options.strings)
    declared = table if options.over_step else at_points(table)
    groups = standard.grouped(table)
    rows, version = variable_rows(table, groups), elastic_robot.__version__
    date = build_date(Path(elastic_robot.__file__).parent, SOURCES)
    states = [b.derivative_of for b in table.values() if b.derivative_of and b.variables]
    needs = _NEEDS.format(", ".join(states))
    texts = {
        "documentation/index.html": index_html(robot, rows, standard.version, version, needs),
        "documentation/licenses/fmi-headers.txt": headers_licenses(),
    }
    entries = licenses() | {name: text.encode() for name, text in texts.items()}
    entries |= {f"resources/{name}": data for name, data in resources.items()}
    entries |= _libraries(standard, options.platforms or [host_platform().name], name)
    source_files: tuple[str, ...] = ()
    if options.sources:
        entries |= packed_sources(standard.function_sources(), standard.sources(), name)
        source_files = tuple(
            source.relative_to(SOURCES).as_posix() for source in standard.sources()
        )
    entries |= standard.further_entries(groups, name, source_files)
    described = ModelInfo(
        name,
        robot_line(robot),
        "native",
        date,
        standard.capabilities,
        _STOP_TIME,
        standard.exchange,
    )

    def identified(guid: str) -> dict[str, bytes]:
        return {
            "modelDescription.xml": standard.describe(
                described, declared, groups, guid, source_files
            ),
            NATIVE: robot_data(robot, table, groups, guid),
        }

    return write_fmu(file, entries, identified, date)


def robot_data(robot: Robot, table: Mapping[str, Block], groups: Groups, guid: str) -> bytes:
    """Return the file that the C core reads: the robot, then the FMU's variables."""
    return f"{robot_text(robot, guid)}\n{interface_text(table, groups)}\n".encode()


def _libraries(standard: FmiStandard, names: Sequence[str], name: str) -> dict[str, bytes]:
    platforms = platforms_named(names)
    libraries = core_libraries(platforms)
    return {
        f"binaries/{standard.folder(p)}/{name}{p.suffix}": libraries[p.name].read_bytes()
        for p in platforms
    }


def packed_sources(
    functions: Sequence[Path], sources: Sequence[Path], name: str
) -> dict[str, bytes]:
    """Return the C sources as an FMU packs them, by path inside the archive.

    Every name with external linkage begins with the FMU's identifier, so that the sources of several
    FMUs can be linked into one program, as both standards have it (FMI 2.0.5, 2.1.1, FMI 3.0.2, 2.2.2:
    FMI2_FUNCTION_PREFIX, FMI3_FUNCTION_PREFIX).  For a shared library the functions of FMI bear no
    prefix; whoever compiles one defines FMI2_OVERRIDE_FUNCTION_PREFIX or FMI3_OVERRIDE_FUNCTION_PREFIX.

    Args:
        functions: C files with the functions of a version of FMI.
        sources: All C files, these among them.
        name: The FMU's model identifier.
    """
    files = [*sources, *sorted(SOURCES.rglob("*.h"))]
    texts = {file: file.read_text(encoding="utf-8") for file in files}
    packed = {f"sources/{_NAMES}": _names_header(texts, name)}
    for file, text in texts.items():
        path = file.relative_to(SOURCES)
        if file.suffix == ".c":
            up = "../" * (len(path.parts) - 1)
            text = f'#include "{up}{_NAMES}"\n{text}'
        if file in functions:
            text = _with_prefix(text, path.name, name)
        packed[f"sources/{path.as_posix()}"] = text
    return {path: text.encode() for path, text in packed.items()}


def _with_prefix(text: str, file: str, name: str) -> str:
    """Define the prefix of the standard's functions where they are included first."""
    version = file[3]
    standards = f'#include "fmi{version}Functions.h"\n'
    definition = f"#define FMI{version}_FUNCTION_PREFIX {name}_\n"
    if standards in text:
        return text.replace(standards, definition + standards, 1)
    start = text.index("\n") + 1  # behind the names
    first = _FIRST_INCLUDE.search(text, start)
    assert first is not None, file
    return text[: first.start()] + definition + text[first.start() :]


def _names_header(texts: Mapping[Path, str], name: str) -> str:
    headers = (text for file, text in texts.items() if file.suffix == ".h")
    names = sorted({match for text in headers for match in _OWN.findall(text)})
    return "\n".join(
        [
            f"/* The core's names begin with {name}: other FMUs of one program have their own. */",
            *(f"#define {match} {name}_{match}" for match in names),
            "",
        ]
    )

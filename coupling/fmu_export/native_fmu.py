"""The robot's FMU in C: it needs nothing of its host."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import elastic_robot
from coupling.fmu_export.archive import build_date, licenses, write_fmu
from coupling.fmu_export.build_options import BuildOptions
from coupling.fmu_export.exchange_blocks import all_blocks
from coupling.fmu_export.grouping import Groups, VariableGroup
from coupling.fmu_export.index_html import index_html, variable_rows
from coupling.fmu_export.model_description import ModelInfo, at_points, robot_line
from coupling.fmu_export.native_standards import FmiStandard, headers_licenses
from coupling.native.compiler import SOURCES, host_platform
from coupling.native.core_library import core_libraries, platforms_named
from coupling.native.robot_text import robot_text
from coupling.robot.fmu_signals import NATIVE
from elastic_robot.description import Robot
from elastic_robot.fmi.inputs import limits_of
from elastic_robot.fmi.tolerance import LEAST, MOST, RELATIVE, TOLERANCE
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
# Stands for a blank in a name; ER_BLANK in C.
BLANK = "~"


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


def interface_text(blocks: Mapping[str, Block], groups: Groups) -> str:
    """Return a line for each variable, in the order of the value references.

    Before them the tolerance to begin with, the relative one that is the same, and their limits; the
    blocks of states of model exchange, that of their derivatives and how large they are, and those of
    event indicators, in the order of modelDescription.xml, which is made of the same blocks; and the
    lowest and highest angle of every drive.
    Reals: block, unit and the names of the elements in sentences, without blanks.  Strings: name,
    start value, where it is not empty, and the values that they may have, if not any.

    Args:
        blocks: The variables.
        groups: The same as masters see them.

    Example:
        >>> from coupling.fmu_export.grouping import arrays
        >>> from elastic_robot.fmi.variables import Array, Block, Variable
        >>> axes = tuple(Variable(f"gravity.{c}", "m/s2", "Gravity", 0.0) for c in "xyz")
        >>> mode = Variable("mode", "", "Mode", "fast", choices=("slow", "fast"))
        >>> gravity = Block("parameter", "tunable", axes, arrays=(Array("gravity", "Gravity", 3),))
        >>> strings = Block("parameter", "fixed", (mode,))
        >>> table = {"gravity": gravity, "strings": strings}
        >>> print(interface_text(table, arrays(table)))
        tolerance 1e-06 0.0001 1e-09 1e-05
        limits
        reals gravity m/s2 gravity.x gravity.y gravity.z
        string mode fast slow fast
        end
    """
    tolerances = " ".join(map(repr, (TOLERANCE, RELATIVE, LEAST, MOST)))
    limits = [
        repr(limit)
        for drives in groups.get("q_cmd", ())
        for variable in drives.elements
        for limit in limits_of(variable)
    ]
    lines = [f"tolerance {tolerances}"]
    for name, block in blocks.items():
        if block.derivative_of and block.variables:
            nominal = blocks[block.derivative_of].variables[0].nominal
            lines.append(f"state {block.derivative_of} {name} {nominal!r}")
    lines += [f"indicator {k}" for k, b in blocks.items() if b.is_event_indicator and b.variables]
    lines.append(" ".join(["limits", *limits]))
    for key, variables in groups.items():
        lines += [_line(key, variable) for variable in variables]
    return "\n".join([*lines, "end"])


def _line(block: str, variable: VariableGroup) -> str:
    first = variable.elements[0]
    if first.unit:
        names = [v.shown.replace(" ", BLANK) for v in variable.elements]
        return " ".join(["reals", block, first.unit, *names])
    start = [str(first.start)] if first.start else []
    return " ".join(["string", first.name, *start, *first.choices])

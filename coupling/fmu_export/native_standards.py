"""The versions of FMI that a native FMU can be of, what differs, and terminals of FMI 3.0."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

from coupling.fmu_export.archive import ICON
from coupling.fmu_export.fmi2 import fmi2_description
from coupling.fmu_export.fmi3 import build_description, fmi3_description
from coupling.fmu_export.grouping import Groups, arrays, scalars
from coupling.fmu_export.model_description import ModelInfo, xml_text
from coupling.native.compiler import SOURCES, Platform, core_sources
from elastic_robot.fmi.variables import Block

Blocks = Mapping[str, Block]
FOLDER = "terminalsAndIcons"
# Blocks of variables by terminal, and what it is.  Another FMU's terminal fits by the members' names.
TERMINALS: Mapping[str, tuple[tuple[str, ...], str]] = {
    "pose": (("tcp",), "Pose of the TCP, base frame"),
    "wrench": (("wrench",), "Force and moment on the tool at the TCP, base axes"),
    "wrench_rate": (("wrench_rate",), "Their rates over a communication step"),
    "contact_spring": (
        ("anchor", "anchor_velocity", "anchor_stiffness"),
        "Anchor of a spring to the TCP, its velocity, and the spring's stiffness, base axes",
    ),
}
_SIZE = 100.0  # of the icon, in the units of its coordinates


@dataclass(frozen=True)
class FmiStandard:
    """A version of FMI.

    Attributes:
        version: Version as `fmiVersion` states it.
        capabilities: Flags of `CoSimulation` that are true.
        exchange: Flags of `ModelExchange` that are true.
        functions: C files with the standard's functions, beside the core.
        types_header: The standard's own header with the notice of its licence.
        folder: Gives the name of the folder under binaries/ for a platform.
        grouped: Gives the variables as masters are to see them.
        describe: Gives modelDescription.xml from what the FMU is, its variables, element by element and
            grouped, the token that ties it to its binary and the C files packed with it.
        further_entries: Gives what else this version wants in the archive, from the grouped variables,
            the model identifier and the packed C files.
    """

    version: str
    capabilities: tuple[str, ...]
    exchange: tuple[str, ...]
    functions: tuple[str, ...]
    types_header: str
    folder: Callable[[Platform], str]
    grouped: Callable[[Blocks], Groups]
    describe: Callable[[ModelInfo, Blocks, Groups, str, tuple[str, ...]], bytes]
    further_entries: Callable[[Groups, str, tuple[str, ...]], dict[str, bytes]]

    def sources(self) -> list[Path]:
        """Return the C files of the FMU's library."""
        return [*core_sources(), *self.function_sources()]

    def function_sources(self) -> list[Path]:
        """Return the C files with the standard's functions."""
        return [SOURCES / "fmi" / name for name in self.functions]

    def headers_license(self) -> str:
        """Return the notice of the standard's own headers, which the libraries are compiled with."""
        text = (SOURCES / "fmi" / self.types_header).read_text(encoding="utf-8")
        return text[text.index("Copyright") : text.index("*/")].rstrip("- \n") + "\n"


def _icon(groups: Groups, name: str, source_files: tuple[str, ...]) -> dict[str, bytes]:
    return {"model.png": ICON.read_bytes()}


def _entries_of_fmi3(groups: Groups, name: str, source_files: tuple[str, ...]) -> dict[str, bytes]:
    entries = terminal_entries(groups)
    if source_files:
        entries["sources/buildDescription.xml"] = build_description(name, source_files)
    return entries


STANDARDS = {
    "2": FmiStandard(
        version="2.0",
        capabilities=(
            "canHandleVariableCommunicationStepSize",
            "canInterpolateInputs",
            "canNotUseMemoryManagementFunctions",
            "canGetAndSetFMUstate",
            "canSerializeFMUstate",
            "providesDirectionalDerivative",
        ),
        exchange=(
            "canNotUseMemoryManagementFunctions",
            "canGetAndSetFMUstate",
            "canSerializeFMUstate",
            "providesDirectionalDerivative",
        ),
        functions=("fmi2.c",),
        types_header="fmi2TypesPlatform.h",
        folder=lambda platform: platform.name,
        grouped=scalars,
        describe=lambda about, blocks, _, guid, files: fmi2_description(about, blocks, guid, files),
        further_entries=_icon,
    ),
    "3": FmiStandard(
        version="3.0",
        capabilities=(
            "canGetAndSetFMUState",
            "canSerializeFMUState",
            "providesDirectionalDerivatives",
            "canHandleVariableCommunicationStepSize",
        ),
        exchange=(
            "canGetAndSetFMUState",
            "canSerializeFMUState",
            "providesDirectionalDerivatives",
            "needsCompletedIntegratorStep",
        ),
        functions=("fmi3.c", "fmi3_rest.c"),
        types_header="fmi3PlatformTypes.h",
        folder=lambda platform: platform.machine,
        grouped=scalars,
        describe=lambda about, blocks, groups, token, _: fmi3_description(
            about, blocks, groups, token
        ),
        further_entries=_entries_of_fmi3,
    ),
}
# FMI 3.0 with arrays, which few masters read.
FMI3_ARRAYS = replace(STANDARDS["3"], grouped=arrays)


def headers_licenses() -> str:
    """Return the notices of all versions' headers, each once: a core's library has all functions."""
    return "\n".join(dict.fromkeys(standard.headers_license() for standard in STANDARDS.values()))


def terminal_entries(groups: Groups) -> dict[str, bytes]:
    """Return the folder's files by their paths inside the archive.

    Args:
        groups: The FMU's variables, as masters see them.
    """
    root = Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    picture = SubElement(root, "GraphicalRepresentation")
    corners = {"x1": repr(-_SIZE), "y1": repr(-_SIZE), "x2": repr(_SIZE), "y2": repr(_SIZE)}
    SubElement(picture, "CoordinateSystem", {**corners, "suggestedScalingFactorTo_mm": "0.1"})
    SubElement(picture, "Icon", corners)
    terminals = SubElement(root, "Terminals")
    for name, (blocks, text) in TERMINALS.items():
        about = {"name": name, "matchingRule": "plug", "description": text}
        terminal = SubElement(terminals, "Terminal", about)
        for block in blocks:
            for variable in groups[block]:
                member = {"variableName": variable.name, "memberName": variable.name}
                SubElement(terminal, "TerminalMemberVariable", {**member, "variableKind": "signal"})
    return {
        f"{FOLDER}/terminalsAndIcons.xml": xml_text(root),
        f"{FOLDER}/icon.png": ICON.read_bytes(),
    }

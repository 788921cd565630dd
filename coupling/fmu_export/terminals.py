"""terminalsAndIcons/ of an FMU of FMI 3.0: which variables a master connects together, and the icon."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element, SubElement

from coupling.fmu_export.grouping import Groups
from coupling.fmu_export.licenses import ICON
from coupling.fmu_export.model_description import xml_text

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

"""modelDescription.xml of an FMI 2.0 co-simulation FMU, from blocks of variables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from coupling.fmu_export.units import BASE_UNITS
from elastic_robot.interface import Block, Variable

LOG_CATEGORIES = {
    "logStatusWarning": "Messages with status fmi2Warning",
    "logStatusDiscard": "Messages with status fmi2Discard",
    "logStatusError": "Messages with status fmi2Error",
    "logStatusFatal": "Messages with status fmi2Fatal",
    "logAll": "All messages",
}


@dataclass(frozen=True)
class About:
    """What an FMU tells of itself.

    Attributes:
        model_name: Name of the model; also of its library.
        description: One line.
        version: Of the model.
        tool: That wrote it.
        date: UTC, ISO 8601, ending in Z.
        capabilities: Flags of `CoSimulation` that are true.
        step_size: Communication step to begin with [s].
        tolerance: To begin with.
    """

    model_name: str
    description: str
    version: str
    tool: str
    date: str
    capabilities: tuple[str, ...]
    step_size: float
    tolerance: float


def model_description(about: About, blocks: Mapping[str, Block], guid: str) -> bytes:
    """Return modelDescription.xml.

    Value references are the variables' places in the order of the blocks.  Every real is stated
    explicitly where FMI has a default, since masters differ in the defaults that they assume.

    Args:
        about: What the FMU is.
        blocks: Its variables.
        guid: Ties the description to the binary.
    """
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0",
            "modelName": about.model_name,
            "guid": guid,
            "description": about.description,
            "author": "The elastic-robot-fmu authors",
            "version": about.version,
            "copyright": "Copyright (c) 2026 The elastic-robot-fmu authors",
            "license": "MIT, see documentation/licenses",
            "generationTool": about.tool,
            "generationDateAndTime": about.date,
            "variableNamingConvention": "structured",
        },
    )
    _add_co_simulation(root, about)
    _add_units(root, blocks)
    categories = SubElement(root, "LogCategories")
    for name, description in LOG_CATEGORIES.items():
        SubElement(categories, "Category", {"name": name, "description": description})
    SubElement(
        root,
        "DefaultExperiment",
        {
            "startTime": "0",
            "stopTime": "1",
            "tolerance": repr(about.tolerance),
            "stepSize": repr(about.step_size),
        },
    )
    variables = SubElement(root, "ModelVariables")
    reference = 0
    for block in blocks.values():
        for variable in block.variables:
            variables.append(_variable(block, variable, reference))
            reference += 1
    _add_structure(root, blocks)
    indent(root, " ")
    text: bytes = tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def _add_co_simulation(root: Element, about: About) -> None:
    flags = (
        "needsExecutionTool",
        "canHandleVariableCommunicationStepSize",
        "canInterpolateInputs",
        "canRunAsynchronuously",
        "canBeInstantiatedOnlyOncePerProcess",
        "canNotUseMemoryManagementFunctions",
        "canGetAndSetFMUstate",
        "canSerializeFMUstate",
        "providesDirectionalDerivative",
    )
    unknown = set(about.capabilities) - set(flags)
    assert not unknown, unknown
    attributes = {name: _boolean(name in about.capabilities) for name in flags}
    attributes["maxOutputDerivativeOrder"] = "0"
    SubElement(root, "CoSimulation", {"modelIdentifier": about.model_name, **attributes})


def _add_units(root: Element, blocks: Mapping[str, Block]) -> None:
    used = sorted({v.unit for block in blocks.values() for v in block.variables if v.unit})
    definitions = SubElement(root, "UnitDefinitions")
    for unit in used:
        element = SubElement(definitions, "Unit", {"name": unit})
        SubElement(element, "BaseUnit", {k: str(n) for k, n in BASE_UNITS[unit].items()})


def _variable(block: Block, variable: Variable, reference: int) -> Element:
    element = Element(
        "ScalarVariable",
        {
            "name": variable.name,
            "valueReference": str(reference),
            "description": variable.text,
            "causality": block.causality,
            "variability": block.variability,
        },
    )
    if block.causality != "input":  # inputs have no initial (FMI 2.0.4, table on page 49)
        element.set("initial", "calculated" if block.causality == "output" else "exact")
    if not variable.unit:
        SubElement(element, "String", {"start": str(variable.start)})
        return element
    numbers = {
        "min": variable.minimum,
        "max": variable.maximum,
        "nominal": variable.nominal,
        "start": variable.start,
    }
    given = {name: repr(value) for name, value in numbers.items() if value is not None}
    SubElement(element, "Real", {"unit": variable.unit, **given})
    return element


def _add_structure(root: Element, blocks: Mapping[str, Block]) -> None:
    index: dict[str, range] = {}  # numbers of the variables, from 1
    first = 1
    for name, block in blocks.items():
        index[name] = range(first, first + len(block.variables))
        first += len(block.variables)
    outputs = [name for name, block in blocks.items() if block.causality == "output"]
    structure = SubElement(root, "ModelStructure")
    for element, by in (
        ("Outputs", {name: blocks[name].follows for name in outputs}),
        ("InitialUnknowns", {name: blocks[name].starts_from for name in outputs}),
    ):
        unknowns = SubElement(structure, element)
        for name in outputs:
            numbers = _sorted_text(k for known in by[name] for k in index[known])
            for k in index[name]:
                SubElement(unknowns, "Unknown", {"index": str(k), "dependencies": numbers})


def _sorted_text(numbers: Iterable[int]) -> str:
    return " ".join(str(k) for k in sorted(numbers))


def _boolean(value: bool) -> str:
    return "true" if value else "false"

"""modelDescription.xml of an FMI 2.0 co-simulation FMU, from blocks of variables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element, SubElement

from coupling.fmu_export import model_description as md
from elastic_robot.fmi.interface import Block, Variable

_FLAGS = (
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


def fmi2_description(
    about: md.About, blocks: Mapping[str, Block], guid: str, source_files: Iterable[str] = ()
) -> bytes:
    """Return modelDescription.xml.

    Value references are the variables' places in the order of the blocks.

    Args:
        about: Description of the FMU.
        blocks: Its variables.
        guid: Ties the description to the binary.
        source_files: C files under sources/ that make up the library, if they are in the FMU.
    """
    root = md.root_element(about, "2.0", "guid", guid)
    element = md.add_co_simulation(root, about, _FLAGS)
    names = list(source_files)
    if names:
        listed = SubElement(element, "SourceFiles")
        for name in names:
            SubElement(listed, "File", {"name": name})
    md.add_units(root, blocks)
    md.add_log_categories(root, "fmi2")
    md.add_experiment(root, about)
    variables = SubElement(root, "ModelVariables")
    reference = 0
    for block in blocks.values():
        for variable in block.variables:
            variables.append(_variable(block, variable, reference))
            reference += 1
    _add_structure(root, blocks)
    return md.xml_text(root)


def _variable(block: Block, variable: Variable, reference: int) -> Element:
    attributes = md.variable_attributes(block, variable.name, variable.text, reference)
    element = Element("ScalarVariable", attributes)
    if not variable.unit:
        SubElement(element, "String", {"start": str(variable.start)})
        return element
    start = {} if variable.start is None else {"start": repr(variable.start)}
    SubElement(element, "Real", {**md.range_attributes(variable), **start})
    return element


def _add_structure(root: Element, blocks: Mapping[str, Block]) -> None:
    index: dict[str, range] = {}  # numbers of the variables, from 1
    first = 1
    for name, block in blocks.items():
        index[name] = range(first, first + len(block.variables))
        first += len(block.variables)
    outputs = md.output_names(blocks)
    structure = SubElement(root, "ModelStructure")
    for element, by in (
        ("Outputs", {name: blocks[name].follows for name in outputs}),
        ("InitialUnknowns", {name: blocks[name].starts_from for name in outputs}),
    ):
        unknowns = SubElement(structure, element)
        for name in outputs:
            numbers = md.sorted_text(k for known in by[name] for k in index[known])
            for k in index[name]:
                SubElement(unknowns, "Unknown", {"index": str(k), "dependencies": numbers})
